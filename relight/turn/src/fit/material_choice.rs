//! What an object is made of, as far as its curves tell it.

use crate::fit::figures::MaterialFigure;
use crate::model::material::MaterialKind;

/// Parameters of the choice of the material.
struct MaterialParameters {
    /// Residual up to which a diffuse material fits the turn, over the energy of the variation. By hand.
    explained: f64,
    /// Largest part of the diffuse residual with which metal is taken: its light has many more terms. Measured: the
    /// rendered sessions of docs/results/turns.md have 0.53 (bronze) and 0.63 (plastic).
    metal_part: f64,
    /// Residual up to which metal fits the turn, over the energy of the variation. By hand.
    explained_by_metal: f64,
}

const PARAMETERS: MaterialParameters = MaterialParameters {
    explained: 0.03,
    metal_part: 0.58,
    explained_by_metal: 0.01,
};

/// Whether the residual of a diffuse material lets the object be metal.
pub(crate) fn may_be_metal(diffuse: f64) -> bool {
    diffuse > PARAMETERS.explained
}

/// Whether what both kinds leave says that the object is metal.
pub(crate) fn is_metal(diffuse: f64, metal: f64) -> bool {
    may_be_metal(diffuse) && metal < PARAMETERS.metal_part * diffuse
}

/// The other kind, where it fits clearly better than the one that was given, whose figure is the first.
pub(crate) fn doubted(materials: &[MaterialFigure]) -> Option<MaterialKind> {
    let [given, other] = materials else {
        return None;
    };
    let is_better = match other.material {
        MaterialKind::Metal => is_metal(given.residual, other.residual),
        // It has fewer terms: a smaller residual says enough, where both are large.
        MaterialKind::Diffuse => {
            let part = if given.residual > PARAMETERS.explained_by_metal {
                1.0
            } else {
                PARAMETERS.metal_part
            };
            other.residual < part * given.residual
        }
    };
    is_better.then_some(other.material)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metal_has_to_fit_clearly_better() {
        assert!(is_metal(0.11, 0.04));
        assert!(!is_metal(0.11, 0.10));
        assert!(!is_metal(0.02, 0.001));
    }

    #[test]
    fn a_kind_that_was_given_is_doubted_where_the_other_fits_clearly_better() {
        let figures = |given, other| {
            let figure = |(material, residual)| MaterialFigure { material, residual };
            doubted(&[given, other].map(figure))
        };
        let (diffuse, metal) = (MaterialKind::Diffuse, MaterialKind::Metal);
        assert_eq!(figures((diffuse, 0.11), (metal, 0.04)), Some(metal));
        assert_eq!(figures((diffuse, 0.11), (metal, 0.10)), None);
        assert_eq!(figures((metal, 0.05), (diffuse, 0.03)), Some(diffuse));
        assert_eq!(figures((metal, 0.04), (diffuse, 0.11)), None);
        assert_eq!(doubted(&[]), None);
    }
}
