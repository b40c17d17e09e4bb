//! Making masks.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use relit_console::{Console, Event, Outcome};
use relit_data::session::{beside_sessions, recordings};
use relit_mask::{MaskOutput, MaskingError, edit, make_mask};
use relit_web::Announcement;
use serde_json::json;

use super::arguments::MaskArguments;

/// Makes the mask of every recording that the arguments name.
pub(crate) fn run(console: Console, arguments: &MaskArguments) -> ExitCode {
    let paths = match recordings(&arguments.input) {
        Ok(paths) => paths,
        Err(error) => return console.finish(Err(error)),
    };
    if let Err(usage) = arguments.check(paths.len()) {
        // Nothing can be done if standard error is closed.
        let _ = usage.print();
        return ExitCode::from(2);
    }
    match (arguments.edit, paths.first()) {
        (true, Some(path)) => console.finish(draw(path, arguments, console)),
        _ => {
            let leaves_out = says_unused(&paths, &arguments.input, console);
            let made = make(&paths, arguments, console);
            console.finish(made.map(|outcome| match outcome {
                Outcome::Success if leaves_out => Outcome::Partial,
                outcome => outcome,
            }))
        }
    }
}

/// Names what lies beside the recordings of a folder; whether there is anything.
fn says_unused(paths: &[PathBuf], input: &Path, console: Console) -> bool {
    if paths == [input] {
        return false;
    }
    let unused = beside_sessions(input).unwrap_or_default();
    for path in &unused {
        console.warn(&format!(
            "{} is left out: it is no session and holds no video",
            path.display()
        ));
    }
    !unused.is_empty()
}

/// Lets a person draw the hints in a browser.
fn draw(path: &Path, arguments: &MaskArguments, console: Console) -> Result<Outcome, MaskingError> {
    let request = arguments.request()?;
    let output = arguments.output.clone();
    let announce = |announcement: &Announcement| print_editor(announcement, console);
    match edit(path, output, request, arguments.listen.socket(), announce)? {
        Some(output) => {
            print(&output, console);
            Ok(Outcome::Success)
        }
        None => {
            console.warn("the editor was left without a mask: nothing was written");
            Ok(Outcome::Failure)
        }
    }
}

fn make(
    paths: &[PathBuf],
    arguments: &MaskArguments,
    console: Console,
) -> Result<Outcome, MaskingError> {
    let request = arguments.request()?;
    let bar = console.progress(paths.len() as u64, "masks");
    let mut failed = 0;
    for path in paths {
        match make_mask(path, arguments.output.clone(), &request) {
            Ok(output) => bar.suspend(|| print(&output, console)),
            Err(error) if paths.len() == 1 => return Err(error),
            Err(error) => {
                failed += 1;
                bar.suspend(|| console.error(&error));
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(match failed {
        0 => Outcome::Success,
        all if all == paths.len() => Outcome::Failure,
        _ => Outcome::Partial,
    })
}

/// Prints the warnings about one mask, its files and its size.
fn print(output: &MaskOutput, console: Console) {
    let id = &output.recording;
    for notice in &output.notices {
        console.warn(&format!("{id}: {}", notice.text()));
    }
    for warning in &output.record.warnings {
        console.warn(&format!("{id}: {warning}"));
    }
    let (source, result) = (&output.record.source, &output.record.result);
    let found = result.statistics;
    let frame_px = f64::from(source.width) * f64::from(source.height);
    let text = format!(
        "{id}: {} with {} pixels ({:.1} % of the frame) at {}, {} of {} parts; check {}",
        output.files.mask.display(),
        found.area_px,
        100.0 * found.area_px as f64 / frame_px,
        found.bounding_box,
        found.components_kept,
        found.components,
        output.files.preview.display(),
    );
    let path = |path: &Path| path.to_string_lossy().into_owned();
    let event = Event::Mask {
        recording: id.clone(),
        mask: path(&output.files.mask),
        record: path(&output.files.record),
        preview: path(&output.files.preview),
        source: json!(source),
        result: json!(result),
        warnings: output.record.warnings.clone(),
    };
    console.say(&text, &event);
}

/// Prints where the editor is.
fn print_editor(announcement: &Announcement, console: Console) {
    let url = &announcement.url;
    let qr = match (announcement.address.ip().is_loopback(), &announcement.qr) {
        (false, Some(qr)) => format!("{qr}\n"),
        _ => String::new(),
    };
    console.say(
        &format!("{qr}Open in a browser: {url}"),
        &Event::Editor {
            address: announcement.address.to_string(),
            url: url.clone(),
        },
    );
}
