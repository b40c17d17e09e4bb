//! How far a decomposition can be trusted, pixel by pixel: where it does not explain the photograph, and where another look at the
//! same photograph gives another answer.

use super::smooth::weighted_mean;
use super::{InsertError, Subject};
use crate::decompose::{DecomposeOptions, Decomposer, Decomposition};
use relight_core::image::{Extent, Linear, Planes, Rgb};
use relight_core::render::{DiffuseForm, DiffuseLayer};

/// A rescaled look sees the object at this part of the network's side.
const RESCALED_SIDE: usize = 112;
/// Doubts are means over squares that reach this part of the object's side.
const NEIGHBOURHOOD: f64 = 0.05;
/// The doubt at which trust is one half.
const HALF_TRUST: f32 = 0.5;
/// Shading below this part of its mean is not divided by.
const DARK: f32 = 0.05;

/// The doubts about a decomposition, each 0 or more, 0 outside the object. All maps have the size of
/// [`Subject::extent`].
#[derive(Debug, Clone, PartialEq)]
pub struct TrustMap {
    /// How far shading is from what the light makes on the normals, as a part of it: shadows, bounced light, wrong normals.
    pub unexplained: Planes<1>,
    /// How far the normals of the mirrored photograph are from the photograph's, radians.
    pub mirrored: Planes<1>,
    /// The same for the photograph in a smaller size.
    pub rescaled: Planes<1>,
    inside: Vec<bool>,
}

/// What a trust map says of the whole object.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct TrustFigures {
    /// The mean trust, 0 to 1.
    pub mean: f64,
    /// The part of the object that is trusted less than one half.
    pub doubtful: f64,
    /// The mean of what the light does not explain.
    pub unexplained: f64,
    /// The mean difference to the mirrored look.
    pub mirrored: f64,
    /// The mean difference to the smaller look.
    pub rescaled: f64,
}

impl TrustMap {
    /// Looks at the object of a subject again, in a mirror and in a smaller size.
    ///
    /// # Errors
    /// Where the network fails.
    pub fn of(
        subject: &Subject,
        decomposer: &Decomposer,
        options: &DecomposeOptions,
    ) -> Result<Self, InsertError> {
        let picture = Rgb::new(subject.matte().foreground.clone());
        Self::of_picture(&picture, subject.mask(), decomposer, options)
    }

    /// The same of a picture of an object.
    ///
    /// # Errors
    /// Where the network fails.
    pub fn of_picture(
        picture: &Rgb<Linear>,
        mask: &Planes<1>,
        decomposer: &Decomposer,
        options: &DecomposeOptions,
    ) -> Result<Self, InsertError> {
        // One look a time: the mean of a picture and its mirror image would agree with itself.
        let options = DecomposeOptions {
            mirror: false,
            ..*options
        };
        let plain = decomposer.decompose(picture, mask, &options)?;
        let mirrored =
            decomposer.decompose(&mirror(picture), &mask.clone().mirrored(), &options)?;
        let rescaled = rescaled(picture, mask, plain.region.side, decomposer, &options)?;
        let inside: Vec<bool> = mask.plane(0).iter().map(|&m| m >= 0.5).collect();
        let normals = plain.normals.planes();
        Ok(Self {
            unexplained: smooth(&unexplained(&plain), &inside),
            mirrored: smooth(
                &angles(normals, &turned_back(mirrored.normals.planes()), &inside),
                &inside,
            ),
            rescaled: smooth(&angles(normals, &rescaled, &inside), &inside),
            inside,
        })
    }

    /// All doubts together.
    #[must_use]
    pub fn doubt(&self) -> Planes<1> {
        let mut doubt = self.mirrored.clone();
        let [sum] = doubt.planes_mut();
        for (at, sum) in sum.iter_mut().enumerate() {
            *sum += self.rescaled.plane(0)[at] + UNEXPLAINED_WEIGHT * self.unexplained.plane(0)[at];
        }
        doubt
    }

    /// 1 where nothing is in doubt, one half where the doubts sum up to 0.5, and 0 outside the object.
    #[must_use]
    pub fn trust(&self) -> Planes<1> {
        let mut trust = self.doubt().map(|doubt| HALF_TRUST / (HALF_TRUST + doubt));
        for (trust, &inside) in trust.planes_mut()[0].iter_mut().zip(&self.inside) {
            *trust = if inside { *trust } else { 0.0 };
        }
        trust
    }

