//! The shading of a photograph compared with that of its light: relief, shadows, and the uncertain rest.

use relight_core::image::Planes;

use super::smooth::weighted_mean;

/// Added to irradiance, whose mean on the object is 1, before ratios of it are taken.
pub(crate) const DARK: f32 = 0.05;
/// The most and the least that the shading may be of what the light makes on the normals; what is beyond it is kept as a
/// difference.
const RATIOS: (f32, f32) = (0.25, 4.0);
/// Details of shading up to this part of the object's side are relief; larger ones are shadows, kept as far as the
/// lights are alike.
const RELIEF: f64 = 0.04;
/// The most pixels over which the mean change of an object is taken, evenly from all of them: enough for a mean.
const MEAN_PIXELS: usize = 4096;

/// The part of the mean change of a photographed object's brightness, as a logarithm, that is kept. This and the next ones were
/// chosen on synthetic objects (docs/results/relighting.md).
const KEPT_OF_MEAN: f32 = 0.6;
/// The part of the change's deviation from the mean that is kept where the shading is dark, which may be paint, and where it
/// is bright.
const KEPT_BESIDE: (f32, f32) = (0.2, 0.8);
/// The least part of what is beside the mean that is kept in light that comes from one side alone: a lamp that is asked for is to be
/// seen, though the object's shape is a guess.
const KEPT_OF_LAMP: f32 = 0.8;
/// By how much more of it is kept where it is certain what is paint than where nobody can tell.
const KEPT_IF_CERTAIN: f32 = 0.5;
/// Shading that counts as dark, and as bright.
const DARK_AND_BRIGHT: (f32, f32) = (0.15, 0.5);

/// How much of a change of brightness is kept at the least, whatever is uncertain.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LeastKept {
    /// Of its mean over the object.
    of_mean: f32,
    /// Of what is beside the mean.
    beside: f32,
}

impl LeastKept {
    /// In light that comes from one side as much as this says, 0 to 1.
    pub(crate) fn in_light(directedness: f32) -> Self {
        Self {
            of_mean: KEPT_OF_MEAN,
            beside: KEPT_OF_LAMP * directedness,
        }
    }

    /// The same, and all of the mean.
    pub(crate) fn with_mean(self) -> Self {
        Self {
            of_mean: 1.0,
            ..self
        }
    }
}

/// The uncertainty of a photograph's decomposition: see [`Shading::damping`].
#[derive(Debug, Clone)]
struct Doubt {
    /// Pixels over which the mean change is taken.
    sample: Vec<usize>,
    /// The part of a change's deviation from the mean that is kept, per pixel.
    kept_beside: Vec<f32>,
}

/// The part of a change's deviation from the mean that is kept at a place of this `ln(S + d)`; `paint` is the part of its
/// darkness expected to be paint.
fn kept_beside(seen: f32, paint: f32) -> f32 {
    let (dark, bright) = DARK_AND_BRIGHT;
    let (dark, bright) = ((dark + DARK).ln(), (bright + DARK).ln());
    let towards_bright = ((seen - dark) / (bright - dark)).clamp(0.0, 1.0);
    let kept = KEPT_BESIDE.0 + towards_bright * (KEPT_BESIDE.1 - KEPT_BESIDE.0);
    let certainty = (2.0 * paint - 1.0).abs();
    (kept + KEPT_IF_CERTAIN * (certainty - 0.5)).clamp(0.0, 1.0)
}

/// The shading S of a photograph beside the irradiance E of its light on the normals, with D = (S + d) / (E + d), d = 0.05.
/// Logarithms are kept: a picture in new light raises to powers at each pixel.
#[derive(Debug, Clone)]
pub(crate) struct Shading {
    /// The logarithm of the fine part of D.
    relief: Vec<f32>,
    /// The logarithm of the coarse part of D: shadows, bounced light, and what order 2 cannot represent.
    shadow: Vec<f32>,
    /// What the bounds of D leave of S.
    residual: Vec<f32>,
    /// The logarithm of S + d.
    seen: Vec<f32>,
    /// `None` if it counts as the ground truth.
    doubt: Option<Doubt>,
    /// E.
    pub(crate) own: Vec<f32>,
}

