//! Coarse to fine: the whole image is cut at a small size, and at each larger size only a band along
//! the edge is decided again.
//!
//! Time and memory therefore grow with the length of the object's edge, not with the image's area.

use image::{ImageBuffer, Pixel, RgbImage};

use super::bitmap::Bitmap;
use super::grab_cut::{self, Field, Label, Models, OpenCut, SMOOTHNESS};
use super::lab::LabTable;
use super::{Effort, Iterations, MaskError};

/// Variance of the colour of equal surfaces.
const COLOUR_VARIANCE: f64 = 0.1;
/// Half the width of the band, pixels of the finer image: the coarse edge is uncertain by 2.
const BAND: usize = 3;
/// Where a cut finds one side alone at this smoothness too, there is none.
const LEAST_SMOOTHNESS: f32 = SMOOTHNESS / 8.0;

/// Where the first colour models come from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum FirstModels {
    /// From all pixels, after the given share of the probable object that is most like the sure
    /// background was set to probably background.
    Ranked(f64),
    /// From the sure pixels alone.
    Sure,
    /// From all pixels.
    All,
}

/// Cuts the object out of `image`. `labels` holds what is known, row by row, and the result.
pub(super) fn segment(
    image: &RgbImage,
    labels: &mut Vec<Label>,
    first: FirstModels,
    iterations: Iterations,
    effort: Effort,
) -> Result<(), MaskError> {
    let table = LabTable::new();
    let mut levels: Vec<(RgbImage, Vec<Label>)> = Vec::new();
    loop {
        let (image, known) = levels.last().map_or((image, &*labels), |(i, l)| (i, l));
        if pixels(image) <= effort.coarsest_px() {
            break;
        }
        let half = (half_image(image), half_labels(known, size(image)));
        levels.push(half);
    }
    let mut models = None;
    let mut coarser: Option<(Vec<Label>, (usize, usize))> = None;
    for (image, mut known) in levels.into_iter().rev() {
        let begin =
            |field: &LabField, labels: &mut [Label]| begin_smooth(field, labels, first, iterations);
        solve(
            &image,
            &mut known,
            coarser.as_ref(),
            &mut models,
            effort,
            &table,
            begin,
        )?;
        coarser = Some((known, size(&image)));
    }
    let begin =
        |field: &LabField, labels: &mut [Label]| begin_smooth(field, labels, first, iterations);
    solve(
        image,
        labels,
        coarser.as_ref(),
        &mut models,
        effort,
        &table,
        begin,
    )
}

fn solve(
    image: &RgbImage,
    labels: &mut [Label],
    coarser: Option<&(Vec<Label>, (usize, usize))>,
    models: &mut Option<Models<3>>,
    effort: Effort,
    table: &LabTable,
    begin: impl FnOnce(&LabField, &mut [Label]) -> Result<Models<3>, MaskError>,
) -> Result<(), MaskError> {
    match (coarser, models.as_mut()) {
        (Some((coarse, coarse_size)), Some(_)) if pixels(image) > effort.finest_px() => {
            grow(labels, size(image), coarse, *coarse_size);
        }
        (Some((coarse, coarse_size)), Some(models)) => {
            let field = RgbField { image, table };
            refine(&field, labels, coarse, *coarse_size, models);
        }
        _ => *models = Some(begin(&LabField::new(image, table), labels)?),
    }
    Ok(())
}

/// Cuts at the coarsest size. A cut that finds one side alone, because an outline costs more than what the colours gain,
/// is made again with half the smoothness.
fn begin_smooth(
    field: &LabField,
    labels: &mut [Label],
    first: FirstModels,
    iterations: Iterations,
) -> Result<Models<3>, MaskError> {
    let known = labels.to_vec();
    let mut smoothness = SMOOTHNESS;
    loop {
        let cut = start(field, labels, first, iterations, smoothness);
        match cut {
            Err(MaskError::Empty | MaskError::Everything) if smoothness > LEAST_SMOOTHNESS => {
                labels.copy_from_slice(&known);
                smoothness /= 2.0;
            }
            cut => return cut,
        }
    }
}

/// Cuts at the coarsest size.
pub(super) fn start<const D: usize>(
    field: &impl Field<D>,
    labels: &mut [Label],
    first: FirstModels,
    iterations: Iterations,
    smoothness: f32,
) -> Result<Models<D>, MaskError> {
    let models = match first {
        FirstModels::Ranked(share) => {
            grab_cut::rank(field, labels, share, |_| false);
            None
        }
        FirstModels::Sure => Some(Models::learn(field, labels, Label::is_sure)),
        FirstModels::All => None,
    };
    grab_cut::iterate(field, labels, models, iterations.get(), smoothness)
}

/// Decides a band along the coarse result's edge; elsewhere the coarse result stays.
pub(super) fn refine<const D: usize>(
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
    OpenCut::new(field, scale, SMOOTHNESS, labels, &band).decide(field, models, labels);
}

/// Each pixel that is not sure takes the coarse result.
pub(super) fn grow(
    labels: &mut [Label],
    size: (usize, usize),
    coarse: &[Label],
    coarse_size: (usize, usize),
) {
    for (at, label) in labels.iter_mut().enumerate() {
        if !label.is_sure() {
            let (x, y) = (at % size.0 / 2, at / size.0 / 2);
            let from = y.min(coarse_size.1 - 1) * coarse_size.0 + x.min(coarse_size.0 - 1);
            *label = Label::probably(coarse[from].is_object());
        }
    }
}

/// The pixels that are not sure within `radius` of the edge between the labels, in order.
pub(super) fn band(labels: &[Label], size: (usize, usize), radius: usize) -> Vec<u32> {
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

fn size(image: &RgbImage) -> (usize, usize) {
    (image.width() as usize, image.height() as usize)
}

fn pixels(image: &RgbImage) -> usize {
    size(image).0 * size(image).1
}

/// Half the image: each pixel is the average of 2 x 2; the last column and row of an odd side are doubled.
#[must_use]
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
pub(super) fn half_labels(labels: &[Label], (width, height): (usize, usize)) -> Vec<Label> {
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

/// A small image, its colours converted once.
pub(super) struct LabField {
    size: (usize, usize),
    lab: Vec<[f32; 3]>,
}

impl LabField {
    pub(super) fn new(image: &RgbImage, table: &LabTable) -> Self {
        Self {
            size: size(image),
            lab: image.pixels().map(|pixel| table.lab(pixel.0)).collect(),
        }
    }
}

impl Field<3> for LabField {
    const VARIANCE_FLOOR: f64 = COLOUR_VARIANCE;

    fn size(&self) -> (usize, usize) {
        self.size
    }

    fn feature(&self, at: usize) -> [f32; 3] {
        self.lab[at]
    }

    fn contrast(&self, a: usize, b: usize) -> f32 {
        squared_distance(&self.lab[a], &self.lab[b])
    }
}

/// A large image, of which few pixels are needed.
pub(super) struct RgbField<'a> {
    pub(super) image: &'a RgbImage,
    pub(super) table: &'a LabTable,
}

impl Field<3> for RgbField<'_> {
    const VARIANCE_FLOOR: f64 = COLOUR_VARIANCE;

    fn size(&self) -> (usize, usize) {
        size(self.image)
    }

    fn feature(&self, at: usize) -> [f32; 3] {
        let bytes = self.image.as_raw();
        self.table
            .lab([bytes[3 * at], bytes[3 * at + 1], bytes[3 * at + 2]])
    }

    fn contrast(&self, a: usize, b: usize) -> f32 {
        squared_distance(&self.feature(a), &self.feature(b))
    }
}

fn squared_distance(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}
