//! What an object is made of, as far as its curves tell it.

use crate::fit::figures::BodyFigure;
use crate::model::material::BodyKind;

/// A diffuse body that leaves no more than this of a curve, over the energy of its variation, explains the turn.
const EXPLAINED: f64 = 0.03;

/// The part of what a diffuse body leaves that a metal has to leave at most to be taken for what the object is: its light
/// has many more terms.
const METAL_LEAVES: f64 = 0.58;

/// Metal that leaves no more than this explains the turn too.
const LITTLE: f64 = 0.01;

/// Whether what a diffuse body leaves lets the object be metal.
pub(crate) fn may_be_metal(diffuse: f64) -> bool {
    diffuse > EXPLAINED
}

/// Whether what both kinds leave says that the object is metal.
pub(crate) fn is_metal(diffuse: f64, metal: f64) -> bool {
    may_be_metal(diffuse) && metal < METAL_LEAVES * diffuse
}

/// The other kind, where it explains clearly more than the one that was given, whose figure is the first.
pub(crate) fn doubted(bodies: &[BodyFigure]) -> Option<BodyKind> {
    let [given, other] = bodies else {
        return None;
    };
    let is_better = match other.body {
        BodyKind::Metal => is_metal(given.residual, other.residual),
        // It has fewer terms: that it leaves less says enough, where both leave much.
        BodyKind::Diffuse => {
            let part = if given.residual > LITTLE {
                1.0
            } else {
                METAL_LEAVES
            };
            other.residual < part * given.residual
        }
    };
    is_better.then_some(other.body)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metal_has_to_explain_clearly_more() {
        assert!(is_metal(0.11, 0.04));
        assert!(!is_metal(0.11, 0.10));
        assert!(!is_metal(0.02, 0.001));
    }

    #[test]
    fn a_kind_that_was_given_is_doubted_where_the_other_explains_clearly_more() {
        let figures = |given, other| {
            let figure = |(body, residual)| BodyFigure { body, residual };
            doubted(&[given, other].map(figure))
        };
        let (diffuse, metal) = (BodyKind::Diffuse, BodyKind::Metal);
        assert_eq!(figures((diffuse, 0.11), (metal, 0.04)), Some(metal));
        assert_eq!(figures((diffuse, 0.11), (metal, 0.10)), None);
        assert_eq!(figures((metal, 0.05), (diffuse, 0.03)), Some(diffuse));
        assert_eq!(figures((metal, 0.04), (diffuse, 0.11)), None);
        assert_eq!(doubted(&[]), None);
    }
}
