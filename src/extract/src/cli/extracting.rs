//! `relit-extract INPUT... -o OUT`: progress and results of the extraction.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use relit_console::{Console, Done, Event, Outcome, ProgressBar, RunTotals};
use relit_data::causes::with_causes;
use relit_data::counts::count_of;
use relit_data::shard::SessionEntry;
use relit_extract::{
    ExtractError, ExtractOptions, ExtractSummary, Observer, RecordingOutcome, extract,
};
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
        totals: Mutex::new(RunTotals::new(0, Instant::now())),
    };
    if let Some(task) = options.task {
        // It may be the scheduler's variables that say so.
        console.print_phase(
            &format!(
                "task {task}: extracts one of every {} recordings",
                task.count()
            ),
            &Event::Task {
                task: task.to_string(),
            },
        );
    }
    let summary = extract(inputs, out, options, &reporter)?;
    if let Some(task) = options.task
        && summary == ExtractSummary::default()
    {
        console.warn(&format!(
            "task {task} has no recording: give all recordings to each task, or --task 0/1 to extract all that are given"
        ));
    }
    let description = describe(&summary);
    console.print(
        &format!("{}: {description}", out.display()),
        &Event::Done(Done::Extraction {
            out: out.to_string_lossy().into_owned(),
            extracted: summary.extracted as u64,
            lossy: summary.lossy as u64,
            misfits: summary.misfits as u64,
            broken: summary.broken as u64,
            skipped: summary.skipped as u64,
            left_out: summary.left_out as u64,
            failed: summary.failed as u64,
            summary: description,
        }),
    );
    let nothing_came_out = summary.extracted + summary.skipped == 0;
    Ok(match (summary.failed, summary.flawed + summary.left_out) {
        (0, 0) => Outcome::Success,
        (1.., _) if nothing_came_out => Outcome::Failure,
        _ => Outcome::Partial,
    })
}

/// What happened, in words that need no manual.
fn describe(summary: &ExtractSummary) -> String {
    let sessions = |count: usize| count_of(count as u64, "session");
    let came_out = match (summary.extracted, summary.skipped) {
        (0, 0) => "nothing extracted".to_owned(),
        (0, 1) => "nothing new, 1 session was there already".to_owned(),
        (0, skipped) => format!("nothing new, {} were there already", sessions(skipped)),
        (extracted, 0) => format!("{} extracted", sessions(extracted)),
        (extracted, skipped) => format!(
            "{} extracted, {skipped} were there already",
            sessions(extracted)
        ),
    };
    let troubles = [
        (summary.failed, "failed"),
        (summary.left_out, "left out"),
        (summary.lossy, "with losses"),
        (summary.misfits, "with a mask that does not fit"),
        (summary.broken, "broken: do not train on it"),
    ];
    let troubles = troubles.iter().filter(|(count, _)| *count > 0);
    let troubles: Vec<String> = troubles
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
    match (troubles.is_empty(), summary.extracted + summary.skipped) {
        (true, 0) => came_out,
        (true, _) => format!("{came_out}, all is well"),
        (false, _) => format!("{came_out}; {}; see above", troubles.join(", ")),
    }
}

/// Prints the progress and the outcome of each recording.
struct Reporter<'a> {
    console: Console,
    out: &'a Path,
    bar: Mutex<ProgressBar>,
    totals: Mutex<RunTotals>,
}

impl Reporter<'_> {
    fn bar(&self) -> MutexGuard<'_, ProgressBar> {
        self.bar.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn totals(&self) -> MutexGuard<'_, RunTotals> {
        self.totals.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn skipped(&self, input: &Path, entry: &SessionEntry) {
        let flaw = if entry.has_misfit() {
            "; its mask does not fit, see its report"
        } else if entry.is_broken() {
            "; it is broken, see its report"
        } else if entry.lossy {
            "; parts of it are lost, see its report"
        } else {
            ""
        };
        self.console.print(
            &format!("{}: already extracted, skipped{flaw}", entry.id),
            &Event::Skipped {
                session: entry.id.clone(),
                input: input.to_string_lossy().into_owned(),
                lossy: entry.lossy,
                misfit: entry.has_misfit(),
                broken: entry.is_broken(),
            },
        );
    }

    fn left_out(&self, input: &Path, session: Option<&str>, error: &ExtractError) {
        let input = input.to_string_lossy().into_owned();
        let message = with_causes(error);
        self.console.print(
            &format!("{input}: left out: {message}"),
            &Event::LeftOut {
                session: session.map(str::to_owned),
                input,
                message,
            },
        );
    }

    fn extracted(&self, input: &Path, entry: &SessionEntry) {
        for warning in &entry.warnings {
            self.console.warn_for(&entry.id, warning);
        }
        let report = self.out.join(format!("{}.html", entry.id));
        self.console.print(
            &format!(
                "{}: {}, {} ({}), Spec-Net on for {}, report {}",
                entry.id,
                entry.quality.verdict,
                count_of(u64::from(entry.samples), "sample"),
                count_of(u64::from(entry.duplicates), "duplicate"),
                entry.spec_net,
                report.display()
            ),
            &Event::Extracted {
                session: entry.id.clone(),
                input: input.to_string_lossy().into_owned(),
                entry: json!(entry),
            },
        );
    }
}

impl Observer for Reporter<'_> {
    fn planned(&self, recordings: usize) {
        *self.totals() = RunTotals::new(recordings as u64, Instant::now());
    }

    fn started(&self, session: &str, samples: u32) {
        let label = {
            let totals = self.totals();
            match totals.of {
                0 | 1 => session.to_owned(),
                of => format!("{}/{of} {session}", totals.done + 1),
            }
        };
        let samples = u64::from(samples);
        *self.bar() = self.console.progress_in(Some(session), samples, &label);
    }

    fn advanced(&self) {
        self.bar().inc(1);
    }

    fn ended(&self, input: &Path, session: Option<&str>, outcome: &RecordingOutcome) {
        self.bar().finish_and_clear();
        match outcome {
            RecordingOutcome::Extracted(entry) => self.extracted(input, entry),
            RecordingOutcome::Skipped(entry) => self.skipped(input, entry),
            RecordingOutcome::LeftOut(error) => self.left_out(input, session, error),
            RecordingOutcome::Failed(error) => self.console.error_for(input, session, error),
        }
        if session.is_some() {
            let was_extracted = matches!(outcome, RecordingOutcome::Extracted(_));
            let mut totals = self.totals();
            totals.ended(was_extracted, Instant::now());
            totals.say(self.console);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_summary_names_what_happened_and_nothing_else() {
        let of = |change: fn(&mut ExtractSummary)| {
            let mut summary = ExtractSummary::default();
            change(&mut summary);
            describe(&summary)
        };
        assert_eq!(of(|_| ()), "nothing extracted");
        let failed = of(|summary| summary.failed = 3);
        assert!(failed.contains("nothing extracted") && failed.contains('3'));
        assert!(of(|summary| summary.extracted = 2).contains("all is well"));
        let broken = of(|summary| (summary.extracted, summary.broken) = (2, 1));
        assert!(broken.contains("1 broken") && !broken.contains("well"));
        assert!(!broken.contains('0'), "{broken}");
    }
}
