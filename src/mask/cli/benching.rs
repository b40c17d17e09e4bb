//! `relit-mask bench`: figures over a folder of images with ground truth, as a table or JSON lines.

use std::path::Path;

use relit_console::{Console, Outcome};
use relit_grabcut::MaskScore;
use relit_mask::{
    BenchOptions, BenchRow, BoxKind, FoldFigures, FoldReport, MaskEngine, MaskingError, Prompt,
    bench_image, bench_images, cross_validate, start_rules,
};
use serde_json::{Value, json};

/// An image counts as worse if its IoU is lower by more than this.
const WORSE_BY: f64 = 0.02;

/// Measures every image, and prints a line for each and one for the average; with `folds` also what cross-validation
/// says of the starts.
pub(crate) fn run(
    console: Console,
    folder: &Path,
    boxes: Vec<BoxKind>,
    folds: Option<u8>,
    whole: bool,
) -> Result<Outcome, MaskingError> {
    let images = bench_images(folder)?;
    let options = BenchOptions {
        boxes,
        whole,
        rules: folds.map(|_| start_rules()).unwrap_or_default(),
    };
    let bar = console.progress(images.len() as u64, "images");
    bar.suspend(|| print_head(console));
    let mut rows = Vec::new();
    for image in &images {
        for row in bench_image(image, &options)? {
            bar.suspend(|| print_row(console, &row));
            rows.push(row);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    let mut prompts: Vec<Prompt> = Vec::new();
    for row in &rows {
        if !prompts.contains(&row.prompt) {
            prompts.push(row.prompt);
        }
    }
    for prompt in prompts {
        print_average(console, prompt, &rows);
    }
    if let Some(folds) = folds {
        match cross_validate(&rows, &options.rules, folds.into()) {
            Some(report) => print_folds(console, &report),
            None => {
                return Err(MaskingError::Bench {
                    path: folder.to_owned(),
                    why: "folds need rectangles on at least two images".to_owned(),
                });
            }
        }
    }
    Ok(match rows.is_empty() {
        true => Outcome::Wrong,
        false => Outcome::Whole,
    })
}

fn print_head(console: Console) {
    let engines = match MaskEngine::OpenCv.is_built_in() {
        true => &["relit-mask", "OpenCV's GrabCut"][..],
        false => &["relit-mask"],
    };
    let names: String = engines.iter().map(|name| format!("  {name:^26}")).collect();
    let columns = format!("  {:>8} {:>8} {:>8}", "error %", "IoU", "F 2 px").repeat(engines.len());
    let text = format!("{:<33}{names}\n{:<24} {:<8}{columns}", "", "image", "hint");
    console.say(
        &text,
        &json!({ "event": "bench", "tolerance_px": relit_grabcut::BOUNDARY_TOLERANCE_PX }),
    );
}

fn print_row(console: Console, row: &BenchRow) {
    let mut text = line(&row.image, row.prompt, &row.ours, row.opencv.as_ref());
    if let Some(whole) = &row.whole {
        text += &format!("  cut whole: IoU {:.3}", whole.iou);
    }
    let event = json!({
        "event": "image",
        "image": row.image,
        "hint": row.prompt.name(),
        "ours": figures(&row.ours),
        "opencv": row.opencv.as_ref().map(figures),
        "whole": row.whole.as_ref().map(figures),
    });
    console.say(&text, &event);
}

fn print_average(console: Console, prompt: Prompt, rows: &[BenchRow]) {
    let rows: Vec<&BenchRow> = rows.iter().filter(|row| row.prompt == prompt).collect();
    if rows.is_empty() {
        return;
    }
    let ours = average(rows.iter().map(|row| row.ours));
    let opencv = average_of_some(rows.iter().map(|row| row.opencv));
    let whole = average_of_some(rows.iter().map(|row| row.whole));
    let worse: Vec<&str> = rows
        .iter()
        .filter(|row| {
            row.opencv
                .is_some_and(|opencv| row.ours.iou < opencv.iou - WORSE_BY)
        })
        .map(|row| &*row.image)
        .collect();
    let ratio = opencv.map(|opencv| ours.error / opencv.error.max(f64::MIN_POSITIVE));
    let mut text = line("average", prompt, &ours, opencv.as_ref());
    let indent = format!("\n{:<24} {:<8}", "", prompt.name());
    if let Some(ratio) = ratio {
        text += &format!("{indent}  error {ratio:.2} x OpenCV's; ");
        text += &match worse.len() {
            0 => "no image is worse by more than 2 points of IoU".to_owned(),
            _ => format!("worse by more than 2 points of IoU: {}", worse.join(", ")),
        };
    }
    if let Some(whole) = &whole {
        let points = 100.0 * (ours.iou - whole.iou);
        text += &format!("{indent}  {points:+.2} points of IoU against masks cut whole");
    }
    let event = json!({
        "event": "average",
        "hint": prompt.name(),
        "images": rows.len(),
        "ours": figures(&ours),
        "opencv": opencv.as_ref().map(figures),
        "whole": whole.as_ref().map(figures),
        "error_ratio": ratio,
        "worse": worse,
    });
    console.say(&text, &event);
}

fn print_folds(console: Console, report: &FoldReport) {
    let rules: Vec<String> = report
        .chosen
        .iter()
        .map(|rule| format!("{:?} margin {}", rule.shares, rule.margin))
        .collect();
    let text = format!(
        "\n100 - IoU, points, where each part's rule of starts was chosen on the other parts\nchosen: {}\n{:<10}{:>7}{:>18}{:>10}{:>10}{:>10}",
        rules.join("; "),
        "hint",
        "images",
        "out of fold",
        "plain",
        "shipped",
        "OpenCV"
    );
    console.say(&text, &json!({ "event": "folds", "chosen": rules }));
    for figures in &report.figures {
        print_fold(console, figures);
    }
}

fn print_fold(console: Console, figures: &FoldFigures) {
    let (mean, standard_error) = figures.out_of_fold;
    let opencv = figures
        .opencv
        .map_or("-".to_owned(), |error| format!("{error:.2}"));
    let mut text = format!(
        "{:<10}{:>7}{mean:>10.2} +- {standard_error:>4.2}{:>10.2}{:>10.2}{opencv:>10}",
        figures.prompt.name(),
        figures.images,
        figures.plain,
        figures.shipped,
    );
    if !figures.worse.is_empty() {
        let worse = figures.worse.join(", ");
        text += &format!("  worse than OpenCV's by more than 2 points: {worse}");
    }
    let event = json!({
        "event": "fold",
        "hint": figures.prompt.name(),
        "images": figures.images,
        "out_of_fold": mean,
        "standard_error": standard_error,
        "plain": figures.plain,
        "shipped": figures.shipped,
        "opencv": figures.opencv,
        "worse": figures.worse,
    });
    console.say(&text, &event);
}

fn line(name: &str, prompt: Prompt, ours: &MaskScore, opencv: Option<&MaskScore>) -> String {
    let mut line = format!("{name:<24} {:<8}", prompt.name());
    for score in [Some(ours), opencv].into_iter().flatten() {
        let error = 100.0 * score.error;
        line += &format!(
            "  {error:>8.2} {:>8.3} {:>8.3}",
            score.iou, score.boundary_f
        );
    }
    line
}

fn figures(score: &MaskScore) -> Value {
    json!({ "error": score.error, "iou": score.iou, "boundary_f": score.boundary_f })
}

/// The average of the scores that there are; `None` without any.
fn average_of_some(scores: impl Iterator<Item = Option<MaskScore>>) -> Option<MaskScore> {
    let scores: Vec<MaskScore> = scores.flatten().collect();
    (!scores.is_empty()).then(|| average(scores.iter().copied()))
}

fn average(scores: impl ExactSizeIterator<Item = MaskScore> + Clone) -> MaskScore {
    let count = scores.len() as f64;
    let mean = |of: fn(&MaskScore) -> f64| scores.clone().map(|s| of(&s)).sum::<f64>() / count;
    MaskScore {
        error: mean(|score| score.error),
        iou: mean(|score| score.iou),
        boundary_f: mean(|score| score.boundary_f),
    }
}
