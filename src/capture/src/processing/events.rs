//! What the programs say on standard output, one JSON object a line, and what follows from it. Without I/O.

use relit_console::{Check, Event};
use serde::Deserialize;

use super::editor::EditorTarget;
use super::queue::StepOutcome;
use crate::state::{ProcessingOutcome, ProcessingStep};

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct CheckReport {
    verdict: String,
    reasons: Vec<String>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct ExtractedSession {
    samples: u64,
    lossy: bool,
    quality: Option<Quality>,
    warnings: Vec<String>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Quality {
    verdict: String,
    reasons: Vec<String>,
}

/// All that a program reported.
#[derive(Debug, Default)]
pub(super) struct ProgramEvent {
    progress: Option<(u64, u64)>,
    /// Its error; without one, why it left the session out.
    error: Option<String>,
    /// The first one.
    warning: Option<String>,
    check: Option<CheckReport>,
    extracted: Option<ExtractedSession>,
    /// Set where the data set holds the session already.
    skipped: Option<StepOutcome>,
    has_mask: bool,
    editor: Option<EditorTarget>,
}

impl ProgramEvent {
    /// Takes in a line. What cannot be understood is passed over: newer programs say more.
    pub(super) fn line(&mut self, line: &[u8]) {
        let Ok(event) = serde_json::from_slice(line) else {
            return;
        };
        match event {
            Event::Progress { done, of, .. } => self.progress = Some((done, of)),
            Event::Error { message, .. } => self.error = Some(message),
            Event::Warning { message, .. } => {
                self.warning.get_or_insert(message);
            }
            Event::Mask { .. } => self.has_mask = true,
            Event::Check(Check::Mask { report, .. }) => {
                self.check = serde_json::from_value(report).ok();
            }
            Event::Extracted { entry, .. } => self.extracted = serde_json::from_value(entry).ok(),
            Event::Skipped {
                lossy,
                misfit,
                broken,
                ..
            } => self.skipped = Some(skipped(lossy, misfit, broken)),
            Event::LeftOut { message, .. } => {
                self.error.get_or_insert(message);
            }
            Event::Editor { address, url } => self.editor = EditorTarget::parse(&address, &url),
            _ => {}
        }
    }

    /// The newest word on the progress, once.
    pub(super) fn take_progress(&mut self) -> Option<(u64, u64)> {
        self.progress.take()
    }

    /// Where the editor is, once it has said so.
    pub(super) fn editor(&self) -> Option<&EditorTarget> {
        self.editor.as_ref()
    }

    /// Whether it made a mask.
    pub(super) fn has_mask(&self) -> bool {
        self.has_mask
    }

    /// What went wrong, for a person; `error_output` is what the program wrote on standard error.
    pub(super) fn failure(&self, exit_code: Option<i32>, error_output: &str) -> String {
        let last = || {
            let mut lines = error_output.lines().map(str::trim);
            let last = lines.rfind(|line| !line.is_empty())?;
            Some(last.strip_prefix("error: ").unwrap_or(last).to_owned())
        };
        self.error
            .clone()
            .or_else(last)
            .unwrap_or_else(|| match exit_code {
                Some(code) => format!("the program ended with exit code {code}, without a message"),
                None => "the program was ended by a signal: check the machine's memory".to_owned(),
            })
    }

    /// How a step ended whose program had this exit code; `None` if a signal ended it.
    pub(super) fn end(
        mut self,
        step: ProcessingStep,
        exit_code: Option<i32>,
        error_output: &str,
    ) -> StepOutcome {
        let end = match (step, exit_code) {
            (ProcessingStep::Mask, Some(0)) if self.has_mask => Some(self.masked()),
            (ProcessingStep::Check, Some(_)) => self.check.take().map(checked),
            (ProcessingStep::Extract, Some(code @ (0 | 3))) => self.extracted(code),
            _ => None,
        };
        end.unwrap_or_else(|| StepOutcome {
            outcome: ProcessingOutcome::Failed,
            what: self.failure(exit_code, error_output),
            goes_on: false,
        })
    }

    /// Doubts of relit-mask about its own mask count too.
    fn masked(&self) -> StepOutcome {
        match &self.warning {
            None => good("the mask is made"),
            Some(warning) => doubtful(warning, true),
        }
    }

    fn extracted(&mut self, code: i32) -> Option<StepOutcome> {
        if let Some(skipped) = self.skipped.take() {
            return Some(skipped);
        }
        let session = self.extracted.take()?;
        let quality = session.quality.unwrap_or_default();
        let is_good = code == 0 && !session.lossy && matches!(&*quality.verdict, "good" | "");
        if is_good {
            return Some(good(&format!("{} samples, good", session.samples)));
        }
        let mut why = quality.reasons;
        why.extend(session.warnings.into_iter().take(1));
        let (samples, verdict) = (session.samples, quality.verdict);
        let what = format!("{samples} samples, {verdict}: {}", why.join("; "));
        Some(doubtful(&what, true))
    }
}

/// A session that was not extracted again.
fn skipped(lossy: bool, misfit: bool, broken: bool) -> StepOutcome {
    let fault = if misfit {
        "its mask does not fit"
    } else if broken {
        "it is broken"
    } else if lossy {
        "parts of it are lost"
    } else {
        return good("it is in the data set already");
    };
    let what = format!("it is in the data set already; {fault}: see its report");
    doubtful(&what, true)
}

fn checked(report: CheckReport) -> StepOutcome {
    let why = report.reasons.join("; ");
    match &*report.verdict {
        "fits" => good("the mask fits"),
        verdict => doubtful(&format!("{verdict}: {why}"), false),
    }
}

fn good(what: &str) -> StepOutcome {
    StepOutcome {
        outcome: ProcessingOutcome::Good,
        what: what.to_owned(),
        goes_on: true,
    }
}

fn doubtful(what: &str, goes_on: bool) -> StepOutcome {
    StepOutcome {
        outcome: ProcessingOutcome::Doubtful,
        what: what.to_owned(),
        goes_on,
    }
}

#[cfg(test)]
mod tests {
    use super::ProcessingOutcome::{Doubtful, Failed, Good};
    use super::*;

    fn end(
        step: ProcessingStep,
        code: Option<i32>,
        lines: &[&str],
    ) -> (ProcessingOutcome, String, bool) {
        let mut heard = ProgramEvent::default();
        for line in lines {
            heard.line(line.as_bytes());
        }
        let end = heard.end(step, code, "warning: x\nerror: no space\n");
        (end.outcome, end.what, end.goes_on)
    }

    #[test]
    fn each_programs_last_word_is_understood() {
        use ProcessingStep::{Check, Extract, Mask};
        let good = r#"{"event":"extracted","session":"x","entry":{"samples":1500,"lossy":false,"quality":{"verdict":"good","reasons":[]},"warnings":[]}}"#;
        let usable = r#"{"event":"extracted","session":"x","entry":{"samples":1500,"lossy":true,"quality":{"verdict":"usable","reasons":["3 frames are lost"]},"warnings":["the camera dropped 3 frames"]}}"#;
        for (step, code, line, outcome, named, goes_on) in [
            (Mask, 0, r#"{"event":"mask","session":"x"}"#, Good, "", true),
            (
                Check,
                0,
                r#"{"event":"check","report":{"verdict":"fits","reasons":[]}}"#,
                Good,
                "fits",
                true,
            ),
            (
                Check,
                3,
                r#"{"event":"check","report":{"verdict":"wrong","reasons":["a hole"]}}"#,
                Doubtful,
                "wrong: a hole",
                false,
            ),
            (
                Check,
                3,
                r#"{"event":"check","report":{"verdict":"of-a-later-version","reasons":[]}}"#,
                Doubtful,
                "later",
                false,
            ),
            (
                Check,
                1,
                r#"{"event":"error","message":"it is empty"}"#,
                Failed,
                "it is empty",
                false,
            ),
            (Extract, 0, good, Good, "good", true),
            (Extract, 3, good, Doubtful, "1500 samples", true),
            (Extract, 3, usable, Doubtful, "3 frames are lost", true),
            (
                Extract,
                0,
                r#"{"event":"skipped","session":"x","lossy":false}"#,
                Good,
                "",
                true,
            ),
            (
                Extract,
                3,
                r#"{"event":"skipped","session":"x","lossy":false,"misfit":true}"#,
                Doubtful,
                "mask",
                true,
            ),
            (
                Extract,
                3,
                r#"{"event":"skipped","session":"x","lossy":false,"broken":true}"#,
                Doubtful,
                "broken",
                true,
            ),
            (
                Extract,
                3,
                r#"{"event":"left_out","message":"the frames cover 20"}"#,
                Failed,
                "cover 20",
                false,
            ),
            (Extract, 1, good, Failed, "no space", false),
            (Mask, 0, "no JSON", Failed, "no space", false),
        ] {
            let (found, what, on) = end(step, Some(code), &[line]);
            assert_eq!((found, on), (outcome, goes_on), "{line}: {what}");
            assert!(!what.is_empty() && what.contains(named), "{line}: {what}");
        }
        // Warnings follow the reasons.
        let (_, what, _) = end(Extract, Some(3), &[usable]);
        assert!(what.contains("the camera dropped 3 frames"), "{what}");
    }

    #[test]
    fn a_mask_with_a_warning_is_looked_at_by_the_check() {
        let lines = [
            r#"{"event":"warning","session":"x","message":"the mask touches the border"}"#,
            r#"{"event":"mask"}"#,
        ];
        let (outcome, what, goes_on) = end(ProcessingStep::Mask, Some(0), &lines);
        assert_eq!((outcome, goes_on), (Doubtful, true));
        assert!(what.contains("border"));
    }

    #[test]
    fn a_program_that_says_nothing_is_reported_by_what_ended_it() {
        let heard = ProgramEvent::default();
        assert!(heard.failure(Some(7), "").contains("7"));
        let signal = heard.failure(None, "\n");
        assert!(!signal.trim().is_empty() && signal != heard.failure(Some(0), ""));
        assert_eq!(heard.failure(Some(1), "error: a\n\n"), "a");
    }
}
