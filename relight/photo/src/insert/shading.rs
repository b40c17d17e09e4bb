//! The shading of a photograph beside that of its light: relief, shadows, and what neither says.

use relight_core::image::Planes;

use super::smooth::weighted_mean;

/// Added to irradiance, whose mean on the object is 1, before ratios of it are taken.
pub(super) const DARK: f32 = 0.05;
/// The most and the least that the shading may be of what the light makes on the normals; what is beyond it is kept as a
/// difference.
const RATIOS: (f32, f32) = (0.25, 4.0);
/// Details of shading up to this part of the object's side are relief; larger ones are shadows, of which as much is kept as the
/// lights are alike.
const RELIEF: f64 = 0.04;
/// How far the decomposition of a photograph is believed: see [`Shading::hedge`]. Chosen on synthetic objects
/// (docs/results/insertion.md).
pub(super) const TRUST_IN_PHOTOGRAPHS: f32 = 0.6;

/// The shading S of a photograph beside the irradiance E of its light on the normals, with D = (S + d) / (E + d), d = 0.05.
/// Logarithms are kept: a picture in new light raises to powers at each pixel.
#[derive(Debug, Clone)]
pub(super) struct Shading {
    /// The logarithm of the fine part of D.
    relief: Vec<f32>,
    /// The logarithm of the coarse part of D: shadows, bounced light, and what order 2 cannot say.
    shadow: Vec<f32>,
    /// What the bounds of D leave of S.
    residual: Vec<f32>,
    /// The logarithm of S + d.
    seen: Vec<f32>,
    /// How far it is believed: 1 is wholly.
    trust: f32,
    /// E.
    pub(super) own: Vec<f32>,
}

impl Shading {
    /// Of the shading that was found and the irradiance of the light on the normals, where it is `wanted`, and how far all of
    /// that is believed.
    pub(super) fn new(shading: &Planes<1>, own: &Planes<3>, wanted: &[bool], trust: f32) -> Self {
        let extent = shading.extent();
        // The light is grey: its channels are equal.
        let own = own.plane(0).to_vec();
        let mut logarithm = Planes::zeros(extent);
        let [logs] = logarithm.planes_mut();
        for at in (0..own.len()).filter(|&at| wanted[at]) {
            let ratio = (shading.plane(0)[at] + DARK) / (own[at] + DARK);
            logs[at] = ratio.clamp(RATIOS.0, RATIOS.1).ln();
        }
        let weights = Planes::from_planes(
            extent,
            [wanted.iter().map(|&w| f32::from(u8::from(w))).collect()],
        );
        let radius = (extent.width.max(extent.height) as f64 * RELIEF).ceil() as usize;
        let smooth = |plane: &Planes<1>| match &weights {
            Ok(weights) => {
                let (once, _) = weighted_mean(plane, weights, radius);
                weighted_mean(&once, weights, radius).0
            }
            Err(_) => plane.clone(),
        };
        let coarse = smooth(&logarithm);
        let mut result = Self {
            relief: vec![0.0; own.len()],
            shadow: vec![0.0; own.len()],
            residual: vec![0.0; own.len()],
            seen: own.iter().map(|&own| (own.max(0.0) + DARK).ln()).collect(),
            trust,
            own,
        };
        for at in (0..wanted.len()).filter(|&at| wanted[at]) {
            let (all, coarse) = (logarithm.plane(0)[at], coarse.plane(0)[at]);
            result.relief[at] = all - coarse;
            result.shadow[at] = coarse;
            let seen = shading.plane(0)[at];
            result.residual[at] = seen - (all.exp() * (result.own[at] + DARK) - DARK);
            result.seen[at] = (seen.max(0.0) + DARK).ln();
        }
        result
    }

    /// Takes what was found for the truth.
    pub(super) fn believe(&mut self) {
        self.trust = 1.0;
    }

    /// The shading of a pixel in new irradiance, red, green and blue, where `kept` of the shadows are kept.
    pub(super) fn at(&self, at: usize, irradiance: [f32; 3], kept: f32) -> [f32; 3] {
        let ratio = (self.relief[at] + kept * self.shadow[at]).exp();
        irradiance.map(|irradiance| {
            let shade = ratio * (irradiance + DARK) - DARK;
            (shade + kept * self.residual[at]).max(0.0)
        })
    }

    /// What the pixel is multiplied with, so that its brightness changes no more than can be believed.
    ///
    /// Dark may be paint that was taken for shadow, and normals are off by 25 degrees: the new shading S' is a guess whose errors
    /// grow with its distance from the shading S of the photograph. So of the logarithm of their ratio only the part t that is
    /// believed is kept: `((S + d) / (S' + d))^(1 - t)`, S' as the mean of its colours. It is 1 in the light of the photograph.
    pub(super) fn hedge(&self, at: usize, new: [f32; 3]) -> f32 {
        if self.trust == 1.0 {
            return 1.0;
        }
        let new = new.iter().sum::<f32>() / 3.0;
        ((1.0 - self.trust) * (self.seen[at] - (new + DARK).ln())).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::Extent;

    const SIDE: usize = 60;
    const DARK_PLACE: usize = SIDE * SIDE / 2 + SIDE / 8;

    /// Half of an even surface lies in the dark: its shading was found to be a fifth of what the light makes.
    fn half_dark(trust: f32) -> Shading {
        let extent = Extent::new(SIDE, SIDE);
        let shading = Planes::from_fn(extent, |x, _| [if x < SIDE / 2 { 0.2 } else { 1.0 }]);
        let own = Planes::filled(extent, [1.0; 3]);
        Shading::new(&shading, &own, &vec![true; SIDE * SIDE], trust)
    }

    /// The shading of a place in light of the same strength from elsewhere.
    fn moved(shading: &Shading, at: usize) -> f32 {
        let new = shading.at(at, [1.0; 3], 0.0);
        new[0] * shading.hedge(at, new)
    }

    #[test]
    fn a_shadow_goes_with_the_light_as_far_as_it_is_believed() {
        let believed = moved(&half_dark(1.0), DARK_PLACE);
        assert!((believed - 1.0).abs() < 0.05, "{believed}");
        // As logarithms, 0.6 of the way from 0.2 to 1, with d.
        let hedged = moved(&half_dark(0.6), DARK_PLACE);
        assert!((hedged - 0.54).abs() < 0.03, "{hedged}");
        let mut trusted = half_dark(0.6);
        trusted.believe();
        assert_eq!(moved(&trusted, DARK_PLACE), believed);
    }

    #[test]
    fn what_the_light_does_not_change_is_not_hedged() {
        let lit = moved(&half_dark(0.3), DARK_PLACE + SIDE / 2);
        assert!((lit - 1.0).abs() < 0.05, "{lit}");
        let shading = half_dark(0.3);
        let same = shading.at(DARK_PLACE, [1.0; 3], 1.0);
        assert!((same[0] - 0.2).abs() < 1e-4);
        assert!((shading.hedge(DARK_PLACE, same) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn light_of_another_colour_keeps_its_colour() {
        let shading = half_dark(0.5);
        let new = shading.at(DARK_PLACE, [1.5, 1.0, 0.5], 0.0);
        let hedged = new.map(|value| value * shading.hedge(DARK_PLACE, new));
        assert!((hedged[0] / hedged[1] - new[0] / new[1]).abs() < 1e-5);
    }
}
