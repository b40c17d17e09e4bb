//! Light over the table's angle, one curve a pixel and channel.

use std::f64::consts::TAU;

use relight_core::image::{ColourSpace, Extent, Planes, Srgb};
use relit_data::image_stats::SATURATED_VALUE;
use relit_data::statistics::median;

use crate::error::TurnError;
use crate::model::harmonics::{COEFFICIENTS, HARMONICS};

/// Parts into which the turn is divided. Derived: a part of 5 degrees is narrow beside the harmonics, and its own
/// mean of them is kept, so that dividing loses nothing.
const PARTS: usize = 72;
/// Encoded value, 0 to 1, from which a channel counts as clipped. Derived: the saturation level of the data, less
/// rounding.
const CLIPPED_VALUE: f32 = SATURATED_VALUE;
/// Least share of the frames of a part, 0 to 1, in which a channel is not clipped. By hand: the mean of fewer would
/// be that of the darker ones.
const MIN_UNCLIPPED: f32 = 0.95;
/// Least number of parts with frames. Derived: five Fourier coefficients of a Lambertian curve, and three to spare.
const MIN_PARTS: usize = 8;
/// Least gap between parts with frames that is not covered, in usual gaps. By hand.
const HOLE: f64 = 3.0;

/// The fault of frames without a usable pixel.
pub(crate) const NOTHING: &str = "no frame has a pixel under the mask";

/// Gathers the frames of a turn, in any order, into [`TurnCurves`]. Its memory does not grow with the number of frames.
#[derive(Debug)]
pub(crate) struct CurveBuilder {
    extent: Extent,
    /// Which pixels are under the mask.
    places: Vec<usize>,
    clipped: f32,
    parts: Vec<Part>,
    /// Pixel by pixel, in it part by part: sum of light and number of frames that are not clipped.
    sums: Vec<[f32; 3]>,
    counts: Vec<[u16; 3]>,
    frames: u32,
}

/// The frames of a part of the turn.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    frames: u32,
    harmonics: [f64; COEFFICIENTS - 1],
}

/// Light over the table's angle. The turn is divided into parts; of each part a pixel has the mean of its
/// light, channel by channel, where the channel is not clipped.
#[derive(Debug, Clone)]
pub struct TurnCurves {
    extent: Extent,
    places: Vec<usize>,
    frames: u32,
    /// The mean of 1, cos t, -sin t, cos 2t, -sin 2t and so on over each part's frames.
    harmonics: Vec<[f64; COEFFICIENTS]>,
    /// The middle of each part, radians.
    angles: Vec<f64>,
    /// Pixel by pixel, in it part by part.
    values: Vec<[f32; 3]>,
    weights: Vec<[f32; 3]>,
}

impl CurveBuilder {
    /// For the pixels under a mask: where it is at least one half.
    ///
    /// # Errors
    /// If no pixel is under it.
    pub(crate) fn new(extent: Extent, mask: &[f32]) -> Result<Self, TurnError> {
        let places: Vec<usize> = (0..extent.pixels().min(mask.len()))
            .filter(|&at| mask[at] >= 0.5)
            .collect();
        if places.is_empty() {
            return Err(TurnError::Refused(NOTHING.to_owned()));
        }
        let cells = places.len() * PARTS;
        Ok(Self {
            extent,
            places,
            clipped: Srgb::to_linear(CLIPPED_VALUE),
            parts: vec![Part::default(); PARTS],
            sums: vec![[0.0; 3]; cells],
            counts: vec![[0; 3]; cells],
            frames: 0,
        })
    }

