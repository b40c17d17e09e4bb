//! Where the object is in each frame, compared with the frame on which its mask was made.
//!
//! A rig's belt vibrates and its table sags: the object moves by a fraction of a pixel or a few. The light
//! moves far more, so frames are not compared with each other. A template of what lasts (`template`) is made of
//! frames spread over the turn, and each frame is fitted to it on its own (`fit`), from a coarse scale to a
//! fine one (`structure`), and there by a few patches where these can be believed (`patches`): the result does not
//! depend on other frames, nor on the number of threads.
//!
//! This module knows pictures and a mask, and nothing of files, videos or shards.

mod brightness;
mod fit;
mod median;
mod patches;
mod region;
mod required_regions;
mod structure;
mod template;

use std::ops::Range;

use image::GrayImage;
use rayon::iter::{IntoParallelIterator, IntoParallelRefIterator, ParallelIterator};
use relit_data::statistics::upper_median;

use super::CropView;
use brightness::{half, half_luma, luma};
use fit::Fit;
use patches::{PatchBuffers, Patches};
use region::Region;
use required_regions::RequiredRegions;
use structure::{Extractor, Gradients, Plane};
use template::Template;

/// A fit whose correlation is less is none.
const MIN_CONFIDENCE: f64 = 0.3;
/// Nor is one of less than this share of the turn's median: a part of an object that is turned fits somewhere, too.
const MIN_OF_MEDIAN: f64 = 0.6;
/// Larger crops are halved until their longer side is at most this, pixels: what is gained beyond is little.
const FINEST_SIDE: u32 = 640;
/// Pictures are halved until their longer side is at most this, pixels.
const COARSEST_SIDE: u32 = 128;
/// Fewest pixels of the object at the coarsest scale.
const MIN_PIXELS: usize = 150;
/// Largest number of scales.
const MAX_SCALES: usize = 6;
/// Pixels at the object's outline that are left out, at the finest and at the other scales.
const OUTLINE: [usize; 2] = [2, 1];
/// Source pixels by which the mask's frame may lie beside the turn's middle and still be taken to lie there: as exactly as one
/// frame can be measured.
const SAME_PLACE: f64 = 0.1;
/// Times that the template is computed again at the coarsest, the finest, and the scales between.
const ROUNDS: [usize; 3] = [3, 2, 1];
/// The search goes up to this many times the largest shift, so that a larger shift is noticed.
const LOOK_BEYOND: f64 = 1.5;
/// A shift that a scale finds from nothing, pixels.
const LITTLE: f64 = 0.75;
/// Scales, from the finest on, that are compared with the next coarser one.
const COMPARED: usize = 2;
/// A shift that lies further from the turn's middle, in standard deviations of what the turn and the measuring explain,
/// is a jolt.
const JOLT: f64 = 2.5;
/// Shifts that change by less stand still, pixels, at the finest scale and at the others.
const STILL: [f64; 2] = [0.01, 0.05];
/// Further than this, pixels at the object's mean distance from its centre, a rotation or growth counts.
const SIGNIFICANT: f64 = 0.5;

/// The brightness of the part of a frame in which the object is looked for, at the resolution that is needed.
#[derive(Debug, Clone)]
pub struct AlignSample(GrayImage);

impl AlignSample {
    /// The brightness of `crop`.
    pub fn from_crop(crop: CropView<'_>) -> Self {
        let (width, height) = crop.dimensions();
        let (halvings, rows) = (halvings((width, height)), 0..height as usize);
        let mut image = GrayImage::default();
        if halvings == 0 {
            luma(crop, rows, &Region::whole(crop.dimensions()), &mut image);
            return Self(image);
        }
        let half = Region::whole((width / 2, height / 2));
        half_luma(crop, rows, &half, &mut image);
        Self((1..halvings).fold(image, |image, _| halved(&image)))
    }
}

/// How often a crop of this size is halved before anything else.
fn halvings((width, height): (u32, u32)) -> u32 {
    let longer = width.max(height);
    (0..16)
        .find(|&by| longer >> by <= FINEST_SIDE)
        .unwrap_or(16)
}

