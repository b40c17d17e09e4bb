//! How much prior normals count beside the curves, where it is known how far they are off.

use relight_core::statistics::median;

use crate::fit::normal_step::PriorNormal;
use crate::fit::options::TurnOptions;
use crate::fit::search::PixelFit;

/// Parameters of the weight.
struct WeightParameters {
    /// For how many independent numbers the residual of a curve counts beside the prior. Chosen on ten synthetic turns:
    /// less than one, because what is not modelled is alike in many pixels.
    freedom: f64,
    /// Least residual that noise and what is not modelled leave, over the energy of the variation. By hand.
    least_residual: f64,
    /// Largest residual of a pixel that counts as noise, in medians. By hand.
    most_residual: f64,
}

const PARAMETERS: WeightParameters = WeightParameters {
    freedom: 0.3,
    least_residual: 0.003,
    most_residual: 20.0,
};

/// The weight of prior normals, beside that which balances them with the curves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PriorWeight(f64);

impl PriorWeight {
    /// That which is asked for.
    pub(crate) fn of(options: &TurnOptions) -> Self {
        Self(options.prior_weight / TurnOptions::default().prior_weight)
    }

    /// Weights each prior normal so that `residual + weight (1 - cos)` is least where the normal is likeliest: the
    /// residual divided by its variance (half of the pixel's own residual and half of the median), the squared angle by
    /// its expected value.
    pub(crate) fn balance(self, prior: &mut [PriorNormal], fits: &[PixelFit]) {
        let usual = median(fits.iter().map(|fit| fit.residual))
            .unwrap_or(0.0)
            .max(PARAMETERS.least_residual);
        for (prior, fit) in prior.iter_mut().zip(fits) {
            let own = fit.residual.clamp(0.0, PARAMETERS.most_residual * usual);
            let variance = (usual + own) / 2.0 / PARAMETERS.freedom;
            prior.weight = self.0 * 2.0 * variance * prior.sureness;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prior(error_deg: f64) -> PriorNormal {
        PriorNormal {
            normal: [0.0, 0.0, 1.0],
            weight: 0.0,
            sureness: error_deg.to_radians().powi(-2),
        }
    }

    fn fit(residual: f64) -> PixelFit {
        PixelFit {
            normal: [0.0, 0.0, 1.0],
            albedo: [0.5; 3],
            residual,
        }
    }

    #[test]
    fn a_sure_normal_counts_more_and_so_does_any_beside_a_curve_that_is_not_explained() {
        let mut normals = [prior(5.0), prior(10.0), prior(10.0)];
        PriorWeight(1.0).balance(&mut normals, &[fit(0.02), fit(0.02), fit(0.5)]);
        let [sure, usual, unexplained] = normals.map(|normal| normal.weight);
        assert!((sure / usual - 4.0).abs() < 1e-9);
        assert!(unexplained > 5.0 * usual);
    }

    #[test]
    fn twice_the_weight_is_asked_for_and_given() {
        let options = |prior_weight| TurnOptions {
            prior_weight,
            ..TurnOptions::default()
        };
        let usual = TurnOptions::default().prior_weight;
        let weights = [usual, 2.0 * usual].map(|weight| {
            let mut normals = [prior(10.0)];
            PriorWeight::of(&options(weight)).balance(&mut normals, &[fit(0.02)]);
            normals[0].weight
        });
        assert!((weights[1] / weights[0] - 2.0).abs() < 1e-9);
    }
}
