//! Coarse to fine: the whole image is cut at a small size, and at each larger size only a band along
//! the edge is decided again.
//!
//! Time and memory therefore grow with the length of the object's edge, not with the image's area.

use std::borrow::Cow;

use image::{ImageBuffer, Pixel, RgbImage};
use relit_data::geometry::Rect;

use super::geodesic;
use super::grab_cut;
use super::grab_cut::{Field, IncrementalCut, Label, Models, SMOOTHNESS, squared_distance};
use super::lab::LabTable;
use crate::bitmap::Bitmap;
use crate::{Effort, MaskError};

/// Variance of the colour of equal surfaces.
const COLOUR_VARIANCE: f64 = 0.1;
/// An image is halved until it has at most so many pixels.
const COARSEST_PX: usize = 200_000;
/// Half the width of the band, pixels of the finer image: the coarse edge is uncertain by 2.
const BAND: usize = 3;
/// Where a cut finds one side alone at this smoothness too, there is none.
const MIN_SMOOTHNESS: f32 = SMOOTHNESS / 8.0;

/// Where the first colour models come from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum InitialModels {
    /// From all pixels, after the given share of the probable object that is most like the sure
    /// background was set to probably background.
    Ranked(f64),
    /// From the sure pixels alone, with what is connected with them as evidence.
    Sure,
    /// From all pixels.
    All,
}

/// An image at one of its sizes, with what is known at it.
pub(crate) struct Level<'a> {
    pub(crate) image: Cow<'a, RgbImage>,
    pub(crate) labels: Vec<Label>,
}

impl Level<'_> {
    pub(crate) fn size(&self) -> (usize, usize) {
        (self.image.width() as usize, self.image.height() as usize)
    }
}

/// The image, its half, its quarter, down to at most `coarsest` pixels.
pub(crate) fn levels(image: &RgbImage, known: Vec<Label>, coarsest: usize) -> Vec<Level<'_>> {
    let mut level = Level {
        image: Cow::Borrowed(image),
        labels: known,
    };
    let mut levels = Vec::new();
    while level.labels.len() > coarsest {
        let half = Level {
            image: Cow::Owned(half_image(&level.image)),
            labels: half_labels(&level.labels, level.size()),
        };
        levels.push(level);
        level = half;
    }
    levels.push(level);
    levels
}

/// An image at all its sizes, with what is known of it.
pub(crate) struct Pyramid<'a> {
    coarsest: Level<'a>,
    /// From fine to coarse.
    finer: Vec<Level<'a>>,
    table: LabTable,
    /// What else makes a pixel of the coarsest size object (positive) or background, in units of the log-likelihood;
    /// empty where that is nothing.
    evidence: Vec<f32>,
}

/// A cut at the coarsest size.
pub(crate) struct CoarseCut {
    pub(crate) object: Bitmap,
    pub(crate) labels: Vec<Label>,
    models: Models<3>,
    sampled: Option<Rect>,
}

impl<'a> Pyramid<'a> {
    pub(crate) fn new(image: &'a RgbImage, known: Vec<Label>) -> Result<Self, MaskError> {
        let mut finer = levels(image, known, COARSEST_PX);
        Ok(Self {
            coarsest: finer.pop().ok_or(MaskError::Empty)?,
            finer,
            table: LabTable::new(),
            evidence: Vec::new(),
        })
    }

    /// With evidence for each pixel of the coarsest size.
    pub(crate) fn with_evidence(self, evidence: Vec<f32>) -> Self {
        Self { evidence, ..self }
    }

    /// The image at the smallest of its sizes at which this holds of a part's width and height, else at its own, and how
    /// often it was halved.
    pub(crate) fn smallest(
        &self,
        part: Rect,
        is_enough: impl Fn(Rect) -> bool,
    ) -> (&Level<'a>, usize) {
        let coarsest = (&self.coarsest, self.finer.len());
        let finer = self.finer.iter().enumerate().rev();
        let levels =
            std::iter::once(coarsest).chain(finer.map(|(halvings, level)| (level, halvings)));
        let mut found = coarsest;
        for (level, halvings) in levels {
            found = (level, halvings);
            if is_enough(shrunk(part, halvings)) {
                break;
            }
        }
        found
    }