/// Where the object of a frame is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alignment {
    /// To the right and down of its place in the mask, pixels: what is most likely, given what the frame shows and
    /// how far the object moves in its turn. `None` if the frame cannot be registered.
    pub shift: Option<[f64; 2]>,
    /// Standard deviation of what the frame shows, pixels: by how much parts of
    /// the object and neighbouring scales disagree; moving light shifts the coarser scales more.
    /// Infinite without a shift.
    pub uncertainty: f64,
    /// Correlation of the frame's structure with the object's lasting one, 0..=1.
    pub confidence: f64,
    /// How far a rotation and a growth move the object's pixels in the mean, beyond the shift: degrees
    /// clockwise, and the factor of size minus 1. `None` if it is not significant.
    pub turned: Option<(f64, f64)>,
}

/// Measures shifts of one object in frames of one video.
#[derive(Debug)]
pub struct Aligner {
    /// From the finest to the coarsest.
    templates: Vec<Template>,
    /// Of the finest template, if there are coarser ones.
    patches: Option<Patches>,
    /// Largest shift that is looked for, pixels of the finest template.
    reach: f64,
    /// Pixels of a frame in one of the finest template.
    unit: f64,
    required_regions: RequiredRegions,
    min_confidence: f64,
    motion: Motion,
}

/// How the object moves in its turn, by the frames that it was learnt from.
#[derive(Debug, Default)]
struct Motion {
    /// The middle place, pixels.
    centre: [f64; 2],
    /// Mean square of the distances from there beyond what is measuring error, square pixels; `None` before it is
    /// known.
    variance: Option<f64>,
    /// Where the object is in the mask's frame, pixels.
    origin: [f64; 2],
}

/// What a thread needs to measure shifts; it keeps its buffers from frame to frame.
#[derive(Debug, Default)]
pub struct AlignBuffers {
    /// The brightness at each scale.
    lumas: Vec<GrayImage>,
    gradients: GradientBuffers,
}

/// The gradients of a frame at each scale, and what makes them.
#[derive(Debug, Default)]
struct GradientBuffers {
    extractor: Extractor,
    scales: Vec<Gradients>,
    patches: PatchBuffers,
}

impl Aligner {
    /// Learns the object under `mask` (not 0) from frames that are spread over the turn, in the mask's size.
    /// Shifts count from the object's place in `samples[reference]`, the frame of the mask; where that is
    /// within a tenth of a pixel of the turn's middle place, which is known more exactly, from there.
    ///
    /// `None` if the object has too little structure.
    pub fn learn(
        samples: &[AlignSample],
        reference: usize,
        mask: &GrayImage,
        max_shift: f64,
    ) -> Option<Self> {
        let halvings = halvings(mask.dimensions());
        let unit = f64::from(1_u32 << halvings);
        let scales = scales(&halved_mask(mask, halvings));
        let reach = (max_shift * LOOK_BEYOND + 1.0) / unit;
        let near = SAME_PLACE / unit;
        let mut shifts = vec![[0.0; 2]; samples.len()];
        let mut templates = Vec::new();
        for (scale, inner) in scales.iter().enumerate().rev() {
            let planes: Vec<Plane> = samples
                .par_iter()
                .map(|sample| plane_at(&sample.0, scale))
                .collect();
            let reach = reach / (1_u32 << scale) as f64;
            let coarsest = scale + 1 == scales.len();
            let rounds = ROUNDS[if coarsest {
                0
            } else if scale == 0 {
                1
            } else {
                2
            }];
            for round in 0..rounds {
                let template = Template::from_planes(&planes, &shifts, inner);
                // The first template of all is too blurred to search with.
                let search = coarsest && round > 0;
                fit_all(&template, &planes, &mut shifts, reach, search, still(scale));
                let last = scale == 0 && round + 1 == rounds;
                let origin = match shifts.get(reference).copied() {
                    Some(origin) if !last => origin,
                    origin => final_origin(origin, &shifts, near),
                };
                for shift in &mut shifts {
                    *shift = [shift[0] - origin[0], shift[1] - origin[1]];
                }
            }
            templates.push(Template::from_planes(&planes, &shifts, inner));
            if scale > 0 {
                for shift in &mut shifts {
                    let doubled = shift.map(|part| 2.0 * part);
                    // The finer scale finds less from nothing, and without the light's pull on the coarser.
                    let little = doubled[0].hypot(doubled[1]) < LITTLE;
                    *shift = if little { [0.0; 2] } else { doubled };
                }
            }
        }
        templates.reverse();
        let coarsest = reach / (1_u32 << (templates.len() - 1)) as f64;
        let mut aligner = Self {
            required_regions: RequiredRegions::new(
                &templates,
                mask.dimensions(),
                halvings,
                coarsest,
            ),
            patches: finest_patches(&templates),
            templates,
            reach,
            unit,
            min_confidence: MIN_CONFIDENCE,
            motion: Motion::default(),
        };
        let locate = |aligner: &Self| -> (Vec<Alignment>, Vec<Option<f64>>) {
            let located = samples
                .par_iter()
                .map_init(AlignBuffers::default, |buffers, sample| {
                    let AlignBuffers { lumas, gradients } = buffers;
                    let lumas = aligner.required_regions.lumas_of_sample(&sample.0, lumas);
                    aligner.located(lumas, gradients)
                });
            located.unzip()
        };
        let (mut found, agreements) = locate(&aligner);
        if let Some(patches) = &mut aligner.patches {
            // Until it is known what is usual, all patches were believed.
            let agreements: Vec<f64> = agreements.into_iter().flatten().collect();
            if !patches.expect(&agreements) {
                (found, _) = locate(&aligner);
            }
        }
        let usable = found.get(reference)?.shift.is_some();
        let registered = found.iter().filter(|found| found.shift.is_some());
        let usual = upper_median(registered.map(|found| found.confidence)).unwrap_or_default();
        aligner.min_confidence = MIN_CONFIDENCE.max(MIN_OF_MEDIAN * usual);
        aligner.motion = Motion::from_alignments(&found, reference);
        usable.then_some(aligner)
    }

