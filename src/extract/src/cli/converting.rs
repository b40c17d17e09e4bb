//! `relit-extract convert OUT -o OTHER`: the data set in the other layout.

use std::path::Path;

use relit_console::{Console, Event, Outcome};
use relit_data::counts::count_of;
use relit_data::shard::{Layout, convert};
use relit_extract::ExtractError;

use super::merging::{describe_flawed, flawed, outcome_of};
use super::refuse_urls;

pub(crate) fn run(
    console: Console,
    out: &Path,
    output: &Path,
    layout: Layout,
) -> Result<Outcome, ExtractError> {
    refuse_urls(&[out, output])?;
    let bar = console.progress(0, "convert");
    let converted = convert(out, output, layout, &|done, of| {
        bar.set_length(of);
        bar.set_position(done);
    });
    bar.finish_and_clear();
    let dataset = converted?;
    let sessions = dataset.sessions.len() as u64;
    let samples = dataset.shards.iter().map(|shard| u64::from(shard.samples));
    let samples: u64 = samples.sum();
    let flawed = flawed(&dataset);
    let outcome = outcome_of(&flawed);
    console.print(
        &format!(
            "{}: {} with {} in the layout {layout}{}",
            output.display(),
            count_of(sessions, "session"),
            count_of(samples, "sample"),
            describe_flawed(&flawed),
        ),
        &Event::Converted {
            out: output.to_string_lossy().into_owned(),
            layout: layout.to_string(),
            sessions,
            samples,
            flawed,
        },
    );
    Ok(outcome)
}
