//! What is made of recorded sessions, as everybody beside the rig sees it.

use std::fmt;

use serde::{Deserialize, Serialize};

/// One thing that is done with a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProcessingStep {
    /// Its mask is made by the turn: `relit-mask SESSION --auto`.
    Mask,
    /// The mask is held against all frames: `relit-mask check SESSION`.
    Check,
    /// It is extracted into the data set: `relit-extract SESSION -o DATASET`.
    Extract,
}

impl fmt::Display for ProcessingStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Mask => "the mask",
            Self::Check => "the check of the mask",
            Self::Extract => "the extraction",
        })
    }
}

/// How far a job has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProcessingStatus {
    /// It waits for those before it, or for the rig to rest.
    Waiting,
    /// Its program runs.
    Running,
    /// Its program is held while the rig captures or moves.
    Held,
}

/// Something that waits or is done just now.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ProcessingJob {
    /// Its number, by which it is cancelled.
    pub number: u64,
    /// The session.
    pub session: String,
    /// What is done.
    pub step: ProcessingStep,
    /// What comes after it, if all is well.
    pub then: Vec<ProcessingStep>,
    /// How far it has come.
    pub status: ProcessingStatus,
    /// Steps of its program that are done.
    pub done: u64,
    /// All of them; 0 where they are not counted.
    pub of: u64,
}

/// How a job ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProcessingOutcome {
    /// All is well.
    Good,
    /// It is done, and a person has to look at what came out.
    Doubtful,
    /// Nothing came out.
    Failed,
    /// A person cancelled it.
    Cancelled,
}

/// A job that has ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FinishedJob {
    /// Its number.
    pub number: u64,
    /// The session.
    pub session: String,
    /// What was done.
    pub step: ProcessingStep,
    /// How it ended.
    pub outcome: ProcessingOutcome,
    /// What came out, or went wrong, in a sentence.
    pub what: String,
}

/// What is made of recorded sessions on this machine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Default)]
pub struct ProcessingState {
    /// Whether `relit-mask` is installed.
    pub has_mask_program: bool,
    /// Whether `relit-extract` is installed.
    pub has_extract_program: bool,
    /// Whether each usable take is masked, checked and extracted once the rig rests.
    pub when_done: bool,
    /// The folder of the data set, on the rig's machine.
    pub dataset_folder: String,
    /// What is done and what waits, in that order.
    pub jobs: Vec<ProcessingJob>,
    /// The jobs that ended last, newest last.
    pub finished: Vec<FinishedJob>,
    /// The session whose mask is open in the editor.
    pub editing: Option<String>,
}