    /// The confidence below which a frame of this turn is not registered, 0..=1.
    pub fn min_confidence(&self) -> f64 {
        self.min_confidence
    }

    /// Looks at these rows of a frame's crop, which has the size of the mask; they come from the top to the bottom.
    pub fn take_rows(&self, crop: CropView<'_>, rows: Range<u32>, buffers: &mut AlignBuffers) {
        let rows = rows.start as usize..rows.end as usize;
        self.required_regions
            .take_rows(crop, rows, &mut buffers.lumas);
    }

    /// Where the object is in a frame, all rows of its crop being known.
    pub fn measure_rows(&self, buffers: &mut AlignBuffers) -> Alignment {
        let lumas = self.required_regions.lumas_of_rows(&mut buffers.lumas);
        self.located(lumas, &mut buffers.gradients).0
    }

    /// Where the object is, and the part of the patches that agrees if they told it.
    fn located(
        &self,
        lumas: &[GrayImage],
        buffers: &mut GradientBuffers,
    ) -> (Alignment, Option<f64>) {
        let (fit, agreement) = self.refined(lumas, buffers).unzip();
        let confidence = fit.map_or(0.0, |fit| fit.correlation.clamp(0.0, 1.0));
        let fit = fit.filter(|fit| self.is_sure(fit));
        let in_pixels = |length: f64| self.unit * length;
        let uncertainty = fit.map_or(f64::INFINITY, |fit| in_pixels(fit.uncertainty));
        let shift = fit.map(|fit| fit.shift.map(in_pixels));
        let alignment = Alignment {
            shift: shift.map(|shift| self.motion.against_mask(shift, uncertainty)),
            uncertainty,
            confidence,
            turned: fit.and_then(|fit| self.turned(&buffers.scales, fit)),
        };
        (alignment, agreement.flatten())
    }

    fn is_sure(&self, fit: &Fit) -> bool {
        fit.correlation >= self.min_confidence
    }