    /// The image at its coarsest size, with what is known at it.
    pub(crate) fn coarsest(&self) -> &Level<'a> {
        &self.coarsest
    }

    /// How often the image was halved to the coarsest size.
    pub(crate) fn halvings(&self) -> usize {
        self.finer.len()
    }

    /// The width and height of the image.
    pub(crate) fn size(&self) -> (u32, u32) {
        self.finer
            .first()
            .unwrap_or(&self.coarsest)
            .image
            .dimensions()
    }

    /// A part of the image in the pixels of the coarsest size.
    pub(crate) fn shrunk(&self, part: Rect) -> Rect {
        shrunk(part, self.finer.len())
    }

    /// Cuts at the coarsest size, which starts with these labels. Models learn from the pixels in `sampled`, or from
    /// all.
    pub(crate) fn cut(
        &self,
        mut labels: Vec<Label>,
        first: InitialModels,
        sampled: Option<Rect>,
    ) -> Result<CoarseCut, MaskError> {
        let mut field = RgbField::converted(&self.coarsest.image, &self.table);
        field.sampled = sampled.map(|part| self.shrunk(part));
        field.evidence.clone_from(&self.evidence);
        if first == InitialModels::Sure {
            let nearness = geodesic::evidence(&field, &labels);
            add(&mut field.evidence, nearness);
        }
        let models = begin_smooth(&field, &mut labels, first)?;
        Ok(CoarseCut {
            object: grab_cut::object_of(&labels, self.coarsest.size()),
            labels,
            models,
            sampled,
        })
    }

    /// A cut at the coarsest size without what lies in the sure background.
    ///
    /// # Errors
    /// [`MaskError::Empty`] if nothing of it is left.
    pub(crate) fn within_known(&self, mut cut: CoarseCut) -> Result<CoarseCut, MaskError> {
        for (label, known) in cut.labels.iter_mut().zip(&self.coarsest.labels) {
            if known.is_sure() {
                *label = *known;
            }
        }
        cut.object = grab_cut::object_of(&cut.labels, self.coarsest.size());
        if cut.object.count() == 0 {
            return Err(MaskError::Empty);
        }
        Ok(cut)
    }

    /// Takes a cut up to the finest size.
    pub(crate) fn refined(&self, mut cut: CoarseCut, effort: Effort) -> Bitmap {
        let field = |steps, image| RgbField {
            sampled: cut
                .sampled
                .map(|part| shrunk(part, self.finer.len() - 1 - steps)),
            ..RgbField::new(image, &self.table)
        };
        ascend(
            &self.finer,
            cut.labels,
            self.coarsest.size(),
            &mut cut.models,
            effort,
            field,
        )
    }
}

/// Adds more evidence. Both may be empty.
fn add(evidence: &mut Vec<f32>, more: Vec<f32>) {
    if evidence.is_empty() {
        *evidence = more;
    } else {
        for (sum, more) in evidence.iter_mut().zip(more) {
            *sum += more;
        }
    }
}

/// A part of an image in the pixels of the image that was halved so often.
pub(crate) fn shrunk(part: Rect, halvings: usize) -> Rect {
    let end = |end: i64| ((end - 1) >> halvings) + 1;
    let (x, y) = (part.x >> halvings, part.y >> halvings);
    let side = |begin: i32, last: i64| (end(last) - i64::from(begin)) as u32;
    Rect::new(x, y, side(x, part.right()), side(y, part.bottom()))
}

/// Takes a result of this size up to the finest of the levels, whose order is from fine to coarse. `field` is given how
/// many steps there were before.
pub(crate) fn ascend<'a, const D: usize, F: Field<D>>(
    finer: &'a [Level<'_>],
    mut labels: Vec<Label>,
    mut size: (usize, usize),
    models: &mut Models<D>,
    effort: Effort,
    field: impl Fn(usize, &'a RgbImage) -> F,
) -> Bitmap {
    for (steps, level) in finer.iter().rev().enumerate() {
        let mut fine = level.labels.clone();
        if effort.covers(fine.len()) {
            refine(
                &field(steps, &level.image),
                &mut fine,
                &labels,
                size,
                models,
            );
        } else {
            grow(&mut fine, level.size(), &labels, size);
        }
        (labels, size) = (fine, level.size());
    }
    grab_cut::object_of(&labels, size)
}

