//! What a small network says of one picture and hints, and how a cut begins with it.

mod odds;

use crate::bitmap::Bitmap;
use crate::cut::grab_cut::Label;
use crate::cut::pyramid::InitialModels;
pub(crate) use odds::odds;

/// Weight of what the network says, in units of the log-likelihood.
const WEIGHT: f32 = 3.5;
/// And where there are marks, which may correct it.
const WEIGHT_BESIDE_MARKS: f32 = 1.5;

/// What the network says, as evidence for a cut.
pub(crate) fn evidence(odds: &[f32], has_marks: bool) -> Vec<f32> {
    let weight = if has_marks {
        WEIGHT_BESIDE_MARKS
    } else {
        WEIGHT
    };
    odds.iter().map(|odds| weight * odds).collect()
}

/// The labels with which a cut starts: open pixels are what the network says, if it says that some are object and if the
/// first models learn from them.
pub(crate) fn start(known: &[Label], first: InitialModels, odds: &[f32]) -> Vec<Label> {
    let pixels = || known.iter().zip(odds);
    let is_found = pixels().any(|(label, &odds)| !label.is_sure() && odds > 0.0);
    if first != InitialModels::All || !is_found {
        return known.to_vec();
    }
    let labels = pixels().map(|(&label, &odds)| {
        if label.is_sure() {
            label
        } else {
            Label::probably(odds > 0.0)
        }
    });
    labels.collect()
}

/// The overlap with the object that is to be expected of a mask, all at the coarsest size.
pub(crate) fn expected_overlap(mask: &Bitmap, known: &[Label], odds: &[f32]) -> f32 {
    let pixels = mask.bits().iter().zip(known).zip(odds);
    let pixels = pixels.map(|((&mask, label), &odds)| (mask, label.is_sure(), odds));
    crate::expected_overlap::expected_overlap(pixels)
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: [Label; 4] = [
        Label::Object,
        Label::ProbablyObject,
        Label::ProbablyObject,
        Label::Background,
    ];

    #[test]
    fn a_start_takes_the_networks_answer_where_nothing_is_sure() {
        let found = start(&KNOWN, InitialModels::All, &[-5.0, -1.0, 1.0, 5.0]);
        let wanted = [
            Label::Object,
            Label::ProbablyBackground,
            Label::ProbablyObject,
            Label::Background,
        ];
        assert_eq!(found, wanted);
        assert_eq!(start(&KNOWN, InitialModels::Sure, &[-5.0; 4]), KNOWN);
        assert_eq!(
            start(&KNOWN[1..], InitialModels::All, &[-5.0; 3]),
            KNOWN[1..]
        );
    }

    #[test]
    fn a_mask_that_the_network_contradicts_has_little_overlap_to_expect() {
        let mask = Bitmap::drawn(&["###."]);
        let fits = expected_overlap(&mask, &KNOWN, &[0.0, 8.0, 8.0, 0.0]);
        let contradicted = expected_overlap(&mask, &KNOWN, &[0.0, -8.0, -8.0, 0.0]);
        assert!(fits > 0.99, "{fits}");
        assert!((contradicted - 1.0 / 3.0).abs() < 0.01, "{contradicted}");
    }
}