    /// What it says of the whole object.
    #[must_use]
    pub fn figures(&self) -> TrustFigures {
        let count = self.inside.iter().filter(|&&inside| inside).count().max(1) as f64;
        let mean =
            |map: &Planes<1>| map.plane(0).iter().map(|&v| f64::from(v)).sum::<f64>() / count;
        let trust = self.trust();
        let inside = trust
            .plane(0)
            .iter()
            .zip(&self.inside)
            .filter(|(_, inside)| **inside);
        TrustFigures {
            mean: mean(&trust),
            doubtful: inside.filter(|(trust, _)| **trust < 0.5).count() as f64 / count,
            unexplained: mean(&self.unexplained),
            mirrored: mean(&self.mirrored),
            rescaled: mean(&self.rescaled),
        }
    }

    /// The map as a picture, sRGB values: from blue (trusted) over white to red, black outside the object.
    #[must_use]
    pub fn picture(&self) -> Planes<3> {
        let trust = self.trust();
        let mut picture = Planes::zeros(trust.extent());
        let [red, green, blue] = picture.planes_mut();
        for (at, _) in self
            .inside
            .iter()
            .enumerate()
            .filter(|(_, inside)| **inside)
        {
            let doubt = 1.0 - trust.plane(0)[at];
            [red[at], green[at], blue[at]] = [
                0.15 + 1.7 * doubt.min(0.5),
                1.0 - 1.7 * (doubt - 0.5).abs(),
                0.15 + 1.7 * (1.0 - doubt).min(0.5),
            ];
        }
        picture
    }
}

/// How much what the light does not explain counts beside the differences between looks.
const UNEXPLAINED_WEIGHT: f32 = 0.5;

/// The normals of a mirrored picture, as if they were the picture's.
fn turned_back(normals: &Planes<3>) -> Planes<3> {
    let mut normals = normals.clone().mirrored();
    normals.planes_mut()[0].iter_mut().for_each(|x| *x = -*x);
    normals
}

/// The angles between normals, radians.
fn angles(a: &Planes<3>, b: &Planes<3>, inside: &[bool]) -> Planes<1> {
    let mut angles = Planes::zeros(a.extent());
    let (a, b) = (a.planes(), b.planes());
    let length = |n: [&[f32]; 3], at: usize| n.iter().map(|p| p[at] * p[at]).sum::<f32>().sqrt();
    for (at, angle) in angles.planes_mut()[0]
        .iter_mut()
        .enumerate()
        .filter(|(at, _)| inside[*at])
    {
        let dot: f32 = (0..3).map(|c| a[c][at] * b[c][at]).sum();
        let cosine = dot / (length(a, at) * length(b, at)).max(1e-6);
        *angle = cosine.clamp(-1.0, 1.0).acos();
    }
    angles
}

fn mirror(picture: &Rgb<Linear>) -> Rgb<Linear> {
    Rgb::new(picture.planes().clone().mirrored())
}

/// The normals of a smaller picture, at the size of the picture.
fn rescaled(
    picture: &Rgb<Linear>,
    mask: &Planes<1>,
    side: usize,
    decomposer: &Decomposer,
    options: &DecomposeOptions,
) -> Result<Planes<3>, InsertError> {
    let extent = mask.extent();
    let wanted = RESCALED_SIDE
        .min(decomposer.side() * 7 / 16)
        .min(side * 3 / 4)
        .max(1);
    let part = |pixels: usize| (pixels * wanted / side.max(1)).max(1);
    let reduced = Extent::new(part(extent.width), part(extent.height));
    let share = mask.resized(reduced);
    let most = share.plane(0).iter().fold(0.0_f32, |a, &b| a.max(b));
    let small = share.map(|m| f32::from(u8::from(m >= most.min(0.5))));
    // Only the object's own colours count.
    let (colours, _) = weighted_reduced(picture.planes(), mask, reduced);
    let found = decomposer.decompose(&Rgb::new(colours), &small, options)?;
    let known: Vec<bool> = small.plane(0).iter().map(|&m| m >= 0.5).collect();
    let everywhere = vec![true; known.len()];
    let normals = found.normals.planes().clone();
    Ok(normals.extended(&known, &everywhere).resized(extent))
}

/// The mean colours of what a mask covers of each smaller pixel, and how much that is.
fn weighted_reduced(
    picture: &Planes<3>,
    mask: &Planes<1>,
    extent: Extent,
) -> (Planes<3>, Planes<1>) {
    let mut covered = picture.clone();
    for plane in covered.planes_mut() {
        plane
            .iter_mut()
            .zip(mask.plane(0))
            .for_each(|(v, m)| *v *= m);
    }
    let (mut sums, share) = (covered.resized(extent), mask.resized(extent));
    for plane in sums.planes_mut() {
        plane
            .iter_mut()
            .zip(share.plane(0))
            .for_each(|(v, s)| *v /= s.max(1e-6));
    }
    (sums, share)
}

