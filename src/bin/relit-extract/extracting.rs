//! `relit-extract INPUT... -o OUT`: progress and results of the extraction, for a person or a
//! machine.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use indicatif::ProgressBar;
use relit::extract::{Error, Observer, Options, Outcome, extract};
use relit_data::shard::SessionEntry;
use serde_json::json;

use relit::console::{self, Console};

pub(crate) fn run(
    console: Console,
    inputs: &[PathBuf],
    out: &Path,
    options: &Options,
) -> Result<console::Outcome, Error> {
    let teller = Teller {
        console,
        out,
        bar: Mutex::new(ProgressBar::hidden()),
    };
    let tally = extract(inputs, out, options, &teller)?;
    console.say(
        &format!(
            "{}: {} extracted ({} with losses), {} skipped, {} failed",
            out.display(),
            tally.extracted,
            tally.lossy,
            tally.skipped,
            tally.failed
        ),
        &json!({
            "event": "done",
            "out": out.to_string_lossy(),
            "extracted": tally.extracted,
            "lossy": tally.lossy,
            "skipped": tally.skipped,
            "failed": tally.failed,
        }),
    );
    let nothing_came_out = tally.extracted + tally.skipped == 0;
    Ok(match (tally.failed, tally.lossy) {
        (0, 0) => console::Outcome::Whole,
        (1.., _) if nothing_came_out => console::Outcome::Wrong,
        _ => console::Outcome::Lossy,
    })
}

/// Tells what happens, recording by recording.
struct Teller<'a> {
    console: Console,
    out: &'a Path,
    bar: Mutex<ProgressBar>,
}

impl Teller<'_> {
    fn bar(&self) -> std::sync::MutexGuard<'_, ProgressBar> {
        self.bar.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn skipped(&self, entry: &SessionEntry) {
        let lossy = if entry.lossy {
            "; something of it is lost, see its report"
        } else {
            ""
        };
        self.console.say(
            &format!("{}: there already, skipped{lossy}", entry.id),
            &json!({ "event": "skipped", "id": entry.id, "lossy": entry.lossy }),
        );
    }

    fn extracted(&self, entry: &SessionEntry) {
        for warning in &entry.warnings {
            self.console.warn(&format!("{}: {warning}", entry.id));
        }
        let report = self.out.join(format!("{}.html", entry.id));
        self.console.say(
            &format!(
                "{}: {} samples ({} duplicates), Spec-Net on for {}, report {}",
                entry.id,
                entry.samples,
                entry.duplicates,
                entry.spec_net,
                report.display()
            ),
            &json!({ "event": "extracted", "session": entry }),
        );
    }
}

impl Observer for Teller<'_> {
    fn begun(&self, recording: &Path, samples: u32) {
        let name = recording
            .file_name()
            .unwrap_or(recording.as_os_str())
            .to_string_lossy();
        *self.bar() = self.console.progress(u64::from(samples), &name);
    }

    fn advanced(&self) {
        self.bar().inc(1);
    }

    fn ended(&self, recording: &Path, outcome: &Outcome) {
        self.bar().finish_and_clear();
        match outcome {
            Outcome::Extracted(entry) => self.extracted(entry),
            Outcome::Skipped(entry) => self.skipped(entry),
            Outcome::Failed(error) => self.console.error_in(recording, error),
        }
    }
}