    /// From the coarsest scale to the finest.
    fn refined(
        &self,
        lumas: &[GrayImage],
        buffers: &mut GradientBuffers,
    ) -> Option<(Fit, Option<f64>)> {
        let GradientBuffers {
            extractor,
            scales,
            patches,
        } = buffers;
        scales.resize_with(self.templates.len(), Gradients::default);
        let coarsest = self.templates.len() - 1;
        let mut start = [0.0; 2];
        let mut found: Option<(Fit, Option<f64>)> = None;
        let mut apart = 0.0;
        for (scale, template) in self.templates.iter().enumerate().rev() {
            let pixels = f64::from(1_u32 << scale);
            let (reach, still) = (self.reach / pixels, still(scale));
            let luma = lumas.get(scale)?;
            // Without a place at a coarser scale, nothing tells where the patches are.
            let by_patches = self
                .patches
                .as_ref()
                .filter(|_| scale == 0 && found.is_some());
            let by_patches = by_patches
                .and_then(|by| by.fit(luma, start, still, extractor, patches))
                .filter(|(fit, _)| {
                    let is_near = fit.shift.iter().all(|shift| shift.abs() <= reach);
                    is_near && self.is_sure(fit)
                });
            found = match by_patches {
                Some((fit, agreement)) => Some((fit, Some(agreement))),
                None => {
                    let gradients = scales.get_mut(scale)?;
                    extractor.gradients(luma, self.required_regions.needs.get(scale)?, gradients);
                    if scale == coarsest {
                        start = template.search(gradients, reach);
                    }
                    let fit = template.fit(gradients, start, reach, still);
                    fit.map(|fit| (fit, None))
                }
            };
            // A scale at which the object has no structure says nothing.
            if let Some((fit, _)) = found {
                let [dx, dy] = [fit.shift[0] - start[0], fit.shift[1] - start[1]];
                if scale < coarsest && scale < COMPARED {
                    apart += pixels * pixels * (dx * dx + dy * dy);
                }
                start = fit.shift;
            }
            if scale > 0 {
                start = start.map(|part| 2.0 * part);
            }
        }
        let (fit, agreement) = found?;
        let uncertainty = (fit.uncertainty * fit.uncertainty + apart).sqrt();
        Some((Fit { uncertainty, ..fit }, agreement))
    }

    fn turned(&self, gradients: &[Gradients], fit: Fit) -> Option<(f64, f64)> {
        // At the second scale, movements are half as many pixels: nearer to the first order.
        let scale = 1.min(self.templates.len() - 1);
        let pixels = (1_u32 << scale) as f64;
        let shift = fit.shift.map(|part| part / pixels);
        let similarity = self.templates[scale].similarity(&gradients[scale], shift)?;
        let moved =
            self.unit * pixels * similarity.radius * similarity.turned.hypot(similarity.grown);
        (moved > SIGNIFICANT).then_some((similarity.turned.to_degrees(), similarity.grown))
    }
}

impl Motion {
    /// From the frames that were learnt from; the mask was made on that of index `reference`.
    fn from_alignments(found: &[Alignment], reference: usize) -> Self {
        let shifts: Vec<[f64; 2]> = found.iter().filter_map(|found| found.shift).collect();
        let centre = middle_place(&shifts);
        let beyond = |found: &Alignment| {
            let [x, y] = found.shift?;
            let (dx, dy) = (x - centre[0], y - centre[1]);
            Some(dx * dx + dy * dy - found.uncertainty * found.uncertainty)
        };
        let variance = found.iter().filter_map(beyond).sum::<f64>() / shifts.len().max(1) as f64;
        let mut motion = Self {
            centre,
            variance: Some(variance.max(0.0)),
            origin: [0.0; 2],
        };
        let of_mask = found.get(reference);
        if let Some((shift, found)) = of_mask.and_then(|found| Some((found.shift?, found))) {
            let away = (shift[0] - centre[0]).hypot(shift[1] - centre[1]);
            motion.origin = if away > SAME_PLACE {
                motion.most_likely(shift, found.uncertainty)
            } else {
                centre
            };
        }
        motion
    }

    /// The most likely shift against the mask's frame, of a frame that shows this one.
    fn against_mask(&self, shift: [f64; 2], uncertainty: f64) -> [f64; 2] {
        let found = self.most_likely(shift, uncertainty);
        [0, 1].map(|axis| found[axis] - self.origin[axis])
    }

    /// The most likely place of a frame's object of this turn. A measured value holds the error of its
    /// measuring, which in a turn that hardly moves is most of it, and counts the less: an empirical Bayes
    /// estimate (Efron and Morris, "Stein's estimation rule and its competitors", 1973). Uncertainties are generous,
    /// and must not pull at an object that clearly moves: it counts by the ratio of the variances, at most wholly. What
    /// neither the turn's motion nor an error explains is taken as it is.
    fn most_likely(&self, shift: [f64; 2], uncertainty: f64) -> [f64; 2] {
        let Some(variance) = self.variance else {
            return shift;
        };
        let away = [shift[0] - self.centre[0], shift[1] - self.centre[1]];
        let spread = variance + uncertainty * uncertainty;
        let square = away[0] * away[0] + away[1] * away[1];
        if spread <= 0.0 || square > JOLT * JOLT * spread {
            return shift;
        }
        let part = (variance / uncertainty.powi(2)).min(1.0);
        [0, 1].map(|axis| self.centre[axis] + part * away[axis])
    }
}

