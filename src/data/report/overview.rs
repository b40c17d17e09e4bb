//! The page of a data set: its sessions at a glance.

use super::axis::{number, percent};
use super::html::{self, badge, counted, escape, table, warnings};
use crate::counts::count_of;
use crate::shard::{Overview, QualityVerdict, SATURATION_BOUNDS, SessionOverview};

/// Size of a session's small plot, in its own units.
const PLOT: (f64, f64) = (180.0, 36.0);
/// Size of the histogram, in its own units; the page scales it to the column.
const BARS: (f64, f64) = (600.0, 240.0);
/// Space above the bars, for their labels, and below, for the classes.
const ABOVE: f64 = 24.0;
const BELOW: f64 = 48.0;

/// The page of a data set as one HTML document, under this name. Where it will lie in the data set's folder
/// (`beside`), it leads to the sessions' own pages.
#[must_use]
pub fn render_overview(name: &str, overview: &Overview, beside: bool) -> String {
    let name = escape(name);
    let body = format!(
        "<header>\n<p class=\"kind\">Data set</p>\n<h1><bdi>{name}</bdi></h1>\n\
         <p class=\"verdict\">{summary}</p>\n</header>\n{problems}{verdicts}{sessions}{histogram}\
         <div class=\"tables\">\n{found}{settings}</div>\n",
        summary = summary(overview),
        problems = warnings(&overview.problems),
        verdicts = verdicts(overview),
        sessions = sessions(overview, beside),
        histogram = histogram(overview),
        found = found(overview),
        settings = table("Settings", &overview.settings.rows()),
    );
    html::document(&name, &body)
}

fn share(part: u64, whole: u64) -> String {
    format!("{} %", number(100.0 * part as f64 / whole.max(1) as f64, 1))
}

fn summary(overview: &Overview) -> String {
    let totals = overview.totals();
    let samples = usize::try_from(totals.samples).unwrap_or(usize::MAX);
    format!(
        "{sessions} of {objects}, {samples}. Spec-Net is on in <b>{on}</b> ({share}).",
        sessions = counted(overview.sessions.len(), "session"),
        objects = counted(totals.objects, "object"),
        samples = counted(samples, "sample"),
        on = totals.spec_net,
        share = share(totals.spec_net, totals.samples),
    )
}

/// How many sessions are good, usable, broken; and not judged, if there are any.
fn verdicts(overview: &Overview) -> String {
    let unjudged = overview.count(None) > 0;
    let verdicts = QualityVerdict::ALL.map(Some).into_iter();
    let marks: String = verdicts
        .chain(unjudged.then_some(None))
        .map(|verdict| format!("<li>{} {}</li>\n", badge(verdict), overview.count(verdict)))
        .collect();
    format!("<ul class=\"verdicts\">\n{marks}</ul>\n")
}

fn sessions(overview: &Overview, beside: bool) -> String {
    if overview.sessions.is_empty() {
        return String::new();
    }
    let rows: String = overview
        .sessions
        .iter()
        .map(|session| row(session, overview.settings.gate, beside))
        .collect();
    format!(
        "<section>\n<h2>Sessions</h2>\n<table class=\"sessions\">\n<thead><tr><th>session</th>\
         <th>verdict</th><th>samples</th><th>Spec-Net</th>\
         <th>saturated over the turn</th><th>shift</th><th>found</th></tr></thead>\n\
         <tbody>\n{rows}</tbody>\n</table>\n<p class=\"note\">Saturated: the part of the object with all \
         channels saturated; the line is the gate, {gate}, above which Spec-Net is on, and the number is the \
         mean. Shift: root mean square, and the largest.</p>\n</section>\n",
        gate = percent(overview.settings.gate),
    )
}

fn row(session: &SessionOverview, gate: f64, beside: bool) -> String {
    let SessionOverview { entry, quality, .. } = session;
    let id = escape(&entry.id);
    let page = entry.report.as_ref().filter(|_| beside);
    let name = match page {
        Some(page) => format!("<a href=\"{}\"><bdi>{id}</bdi></a>", escape(&page.file)),
        None => format!("<bdi>{id}</bdi>"),
    };
    let shift = match (quality.shift_rms_px, quality.shift_max_px) {
        (Some(rms), Some(most)) => format!("{}, {} px", number(rms, 2), number(most, 2)),
        _ => "\u{2013}".to_owned(),
    };
    let mut found = session.reasons().to_vec();
    if quality.moved > 0 {
        let moved = count_of(u64::from(quality.moved), "sample");
        found.push(format!("{moved} moved back"));
    }
    let warnings = match entry.warnings.len() {
        0 => None,
        1 => Some("1 warning".to_owned()),
        n => Some(format!("{n} warnings")),
    };
    found.extend(warnings);
    let found = match found.as_slice() {
        [] => "\u{2013}".to_owned(),
        found => found.join("; "),
    };
    format!(
        "<tr><td class=\"name\">{name}<br><span class=\"kind\"><bdi>{object}</bdi></span></td>\
         <td data-name=\"verdict\">{badge}</td><td data-name=\"samples\">{samples}</td>\
         <td data-name=\"Spec-Net\">{on} <span class=\"kind\">({part})</span></td>\
         <td data-name=\"saturated\">{plot}<span class=\"kind\">{mean}</span></td>\
         <td data-name=\"shift\">{shift}</td><td data-name=\"found\">{found}</td></tr>\n",
        object = escape(&entry.object),
        badge = badge(session.verdict()),
        samples = entry.samples,
        on = entry.spec_net,
        part = share(u64::from(entry.spec_net), u64::from(entry.samples)),
        plot = small_plot(session, gate),
        mean = percent(quality.saturated_mean),
        found = escape(&found),
    )
}

