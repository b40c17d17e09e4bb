//! Making masks.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use relit_console::{Console, Outcome};
use relit_data::session::{beside_sessions, recordings};
use relit_mask::{MaskingError, edit, make_mask};
use relit_web::Announcement;

use super::arguments::MaskArguments;
use super::report;

/// Makes the mask of every recording that the arguments name.
pub(crate) fn run(arguments: &MaskArguments) -> ExitCode {
    let console = Console::new(arguments.json);
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
        _ => console.finish(
            make(&paths, arguments, console).map(|outcome| match outcome {
                Outcome::Whole if says_unused(&paths, &arguments.input, console) => {
                    Outcome::Incomplete
                }
                outcome => outcome,
            }),
        ),
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
    let announce = |announcement: &Announcement| report::print_editor(announcement, console);
    match edit(path, output, request, arguments.listen.socket(), announce)? {
        Some(output) => {
            report::print(&output, console);
            Ok(Outcome::Whole)
        }
        None => {
            console.warn("the editor was left without a mask: nothing was written");
            Ok(Outcome::Wrong)
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
            Ok(output) => bar.suspend(|| report::print(&output, console)),
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
        0 => Outcome::Whole,
        all if all == paths.len() => Outcome::Wrong,
        _ => Outcome::Incomplete,
    })
}