/// The patches of the finest template, if there are coarser ones.
fn finest_patches(templates: &[Template]) -> Option<Patches> {
    match templates {
        [finest, _, ..] => Patches::from_template(finest),
        _ => None,
    }
}

/// Where shifts count from in the end.
fn final_origin(reference: Option<[f64; 2]>, shifts: &[[f64; 2]], near: f64) -> [f64; 2] {
    let middle = middle_place(shifts);
    let far = |[x, y]: &[f64; 2]| (x - middle[0]).hypot(y - middle[1]) > near;
    reference.filter(far).unwrap_or(middle)
}

/// The median shift to the right, and that down.
fn middle_place(shifts: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|axis| {
        let median = upper_median(shifts.iter().map(|shift| shift[axis]));
        median.unwrap_or_default()
    })
}

fn fit_all(
    template: &Template,
    planes: &[Plane],
    shifts: &mut [[f64; 2]],
    reach: f64,
    search: bool,
    still: f64,
) {
    let found: Vec<[f64; 2]> = (0..planes.len())
        .into_par_iter()
        .map_init(Gradients::default, |gradients, at| {
            gradients.take(&planes[at]);
            let start = if search {
                template.search(gradients, reach)
            } else {
                shifts[at]
            };
            let fit = template.fit(gradients, start, reach, still);
            fit.map_or(shifts[at], |fit| fit.shift)
        })
        .collect();
    shifts.copy_from_slice(&found);
}

/// A change of the shift at which a scale is done, its pixels: a finer scale improves on the coarser.
fn still(scale: usize) -> f64 {
    STILL[usize::from(scale > 0)]
}

fn plane_at(sample: &GrayImage, scale: usize) -> Plane {
    let mut smaller: Option<GrayImage> = None;
    for _ in 0..scale {
        smaller = Some(halved(smaller.as_ref().unwrap_or(sample)));
    }
    let mut plane = Plane::default();
    Extractor::default().structure(smaller.as_ref().unwrap_or(sample), &mut plane);
    plane
}

/// Half the picture.
fn halved(image: &GrayImage) -> GrayImage {
    let mut small = GrayImage::default();
    let all = Region::whole((image.width() / 2, image.height() / 2));
    half(image, &all, &mut small);
    small
}

/// The mask of as many halvings as the frames have: only what is object in all pixels.
fn halved_mask(mask: &GrayImage, halvings: u32) -> GrayImage {
    let mut small = mask.clone();
    small
        .iter_mut()
        .for_each(|m| *m = if *m != 0 { 255 } else { 0 });
    for _ in 0..halvings {
        small = halved(&small);
        small
            .iter_mut()
            .for_each(|m| *m = if *m == 255 { 255 } else { 0 });
    }
    small
}

/// The object without its outline at each scale, from the finest to the coarsest.
fn scales(mask: &GrayImage) -> Vec<Vec<bool>> {
    let full = |mask: &GrayImage| mask.as_raw().iter().map(|&m| m != 0).collect();
    let mut scales: Vec<Vec<bool>> = vec![eroded(full(mask), mask.dimensions(), OUTLINE[0])];
    let mut image = mask.clone();
    while image.width().max(image.height()) > COARSEST_SIDE && scales.len() < MAX_SCALES {
        image = halved(&image);
        // Only what was object in all four pixels.
        let whole = image.as_raw().iter().map(|&m| m == 255).collect();
        let inner = eroded(whole, image.dimensions(), OUTLINE[1]);
        if inner.iter().filter(|&&inside| inside).count() < MIN_PIXELS {
            break;
        }
        scales.push(inner);
    }
    scales
}

/// Without the pixels within `by` of one outside, in both directions.
fn eroded(inside: Vec<bool>, (width, height): (u32, u32), by: usize) -> Vec<bool> {
    let (width, height) = (width as usize, height as usize);
    let along = |from: &[bool], step: usize, last: usize, at: usize, place: usize| {
        let range = place.saturating_sub(by)..=(place + by).min(last);
        let whole = place >= by && place + by <= last;
        whole
            && range
                .into_iter()
                .all(|to| from[at - place * step + to * step])
    };
    let rows: Vec<bool> = (0..inside.len())
        .map(|at| along(&inside, 1, width - 1, at, at % width))
        .collect();
    (0..rows.len())
        .map(|at| along(&rows, width, height - 1, at, at / width))
        .collect()
}

#[cfg(test)]
mod tests;