/// Cuts at the coarsest size. A cut that finds one side alone, because an outline costs more than what the colours gain,
/// is made again with half the smoothness.
fn begin_smooth(
    field: &RgbField<'_>,
    labels: &mut [Label],
    first: InitialModels,
) -> Result<Models<3>, MaskError> {
    let known = labels.to_vec();
    let mut smoothness = SMOOTHNESS;
    loop {
        let cut = start(field, labels, first, smoothness);
        match cut {
            Err(MaskError::Empty | MaskError::Everything) if smoothness > MIN_SMOOTHNESS => {
                labels.copy_from_slice(&known);
                smoothness /= 2.0;
            }
            cut => return cut,
        }
    }
}

/// Cuts at the coarsest size.
pub(crate) fn start<const D: usize>(
    field: &impl Field<D>,
    labels: &mut [Label],
    first: InitialModels,
    smoothness: f32,
) -> Result<Models<D>, MaskError> {
    let models = match first {
        InitialModels::Ranked(share) => {
            let (width, height) = field.size();
            let is_border = |at: usize| {
                let (x, y) = (at % width, at / width);
                x == 0 || y == 0 || x + 1 == width || y + 1 == height
            };
            // A rectangle nearly as large as the image leaves no background at this size.
            let is_filled = !labels.contains(&Label::Background);
            grab_cut::rank(field, labels, share, |at| is_filled && is_border(at));
            None
        }
        InitialModels::Sure => Some(Models::learn(field, labels, Label::is_sure)),
        InitialModels::All => None,
    };
    grab_cut::iterate(field, labels, models, smoothness)
}

/// Decides a band along the coarse result's edge; elsewhere the coarse result stays.
fn refine<const D: usize>(
    field: &impl Field<D>,
    labels: &mut [Label],
    coarse: &[Label],
    coarse_size: (usize, usize),
    models: &mut Models<D>,
) {
    let size = field.size();
    grow(labels, size, coarse, coarse_size);
    let band = band(labels, size, BAND);
    models.refine(field, labels);
    let scale = grab_cut::contrast_scale(field);
    IncrementalCut::new(field, scale, SMOOTHNESS, labels, &band).decide(field, models, labels);
}

/// Each pixel that is not sure takes the coarse result.
fn grow(labels: &mut [Label], size: (usize, usize), coarse: &[Label], coarse_size: (usize, usize)) {
    for (at, label) in labels.iter_mut().enumerate() {
        if !label.is_sure() {
            let (x, y) = (at % size.0 / 2, at / size.0 / 2);
            let from = y.min(coarse_size.1 - 1) * coarse_size.0 + x.min(coarse_size.0 - 1);
            *label = Label::probably(coarse[from].is_object());
        }
    }
}

/// The pixels that are not sure within `radius` of the edge between the labels, in order.
fn band(labels: &[Label], size: (usize, usize), radius: usize) -> Vec<u32> {
    let differs = |at: usize, direction| {
        grab_cut::neighbour(at, direction, size)
            .is_some_and(|next| labels[next].is_object() != labels[at].is_object())
    };
    let edge = (0..labels.len()).map(|at| [1, 3, 4, 6].iter().any(|&to| differs(at, to)));
    let near = Bitmap::new((size.0 as u32, size.1 as u32), edge).dilated(radius - 1);
    let near = near.bits().iter().zip(labels).enumerate();
    near.filter(|(_, (near, label))| **near && !label.is_sure())
        .map(|(at, _)| at as u32)
        .collect()
}

/// Half the image: each pixel is the average of 2 x 2; the last column and row of an odd side are doubled.
pub fn half_image<P: Pixel<Subpixel = u8>>(
    image: &ImageBuffer<P, Vec<u8>>,
) -> ImageBuffer<P, Vec<u8>> {
    let channels = usize::from(P::CHANNEL_COUNT);
    let (width, height) = image.dimensions();
    let mut half = ImageBuffer::new(width.div_ceil(2), height.div_ceil(2));
    let row_bytes = channels * width as usize;
    if row_bytes == 0 {
        return half;
    }
    let to = half.chunks_exact_mut(channels * width.div_ceil(2) as usize);
    for (to, pair) in to.zip(image.as_raw().chunks(2 * row_bytes)) {
        let (above, below) = pair.split_at(row_bytes);
        let below = if below.is_empty() { above } else { below };
        let pairs = above.chunks(2 * channels).zip(below.chunks(2 * channels));
        for (to, (above, below)) in to.chunks_exact_mut(channels).zip(pairs) {
            // Of a last column alone, both pixels are one.
            let right = above.len() - channels;
            for (channel, to) in to.iter_mut().enumerate() {
                let four = [above, below].map(|row| [row[channel], row[right + channel]]);
                let sum: u16 = four.as_flattened().iter().copied().map(u16::from).sum();
                *to = ((sum + 2) / 4) as u8;
            }
        }
    }
    half
}

