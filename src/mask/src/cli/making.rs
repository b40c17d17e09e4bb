//! Making masks.

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use relit_console::{Console, Done, Event, Outcome, RunTotals};
use relit_data::counts::count_of;
use relit_data::session::{recording_name, recordings};
use relit_data::still::is_named;
use relit_mask::{MaskInputs, MaskOutput, MaskingError, edit, make_mask};
use relit_web::Announcement;
use serde_json::json;

use super::arguments::MaskArguments;

/// Makes the mask of every recording that the arguments name.
pub(crate) fn run(console: Console, arguments: &MaskArguments) -> ExitCode {
    let mut inputs = MaskInputs::find(&arguments.inputs, arguments.output.as_ref());
    if inputs.recordings.is_empty()
        && inputs.faults.len() == 1
        && let Some((_, fault)) = inputs.faults.pop()
    {
        return console.finish(Err(fault));
    }
    if let Err(usage) = arguments.check(inputs.recordings.len()) {
        // Nothing can be done if standard error is closed.
        let _ = usage.print();
        return ExitCode::from(2);
    }
    console.finish(if arguments.edit {
        draw(inputs, arguments, console)
    } else {
        make(inputs, arguments, console)
    })
}

/// Lets a person draw the hints in a browser.
fn draw(
    mut inputs: MaskInputs,
    arguments: &MaskArguments,
    console: Console,
) -> Result<Outcome, MaskingError> {
    let Some(path) = inputs.recordings.pop() else {
        return Ok(says_left_out(&inputs, console));
    };
    let request = arguments.request()?;
    let output = inputs.files_of(&path, arguments.output.as_ref())?;
    let announce = |announcement: &Announcement| print_editor(announcement, console);
    match edit(&path, output, &request, arguments.listen.socket(), announce)? {
        Some(output) => {
            print(&path, &output, console);
            Ok(Outcome::Success)
        }
        None => {
            console.warn("the editor was closed without a mask: nothing was written");
            Ok(Outcome::Failure)
        }
    }
}

/// Names what lies beside the recordings, and inputs that hold none.
fn says_left_out(inputs: &MaskInputs, console: Console) -> Outcome {
    for path in &inputs.strays {
        let input = path.to_string_lossy().into_owned();
        let message = if is_named(path) {
            "it is a photograph beside recordings: name it as an input of its own"
        } else if recordings(path).is_ok() {
            "it holds recordings, beside a video for which its folder stands: name it as an input of its own"
        } else {
            "it is not a session, a video or a photograph"
        };
        let message = message.to_owned();
        console.print(
            &format!("{input}: left out: {message}"),
            &Event::LeftOut {
                session: None,
                input,
                message,
            },
        );
    }
    for (input, fault) in &inputs.faults {
        console.error_for(input, None, fault);
    }
    if !inputs.faults.is_empty() && inputs.recordings.is_empty() {
        Outcome::Failure
    } else if inputs.strays.is_empty() && inputs.faults.is_empty() {
        Outcome::Success
    } else {
        Outcome::Partial
    }
}

fn make(
    mut inputs: MaskInputs,
    arguments: &MaskArguments,
    console: Console,
) -> Result<Outcome, MaskingError> {
    let mut request = arguments.request()?;
    let found = says_left_out(&inputs, console);
    let paths = std::mem::take(&mut inputs.recordings);
    request.inputs.extend(paths.iter().cloned());
    let bar = console.progress(paths.len() as u64, "masks");
    let mut totals = RunTotals::new(paths.len() as u64, Instant::now());
    let (mut failed, mut kept) = (0, 0);
    for path in &paths {
        let files = inputs.files_of(path, arguments.output.as_ref());
        let made = files.and_then(|files| make_mask(path, files, &request));
        totals.ended(made.is_ok(), Instant::now());
        match made {
            Ok(output) => bar.suspend(|| print(path, &output, console)),
            Err(error) => match error.handmade().filter(|_| paths.len() > 1) {
                Some(mask) => {
                    kept += 1;
                    bar.suspend(|| print_kept(path, mask, console));
                }
                None => {
                    failed += 1;
                    let session = recording_name(path);
                    bar.suspend(|| console.error_for(path, Some(&session), &error));
                }
            },
        }
        bar.inc(1);
        bar.suspend(|| totals.say(console));
    }
    bar.finish_and_clear();
    let made = paths.len() - failed - kept;
    if paths.len() > 1 || found != Outcome::Success {
        let left_out = inputs.strays.len();
        say_summary(console, made, kept, left_out, failed + inputs.faults.len());
    }
    Ok(if failed > 0 && made == 0 {
        Outcome::Failure
    } else if failed > 0 {
        Outcome::Partial
    } else {
        found
    })
}

/// What became of all inputs.
fn say_summary(console: Console, made: usize, kept: usize, left_out: usize, failed: usize) {
    let mut summary = match made {
        0 => "no mask made".to_owned(),
        made => format!("{} made", count_of(made as u64, "mask")),
    };
    let others = [
        (kept, "kept as made by hand"),
        (failed, "failed"),
        (left_out, "left out"),
    ];
    for (count, what) in others {
        if count > 0 {
            summary += &format!(", {count} {what}");
        }
    }
    summary += match (made, left_out + failed) {
        (0, 0) => "",
        (0, _) => ": see above",
        (_, 0) => "; look at each preview",
        _ => ": see above; look at each preview",
    };
    let event = Event::Done(Done::Masks {
        made: made as u64,
        kept: kept as u64,
        left_out: left_out as u64,
        failed: failed as u64,
        summary: summary.clone(),
    });
    console.print(&summary, &event);
}

/// Prints that a mask stays as somebody made it.
fn print_kept(input: &Path, mask: &Path, console: Console) {
    let session = recording_name(input);
    let mask = mask.to_string_lossy().into_owned();
    console.print(
        &format!("{session}: kept {mask}, which was made or changed by hand; --force replaces it"),
        &Event::Kept {
            session: session.clone(),
            input: input.to_string_lossy().into_owned(),
            mask: mask.clone(),
        },
    );
}

/// Prints the warnings about one mask, its files and its size.
fn print(input: &Path, output: &MaskOutput, console: Console) {
    let id = &output.recording;
    for notice in &output.notices {
        console.warn_for(id, notice.text());
    }
    for warning in &output.record.warnings {
        console.warn_for(id, warning);
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
        session: id.clone(),
        input: path(input),
        mask: path(&output.files.mask),
        record: path(&output.files.record),
        preview: path(&output.files.preview),
        source: json!(source),
        result: json!(result),
        warnings: output.record.warnings.clone(),
    };
    console.print(&text, &event);
}

/// Prints where the editor is.
fn print_editor(announcement: &Announcement, console: Console) {
    let url = &announcement.url;
    let qr = match (announcement.address.ip().is_loopback(), &announcement.qr) {
        (false, Some(qr)) => format!("{qr}\n"),
        _ => String::new(),
    };
    console.print(
        &format!("{qr}Open in a browser: {url}"),
        &Event::Editor {
            address: announcement.address.to_string(),
            url: url.clone(),
        },
    );
}