    /// Takes a frame up: its angle, degrees, and its planes of linear red, green and blue. Frames whose angle is
    /// not a number are left out.
    ///
    /// # Errors
    /// If it has another size.
    pub(crate) fn push(
        &mut self,
        angle_deg: f64,
        extent: Extent,
        planes: [&[f32]; 3],
    ) -> Result<(), TurnError> {
        if extent != self.extent || planes.iter().any(|plane| plane.len() != extent.pixels()) {
            let [found, expected] =
                [extent, self.extent].map(|size| format!("{} x {}", size.width, size.height));
            return Err(TurnError::Refused(format!(
                "a frame has {found} pixels instead of {expected}"
            )));
        }
        if !angle_deg.is_finite() {
            return Ok(());
        }
        let part = (angle_deg.rem_euclid(360.0) / 360.0 * PARTS as f64) as usize % PARTS;
        self.parts[part].add(angle_deg.to_radians());
        self.frames += 1;
        for (pixel, &at) in self.places.iter().enumerate() {
            let cell = pixel * PARTS + part;
            for (channel, plane) in planes.iter().enumerate() {
                if plane[at] < self.clipped {
                    self.sums[cell][channel] += plane[at];
                    let count = &mut self.counts[cell][channel];
                    *count = count.saturating_add(1);
                }
            }
        }
        Ok(())
    }

    /// The curves of all frames.
    ///
    /// # Errors
    /// If the frames do not determine two harmonics.
    pub(crate) fn finish(self) -> Result<TurnCurves, TurnError> {
        let seen: Vec<usize> = (0..PARTS).filter(|&at| self.parts[at].frames > 0).collect();
        if seen.len() < MIN_PARTS {
            return Err(TurnError::Refused(format!(
                "{} different angles were found: at least {MIN_PARTS}, spread over the turn, are needed",
                seen.len()
            )));
        }
        let cells = || {
            self.places
                .iter()
                .enumerate()
                .flat_map(|(pixel, _)| seen.iter().map(move |part| pixel * PARTS + part))
        };
        let mean = |cell: usize| {
            [0, 1, 2].map(|c| self.sums[cell][c] / f32::from(self.counts[cell][c].max(1)))
        };
        let values = cells().map(mean).collect();
        let weights = cells()
            .map(|cell| {
                let frames = self.parts[cell % PARTS].frames as f32;
                self.counts[cell].map(|count| {
                    let is_seen = f32::from(count) >= MIN_UNCLIPPED * frames;
                    f32::from(u8::from(is_seen))
                })
            })
            .collect();
        Ok(TurnCurves {
            extent: self.extent,
            frames: self.frames,
            harmonics: seen.iter().map(|&at| self.parts[at].harmonics()).collect(),
            angles: seen
                .iter()
                .map(|&at| (at as f64 + 0.5) / PARTS as f64 * TAU)
                .collect(),
            values,
            weights,
            places: self.places,
        })
    }
}

impl Part {
    fn add(&mut self, angle: f64) {
        self.frames += 1;
        for harmonic in 1..=HARMONICS {
            let (sin, cos) = (harmonic as f64 * angle).sin_cos();
            self.harmonics[2 * harmonic - 2] += cos;
            self.harmonics[2 * harmonic - 1] -= sin;
        }
    }

    fn harmonics(&self) -> [f64; COEFFICIENTS] {
        let mut harmonics = [1.0; COEFFICIENTS];
        for (coefficient, sum) in harmonics[1..].iter_mut().zip(self.harmonics) {
            *coefficient = sum / f64::from(self.frames.max(1));
        }
        harmonics
    }
}

impl TurnCurves {
    /// Width and height of the frames.
    pub const fn extent(&self) -> Extent {
        self.extent
    }

    /// How many pixels are under the mask.
    pub(crate) fn pixels(&self) -> usize {
        self.places.len()
    }

    /// How many frames were taken up.
    pub const fn frames(&self) -> u32 {
        self.frames
    }

    /// In how many parts of the turn there are frames.
    pub(crate) fn parts(&self) -> usize {
        self.harmonics.len()
    }

    /// The part of the light, 0 to 1, that is left out because it is clipped in the same part of the turn.
    pub(crate) fn clipped(&self) -> f64 {
        let sum: f64 = self
            .weights
            .iter()
            .flatten()
            .map(|&weight| f64::from(weight))
            .sum();
        (1.0 - sum / (3 * self.weights.len()).max(1) as f64).max(0.0)
    }

