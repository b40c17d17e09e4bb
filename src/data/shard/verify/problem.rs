//! What a verification reports.

use std::fmt;

/// The result of a verification.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct VerifyReport {
    /// Sessions that `dataset.json` lists.
    pub sessions: u64,
    /// Shards that were read.
    pub shards: u64,
    /// Samples of which every part was found.
    pub samples: u64,
    /// What is wrong; empty if the data set is intact.
    pub problems: Vec<VerifyProblem>,
}

/// Something that is wrong with a data set.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct VerifyProblem {
    /// The file, or the folder of images, relative to the data set.
    pub file: String,
    /// The key of the sample, `<session>/<kkkk>`, if the problem concerns one.
    pub sample: Option<String>,
    /// What is wrong.
    pub what: String,
}

impl fmt::Display for VerifyProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.sample {
            Some(sample) => write!(f, "{}: sample {sample}: {}", self.file, self.what),
            None => write!(f, "{}: {}", self.file, self.what),
        }
    }
}
