//! `relit-extract merge OUT`: the pieces of several tasks become one data set.

use std::path::Path;

use relit_console::{Console, Outcome};
use relit_data::counts::count_of;
use relit_extract::ExtractError;
use relit_extract::objects::merge;
use serde_json::json;

pub(crate) fn run(console: Console, out: &Path) -> Result<Outcome, ExtractError> {
    let merged = merge(out)?;
    for (name, why) in &merged.left_out {
        console.say(
            &format!("{name}: left out: {why}"),
            &json!({ "event": "left_out", "input": name, "message": why }),
        );
    }
    let (sessions, tasks) = (merged.dataset.sessions.len(), merged.tasks);
    let samples: u64 = merged
        .dataset
        .shards
        .iter()
        .map(|shard| u64::from(shard.samples))
        .sum();
    console.say(
        &format!(
            "{}: {} with {}, of {}",
            out.display(),
            count_of(sessions as u64, "session"),
            count_of(samples, "sample"),
            count_of(tasks.into(), "task")
        ),
        &json!({
            "event": "merged",
            "out": out.to_string_lossy(),
            "sessions": sessions,
            "samples": samples,
            "tasks": tasks,
        }),
    );
    let mut sessions = merged.dataset.sessions.iter();
    let is_flawed = sessions.any(|session| session.lossy || session.has_misfit());
    Ok(match is_flawed || !merged.left_out.is_empty() {
        true => Outcome::Incomplete,
        false => Outcome::Whole,
    })
}
