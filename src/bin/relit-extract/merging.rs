//! `relit-extract merge OUT`: the pieces of several tasks become one data set.

use std::path::Path;

use relit::console::{Console, Outcome};
use relit::extract::ExtractError;
use relit::extract::objects::merge;
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
            "{}: {sessions} sessions with {samples} samples, of {tasks} tasks",
            out.display()
        ),
        &json!({
            "event": "merged",
            "out": out.to_string_lossy(),
            "sessions": sessions,
            "samples": samples,
            "tasks": tasks,
        }),
    );
    let lossy = merged.dataset.sessions.iter().any(|session| session.lossy);
    Ok(match lossy || !merged.left_out.is_empty() {
        true => Outcome::Lossy,
        false => Outcome::Whole,
    })
}
