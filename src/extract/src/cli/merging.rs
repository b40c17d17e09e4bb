//! `relit-extract merge OUT`: the pieces of several tasks become one data set.

use std::path::Path;

use relit_console::{Console, Event, Outcome};
use relit_data::counts::count_of;
use relit_data::shard::SessionEntry;
use relit_extract::ExtractError;
use relit_extract::objects::merge;

pub(crate) fn run(console: Console, out: &Path) -> Result<Outcome, ExtractError> {
    let merged = merge(out)?;
    for (name, why) in &merged.left_out {
        console.say(
            &format!("{name}: left out: {why}"),
            &Event::LeftOut {
                input: name.clone(),
                message: why.clone(),
            },
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
        &Event::Merged {
            out: out.to_string_lossy().into_owned(),
            sessions: sessions as u64,
            samples,
            tasks: tasks.into(),
        },
    );
    let mut sessions = merged.dataset.sessions.iter();
    let is_flawed = sessions.any(SessionEntry::is_flawed);
    Ok(if is_flawed || !merged.left_out.is_empty() {
        Outcome::Partial
    } else {
        Outcome::Success
    })
}
