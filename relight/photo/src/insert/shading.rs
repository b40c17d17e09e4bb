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
/// The shading S of a photograph beside the irradiance E of its light on the normals, with D = (S + d) / (E + d), d = 0.05.
#[derive(Debug, Clone)]
pub(super) struct Shading {
    /// The fine part of D.
    relief: Vec<f32>,
    /// The coarse part of D: shadows, bounced light, and what order 2 cannot say.
    shadow: Vec<f32>,
    /// What the bounds of D leave of S.
    residual: Vec<f32>,
    /// E.
    pub(super) own: Vec<f32>,
}

impl Shading {
    pub(super) fn new(shading: &Planes<1>, own: &Planes<3>, wanted: &[bool]) -> Self {
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
        let coarse = match weights {
            Ok(weights) => {
                let (once, _) = weighted_mean(&logarithm, &weights, radius);
                weighted_mean(&once, &weights, radius).0
            }
            Err(_) => logarithm.clone(),
        };
        let mut result = Self {
            relief: vec![1.0; own.len()],
            shadow: vec![1.0; own.len()],
            residual: vec![0.0; own.len()],
            own,
        };
        for at in (0..wanted.len()).filter(|&at| wanted[at]) {
            let (all, coarse) = (logarithm.plane(0)[at], coarse.plane(0)[at]);
            result.relief[at] = (all - coarse).exp();
            result.shadow[at] = coarse.exp();
            let held = all.exp() * (result.own[at] + DARK) - DARK;
            result.residual[at] = shading.plane(0)[at] - held;
        }
        result
    }

    /// The shading of a pixel in new irradiance, where `kept` of the shadows are kept.
    pub(super) fn at(&self, at: usize, irradiance: f32, kept: f32) -> f32 {
        let shadow = if self.shadow[at] == 1.0 {
            1.0
        } else {
            self.shadow[at].powf(kept)
        };
        let shade = self.relief[at] * shadow * (irradiance + DARK) - DARK;
        (shade + kept * self.residual[at]).max(0.0)
    }
}
