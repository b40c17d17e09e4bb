//! `relit-extract remove OUT SESSION...`: sessions out of a data set.

use std::path::Path;

use relit_console::{Console, Event, Outcome};
use relit_data::counts::count_of;
use relit_data::shard::remove_sessions;
use relit_extract::ExtractError;

use super::refuse_urls;

pub(crate) fn run(
    console: Console,
    out: &Path,
    sessions: &[String],
) -> Result<Outcome, ExtractError> {
    refuse_urls(&[out])?;
    let removed = remove_sessions(out, sessions)?;
    let samples = removed.iter().map(|entry| u64::from(entry.samples)).sum();
    let sessions: Vec<String> = removed.into_iter().map(|entry| entry.id).collect();
    console.print(
        &format!(
            "{}: {} with {} removed: {}",
            out.display(),
            count_of(sessions.len() as u64, "session"),
            count_of(samples, "sample"),
            sessions.join(", "),
        ),
        &Event::Removed {
            out: out.to_string_lossy().into_owned(),
            sessions,
            samples,
        },
    );
    Ok(Outcome::Success)
}
