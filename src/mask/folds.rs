//! Which rule of starts generalises: each fold's rule is chosen on the images of the other folds.

use relit_grabcut::StartRule;

use super::{BenchRow, Prompt};

/// The rules among which is chosen: GrabCut's own start, each share alone, and the lower energy of several.
#[must_use]
pub fn start_rules() -> Vec<StartRule> {
    const ALONE: [&[f64]; 3] = [&[0.0], &[0.25], &[0.5]];
    const SEVERAL: [&[f64]; 3] = [&[0.0, 0.25], &[0.0, 0.5], &[0.0, 0.25, 0.5]];
    const MARGINS: [f64; 6] = [0.0, 0.05, 0.1, 0.2, 0.3, 0.5];
    let alone = ALONE.map(|shares| StartRule {
        shares,
        margin: 0.0,
    });
    let several = SEVERAL
        .iter()
        .flat_map(|&shares| MARGINS.map(|margin| StartRule { shares, margin }));
    alone.into_iter().chain(several).collect()
}

/// What cross-validation says of the rules.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct FoldReport {
    /// The rule that each fold's other images chose.
    pub chosen: Vec<StartRule>,
    /// One entry for each kind of rectangle.
    pub figures: Vec<FoldFigures>,
}

/// The errors of one kind of rectangle: 100 minus the intersection over union, in points.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct FoldFigures {
    /// The kind.
    pub prompt: Prompt,
    /// Images with it.
    pub images: usize,
    /// Of the rule that was chosen without the image, and its standard error over images.
    pub out_of_fold: (f64, f64),
    /// Of GrabCut's own start alone.
    pub plain: f64,
    /// Of the rule of the program.
    pub shipped: f64,
    /// Of OpenCV's GrabCut, if it is built in.
    pub opencv: Option<f64>,
    /// Images whose mask by the rule chosen without them is worse than OpenCV's by more than 2 points.
    pub worse: Vec<String>,
}

/// An image counts as worse if its error is higher by more than this, points.
const WORSE_BY: f64 = 2.0;

/// Chooses a rule for each of `folds` parts of the images on the other parts, by the mean error over all rectangles,
/// and measures it on that part. `None` with fewer than two folds or images, or without rows measured by `rules`.
#[must_use]
pub fn cross_validate(rows: &[BenchRow], rules: &[StartRule], folds: usize) -> Option<FoldReport> {
    let rows: Vec<&BenchRow> = rows
        .iter()
        .filter(|row| !row.by_rule.is_empty() && row.by_rule.len() == rules.len())
        .collect();
    let mut images: Vec<&str> = rows.iter().map(|row| &*row.image).collect();
    images.dedup();
    if folds < 2 || images.len() < 2 {
        return None;
    }
    let fold_of = |row: &BenchRow| {
        images
            .iter()
            .position(|&name| name == row.image)
            .map(|at| at % folds)
    };
    let chosen: Vec<usize> = (0..folds)
        .map(|fold| {
            best(
                rules.len(),
                rows.iter().filter(|row| fold_of(row) != Some(fold)),
            )
        })
        .collect();
    let mut prompts: Vec<Prompt> = Vec::new();
    for row in &rows {
        if !prompts.contains(&row.prompt) {
            prompts.push(row.prompt);
        }
    }
    let figures = prompts.into_iter().map(|prompt| {
        let of_kind: Vec<(&BenchRow, f64)> = rows
            .iter()
            .filter(|row| row.prompt == prompt)
            .filter_map(|row| Some((*row, error(row, *chosen.get(fold_of(row)?)?))))
            .collect();
        figures(prompt, &of_kind, plain(rules))
    });
    Some(FoldReport {
        figures: figures.collect(),
        chosen: chosen
            .iter()
            .filter_map(|&at| rules.get(at).copied())
            .collect(),
    })
}

/// The place of GrabCut's own start among the rules.
fn plain(rules: &[StartRule]) -> Option<usize> {
    rules.iter().position(|rule| rule.shares == [0.0])
}

