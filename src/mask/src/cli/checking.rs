//! `relit-mask check`: a mask against what the turn of its recording shows.

use std::path::Path;

use relit_console::{Check, Console, Done, Event, Outcome};
use relit_data::session::{clips, recording_name, recordings};
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
    let several = paths.len() > 1;
    let (mut fitting, mut failed) = (0, 0);
    for path in &paths {
        match check_mask(path, mask) {
            Ok(output) => {
                print(path, &output, console);
                fitting += usize::from(output.report.verdict == MaskVerdict::Fits);
            }
            Err(error) if !several => return Err(error),
            Err(error) => {
                console.error_for(path, Some(&recording_name(path)), &error);
                failed += 1;
            }
        }
    }
    if several {
        say_summary(console, fitting, paths.len() - fitting - failed, failed);
    }
    Ok(if failed == paths.len() {
        Outcome::Failure
    } else if fitting == paths.len() {
        Outcome::Success
    } else {
        Outcome::Partial
    })
}

/// What became of all of them.
fn say_summary(console: Console, fitting: usize, unfit: usize, failed: usize) {
    let parts = [
        (fitting, "that fit"),
        (unfit, "that do not fit or are unknown: look at their pages"),
        (failed, "that could not be checked"),
    ];
    let parts = parts.iter().filter(|(count, _)| *count > 0);
    let parts: Vec<String> = parts
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
    let summary = format!("masks: {}", parts.join(", "));
    let event = Event::Done(Done::Checks {
        fitting: fitting as u64,
        unfit: unfit as u64,
        failed: failed as u64,
        summary: summary.clone(),
    });
    console.print(&summary, &event);
}

fn print(input: &Path, output: &CheckOutput, console: Console) {
    let (id, report) = (&output.recording, &output.report);
    let (_, word) = report.verdict.words();
    let mut text = format!("{id}: {word}; see {}", output.page.display());
    for reason in &report.reasons {
        text += &format!("\n  {reason}");
    }
    let event = Event::Check(Check::Mask {
        session: id.clone(),
        input: input.to_string_lossy().into_owned(),
        page: output.page.to_string_lossy().into_owned(),
        report: json!(report),
    });
    console.print(&text, &event);
}
