//! `relit-extract INPUT... -o OUT`: progress and results of the extraction.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use relit_console::{Console, Outcome};
use relit_console::{Done, Event, ProgressBar};
use relit_data::causes::with_causes;
use relit_data::counts::count_of;
use relit_data::shard::SessionEntry;
use relit_extract::{ExtractError, ExtractOptions, Observer, RecordingOutcome, Tally, extract};
use serde_json::json;

pub(crate) fn run(
    console: Console,
    inputs: &[PathBuf],
    out: &Path,
    options: &ExtractOptions,
) -> Result<Outcome, ExtractError> {
    let reporter = Reporter {
        console,
        out,
        bar: Mutex::new(ProgressBar::hidden()),
    };
    if let Some(task) = options.task {
        // It may be the scheduler's variables that say so.
        console.say_phase(
            &format!(
                "task {task}: every {}th recording is this one's",
                task.count()
            ),
            &Event::Task {
                task: task.to_string(),
            },
        );
    }
    let tally = extract(inputs, out, options, &reporter)?;
    if let Some(task) = options.task
        && tally == Tally::default()
    {
        console.warn(&format!(
            "task {task} has none of the recordings: name all of them to each task, or give --task 0/1 for all that are named"
        ));
    }
    console.say(
        &format!(
            "{}: {} extracted ({} with losses, {} with a mask that does not fit, {} broken), {} skipped, {} left out, {} failed",
            out.display(),
            tally.extracted,
            tally.lossy,
            tally.misfits,
            tally.broken,
            tally.skipped,
            tally.left_out,
            tally.failed
        ),
        &Event::Done(Done::Extraction {
            out: out.to_string_lossy().into_owned(),
            extracted: tally.extracted as u64,
            lossy: tally.lossy as u64,
            misfits: tally.misfits as u64,
            broken: tally.broken as u64,
            skipped: tally.skipped as u64,
            left_out: tally.left_out as u64,
            failed: tally.failed as u64,
        }),
    );
    let nothing_came_out = tally.extracted + tally.skipped == 0;
    Ok(match (tally.failed, tally.flawed + tally.left_out) {
        (0, 0) => Outcome::Success,
        (1.., _) if nothing_came_out => Outcome::Failure,
        _ => Outcome::Partial,
    })
}

/// Prints the progress and the outcome of each recording.
struct Reporter<'a> {
    console: Console,
    out: &'a Path,
    bar: Mutex<ProgressBar>,
}

impl Reporter<'_> {
    fn bar(&self) -> std::sync::MutexGuard<'_, ProgressBar> {
        self.bar.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn skipped(&self, entry: &SessionEntry) {
        let flaw = if entry.has_misfit() {
            "; its mask does not fit, see its report"
        } else if entry.is_broken() {
            "; it is broken, see its report"
        } else if entry.lossy {
            "; something of it is lost, see its report"
        } else {
            ""
        };
        self.console.say(
            &format!("{}: already extracted, skipped{flaw}", entry.id),
            &Event::Skipped {
                id: entry.id.clone(),
                lossy: entry.lossy,
                misfit: entry.has_misfit(),
                broken: entry.is_broken(),
            },
        );
    }

    fn left_out(&self, recording: &Path, error: &ExtractError) {
        let input = recording.to_string_lossy().into_owned();
        let message = with_causes(error);
        self.console.say(
            &format!("{input}: left out: {message}"),
            &Event::LeftOut { input, message },
        );
    }

    fn extracted(&self, entry: &SessionEntry) {
        for warning in &entry.warnings {
            self.console.warn(&format!("{}: {warning}", entry.id));
        }
        let report = self.out.join(format!("{}.html", entry.id));
        self.console.say(
            &format!(
                "{}: {} ({}), Spec-Net on for {}, report {}",
                entry.id,
                count_of(u64::from(entry.samples), "sample"),
                count_of(u64::from(entry.duplicates), "duplicate"),
                entry.spec_net,
                report.display()
            ),
            &Event::Extracted {
                session: json!(entry),
            },
        );
    }
}

impl Observer for Reporter<'_> {
    fn started(&self, recording: &Path, samples: u32) {
        let name = recording
            .file_name()
            .unwrap_or(recording.as_os_str())
            .to_string_lossy();
        *self.bar() = self.console.progress(u64::from(samples), &name);
    }

    fn advanced(&self) {
        self.bar().inc(1);
    }

    fn ended(&self, recording: &Path, outcome: &RecordingOutcome) {
        self.bar().finish_and_clear();
        match outcome {
            RecordingOutcome::Extracted(entry) => self.extracted(entry),
            RecordingOutcome::Skipped(entry) => self.skipped(entry),
            RecordingOutcome::LeftOut(error) => self.left_out(recording, error),
            RecordingOutcome::Failed(error) => self.console.error_in(recording, error),
        }
    }
}
