//! `relit-extract stats OUT`: the data set at a glance.

use std::path::Path;

use relit_console::{Console, Event, Outcome};
use relit_data::counts::count_of;
use relit_data::durable;
use relit_data::report::render_overview;
use relit_data::shard::{
    Overview, OverviewTotals, QualityVerdict, SATURATION_BOUNDS, SessionOverview, ShardError,
};
use relit_extract::ExtractError;
use relit_extract::objects::overview;
use serde_json::{Value, json};

/// Characters of the longest bar of the histogram.
const BAR: u64 = 40;
/// Sessions that are printed for a person.
const MAX_PRINTED: usize = 200;

pub(crate) fn run(
    console: Console,
    out: &Path,
    page: Option<&Path>,
) -> Result<Outcome, ExtractError> {
    let overview = overview(out)?;
    if let Some(page) = page {
        if is_of_data_set(out, page, &overview) {
            return Err(ExtractError::PageInTheWay(page.to_owned()));
        }
        write_page(out, page, &overview)?;
    }
    for problem in &overview.problems {
        console.warn(problem);
    }
    let most = console.most_lines(MAX_PRINTED);
    let columns = Columns::of(&overview);
    console.say_to_people(&columns.heading());
    for session in overview.sessions.iter().take(most) {
        console.say(&columns.line(session), &event(session));
    }
    if let Some(more @ 1..) = overview.sessions.len().checked_sub(most) {
        console.warn(&format!(
            "{} not shown: --html and --json have them all",
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

/// Whether a page would take the place of a file of the data set.
fn is_of_data_set(out: &Path, page: &Path, overview: &Overview) -> bool {
    let Ok(page) = page.canonicalize() else {
        return false;
    };
    let is_report = |session: &SessionOverview| {
        let report = session.entry.report.as_ref();
        report.is_some_and(|report| {
            out.join(&report.file).canonicalize().ok().as_deref() == Some(&page)
        })
    };
    let is_other = page.extension().is_none_or(|e| e != "html");
    let is_inside = out.canonicalize().is_ok_and(|out| page.starts_with(out));
    (is_inside && is_other) || overview.sessions.iter().any(is_report)
}

fn write_page(out: &Path, page: &Path, overview: &Overview) -> Result<(), ShardError> {
    let whole = |path: &Path| path.canonicalize().ok();
    let parent = page
        .parent()
        .filter(|parent| !parent.as_os_str().is_empty());
    let beside = whole(parent.unwrap_or(Path::new("."))) == whole(out);
    let name = whole(out).unwrap_or_else(|| out.to_owned());
    let name = name.file_name().unwrap_or(name.as_os_str());
    let html = render_overview(&name.to_string_lossy(), overview, beside);
    durable::write_whole(page, html.as_bytes()).map_err(|source| ShardError::Io {
        doing: "write",
        path: page.to_owned(),
        source,
    })
}

/// The widths of the columns whose content is as long as it is.
struct Columns {
    session: usize,
    object: usize,
}

impl Columns {
    fn of(overview: &Overview) -> Self {
        let longest = |name: &str, of: fn(&SessionOverview) -> &str| {
            let lengths = overview.sessions.iter().map(|s| of(s).chars().count());
            lengths.max().unwrap_or_default().max(name.len())
        };
        Self {
            session: longest("session", |session| &session.entry.id),
            object: longest("object", |session| &session.entry.object),
        }
    }

    fn heading(&self) -> String {
        let (session, object) = (self.session, self.object);
        format!(
            "{:session$}  {:object$}  verdict     samples  Spec-Net  saturated  shift rms/max px  reasons",
            "session", "object"
        )
    }

    fn line(&self, session: &SessionOverview) -> String {
        let SessionOverview { entry, quality, .. } = session;
        let shift = match (quality.shift_rms_px, quality.shift_max_px) {
            (Some(rms), Some(most)) => format!("{rms:.2} / {most:.2}"),
            _ => "-".to_owned(),
        };
        let text = format!(
            "{:width$}  {:wide$}  {:10}  {:>7}  {:>6.1} %  {:>7.2} %  {shift:>16}  {}",
            entry.id,
            entry.object,
            session
                .verdict()
                .map_or(QualityVerdict::NONE, QualityVerdict::name),
            entry.samples,
            percent(u64::from(entry.spec_net), u64::from(entry.samples)),
            100.0 * quality.saturated_mean,
            session.reasons().join("; "),
            width = self.session,
            wide = self.object,
        );
        text.trim_end().to_owned()
    }
}

fn percent(part: u64, whole: u64) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}

/// One session for a machine.
fn event(session: &SessionOverview) -> Event {
    let entry = &session.entry;
    let mut quality = json!(session.quality);
    quality["verdict"] = json!(session.verdict());
    quality["reasons"] = json!(session.reasons());
    Event::Session(json!({
        "id": entry.id,
        "object": entry.object,
        "samples": entry.samples,
        "duplicates": entry.duplicates,
        "spec_net": entry.spec_net,
        "lossy": entry.lossy,
        "warnings": entry.warnings,
        "quality": quality,
        "histogram": session.histogram,
    }))
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
    let mut counts = QualityVerdict::ALL
        .map(|verdict| format!("{} {verdict}", overview.count(Some(verdict))))
        .to_vec();
    match overview.count(None) {
        0 => {}
        unjudged => counts.push(format!("{unjudged} {}", QualityVerdict::NONE)),
    }
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
        .map(|verdict| (verdict.to_string(), overview.count(Some(verdict)).into()))
        .chain([("not_judged".to_owned(), overview.count(None).into())])
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