impl Shading {
    /// From the estimated shading and the irradiance of the light on the normals, where it is `wanted`, as the ground truth.
    pub(crate) fn new(shading: &Planes<1>, own: &Planes<3>, wanted: &[bool]) -> Self {
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
            doubt: None,
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

    /// The same for a photograph, with partial confidence, where it is `wanted`; `paint` is the part of its darkness expected to
    /// be paint, 0..=1.
    pub(crate) fn doubted(mut self, paint: &Planes<1>, wanted: &[bool]) -> Self {
        let kept = |(at, &seen)| kept_beside(seen, paint.plane(0)[at]);
        self.doubt = Some(Doubt {
            sample: evenly(wanted),
            kept_beside: self.seen.iter().enumerate().map(kept).collect(),
        });
        self
    }

    /// The shading of a pixel in new irradiance, red, green and blue, where `kept` of the shadows are kept.
    pub(crate) fn at(&self, at: usize, irradiance: [f32; 3], kept: f32) -> [f32; 3] {
        let ratio = (self.relief[at] + kept * self.shadow[at]).exp();
        irradiance.map(|irradiance| {
            let shade = ratio * (irradiance + DARK) - DARK;
            (shade + kept * self.residual[at]).max(0.0)
        })
    }

    /// The mean over the object of the change `ln((S' + d) / (S + d))` in new irradiance; 0 where no damping needs it.
    pub(crate) fn mean_change(&self, irradiance: &Planes<3>, kept: f32) -> f32 {
        let Some(Doubt { sample, .. }) = &self.doubt else {
            return 0.0;
        };
        let changes = sample.iter().map(|&at| {
            let irradiance = std::array::from_fn(|channel| irradiance.plane(channel)[at]);
            self.change(at, self.at(at, irradiance, kept))
        });
        changes.sum::<f32>() / sample.len().max(1) as f32
    }

    /// The change of a pixel of the new shading S', as the mean of its colours.
    fn change(&self, at: usize, new: [f32; 3]) -> f32 {
        let new = new.iter().sum::<f32>() / 3.0;
        (new + DARK).ln() - self.seen[at]
    }

    /// What the pixel is multiplied with, so that its brightness changes only as far as the confidence allows.
    ///
    /// Dark may be paint mistaken for shadow, and normals are off by 25 degrees: the new shading S' is a guess whose errors
    /// grow with its distance from the shading S of the photograph. So only parts of its change c are kept: t of the mean m over
    /// the object, which is the brightness of the light on the visible side, and u of the deviation from m:
    /// `exp(-(1 - t) m - (1 - u) (c - m))`. It is 1 in the light of the photograph.
    pub(crate) fn damping(
        &self,
        at: usize,
        new: [f32; 3],
        mean_change: f32,
        least: LeastKept,
    ) -> f32 {
        let Some(Doubt { kept_beside, .. }) = &self.doubt else {
            return 1.0;
        };
        let beside = self.change(at, new) - mean_change;
        let kept_beside = kept_beside[at].max(least.beside);
        ((least.of_mean - 1.0) * mean_change + (kept_beside - 1.0) * beside).exp()
    }
}

/// The pixels that are `wanted`, or [`MEAN_PIXELS`] of them.
fn evenly(wanted: &[bool]) -> Vec<usize> {
    let all = (0..wanted.len()).filter(|&at| wanted[at]);
    let count = all.clone().count();
    all.step_by(count.div_ceil(MEAN_PIXELS).max(1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::Extent;

    const SIDE: usize = 60;
    const DARK_PLACE: usize = SIDE * SIDE / 2 + SIDE / 8;

    /// Half of an even surface lies in the dark: its shading was found to be a tenth of what the light makes.
    fn half_dark() -> Shading {
        let extent = Extent::new(SIDE, SIDE);
        let shading = Planes::from_fn(extent, |x, _| [if x < SIDE / 2 { 0.1 } else { 1.0 }]);
        let own = Planes::filled(extent, [1.0; 3]);
        let wanted = vec![true; SIDE * SIDE];
        let paint = Planes::filled(extent, [0.25]);
        Shading::new(&shading, &own, &wanted).doubted(&paint, &wanted)
    }

    /// The shading of a place in light of the same strength from elsewhere.
    fn moved(shading: &Shading, at: usize) -> f32 {
        let new = Planes::filled(Extent::new(SIDE, SIDE), [1.0; 3]);
        let mean_change = shading.mean_change(&new, 0.0);
        let new = shading.at(at, [1.0; 3], 0.0);
        new[0] * shading.damping(at, new, mean_change, LeastKept::in_light(0.0))
    }

    #[test]
    fn a_shadow_goes_with_the_light_as_far_as_it_is_believed() {
        let shading = half_dark();
        let damped = moved(&shading, DARK_PLACE);
        let mut trusted = shading;
        trusted.doubt = None;
        let believed = moved(&trusted, DARK_PLACE);
        assert!((believed - 1.0).abs() < 0.05, "{believed}");
        // Of the change from 0.1 to 1, with d, half is that of the mean: 0.4 of that goes, and 0.8 of the rest.
        let change = (1.05_f32 / 0.15).ln();
        let expected = believed * (-0.4 * change / 2.0 - 0.8 * change / 2.0).exp();
        assert!((damped - expected).abs() < 0.03, "{damped} {expected}");
    }

    #[test]
    fn a_change_is_believed_less_where_the_photograph_is_dark() {
        let trust = |seen: f32| kept_beside(seen.ln(), 0.25);
        assert!((trust(0.0) - 0.2).abs() < 1e-6);
        assert!((trust(1.05) - 0.8).abs() < 1e-6);
        assert!((0.4..0.7).contains(&trust(0.35)));
    }

    #[test]
    fn a_change_is_believed_less_where_nobody_can_tell_paint_from_shadow() {
        let trust = |paint| kept_beside(0.35_f32.ln(), paint);
        assert!((trust(0.0) - trust(1.0)).abs() < 1e-6);
        assert!((trust(1.0) - trust(0.5) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn what_the_light_does_not_change_is_not_damped() {
        let shading = half_dark();
        let same = shading.at(DARK_PLACE, [1.0; 3], 1.0);
        assert!((same[0] - 0.1).abs() < 1e-4);
        let new = Planes::filled(Extent::new(SIDE, SIDE), [1.0; 3]);
        let mean_change = shading.mean_change(&new, 1.0);
        let least = LeastKept::in_light(1.0);
        let damping = shading.damping(DARK_PLACE, same, mean_change, least);
        assert!((damping - 1.0).abs() < 1e-4);
    }

    #[test]
    fn of_a_lamp_less_is_withheld_and_of_the_mean_nothing_where_it_is_to_be_kept() {
        let shading = half_dark();
        let new = Planes::filled(Extent::new(SIDE, SIDE), [1.0; 3]);
        let mean_change = shading.mean_change(&new, 0.0);
        let shades = shading.at(DARK_PLACE, [1.0; 3], 0.0);
        let damping = |least| shading.damping(DARK_PLACE, shades, mean_change, least);
        assert!(damping(LeastKept::in_light(1.0)) > damping(LeastKept::in_light(0.0)));
        let whole = damping(LeastKept::in_light(1.0).with_mean());
        assert!(whole > damping(LeastKept::in_light(1.0)));
        assert!(
            (whole / (-0.2 * mean_change).exp() - 1.0).abs() < 0.02,
            "{whole}"
        );
    }

    #[test]
    fn light_of_another_colour_keeps_its_colour() {
        let shading = half_dark();
        let new = shading.at(DARK_PLACE, [1.5, 1.0, 0.5], 0.0);
        let least = LeastKept::in_light(0.5);
        let damped = new.map(|value| value * shading.damping(DARK_PLACE, new, 0.3, least));
        assert!((damped[0] / damped[1] - new[0] / new[1]).abs() < 1e-5);
    }

    #[test]
    fn the_mean_of_a_large_object_is_taken_over_pixels_from_all_of_it() {
        let wanted: Vec<bool> = (0..100_000).map(|at| at % 3 == 0).collect();
        let sample = evenly(&wanted);
        assert!(sample.len() <= MEAN_PIXELS && sample.len() > MEAN_PIXELS / 2);
        assert!(sample.iter().all(|&at| wanted[at]));
        assert!(sample[sample.len() - 1] > 99_900);
        assert!(evenly(&[false; 4]).is_empty());
    }
}
