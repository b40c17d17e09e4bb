//! `relit-extract verify OUT`: the problems of a data set.

use std::path::Path;

use relit_console::{Console, Event, Outcome};
use relit_data::counts::count_of;
use relit_data::shard::verify;
use relit_extract::ExtractError;

use super::refuse_urls;

/// Number of problems that are printed for a person.
const MAX_PRINTED: usize = 50;

pub(crate) fn run(console: Console, out: &Path) -> Result<Outcome, ExtractError> {
    refuse_urls(&[out])?;
    let bar = console.progress(0, "verify");
    let report = verify(out, &|done, total| {
        bar.set_length(total);
        bar.set_position(done);
    })?;
    bar.finish_and_clear();
    let count = report.problems.len();
    for problem in &report.problems[..count.min(console.max_lines(MAX_PRINTED))] {
        let (file, sample, what) = (&problem.file, &problem.sample, &problem.what);
        console.print(
            &problem.to_string(),
            &Event::Problem {
                session: problem.session.clone(),
                file: file.clone(),
                sample: sample.clone(),
                message: what.clone(),
            },
        );
    }
    if count > console.max_lines(MAX_PRINTED) {
        console.warn(&format!(
            "{} not shown: --json lists them all",
            count_of((count - MAX_PRINTED) as u64, "problem")
        ));
    }
    let summary = match count {
        0 => "no problems".to_owned(),
        n => count_of(n as u64, "problem"),
    };
    console.print(
        &format!(
            "{}: {}, {}, {} read back: {summary}",
            out.display(),
            count_of(report.sessions as u64, "session"),
            count_of(report.shards as u64, "shard"),
            count_of(report.samples as u64, "sample")
        ),
        &Event::Verified {
            out: out.to_string_lossy().into_owned(),
            sessions: report.sessions,
            shards: report.shards,
            samples: report.samples,
            problems: count as u64,
        },
    );
    Ok(if count == 0 {
        Outcome::Success
    } else {
        Outcome::Failure
    })
}
