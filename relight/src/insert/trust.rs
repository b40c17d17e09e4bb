//! How far a decomposition can be trusted, pixel by pixel: where it does not explain the photograph, and where another look at the
//! same photograph gives another answer.

use super::smooth::weighted_mean;
use super::{InsertError, Subject};
use crate::decompose::{DecomposeOptions, Decomposer, Decomposition};
use crate::image::{Extent, Linear, Planes, Rgb};
use crate::render::{DiffuseForm, DiffuseLayer};

/// A rescaled look sees the object at this part of the network's side.
const RESCALED_SIDE: usize = 112;
/// Doubts are means over squares that reach this part of the object's side.
const NEIGHBOURHOOD: f64 = 0.015;
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
    /// How far the mirrored photograph's answer is from the photograph's: the angle between the normals in radians, and the
    /// difference of the shadings' logarithms.
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
        let answer = Answer::of(&plain);
        Ok(Self {
            unexplained: smooth(&unexplained(&plain), &inside),
            mirrored: smooth(
                &answer.apart(&Answer::of(&mirrored).turned_back(), &inside),
                &inside,
            ),
            rescaled: smooth(&answer.apart(&rescaled, &inside), &inside),
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

/// What two looks are compared by.
struct Answer {
    normals: Planes<3>,
    shading: Planes<1>,
}

impl Answer {
    fn of(found: &Decomposition) -> Self {
        Self {
            normals: found.normals.planes().clone(),
            shading: found.shading.clone(),
        }
    }

    /// The answer to a mirrored picture, as if it were to the picture.
    fn turned_back(self) -> Self {
        let mut normals = self.normals.mirrored();
        normals.planes_mut()[0].iter_mut().for_each(|x| *x = -*x);
        Self {
            normals,
            shading: self.shading.mirrored(),
        }
    }

    fn apart(&self, other: &Self, inside: &[bool]) -> Planes<1> {
        let mut apart = Planes::zeros(self.shading.extent());
        let [values] = apart.planes_mut();
        let (a, b) = (self.normals.planes(), other.normals.planes());
        for (at, value) in values.iter_mut().enumerate().filter(|(at, _)| inside[*at]) {
            let length = |n: [&[f32]; 3]| n.iter().map(|p| p[at] * p[at]).sum::<f32>().sqrt();
            let dot: f32 = (0..3).map(|c| a[c][at] * b[c][at]).sum();
            let cosine = dot / (length(a) * length(b)).max(1e-6);
            let [s, t] = [self, other].map(|answer| answer.shading.plane(0)[at].max(0.0) + DARK);
            *value = cosine.clamp(-1.0, 1.0).acos() + (s / t).ln().abs();
        }
        apart
    }
}

fn mirror(picture: &Rgb<Linear>) -> Rgb<Linear> {
    Rgb::new(picture.planes().clone().mirrored())
}

/// The answer to a smaller picture, at the size of the picture.
fn rescaled(
    picture: &Rgb<Linear>,
    mask: &Planes<1>,
    side: usize,
    decomposer: &Decomposer,
    options: &DecomposeOptions,
) -> Result<Answer, InsertError> {
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
    let back = |normals: Planes<3>| normals.extended(&known, &everywhere).resized(extent);
    Ok(Answer {
        normals: back(found.normals.planes().clone()),
        shading: found
            .shading
            .clone()
            .extended(&known, &everywhere)
            .resized(extent),
    })
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
