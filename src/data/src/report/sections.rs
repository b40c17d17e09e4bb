//! The sections of the page, from the title to the tables.

use super::Page;
use super::html::{self, badge, table, warnings};
use super::plot::Plot;
use super::text::{counted, degrees, escape, number, percent};
use super::turn::Turn;
use crate::image_stats::fraction;
use crate::shard::SessionQuality;
use crate::shard::record::FrameRecord;

/// Heights of the plotting areas; the width is 500.
const TALL: f64 = 240.0;
const LOW: f64 = 120.0;

/// The whole document around the figures of the contact sheet.
pub(super) fn document(page: &Page<'_>, turn: &Turn, contact: &str) -> String {
    let session = page
        .records
        .first()
        .map(|r| escape(&r.session))
        .unwrap_or_default();
    let body = format!(
        "{header}{warnings}{contact}{plots}<div class=\"tables\">\n{settings}{facts}</div>\n",
        header = header(page),
        warnings = warnings(page.warnings),
        contact = contact_sheet(page, turn, contact),
        plots = plots(page, turn),
        settings = table("Settings", page.settings),
        facts = table("Facts", page.facts),
    );
    html::document(&session, &body)
}

fn header(page: &Page<'_>) -> String {
    let Some(first) = page.records.first() else {
        return String::new();
    };
    format!(
        "<header>\n<p class=\"kind\">Extracted session</p>\n<h1><bdi>{session}</bdi></h1>\n\
         <p>Object: <bdi>{object}</bdi></p>\n<p class=\"verdict\">{verdict}</p>\n{quality}</header>\n",
        session = escape(&first.session),
        object = escape(&first.object),
        verdict = verdict(page),
        quality = page.quality.map(quality).unwrap_or_default(),
    )
}

/// The verdict on the session, with its reasons.
fn quality(quality: &SessionQuality) -> String {
    let reasons = match quality.reasons.as_slice() {
        [] => "no fault was found".to_owned(),
        reasons => escape(&reasons.join("; ")),
    };
    format!("<p>{}: {reasons}.</p>\n", badge(quality.verdict))
}

fn verdict(page: &Page<'_>) -> String {
    let total = page.records.len();
    let duplicates = page.records.iter().filter(|r| r.duplicate).count();
    let on = page.records.iter().filter(|r| r.spec_net).count();
    let gate = percent(page.gate);
    let spec_net = if on == 0 {
        format!("Spec-Net is off in all: at most {gate} of the object is saturated")
    } else {
        let share = percent(share(on, total));
        format!(
            "Spec-Net is on in <b>{on}</b> ({share}): more than {gate} of the object is saturated \
             there"
        )
    };
    format!(
        "<b>{total}</b> {samples}, {duplicates}. {spec_net}. {warnings}.",
        samples = if total == 1 { "sample" } else { "samples" },
        duplicates = counted(duplicates, "duplicate"),
        warnings = capitalised(&counted(page.warnings.len(), "warning")),
    )
}

fn capitalised(text: &str) -> String {
    match text.strip_prefix("no ") {
        Some(rest) => format!("No {rest}"),
        None => text.to_owned(),
    }
}

#[expect(
    clippy::cast_precision_loss,
    reason = "counts of samples stay far below 2^52"
)]
fn share(part: usize, whole: usize) -> f64 {
    part as f64 / whole.max(1) as f64
}

/// The figures below what they show: nobody has to guess what a number means.
fn contact_sheet(page: &Page<'_>, turn: &Turn, figures: &str) -> String {
    if figures.is_empty() {
        return String::new();
    }
    format!(
        "<section>\n<h2>Contact sheet</h2>\n<p class=\"note\">{shown} of {all} samples, evenly \
         spread over the turn, without background. Below each: {angle} and number of the sample. A \
         coloured frame and \u{201c}Spec-Net\u{201d} mark samples with strong highlights.</p>\n\
         <div class=\"contact\">\n{figures}</div>\n</section>\n",
        shown = page.thumbnails.len(),
        all = page.records.len(),
        angle = turn.angle(),
    )
}

fn plots(page: &Page<'_>, turn: &Turn) -> String {
    format!(
        "<section>\n<h2>Measured under the mask</h2>\n<p class=\"note\">{origin}</p>\n\
         <div class=\"plots\">\n{saturated}{any}{colour}{sharpness}</div>\n</section>\n",
        origin = turn.origin(),
        saturated = saturated(page, turn),
        any = saturated_any(page, turn),
        colour = colour(page, turn),
        sharpness = sharpness(page, turn),
    )
}

