//! `relit-extract merge`: the pieces of several tasks, or finished data sets, become one.

use std::path::{Path, PathBuf};

use relit_console::{Console, Event, Outcome};
use relit_data::counts::count_of;
use relit_data::shard::{Dataset, has_only_partial_manifests, merge_datasets};
use relit_extract::ExtractError;
use relit_extract::objects::merge;

use super::refuse_urls;

/// Joins what several tasks wrote into `out`.
pub(crate) fn merge_tasks(console: Console, out: &Path) -> Result<Outcome, ExtractError> {
    let merged = merge(out)?;
    for (name, why) in &merged.left_out {
        console.print(
            &format!("{name}: left out: {why}"),
            &Event::LeftOut {
                session: None,
                input: name.clone(),
                message: why.clone(),
            },
        );
    }
    for (name, why) in &merged.failed {
        let error = ExtractError::Refused(why.clone());
        console.error_for(Path::new(name), None, &error);
    }
    let from = MergedFrom {
        tasks: merged.tasks.into(),
        datasets: 0,
    };
    let outcome = report(console, out, &merged.dataset, &from);
    if merged.left_out.is_empty() && merged.failed.is_empty() {
        Ok(outcome)
    } else {
        Ok(Outcome::Partial)
    }
}

/// Joins finished data sets to a new one in `output`.
pub(crate) fn merge_finished(
    console: Console,
    inputs: &[PathBuf],
    output: &Path,
) -> Result<Outcome, ExtractError> {
    let all: Vec<&Path> = inputs
        .iter()
        .map(PathBuf::as_path)
        .chain([output])
        .collect();
    refuse_urls(&all)?;
    if let Some(unmerged) = inputs
        .iter()
        .find(|input| has_only_partial_manifests(input))
    {
        let unmerged = unmerged.display();
        return Err(ExtractError::Refused(format!(
            "{unmerged} holds what tasks have written: run relit-extract merge {unmerged} first"
        )));
    }
    let bar = console.progress(0, "merge");
    let merged = merge_datasets(inputs, output, &|done, of| {
        bar.set_length(of);
        bar.set_position(done);
    });
    bar.finish_and_clear();
    let from = MergedFrom {
        tasks: 0,
        datasets: inputs.len() as u64,
    };
    Ok(report(console, output, &merged?, &from))
}

/// What a data set was merged from.
struct MergedFrom {
    tasks: u64,
    datasets: u64,
}

fn report(console: Console, out: &Path, dataset: &Dataset, from: &MergedFrom) -> Outcome {
    let sessions = dataset.sessions.len() as u64;
    let samples = dataset.shards.iter().map(|shard| u64::from(shard.samples));
    let samples: u64 = samples.sum();
    let merged_from = match from.datasets {
        0 => count_of(from.tasks, "task"),
        datasets => count_of(datasets, "data set"),
    };
    let flawed = flawed(dataset);
    let outcome = outcome_of(&flawed);
    console.print(
        &format!(
            "{}: {} with {}, merged from {merged_from}{}",
            out.display(),
            count_of(sessions, "session"),
            count_of(samples, "sample"),
            describe_flawed(&flawed),
        ),
        &Event::Merged {
            out: out.to_string_lossy().into_owned(),
            sessions,
            samples,
            tasks: from.tasks,
            datasets: from.datasets,
            flawed,
        },
    );
    outcome
}

/// The sessions of a data set at which a person should look.
pub(super) fn flawed(dataset: &Dataset) -> Vec<String> {
    let sessions = dataset.sessions.iter();
    let flawed = sessions.filter(|session| session.is_flawed());
    flawed.map(|session| session.id.clone()).collect()
}

/// These sessions, at the end of a sentence.
pub(super) fn describe_flawed(flawed: &[String]) -> String {
    if flawed.is_empty() {
        return String::new();
    }
    format!(
        "; with losses, a mask that does not fit, or broken (see their reports): {}",
        flawed.join(", ")
    )
}

/// Whether a person should look at any.
pub(super) fn outcome_of(flawed: &[String]) -> Outcome {
    if flawed.is_empty() {
        Outcome::Success
    } else {
        Outcome::Partial
    }
}
