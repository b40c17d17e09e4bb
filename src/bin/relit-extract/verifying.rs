//! `relit-extract verify OUT`: the verdict on a data set, for a person or a machine.

use std::path::Path;

use relit_data::shard::{Error, verify};
use serde_json::json;

use relit::console::{Console, Outcome};

/// How many problems a person is told one by one.
const TOLD: usize = 50;

pub(crate) fn run(console: Console, out: &Path) -> Result<Outcome, Error> {
    let bar = console.progress(0, "verify");
    let verdict = verify(out, &|done, total| {
        bar.set_length(total);
        bar.set_position(done);
    })?;
    bar.finish_and_clear();
    let wrong = verdict.problems.len();
    for problem in &verdict.problems[..wrong.min(console.most_lines(TOLD))] {
        let (file, sample, what) = (&problem.file, &problem.sample, &problem.what);
        console.say(
            &problem.to_string(),
            &json!({ "event": "problem", "file": file, "sample": sample, "message": what }),
        );
    }
    if wrong > console.most_lines(TOLD) {
        console.warn(&format!(
            "{} more problems: --json lists them all",
            wrong - TOLD
        ));
    }
    let judgement = match wrong {
        0 => "all is well".to_owned(),
        1 => "1 problem".to_owned(),
        n => format!("{n} problems"),
    };
    console.say(
        &format!(
            "{}: {} sessions, {} shards, {} samples read back: {judgement}",
            out.display(),
            verdict.sessions,
            verdict.shards,
            verdict.samples
        ),
        &json!({
            "event": "verified",
            "out": out.to_string_lossy(),
            "sessions": verdict.sessions,
            "shards": verdict.shards,
            "samples": verdict.samples,
            "problems": wrong,
        }),
    );
    Ok(if wrong == 0 {
        Outcome::Whole
    } else {
        Outcome::Wrong
    })
}
