//! The shading of a photograph beside that of its light: relief, shadows, and what neither says.

use relight_core::image::Planes;
use relight_core::statistics::ranked;

use super::smooth::weighted_mean;

/// Added to irradiance, whose mean on the object is 1, before ratios of it are taken.
pub(super) const DARK: f32 = 0.05;
/// The most and the least that the shading may be of what the light makes on the normals; what is beyond it is kept as a
/// difference.
const RATIOS: (f32, f32) = (0.25, 4.0);
/// Details of shading up to this part of the object's side are relief; larger ones are shadows, of which as much is kept as the
/// lights are alike.
const RELIEF: f64 = 0.04;
/// How much the albedo's darkness counts beside that of the shading, where both may be paint.
const DOUBT: f32 = 1.0;
/// The part of an object that has a brighter albedo than that from which darkness counts.
const BRIGHTER_PART: f64 = 0.25;
/// The least albedo that counts, as a part of that one.
const LEAST_ALBEDO: f32 = 0.02;

/// What tells paint from shadow.
pub(super) struct PaintCues<'a> {
    /// The albedo that was found.
    pub(super) albedo: &'a Planes<3>,
    /// The irradiance on the side that the light reaches least: a shadow leaves that much.
    pub(super) dark_side: f32,
}

impl PaintCues<'_> {
    /// How much darker than the bright parts of the object each place was found to be painted: a logarithm, 0 on the bright parts.
    fn darkness(&self, wanted: &[bool]) -> Planes<1> {
        let [red, green, blue] = self.albedo.planes();
        let mean = |at: usize| (red[at] + green[at] + blue[at]) / 3.0;
        let mut known: Vec<f32> = (0..wanted.len())
            .filter(|&at| wanted[at])
            .map(mean)
            .collect();
        let place = (known.len() as f64 * (1.0 - BRIGHTER_PART)) as usize;
        let bright = ranked(&mut known, place)
            .unwrap_or(1.0)
            .max(f32::MIN_POSITIVE);
        let mut darkness = Planes::zeros(self.albedo.extent());
        for (at, value) in darkness.planes_mut()[0].iter_mut().enumerate() {
            if wanted[at] {
                *value = -(mean(at) / bright).clamp(LEAST_ALBEDO, 1.0).ln();
            }
        }
        darkness
    }

    /// How likely it is paint that makes a place dark, where the shading is `exp(coarse)` of what the light makes.
    ///
    /// A shadow takes away no more than the light from one side: what is darker than that is paint, or a hollow, which stays dark
    /// in any light. Of the rest, as much may be paint as the network took for paint there: it shares what it is in doubt about.
    fn paint(&self, coarse: f32, own: f32, darkness: f32) -> f32 {
        if coarse >= 0.0 {
            return 0.0;
        }
        let deepest = ((self.dark_side + DARK) / (own + DARK)).min(1.0).ln();
        let beyond = (1.0 - deepest / coarse).max(0.0);
        let doubt = DOUBT * darkness / (darkness - coarse);
        1.0 - (1.0 - beyond) * (1.0 - doubt.clamp(0.0, 1.0))
    }
}

/// The shading S of a photograph beside the irradiance E of its light on the normals, with D = (S + d) / (E + d), d = 0.05.
#[derive(Debug, Clone)]
pub(super) struct Shading {
    /// The fine part of D.
    relief: Vec<f32>,
    /// The coarse part of D: shadows, bounced light, and what order 2 cannot say.
    shadow: Vec<f32>,
    /// What the bounds of D leave of S.
    residual: Vec<f32>,
    /// How likely the coarse part is paint, 0 to 1.
    paint: Vec<f32>,
    /// E.
    pub(super) own: Vec<f32>,
}