    /// The light from which a channel counts as clipped.
    pub(crate) fn clipped_value(&self) -> f64 {
        f64::from(Srgb::to_linear(CLIPPED_VALUE))
    }

    /// The places of the pixels under the mask in the frame, row by row.
    pub(crate) fn places(&self) -> &[usize] {
        &self.places
    }

    /// Where the mask is.
    pub(crate) fn mask(&self) -> Vec<bool> {
        let mut mask = vec![false; self.extent.pixels()];
        self.places.iter().for_each(|&at| mask[at] = true);
        mask
    }

    /// The mean of 1, cos t, -sin t, cos 2t, -sin 2t and so on over each part.
    pub(crate) fn harmonics(&self) -> &[[f64; COEFFICIENTS]] {
        &self.harmonics
    }

    /// The middle of each part, radians.
    pub(crate) fn angles(&self) -> &[f64] {
        &self.angles
    }

    /// The light of a pixel, part by part.
    pub(crate) fn values(&self, pixel: usize) -> &[[f32; 3]] {
        &self.values[pixel * self.parts()..][..self.parts()]
    }

    /// The weight of each, 0 or 1: 0 if it is clipped.
    pub(crate) fn weights(&self, pixel: usize) -> &[[f32; 3]] {
        &self.weights[pixel * self.parts()..][..self.parts()]
    }

    /// A map whose values under the mask are these, and 0 elsewhere.
    ///
    /// # Panics
    /// Where there are fewer values than pixels.
    pub(crate) fn map<const C: usize>(&self, value: impl Fn(usize) -> [f32; C]) -> Planes<C> {
        let mut map = Planes::zeros(self.extent);
        let width = self.extent.width;
        for (pixel, &at) in self.places.iter().enumerate() {
            map.set_pixel(at % width, at / width, value(pixel));
        }
        map
    }

    /// The values that a map has at the pixels under the mask.
    pub(crate) fn pixels_of<'a, const C: usize>(
        &'a self,
        map: &'a Planes<C>,
    ) -> impl Iterator<Item = [f64; C]> + 'a {
        let width = self.extent.width;
        let places = self.places.iter();
        places.map(move |&at| map.pixel(at % width, at / width).map(f64::from))
    }

    /// The degrees of the turn that the frames cover: all except gaps much larger than the usual distance.
    pub fn coverage_deg(&self) -> f64 {
        let mut angles: Vec<f64> = self.angles.iter().map(|angle| angle.to_degrees()).collect();
        angles.sort_by(f64::total_cmp);
        let after = angles.iter().skip(1).copied();
        let first = angles.first().map(|first| first + 360.0);
        let gaps: Vec<f64> = (angles.iter().zip(after.chain(first)))
            .map(|(angle, next)| next - angle)
            .collect();
        let usual = median(gaps.iter().copied()).unwrap_or(0.0);
        let is_hole = |gap: &&f64| **gap > HOLE * usual;
        360.0
            - gaps
                .iter()
                .filter(is_hole)
                .map(|gap| gap - usual)
                .sum::<f64>()
    }

    /// The curves as they are if the table turns the other way as its angle grows.
    pub(crate) fn with_other_direction(&self) -> Self {
        let mut other = self.clone();
        for harmonics in &mut other.harmonics {
            for sine in harmonics.iter_mut().skip(2).step_by(2) {
                *sine = -*sine;
            }
        }
        for angle in &mut other.angles {
            *angle = (-*angle).rem_euclid(TAU);
        }
        other
    }

    /// The curves of some of the pixels, by their places.
    pub(crate) fn only(&self, is_wanted: impl Fn(usize) -> bool) -> Self {
        let mut some = Self {
            places: Vec::new(),
            values: Vec::new(),
            weights: Vec::new(),
            ..self.clone()
        };
        for (pixel, &place) in self.places.iter().enumerate() {
            if is_wanted(place) {
                some.places.push(place);
                some.values.extend(self.values(pixel));
                some.weights.extend(self.weights(pixel));
            }
        }
        some
    }
}

#[cfg(test)]
mod tests;
