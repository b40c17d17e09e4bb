//! `relit-extract stats OUT`: the data set at a glance.

use std::path::Path;

use relit_console::{Console, Event, Outcome};
use relit_data::counts::count_of;
use relit_data::shard::{
    Overview, OverviewTotals, QualityVerdict, SATURATION_BOUNDS, SaturationHistogram, SessionEntry,
};
use relit_extract::ExtractError;
use relit_extract::objects::overview;
use serde_json::{Value, json};

/// Characters of the longest bar of the histogram.
const BAR: u64 = 40;
/// Sessions that are printed for a person.
const MAX_PRINTED: usize = 200;

pub(crate) fn run(console: Console, out: &Path) -> Result<Outcome, ExtractError> {
    let overview = overview(out)?;
    for problem in &overview.problems {
        console.warn(problem);
    }
    let most = console.most_lines(MAX_PRINTED);
    let longest = |name: &str, of: fn(&SessionEntry) -> &str| {
        let lengths = overview.sessions.iter().map(|(e, _)| of(e).chars().count());
        lengths.max().unwrap_or_default().max(name.len())
    };
    let widths = [
        longest("session", |entry| &entry.id),
        longest("object", |entry| &entry.object),
    ];
    console.say_to_people(&format!(
        "{:id$}  {:object$}  verdict     samples  Spec-Net  saturated  shift rms/max px  reasons",
        "session",
        "object",
        id = widths[0],
        object = widths[1],
    ));
    for (entry, histogram) in overview.sessions.iter().take(most) {
        console.say(&line(entry, widths), &event(entry, histogram));
    }
    if let Some(more @ 1..) = overview.sessions.len().checked_sub(most) {
        console.warn(&format!(
            "{} not shown: --json has them all",
            count_of(more as u64, "session")
        ));
    }
    let totals = overview.totals();
    console.say_to_people(&histogram(&totals));
    console.say(
        &sums(out, &overview, &totals),
        &sums_event(out, &overview, &totals),
    );
    Ok(match overview.problems.is_empty() {
        true => Outcome::Whole,
        false => Outcome::Incomplete,
    })
}

/// One session for a person, in columns of these widths for its name and its object.
fn line(entry: &SessionEntry, widths: [usize; 2]) -> String {
    let quality = &entry.quality;
    let shift = match (quality.shift_rms_px, quality.shift_max_px) {
        (Some(rms), Some(most)) => format!("{rms:.2} / {most:.2}"),
        _ => "-".to_owned(),
    };
    let text = format!(
        "{:id$}  {:object$}  {:10}  {:>7}  {:>6.1} %  {:>7.2} %  {shift:>16}  {}",
        entry.id,
        entry.object,
        quality.verdict,
        entry.samples,
        percent(u64::from(entry.spec_net), u64::from(entry.samples)),
        100.0 * quality.saturated_mean,
        quality.reasons.join("; "),
        id = widths[0],
        object = widths[1],
    );
    text.trim_end().to_owned()
}

fn percent(part: u64, whole: u64) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}

/// One session for a machine.
fn event(entry: &SessionEntry, histogram: &SaturationHistogram) -> Value {
    json!({
        "event": "session",
        "id": entry.id,
        "object": entry.object,
        "samples": entry.samples,
        "duplicates": entry.duplicates,
        "spec_net": entry.spec_net,
        "lossy": entry.lossy,
        "warnings": entry.warnings,
        "quality": entry.quality,
        "histogram": histogram,
    })
}

/// The samples by saturated fraction, as bars.
fn histogram(totals: &OverviewTotals) -> String {
    let largest = totals.histogram.iter().copied().max().unwrap_or_default();
    let lines = totals
        .histogram
        .iter()
        .enumerate()
        .map(|(class, &samples)| {
            let bar = "#".repeat((BAR * samples).div_ceil(largest.max(1)) as usize);
            let bound = |class: usize| 100.0 * SATURATION_BOUNDS.get(class).copied().unwrap_or(1.0);
            let name = match class {
                0 => "0 %".to_owned(),
                n => format!("{} to {} %", bound(n - 1), bound(n)),
            };
            format!("  {name:>13}  {samples:>8}  {bar}")
                .trim_end()
                .to_owned()
        });
    let lines: Vec<String> = lines.collect();
    format!(
        "\nsamples by saturated part of the object:\n{}\n",
        lines.join("\n")
    )
}

fn sums(out: &Path, overview: &Overview, totals: &OverviewTotals) -> String {
    let counts =
        QualityVerdict::ALL.map(|verdict| format!("{} {verdict}", overview.count(verdict)));
    format!(
        "{}: {} ({}) of {}, {}, Spec-Net on for {} ({:.1} %)\n\
         moved back {}, not registered {}, exposure steps {}, pictures repeated {}, frames used again {}, \
         blurred {}; {} with losses, {}",
        out.display(),
        count_of(overview.sessions.len() as u64, "session"),
        counts.join(", "),
        count_of(totals.objects as u64, "object"),
        count_of(totals.samples, "sample"),
        totals.spec_net,
        percent(totals.spec_net, totals.samples),
        totals.moved,
        totals.unregistered,
        totals.exposure_steps,
        totals.identical,
        totals.duplicates,
        totals.blurred,
        count_of(totals.lossy as u64, "session"),
        count_of(totals.warnings as u64, "warning"),
    )
}

fn sums_event(out: &Path, overview: &Overview, totals: &OverviewTotals) -> Event {
    let verdicts: serde_json::Map<String, Value> = QualityVerdict::ALL
        .into_iter()
        .map(|verdict| (verdict.to_string(), overview.count(verdict).into()))
        .collect();
    Event::Stats(json!({
        "out": out.to_string_lossy(),
        "sessions": overview.sessions.len(),
        "verdicts": verdicts,
        "objects": totals.objects,
        "samples": totals.samples,
        "spec_net": totals.spec_net,
        "duplicates": totals.duplicates,
        "moved": totals.moved,
        "unregistered": totals.unregistered,
        "exposure_steps": totals.exposure_steps,
        "identical": totals.identical,
        "blurred": totals.blurred,
        "lossy": totals.lossy,
        "warnings": totals.warnings,
        "bounds": SATURATION_BOUNDS,
        "histogram": totals.histogram,
    }))
}