impl Shading {
    /// Of the shading that was found and the irradiance of the light on the normals, where it is `wanted`. Of what lies in the
    /// dark, `cues` say how likely it is painted so.
    pub(super) fn new(
        shading: &Planes<1>,
        own: &Planes<3>,
        wanted: &[bool],
        cues: &PaintCues<'_>,
    ) -> Self {
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
        let darkness = smooth(&cues.darkness(wanted));
        let mut result = Self {
            relief: vec![1.0; own.len()],
            shadow: vec![1.0; own.len()],
            residual: vec![0.0; own.len()],
            paint: vec![0.0; own.len()],
            own,
        };
        for at in (0..wanted.len()).filter(|&at| wanted[at]) {
            let (all, coarse) = (logarithm.plane(0)[at], coarse.plane(0)[at]);
            result.relief[at] = (all - coarse).exp();
            result.shadow[at] = coarse.exp();
            let held = all.exp() * (result.own[at] + DARK) - DARK;
            result.residual[at] = shading.plane(0)[at] - held;
            result.paint[at] = cues.paint(coarse, result.own[at], darkness.plane(0)[at]);
        }
        result
    }

    /// Takes all that is dark for shadow.
    pub(super) fn forget_paint(&mut self) {
        self.paint.fill(0.0);
    }

    /// The shading of a pixel in new irradiance, where `kept` of the shadows are kept, and all that is paint.
    pub(super) fn at(&self, at: usize, irradiance: f32, kept: f32) -> f32 {
        let kept = kept + (1.0 - kept) * self.paint[at];
        let shadow = if self.shadow[at] == 1.0 {
            1.0
        } else {
            self.shadow[at].powf(kept)
        };
        let shade = self.relief[at] * shadow * (irradiance + DARK) - DARK;
        (shade + kept * self.residual[at]).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::Extent;

    const SIDE: usize = 60;

    /// Half of an even surface lies in the dark: its shading was found to be a fifth of what the light makes, and its albedo to be
    /// `albedo` of the other half's.
    fn half_dark(albedo: f32, dark_side: f32) -> Shading {
        let extent = Extent::new(SIDE, SIDE);
        let is_dark = |x: usize| x < SIDE / 2;
        let shading = Planes::from_fn(extent, |x, _| [if is_dark(x) { 0.2 } else { 1.0 }]);
        let found = Planes::from_fn(extent, |x, _| {
            [if is_dark(x) { 0.6 * albedo } else { 0.6 }; 3]
        });
        let cues = PaintCues {
            albedo: &found,
            dark_side,
        };
        let own = Planes::filled(extent, [1.0; 3]);
        Shading::new(&shading, &own, &vec![true; SIDE * SIDE], &cues)
    }

    /// The shading of its dark half in light of the same strength from elsewhere.
    fn moved(shading: &Shading) -> f32 {
        shading.at(SIDE * SIDE / 2 + SIDE / 8, 1.0, 0.0)
    }

    #[test]
    fn a_shadow_goes_with_the_light_and_what_is_found_to_be_painted_too_stays_dark() {
        let shadow = moved(&half_dark(1.0, 0.15));
        assert!((shadow - 1.0).abs() < 0.05, "{shadow}");
        let paint = moved(&half_dark(0.2, 0.15));
        assert!(paint < 0.55, "{paint}");
        let certain = moved(&half_dark(0.04, 0.15));
        assert!(certain < paint, "{certain} {paint}");
    }

    #[test]
    fn what_no_shadow_can_make_in_even_light_is_paint() {
        let paint = moved(&half_dark(1.0, 1.0));
        assert!((paint - 0.2).abs() < 0.05, "{paint}");
    }

    #[test]
    fn nothing_changes_in_the_same_light_and_paint_can_be_forgotten() {
        let mut shading = half_dark(0.2, 0.5);
        let at = SIDE * SIDE / 2 + 3;
        assert!((shading.at(at, 1.0, 1.0) - 0.2).abs() < 1e-4);
        shading.forget_paint();
        assert!((moved(&shading) - 1.0).abs() < 0.05);
    }
}