/// A coarse pixel is what the marks in it say; background from outside a rectangle counts only if it
/// fills the pixel.
fn half_labels(labels: &[Label], (width, height): (usize, usize)) -> Vec<Label> {
    let (half_width, half_height) = (width.div_ceil(2), height.div_ceil(2));
    let of = |at: usize| {
        let (x, y) = (at % half_width * 2, at / half_width * 2);
        let (right, below) = ((x + 1).min(width - 1), (y + 1).min(height - 1));
        let four =
            [(x, y), (right, y), (x, below), (right, below)].map(|(x, y)| labels[y * width + x]);
        let has = |wanted| four.contains(&wanted);
        if has(Label::Object) && !has(Label::Background) {
            Label::Object
        } else if four.iter().all(|&label| label == Label::Background) {
            Label::Background
        } else if has(Label::ProbablyObject) || has(Label::Object) {
            Label::ProbablyObject
        } else {
            Label::ProbablyBackground
        }
    };
    (0..half_width * half_height).map(of).collect()
}

/// An image in the colours of L*a*b*.
pub(crate) struct RgbField<'a> {
    image: &'a RgbImage,
    table: &'a LabTable,
    /// The colours where all of them are needed; empty where few are.
    lab: Vec<[f32; 3]>,
    /// What else is known of the pixels; empty where that is nothing.
    evidence: Vec<f32>,
    /// The part from which models learn; `None` for all of it.
    sampled: Option<Rect>,
}

impl<'a> RgbField<'a> {
    /// A large image; few of its pixels are needed.
    pub(crate) fn new(image: &'a RgbImage, table: &'a LabTable) -> Self {
        Self {
            image,
            table,
            lab: Vec::new(),
            evidence: Vec::new(),
            sampled: None,
        }
    }

    /// A small image, its colours converted once.
    fn converted(image: &'a RgbImage, table: &'a LabTable) -> Self {
        Self {
            lab: image.pixels().map(|pixel| table.lab(pixel.0)).collect(),
            ..Self::new(image, table)
        }
    }
}

impl Field<3> for RgbField<'_> {
    const VARIANCE_FLOOR: f64 = COLOUR_VARIANCE;

    fn size(&self) -> (usize, usize) {
        (self.image.width() as usize, self.image.height() as usize)
    }

    fn feature(&self, at: usize) -> [f32; 3] {
        let bytes = || {
            let bytes = self.image.as_raw();
            [bytes[3 * at], bytes[3 * at + 1], bytes[3 * at + 2]]
        };
        let known = self.lab.get(at).copied();
        known.unwrap_or_else(|| self.table.lab(bytes()))
    }

    fn contrast(&self, a: usize, b: usize) -> f32 {
        squared_distance(&self.feature(a), &self.feature(b))
    }

    fn evidence(&self, at: usize) -> f32 {
        self.evidence.get(at).copied().unwrap_or(0.0)
    }

    fn is_sampled(&self, at: usize) -> bool {
        self.sampled
            .is_none_or(|part| part.contains(at, self.image.width()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_side_that_is_not_in_the_part_is_learned_from_all_of_it() {
        let part = Rect::new(2, 2, 4, 4);
        let inside = |at: usize| part.contains(at, 8);
        let colour = |x, y| {
            if inside(8 * y as usize + x as usize) {
                [200, 40, 40]
            } else {
                [40, 40, 200]
            }
        };
        let image = RgbImage::from_fn(8, 8, |x, y| image::Rgb(colour(x, y)));
        let labels: Vec<Label> = (0..64).map(|at| Label::probably(inside(at))).collect();
        let table = LabTable::new();
        let mut field = RgbField::new(&image, &table);
        field.sampled = Some(part);
        let models = Models::learn(&field, &labels, |_| true);
        assert!(models.log_ratio(&field.feature(0)) < -10.0);
        assert!(models.log_ratio(&field.feature(27)) > 10.0);
    }

    #[test]
    fn a_shrunk_part_has_all_pixels_that_it_touches() {
        assert_eq!(shrunk(Rect::new(3, 4, 5, 4), 1), Rect::new(1, 2, 3, 2));
        assert_eq!(shrunk(Rect::new(-3, 0, 4, 8), 2), Rect::new(-1, 0, 2, 2));
    }
}
