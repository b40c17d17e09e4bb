//! What was made of a session, as the programs left it: the mask with its record, the check of it, and the session's
//! entry in the data set. Nothing of this is kept anywhere else.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use relit_data::session::{MASK_FILE, Manifest};
use relit_data::shard::{Dataset, QualityVerdict};
use serde::Serialize;
use serde_json::Value;

use super::queue::StepOutcome;
use crate::state::{ProcessingOutcome, ProcessingStep};

/// The record of a mask, and of its check, in a session's folder.
const RECORD_FILE: &str = "mask.json";
const CHECK_FILE: &str = "mask-check.json";
/// The page about a check.
pub(crate) const CHECK_PAGE: &str = "mask-check.html";

/// How far a session has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum SessionStage {
    /// There is its recording.
    Recorded,
    /// It has a mask.
    Masked,
    /// The mask was held against all frames.
    Checked,
    /// It is in the data set, with the mask as it is now.
    Extracted,
}

/// How a mask came to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum MaskOrigin {
    /// By the turn alone.
    Turn,
    /// By a rectangle, seeds or strokes.
    Hints,
    /// By another program, or changed since it was made.
    Hand,
}

/// A session's mask.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct MaskState {
    /// How it came to be.
    pub(crate) origin: MaskOrigin,
    /// What its maker warned of.
    pub(crate) warnings: Vec<String>,
}

/// What `relit-mask check` found.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct CheckState {
    /// `fits`, `wrong`, `unknown`.
    pub(crate) verdict: String,
    /// Why it does not fit.
    pub(crate) reasons: Vec<String>,
    /// Whether the mask is still the one that was checked.
    pub(crate) is_current: bool,
}

/// What `relit-extract` made.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct ExtractionState {
    /// `good`, `usable`, `broken`, or `not judged`.
    pub(crate) verdict: String,
    /// Why it is not good, and what else to know.
    pub(crate) reasons: Vec<String>,
    /// Samples in the data set.
    pub(crate) samples: u32,
    /// Whether something of the recording was lost.
    pub(crate) is_lossy: bool,
    /// Whether the mask is still the one that it was extracted with.
    pub(crate) is_current: bool,
}

/// What was made of a session.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct SessionResults {
    /// How far it has come.
    pub(crate) stage: SessionStage,
    /// True if a person has to look; false if all results are good; `null` without results.
    pub(crate) is_doubtful: Option<bool>,
    /// Its mask.
    pub(crate) mask: Option<MaskState>,
    /// The check of the mask.
    pub(crate) check: Option<CheckState>,
    /// Its entry in the data set.
    pub(crate) extraction: Option<ExtractionState>,
}

/// The entries of a data set's sessions by their names, each with the hash of the mask that it was made with.
pub(crate) type DatasetEntries = BTreeMap<String, (ExtractionState, String)>;

/// What a data set says about its sessions. A description that cannot be read tells of none; `relit-extract` says what
/// is wrong with it.
pub(crate) fn entries_in(dataset: &Path) -> DatasetEntries {
    let sessions = Dataset::read(dataset).map(|dataset| dataset.sessions);
    let entries = sessions.into_iter().flatten().map(|session| {
        let mut reasons = session.quality.reasons;
        reasons.extend(session.warnings);
        let state = ExtractionState {
            verdict: session.quality.verdict.to_string(),
            reasons,
            samples: session.samples,
            is_lossy: session.lossy,
            is_current: false,
        };
        (session.id, (state, session.mask.blake3.to_string()))
    });
    entries.collect()
}

/// What was made of the session in `folder`, whose name may be another than the session's.
pub(crate) fn results_of(folder: &Path, entries: &DatasetEntries) -> SessionResults {
    let name = || folder.file_name().unwrap_or_default().to_string_lossy();
    let id = Manifest::read(folder).map_or_else(|_| name().into_owned(), |manifest| manifest.id);
    let png = fs::read(folder.join(MASK_FILE)).ok();
    let hash = png.map(|png| blake3::hash(&png).to_hex().to_string());
    let is_same = |made: &str| hash.as_deref() == Some(made);
    let mask = hash.as_ref().map(|_| {
        let record = json(&folder.join(RECORD_FILE));
        mask_state(record.filter(|record| is_same(text(&record["result"]["mask_blake3"]))))
    });
    let check = json(&folder.join(CHECK_FILE)).map(|check| CheckState {
        verdict: text(&check["verdict"]).to_owned(),
        reasons: texts(&check["reasons"]),
        is_current: is_same(text(&check["mask_blake3"])),
    });
    let extraction = entries.get(&id).map(|(state, made_with)| ExtractionState {
        is_current: is_same(made_with),
        ..state.clone()
    });
    let mut results = SessionResults {
        stage: SessionStage::Recorded,
        is_doubtful: None,
        mask,
        check,
        extraction,
    };
    (results.stage, results.is_doubtful) = judged(&results);
    results
}

impl SessionResults {
    /// How a step ended that has made its files; `None` if they are not there.
    pub(super) fn outcome(&self, step: ProcessingStep) -> Option<StepOutcome> {
        let (what, is_doubtful, goes_on) = match step {
            ProcessingStep::Mask => match self.mask.as_ref()?.warnings.first() {
                Some(warning) => (warning.clone(), true, true),
                None => ("the mask is made".to_owned(), false, true),
            },
            ProcessingStep::Check => match self.check.as_ref()? {
                check if check.fits() => ("the mask fits".to_owned(), false, true),
                CheckState {
                    verdict, reasons, ..
                } => (format!("{verdict}: {}", reasons.join("; ")), true, false),
            },
            ProcessingStep::Extract => {
                let made = self.extraction.as_ref()?;
                let mut what = format!("{} samples, {}", made.samples, made.verdict);
                if made.is_doubtful() && !made.reasons.is_empty() {
                    what = format!("{what}: {}", made.reasons.join("; "));
                }
                (what, made.is_doubtful(), true)
            }
        };
        let outcome = if is_doubtful {
            ProcessingOutcome::Doubtful
        } else {
            ProcessingOutcome::Good
        };
        Some(StepOutcome {
            outcome,
            what,
            goes_on,
        })
    }
}