/// The saturated fraction over the turn, with the gate.
fn small_plot(session: &SessionOverview, gate: f64) -> String {
    let (width, height) = PLOT;
    let largest = session.profile.iter().copied().fold(2.0 * gate, f64::max);
    let y = |value: f64| number(height * (1.0 - value / largest.max(1e-9)), 1);
    let step = width / session.profile.len().saturating_sub(1).max(1) as f64;
    let points: Vec<String> = session
        .profile
        .iter()
        .enumerate()
        .map(|(place, &value)| format!("{},{}", number(place as f64 * step, 1), y(value)))
        .collect();
    format!(
        "<svg class=\"small\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
         aria-label=\"largest {most}\"><path class=\"axis\" d=\"M0 {height}H{width}\"/>\
         <path class=\"gate\" d=\"M0 {at}H{width}\"/><polyline class=\"all\" points=\"{points}\"/></svg>",
        most = percent(session.profile.iter().copied().fold(0.0, f64::max)),
        at = y(gate),
        points = points.join(" "),
    )
}

/// The classes' names, such as `1 – 2`.
fn class_names() -> Vec<String> {
    let bounds = SATURATION_BOUNDS.map(|bound| number(100.0 * bound, 1));
    let between = bounds
        .windows(2)
        .map(|pair| format!("{}\u{2013}{}", pair[0], pair[1]));
    let first = bounds.first().cloned();
    let last = bounds.last().map(|bound| format!("> {bound}"));
    first.into_iter().chain(between).chain(last).collect()
}

fn histogram(overview: &Overview) -> String {
    let totals = overview.totals();
    let ((width, height), classes) = (BARS, class_names());
    let largest = totals
        .histogram
        .iter()
        .copied()
        .max()
        .unwrap_or_default()
        .max(1) as f64;
    let pitch = width / classes.len() as f64;
    let bars: String = (0..)
        .zip(classes.iter().zip(totals.histogram))
        .map(|(place, (class, samples))| {
            let middle = pitch * (f64::from(place) + 0.5);
            let tall = height * samples as f64 / largest;
            let top = ABOVE + height - tall;
            // The first class is 0; class n begins above the bound n - 1.
            let lower = SATURATION_BOUNDS.get((place as usize).wrapping_sub(1));
            let on = lower.is_some_and(|&bound| bound >= overview.settings.gate);
            format!(
                "<rect class=\"bar{on}\" x=\"{x}\" y=\"{y}\" width=\"{wide}\" height=\"{tall}\"/>\
                 <text class=\"middle\" x=\"{middle}\" y=\"{above}\">{samples}</text>\
                 <text class=\"middle\" x=\"{middle}\" y=\"{below}\">{class}</text>\n",
                on = if on { " on" } else { "" },
                x = number(middle - 0.4 * pitch, 1),
                wide = number(0.8 * pitch, 1),
                y = number(top, 1),
                tall = number(tall, 1),
                middle = number(middle, 1),
                above = number(top - 6.0, 1),
                below = ABOVE + height + 18.0,
            )
        })
        .collect();
    let bottom = ABOVE + height;
    format!(
        "<section>\n<h2>Saturation</h2>\n<figure class=\"plot histogram\">\n\
         <svg viewBox=\"0 0 {width} {total}\" role=\"img\" aria-label=\"Samples by saturated part of the \
         object\">\n{bars}<path class=\"axis\" d=\"M0 {bottom}H{width}\"/>\
         <text class=\"middle\" x=\"{centre}\" y=\"{title}\">saturated, all channels (% of the mask)</text></svg>\n\
         <figcaption>Samples by the part of the object that is saturated. In the coloured bars all are above \
         the gate, {gate}, where Spec-Net is on.</figcaption>\n</figure>\n</section>\n",
        total = bottom + BELOW,
        centre = width / 2.0,
        title = bottom + 42.0,
        gate = percent(overview.settings.gate),
    )
}

/// Sums of what was found, as a table.
fn found(overview: &Overview) -> String {
    let totals = overview.totals();
    let of_samples = |count: u64| match count {
        0 => "none".to_owned(),
        n => format!("{n} ({})", share(n, totals.samples)),
    };
    let row = |name: &str, value: String| (name.to_owned(), value);
    let rows = [
        row("moved back", of_samples(totals.moved)),
        row("shift not measurable", of_samples(totals.unregistered)),
        row(
            "shift from the frames around",
            of_samples(totals.interpolated),
        ),
        row("exposure steps", of_samples(totals.exposure_steps)),
        row(
            "pictures repeated by the camera",
            of_samples(totals.identical),
        ),
        row("source frame used again", of_samples(totals.duplicates)),
        row("blurred", of_samples(totals.blurred)),
        row("sessions with losses", totals.lossy.to_string()),
        row("warnings", totals.warnings.to_string()),
    ];
    table("Found, samples", &rows)
}