/// How far the shading is from the light's irradiance on the normals, as a part of the larger of both.
fn unexplained(found: &Decomposition) -> Planes<1> {
    let lit = DiffuseLayer::new(&found.light, DiffuseForm::Irradiance).shading(&found.normals);
    let mut apart = found.shading.clone();
    for (value, lit) in apart.planes_mut()[0].iter_mut().zip(lit.planes().plane(0)) {
        *value = (*value - lit).abs() / (value.max(*lit) + DARK);
    }
    apart
}

fn smooth(map: &Planes<1>, inside: &[bool]) -> Planes<1> {
    let extent = map.extent();
    let mut weights = Planes::zeros(extent);
    for (weight, &inside) in weights.planes_mut()[0].iter_mut().zip(inside) {
        *weight = f32::from(u8::from(inside));
    }
    let radius = (extent.width.max(extent.height) as f64 * NEIGHBOURHOOD).round() as usize;
    let (mut mean, _) = weighted_mean(map, &weights, radius.max(1));
    for (value, &inside) in mean.planes_mut()[0].iter_mut().zip(inside) {
        *value = if inside { *value } else { 0.0 };
    }
    mean
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_nets::{Weights, decomposer};

    fn map(level: impl Fn(usize) -> f32) -> TrustMap {
        let plane = |part: f32| Planes::from_fn(Extent::new(4, 1), |x, _| [part * level(x)]);
        TrustMap {
            unexplained: plane(0.0),
            mirrored: plane(1.0),
            rescaled: plane(0.5),
            inside: vec![true, true, true, false],
        }
    }

    #[test]
    fn trust_falls_with_doubt_and_is_nothing_outside() {
        let trust = map(|x| x as f32 / 3.0).trust();
        let values = trust.plane(0);
        assert_eq!((values[0], values[3]), (1.0, 0.0));
        assert!(values[0] > values[1] && values[1] > values[2]);
        assert!((values[1] - 0.5).abs() < 1e-6);
        let figures = map(|_| 1.0).figures();
        assert_eq!(figures.doubtful, 1.0);
        assert!((figures.mean - 0.25).abs() < 1e-6 && (figures.mirrored - 4.0 / 3.0).abs() < 1e-6);
        let picture = map(|x| x as f32 * 10.0).picture();
        let [first, _, last] = [0, 1, 2].map(|x| picture.pixel(x, 0));
        assert!(first[2] > first[0] && last[0] > last[2]);
        assert_eq!(picture.pixel(3, 0), [0.0; 3]);
    }

    #[test]
    fn other_looks_are_compared_in_the_picture_s_own_frame() {
        let extent = Extent::new(3, 1);
        let normals = Planes::from_fn(extent, |x, _| {
            [[-0.6, 0.0, 0.8], [0.0, 0.0, 1.0], [0.8, 0.0, 0.6]][x]
        });
        let mut seen_in_mirror = normals.clone().mirrored();
        seen_in_mirror.planes_mut()[0]
            .iter_mut()
            .for_each(|x| *x = -*x);
        let apart = angles(&normals, &turned_back(&seen_in_mirror), &[true; 3]);
        assert!(apart.plane(0).iter().all(|&angle| angle < 1e-3));
        let apart = angles(&normals, &seen_in_mirror, &[true, true, false]);
        assert!((apart.pixel(0, 0)[0] - (0.6_f32.asin() - 0.8_f32.asin()).abs()).abs() < 1e-3);
        assert_eq!(apart.plane(0)[1..], [0.0, 0.0]);
    }

    #[test]
    fn an_object_is_looked_at_three_times() {
        let extent = Extent::new(64, 48);
        let net = Decomposer::with_side(&Weights::initial(&decomposer(), 3), 32).unwrap();
        let mask = Planes::from_fn(extent, |x, _| [f32::from(u8::from((12..52).contains(&x)))]);
        let picture = Rgb::new(Planes::from_fn(extent, |x, y| {
            [x as f32 / 70.0, 0.3, y as f32 / 100.0]
        }));
        let trust =
            TrustMap::of_picture(&picture, &mask, &net, &DecomposeOptions::default()).unwrap();
        for map in [&trust.unexplained, &trust.mirrored, &trust.rescaled] {
            assert_eq!(map.pixel(2, 20), [0.0]);
            assert!(map.pixel(32, 20)[0] > 0.0 && map.plane(0).iter().all(|v| v.is_finite()));
        }
    }
}