impl CheckState {
    fn fits(&self) -> bool {
        self.verdict == "fits"
    }
}

impl ExtractionState {
    fn is_doubtful(&self) -> bool {
        self.verdict != QualityVerdict::Good.to_string() || self.is_lossy
    }
}

fn mask_state(record: Option<Value>) -> MaskState {
    let Some(record) = record else {
        return MaskState {
            origin: MaskOrigin::Hand,
            warnings: Vec::new(),
        };
    };
    let given = |name: &str| match &record["hints"][name] {
        Value::Null => false,
        Value::Array(items) => !items.is_empty(),
        _ => true,
    };
    let is_hinted = given("rect") || given("seeds") || given("strokes");
    MaskState {
        origin: if is_hinted || !given("turn_frames") {
            MaskOrigin::Hints
        } else {
            MaskOrigin::Turn
        },
        warnings: texts(&record["warnings"]),
    }
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

fn texts(value: &Value) -> Vec<String> {
    let values = value.as_array().into_iter().flatten();
    values.map(|value| text(value).to_owned()).collect()
}

/// How far the session has come, and whether a person has to look. What was made of an earlier mask does not count.
fn judged(results: &SessionResults) -> (SessionStage, Option<bool>) {
    let Some(mask) = &results.mask else {
        return (SessionStage::Recorded, None);
    };
    let check = results.check.as_ref().filter(|check| check.is_current);
    let wrong = check.is_some_and(|check| !check.fits());
    let extraction = results.extraction.as_ref();
    match (extraction.filter(|made| made.is_current), check) {
        (Some(made), _) => (SessionStage::Extracted, Some(made.is_doubtful() || wrong)),
        (None, Some(_)) => (SessionStage::Checked, Some(wrong)),
        (None, None) => (SessionStage::Masked, Some(!mask.warnings.is_empty())),
    }
}

/// The content of a JSON file; `None` if it does not exist, or is not JSON.
fn json(path: &Path) -> Option<Value> {
    serde_json::from_slice(&fs::read(path).ok()?).ok()
}

#[cfg(test)]
mod tests {
    use super::ProcessingOutcome::{Doubtful, Good};
    use super::*;

    fn results(
        warnings: &[&str],
        check: (&str, &[&str]),
        made: (&str, &[&str], bool),
    ) -> SessionResults {
        let owned = |texts: &[&str]| texts.iter().map(|&text| text.to_owned()).collect();
        SessionResults {
            stage: SessionStage::Extracted,
            is_doubtful: None,
            mask: Some(MaskState {
                origin: MaskOrigin::Turn,
                warnings: owned(warnings),
            }),
            check: Some(CheckState {
                verdict: check.0.to_owned(),
                reasons: owned(check.1),
                is_current: true,
            }),
            extraction: Some(ExtractionState {
                verdict: made.0.to_owned(),
                reasons: owned(made.1),
                samples: 1500,
                is_lossy: made.2,
                is_current: true,
            }),
        }
    }

    #[test]
    fn a_session_in_a_folder_of_another_name_has_its_own_entry() {
        let root = tempfile::tempdir().unwrap();
        let recorded = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../fixtures/20261120T101500Z-cow-short/session.json");
        fs::copy(recorded, root.path().join("session.json")).unwrap();
        let made = results(&[], ("fits", &[]), ("good", &[], false)).extraction;
        let entry = (made.unwrap(), String::new());
        let entries = DatasetEntries::from([("20261120T101500Z-cow-short".to_owned(), entry)]);
        assert!(results_of(root.path(), &entries).extraction.is_some());
    }

    #[test]
    fn a_step_ends_as_its_files_say() {
        let well = results(&[], ("fits", &[]), ("good", &["a note"], false));
        let doubtful = results(
            &["it touches the border", "another"],
            ("of-a-later-version", &["a hole", "a gap"]),
            ("usable", &["3 frames are lost"], true),
        );
        let lossy = results(&[], ("fits", &[]), ("good", &["frames are lost"], true));
        for (of, step, outcome, named, goes_on) in [
            (&well, ProcessingStep::Mask, Good, "", true),
            (&well, ProcessingStep::Check, Good, "fits", true),
            (
                &well,
                ProcessingStep::Extract,
                Good,
                "1500 samples, good",
                true,
            ),
            (&doubtful, ProcessingStep::Mask, Doubtful, "border", true),
            (
                &doubtful,
                ProcessingStep::Check,
                Doubtful,
                "later-version: a hole; a gap",
                false,
            ),
            (
                &doubtful,
                ProcessingStep::Extract,
                Doubtful,
                "1500 samples, usable: 3 frames",
                true,
            ),
            (
                &lossy,
                ProcessingStep::Extract,
                Doubtful,
                "frames are lost",
                true,
            ),
        ] {
            let end = of.outcome(step).unwrap();
            assert_eq!(
                (end.outcome, end.goes_on),
                (outcome, goes_on),
                "{}",
                end.what
            );
            assert!(
                !end.what.is_empty() && end.what.contains(named),
                "{}",
                end.what
            );
        }
        let nothing = SessionResults {
            check: None,
            ..well
        };
        assert_eq!(nothing.outcome(ProcessingStep::Check), None);
    }
}