fn figures(prompt: Prompt, rows: &[(&BenchRow, f64)], plain: Option<usize>) -> FoldFigures {
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / rows.len() as f64;
    let opencv = |row: &BenchRow| row.opencv.map(|score| points(score.iou));
    let out_of_fold = mean(&mut rows.iter().map(|(_, error)| *error));
    let spread = mean(&mut rows.iter().map(|(_, error)| (error - out_of_fold).powi(2)));
    let is_worse =
        |row: &BenchRow, error: f64| opencv(row).is_some_and(|peer| error > peer + WORSE_BY);
    FoldFigures {
        prompt,
        images: rows.len(),
        out_of_fold: (
            out_of_fold,
            (spread / (rows.len().max(2) - 1) as f64).sqrt(),
        ),
        plain: mean(
            &mut rows
                .iter()
                .map(|(row, _)| plain.map_or(f64::NAN, |at| error(row, at))),
        ),
        shipped: mean(&mut rows.iter().map(|(row, _)| points(row.ours.iou))),
        opencv: rows
            .iter()
            .all(|(row, _)| row.opencv.is_some())
            .then(|| mean(&mut rows.iter().filter_map(|(row, _)| opencv(row)))),
        worse: rows
            .iter()
            .filter(|(row, error)| is_worse(row, *error))
            .map(|(row, _)| row.image.clone())
            .collect(),
    }
}

/// The rule of the least mean error; the first of several.
fn best<'a>(rules: usize, rows: impl Iterator<Item = &'a &'a BenchRow> + Clone) -> usize {
    let sum = |rule: usize| rows.clone().map(|row| error(row, rule)).sum::<f64>();
    let sums: Vec<f64> = (0..rules).map(sum).collect();
    let least = sums.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1));
    least.map_or(0, |(rule, _)| rule)
}

fn error(row: &BenchRow, rule: usize) -> f64 {
    row.by_rule
        .get(rule)
        .map_or(100.0, |score| points(score.iou))
}

fn points(iou: f64) -> f64 {
    100.0 * (1.0 - iou)
}

#[cfg(test)]
mod tests {
    use relit_grabcut::MaskScore;

    use super::*;
    use crate::BoxKind;

    fn score(iou: f64) -> MaskScore {
        MaskScore {
            error: 0.0,
            iou,
            boundary_f: 0.0,
        }
    }

    fn row(image: &str, by_rule: [f64; 2], opencv: f64) -> BenchRow {
        BenchRow {
            image: image.to_owned(),
            prompt: Prompt::Made(BoxKind::Tight),
            ours: score(by_rule[1]),
            opencv: Some(score(opencv)),
            whole: None,
            by_rule: by_rule.map(score).to_vec(),
        }
    }

    #[test]
    fn a_rule_is_judged_on_images_that_did_not_choose_it() {
        let rules = [
            StartRule {
                shares: &[0.0],
                margin: 0.0,
            },
            StartRule {
                shares: &[0.5],
                margin: 0.0,
            },
        ];
        // The first image alone would choose the first rule, and the three others the second.
        let rows = [
            row("a", [1.0, 0.5], 0.8),
            row("b", [0.6, 0.9], 0.8),
            row("c", [0.6, 0.9], 0.8),
            row("d", [0.6, 0.9], 0.95),
        ];
        let report = cross_validate(&rows, &rules, 4).unwrap();
        let shares: Vec<f64> = report.chosen.iter().map(|rule| rule.shares[0]).collect();
        assert_eq!(shares[0], 0.5);
        let figures = &report.figures[0];
        assert_eq!((figures.images, figures.prompt.name()), (4, "tight"));
        assert!((figures.plain - 30.0).abs() < 1e-9);
        assert!((figures.shipped - 20.0).abs() < 1e-9);
        assert!(figures.worse.contains(&"a".to_owned()) && figures.worse.contains(&"d".to_owned()));
        assert!(figures.out_of_fold.0 >= 20.0 && figures.out_of_fold.1 > 0.0);
        assert!(cross_validate(&rows, &rules, 1).is_none());
        assert!(cross_validate(&rows, &start_rules(), 4).is_none());
    }
}
