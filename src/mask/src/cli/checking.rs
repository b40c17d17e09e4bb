//! `relit-mask check`: a mask against what the turn of its recording shows.

use std::path::Path;

use relit_console::{Check, Console, Event, Outcome};
use relit_data::session::{clips, recordings};
use relit_mask::{CheckOutput, MaskVerdict, MaskingError, check_mask};
use serde_json::json;

/// Checks the mask of every recording, and prints a line and the reasons for each.
pub(crate) fn run(
    console: Console,
    input: &Path,
    mask: Option<&Path>,
) -> Result<Outcome, MaskingError> {
    // Masks in a folder have the names of clips.
    let paths = if mask.is_some_and(Path::is_dir) {
        clips(input)?
    } else {
        recordings(input)?
    };
    let (mut fitting, mut failed) = (0, 0);
    for path in &paths {
        match check_mask(path, mask) {
            Ok(output) => {
                print(&output, console);
                fitting += usize::from(output.report.verdict == MaskVerdict::Fits);
            }
            Err(error) if paths.len() == 1 => return Err(error),
            Err(error) => {
                console.error(&error);
                failed += 1;
            }
        }
    }
    Ok(if failed == paths.len() {
        Outcome::Failure
    } else if fitting == paths.len() {
        Outcome::Success
    } else {
        Outcome::Partial
    })
}

fn print(output: &CheckOutput, console: Console) {
    let (id, report) = (&output.recording, &output.report);
    let (_, word) = report.verdict.words();
    let mut text = format!("{id}: {word}; see {}", output.page.display());
    for reason in &report.reasons {
        text += &format!("\n  {reason}");
    }
    let event = Event::Check(Check::Mask {
        recording: id.clone(),
        page: output.page.to_string_lossy().into_owned(),
        report: json!(report),
    });
    console.say(&text, &event);
}
