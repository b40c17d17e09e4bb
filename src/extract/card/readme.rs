//! The page for people.

use std::fmt::Write as _;

use relit_data::counts::count_of;
use relit_data::shard::{Dataset, Overview, SamplingBasis};

use super::facts::{CardFacts, SummedFile};

/// The content of `README.md`.
pub(super) fn readme(
    facts: &CardFacts,
    overview: &Overview,
    dataset: &Dataset,
    files: &[SummedFile],
) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_readme(&mut text, facts, overview, dataset, files);
    text
}

fn write_readme(
    text: &mut String,
    facts: &CardFacts,
    overview: &Overview,
    dataset: &Dataset,
    files: &[SummedFile],
) -> std::fmt::Result {
    let totals = overview.totals();
    let objects = dataset.objects();
    let bytes: u64 = files.iter().map(|file| file.bytes).sum();
    writeln!(text, "# {}\n\n{}\n", facts.name, facts.description)?;
    writeln!(text, "| | |\n| --- | --- |")?;
    writeln!(text, "| version | {}, {} |", facts.version, facts.published)?;
    writeln!(text, "| made by | {} |", facts.creators.join(", "))?;
    writeln!(
        text,
        "| licence | [{}]({}) |",
        facts.license,
        facts.license_url()
    )?;
    writeln!(text, "| published at | {} |", facts.url)?;
    if let Some(cite) = &facts.cite {
        writeln!(text, "| cite as | {cite} |")?;
    }
    writeln!(
        text,
        "| holds | {} of {}, {}, {} in {bytes} bytes |",
        count_of(overview.sessions.len() as u64, "turn"),
        count_of(objects.len() as u64, "object"),
        count_of(totals.samples, "sample"),
        count_of(files.len() as u64, "file"),
    )?;
    writeln!(
        text,
        "| saturated above the gate | {} of {} |\n| used again | {} |\n| turns with losses | {} |\n",
        totals.spec_net,
        count_of(totals.samples, "sample"),
        totals.duplicates,
        totals.lossy,
    )?;

    writeln!(
        text,
        "## Objects\n\n| object | turns | samples |\n| --- | --- | --- |"
    )?;
    for object in &objects {
        let turns = object.sessions.join(", ");
        writeln!(text, "| {} | {turns} | {} |", object.name, object.samples)?;
    }
    writeln!(
        text,
        "\nTurns of one object show it in other poses or light. Keep them on one side of a split.\n"
    )?;

    writeln!(text, "## Angles and light\n")?;
    let by_angle = dataset
        .sessions
        .iter()
        .filter(|session| session.selection == SamplingBasis::Angle)
        .count();
    writeln!(
        text,
        "Camera and object ride on one turntable: the object stands still in the picture while the environment light\n\
         turns around it. `angle_deg` of a sample is the table's angle. {} of {} are sampled by angle, the others evenly\n\
         in time. The light itself is not recorded with the samples.\n",
        by_angle,
        count_of(dataset.sessions.len() as u64, "turn"),
    )?;
    for session in &dataset.sessions {
        if let Some(covered) = session.covered_deg {
            writeln!(text, "- {} covers {covered:.1} degrees.", session.id)?;
        }
    }

    writeln!(
        text,
        "## How it was made\n\n| setting | value |\n| --- | --- |"
    )?;
    let software = &dataset.software;
    writeln!(
        text,
        "| software | {} {} |",
        software.name, software.version
    )?;
    for (name, value) in dataset.settings.rows() {
        writeln!(text, "| {name} | {value} |")?;
    }
    writeln!(
        text,
        "\n`calibration`: colours are the camera's own 8-bit sRGB. Nothing is calibrated to physical units.\n\n\
         ## Check it\n\n    sha256sum -c SHA256SUMS\n    relit-extract verify .\n\n\
         `croissant.json` has the same as Croissant 1.0 metadata."
    )
}
