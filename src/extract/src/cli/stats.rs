//! `relit-extract stats OUT`: the data set at a glance.

use std::collections::BTreeSet;
use std::path::Path;

use relit_console::{Console, Event, Outcome};
use relit_data::counts::count_of;
use relit_data::shard::{QualityVerdict, SessionEntry, SessionQuality};
use relit_extract::ExtractError;
use relit_extract::objects::described;
use serde_json::{Map, json};

/// Sessions that are printed for a person.
const MAX_PRINTED: usize = 200;

/// What is counted over all sessions: its name for a machine, its name for a person, and its number in one session.
type Sum = (&'static str, &'static str, fn(&SessionQuality) -> u32);
const SUMS: [Sum; 5] = [
    ("moved", "moved back", |quality| quality.moved),
    ("unregistered", "not registered", |quality| {
        quality.unregistered
    }),
    ("exposure_steps", "exposure steps", |quality| {
        quality.exposure_steps
    }),
    ("identical", "pictures repeated", |quality| {
        quality.identical
    }),
    ("blurred", "blurred", |quality| quality.blurred),
];

pub(crate) fn run(console: Console, out: &Path) -> Result<Outcome, ExtractError> {
    let (dataset, problem) = described(out)?;
    let sessions = &dataset.sessions;
    if let Some(problem) = &problem {
        console.warn(problem);
    }
    let most = console.max_lines(MAX_PRINTED);
    let longest = |name: &str, of: fn(&SessionEntry) -> &str| {
        let lengths = sessions.iter().map(|entry| of(entry).chars().count());
        lengths.max().unwrap_or_default().max(name.len())
    };
    let widths = [
        longest("session", |entry| &entry.id),
        longest("object", |entry| &entry.object),
    ];
    console.print_text(&format!(
        "{:id$}  {:object$}  verdict     samples  Spec-Net  saturated  shift rms/max px  reasons",
        "session",
        "object",
        id = widths[0],
        object = widths[1],
    ));
    for entry in sessions.iter().take(most) {
        console.print(&line(entry, widths), &event(entry));
    }
    if let Some(more @ 1..) = sessions.len().checked_sub(most) {
        console.warn(&format!(
            "{} not shown: --json has them all",
            count_of(more as u64, "session")
        ));
    }
    let (text, event) = sums(out, sessions);
    console.print(&text, &event);
    Ok(match problem {
        None => Outcome::Success,
        Some(_) => Outcome::Partial,
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
fn event(entry: &SessionEntry) -> Event {
    Event::Session(json!({
        "session": entry.id,
        "object": entry.object,
        "samples": entry.samples,
        "duplicates": entry.duplicates,
        "spec_net": entry.spec_net,
        "lossy": entry.lossy,
        "warnings": entry.warnings,
        "quality": entry.quality,
    }))
}

/// All sessions together, for a person and for a machine.
fn sums(out: &Path, sessions: &[SessionEntry]) -> (String, Event) {
    let sum = |of: &dyn Fn(&SessionEntry) -> u32| -> u64 {
        sessions.iter().map(|entry| u64::from(of(entry))).sum()
    };
    let objects: BTreeSet<&str> = sessions.iter().map(|entry| &*entry.object).collect();
    let samples = sum(&|entry| entry.samples);
    let spec_net = sum(&|entry| entry.spec_net);
    let duplicates = sum(&|entry| entry.duplicates);
    let lossy = sum(&|entry| u32::from(entry.lossy));
    let warnings = sum(&|entry| entry.warnings.len() as u32);
    let verdicts = QualityVerdict::ALL.map(|verdict| {
        let count = sum(&|entry| u32::from(entry.quality.verdict == verdict));
        (verdict, count)
    });
    let figures = SUMS.map(|(name, words, of)| (name, words, sum(&|entry| of(&entry.quality))));
    let text = format!(
        "{}: {} ({}) of {}, {}, Spec-Net on for {spec_net} ({:.1} %)\n{}, frames used again {duplicates}; {} with losses, {}",
        out.display(),
        count_of(sessions.len() as u64, "session"),
        verdicts
            .map(|(verdict, count)| format!("{count} {verdict}"))
            .join(", "),
        count_of(objects.len() as u64, "object"),
        count_of(samples, "sample"),
        percent(spec_net, samples),
        figures
            .map(|(_, words, count)| format!("{words} {count}"))
            .join(", "),
        count_of(lossy, "session"),
        count_of(warnings, "warning"),
    );
    let verdicts = verdicts.map(|(verdict, count)| (verdict.to_string(), count.into()));
    let mut event = json!({
        "out": out.to_string_lossy(),
        "sessions": sessions.len(),
        "verdicts": Map::from_iter(verdicts),
        "objects": objects.len(),
        "samples": samples,
        "spec_net": spec_net,
        "duplicates": duplicates,
        "lossy": lossy,
        "warnings": warnings,
    });
    for (name, _, count) in figures {
        event[name] = count.into();
    }
    (text, Event::Stats(event))
}