/// Fraction of the mask in which any channel is saturated, 0..=1.
fn any_channel(record: &FrameRecord) -> f64 {
    fraction(record.saturated_any_px, record.mask_px)
}

fn saturated(page: &Page<'_>, turn: &Turn) -> String {
    let extremes = Extremes::new(page.records, turn, |r| r.saturated_fraction);
    let caption = format!(
        "Pixels with all three channels at {level} or above. Above the dashed line, {gate}, \
         Spec-Net is on. {extremes}",
        level = page.saturation_level,
        gate = percent(page.gate),
        extremes = extremes.sentence(percent),
    );
    let points = turn.points(page.records, |r| 100.0 * r.saturated_fraction);
    let plot = Plot {
        gate: Some(page.gate),
        ..one_line(
            "saturated, all channels (% of the mask)",
            "all",
            points,
            TALL,
        )
    };
    figure(plot, turn, &caption)
}

/// Its own plot: on a coloured object this fraction is ten times the gated one, and on a common
/// axis the gate would be unreadable.
fn saturated_any(page: &Page<'_>, turn: &Turn) -> String {
    let extremes = Extremes::new(page.records, turn, any_channel);
    let caption = format!(
        "Pixels with at least one channel at {level} or above; not gated. {extremes}",
        level = page.saturation_level,
        extremes = extremes.sentence(percent),
    );
    let points = turn.points(page.records, |r| 100.0 * any_channel(r));
    let quantity = "saturated, any channel (% of the mask)";
    figure(one_line(quantity, "any", points, LOW), turn, &caption)
}

fn colour(page: &Page<'_>, turn: &Turn) -> String {
    let channel = |class, index: usize| (class, turn.points(page.records, |r| r.mean_rgb[index]));
    let plot = Plot {
        series: vec![channel("r", 0), channel("g", 1), channel("b", 2)],
        ..one_line("mean colour (8-bit sRGB value)", "", Vec::new(), TALL)
    };
    let caption = "Mean red, green and blue of the source pixels.";
    figure(plot, turn, caption)
}

fn sharpness(page: &Page<'_>, turn: &Turn) -> String {
    let extremes = Extremes::new(page.records, turn, |r| r.sharpness);
    let caption = format!(
        "Variance of the Laplacian; larger is sharper. {}",
        extremes.sentence(|value| number(value, 1))
    );
    let points = turn.points(page.records, |r| r.sharpness);
    let quantity = "sharpness (squared luma steps)";
    figure(one_line(quantity, "sharp", points, LOW), turn, &caption)
}

fn one_line<'a>(
    quantity: &'a str,
    class: &'static str,
    points: Vec<(f64, f64)>,
    height: f64,
) -> Plot<'a> {
    Plot {
        alternative: "",
        quantity,
        abscissa: "",
        height,
        series: vec![(class, points)],
        gate: None,
    }
}

fn figure(plot: Plot<'_>, turn: &Turn, caption: &str) -> String {
    let plot = Plot {
        alternative: caption,
        abscissa: turn.label(),
        ..plot
    };
    format!(
        "<figure class=\"plot\">\n{}<figcaption>{caption}</figcaption>\n</figure>\n",
        plot.svg()
    )
}

/// Smallest, mean and largest value of a quantity, with the angles of the extremes.
struct Extremes {
    least: (f64, f64),
    mean: f64,
    largest: (f64, f64),
}

impl Extremes {
    fn new(records: &[FrameRecord], turn: &Turn, value: impl Fn(&FrameRecord) -> f64) -> Self {
        let points = turn.points(records, value);
        let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let nowhere = (0.0, 0.0);
        Self {
            least: points.iter().min_by(by_value).copied().unwrap_or(nowhere),
            mean: points.iter().map(|p| p.1).sum::<f64>() * share(1, points.len()),
            largest: points
                .iter()
                .rev()
                .max_by(by_value)
                .copied()
                .unwrap_or(nowhere),
        }
    }

    fn sentence(&self, written: impl Fn(f64) -> String) -> String {
        let (least, largest) = (written(self.least.1), written(self.largest.1));
        if least == largest {
            return format!("{least} throughout.");
        }
        format!(
            "Mean {mean}, least {least} at {low}, largest {largest} at {high}.",
            mean = written(self.mean),
            low = degrees(self.least.0),
            high = degrees(self.largest.0),
        )
    }
}
