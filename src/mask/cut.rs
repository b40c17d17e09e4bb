//! OpenCV's GrabCut: from hints to initial labels, and from these to object and background.

use image::RgbImage;
use opencv::core::{self, Mat, Vec3b};
use opencv::imgproc;
use relit_data::geometry::Rect;

use super::bitmap::Bitmap;
use super::{Hints, Iterations, Mark, MaskError};

/// Seed of OpenCV's random numbers, from which GrabCut draws its first clusters; any fixed number.
const RNG_SEED: i32 = 1;

/// GrabCut's labels, with OpenCV's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
enum Label {
    Background = imgproc::GC_BGD as u8,
    Object = imgproc::GC_FGD as u8,
    ProbablyBackground = imgproc::GC_PR_BGD as u8,
    ProbablyObject = imgproc::GC_PR_FGD as u8,
}

impl Label {
    const OBJECT: [u8; 2] = [Self::Object as u8, Self::ProbablyObject as u8];
}

/// The labels with which GrabCut starts.
#[derive(Debug)]
pub(super) struct InitialLabels {
    size: (u32, u32),
    labels: Vec<u8>,
    /// True if the first colour models are learned from the marks alone.
    learn_from_marks: bool,
    /// The part of the hinted rectangle that is inside the frame.
    pub(super) rect: Option<Rect>,
}

impl InitialLabels {
    /// The labels that the hints give to a frame of `size`.
    pub(super) fn new(hints: &Hints, size: (u32, u32)) -> Result<Self, MaskError> {
        let rect = hints.rect().map(|rect| clip(rect, size)).transpose()?;
        let seeds = hints.seeds();
        if let Some(seeds) = seeds.filter(|seeds| seeds.size() != size) {
            return Err(MaskError::SeedsSize {
                seeds: seeds.size(),
                frame: size,
            });
        }
        let marks = seeds.map_or(&[][..], |seeds| seeds.marks());
        let unmarked = |at: usize| match rect {
            None => Label::ProbablyBackground,
            Some(rect) if contains(rect, at, size.0) => Label::ProbablyObject,
            Some(_) => Label::Background,
        };
        let label = |at: usize| match marks.get(at) {
            Some(Mark::Object) => Label::Object,
            Some(Mark::Background) => Label::Background,
            Some(Mark::Unknown) | None => unmarked(at),
        };
        let pixels = size.0 as usize * size.1 as usize;
        let initial = Self {
            size,
            labels: (0..pixels).map(|at| label(at) as u8).collect(),
            learn_from_marks: rect.is_none() && marks.contains(&Mark::Background),
            rect,
        };
        initial.check(hints)?;
        Ok(initial)
    }

    fn check(&self, hints: &Hints) -> Result<(), MaskError> {
        let object = self.labels.iter().filter(|at| Label::OBJECT.contains(at));
        let object = object.count();
        if object == self.labels.len() {
            let (width, height) = self.size;
            return Err(MaskError::NoBackground { width, height });
        }
        match hints.rect() {
            Some(rect) if object == 0 => Err(MaskError::NoObject { rect }),
            _ => Ok(()),
        }
    }
}

fn clip(rect: Rect, (width, height): (u32, u32)) -> Result<Rect, MaskError> {
    let outside = MaskError::RectOutside {
        rect,
        width,
        height,
    };
    rect.clipped_to(width, height).ok_or(outside)
}

fn contains(rect: Rect, at: usize, width: u32) -> bool {
    let (x, y) = ((at % width as usize) as i64, (at / width as usize) as i64);
    (i64::from(rect.x)..rect.right()).contains(&x)
        && (i64::from(rect.y)..rect.bottom()).contains(&y)
}

/// Separates object from background in `frame`, which has the size of the labels. The same input gives
/// the same bits.
pub(super) fn cut(
    frame: &RgbImage,
    initial: InitialLabels,
    iterations: Iterations,
) -> Result<Bitmap, MaskError> {
    let InitialLabels {
        size,
        mut labels,
        learn_from_marks,
        ..
    } = initial;
    // BGR, the usual order in OpenCV, so that other programs get the same mask.
    let pixels: Vec<Vec3b> = frame
        .pixels()
        .map(|pixel| Vec3b::from([pixel.0[2], pixel.0[1], pixel.0[0]]))
        .collect();
    grab_cut(&pixels, size, &mut labels, learn_from_marks, iterations)
        .map_err(MaskError::opencv("cutting the object out"))??;
    let is_object = labels.iter().map(|label| Label::OBJECT.contains(label));
    Ok(Bitmap::new(size, is_object))
}

/// The outer error is OpenCV's, the inner one is a result with one side only.
fn grab_cut(
    pixels: &[Vec3b],
    size: (u32, u32),
    labels: &mut [u8],
    learn_from_marks: bool,
    iterations: Iterations,
) -> opencv::Result<Result<(), MaskError>> {
    core::set_rng_seed(RNG_SEED)?;
    let mut models = ColourModels::default();
    let mut mode = imgproc::GC_INIT_WITH_MASK;
    if learn_from_marks {
        models.learn_from_marks(pixels, labels)?;
        models.step(pixels, size, labels, imgproc::GC_EVAL_FREEZE_MODEL)?;
        mode = imgproc::GC_EVAL;
    }
    // One iteration at a time: OpenCV does not stop when one side has no pixels left.
    for _ in 0..iterations.get() {
        models.step(pixels, size, labels, mode)?;
        mode = imgproc::GC_EVAL;
        if let Err(one_sided) = both_sides(labels) {
            return Ok(Err(one_sided));
        }
    }
    Ok(Ok(()))
}

/// The colours of the two sides, which GrabCut keeps between its iterations.
#[derive(Default)]
struct ColourModels {
    background: Mat,
    object: Mat,
}

impl ColourModels {
    /// Learns from the marked pixels only. A few strokes leave nearly all pixels unmarked, and these
    /// would mix the colours of object and background.
    fn learn_from_marks(&mut self, pixels: &[Vec3b], labels: &[u8]) -> opencv::Result<()> {
        let sure = [Label::Background as u8, Label::Object as u8];
        let marked = pixels.iter().copied().zip(labels.iter().copied());
        let (row, mut marks): (Vec<Vec3b>, Vec<u8>) =
            marked.filter(|(_, label)| sure.contains(label)).unzip();
        let size = (row.len() as u32, 1);
        self.step(&row, size, &mut marks, imgproc::GC_INIT_WITH_MASK)
    }

    /// One iteration on an image of `size`.
    fn step(
        &mut self,
        pixels: &[Vec3b],
        (width, height): (u32, u32),
        labels: &mut [u8],
        mode: i32,
    ) -> opencv::Result<()> {
        let (rows, columns) = (height as i32, width as i32);
        let picture = Mat::new_rows_cols_with_data(rows, columns, pixels)?;
        let mut map = Mat::new_rows_cols_with_data_mut(rows, columns, labels)?;
        let (background, object) = (&mut self.background, &mut self.object);
        let nowhere = core::Rect::default();
        imgproc::grab_cut(&picture, &mut map, nowhere, background, object, 1, mode)
    }
}

fn both_sides(labels: &[u8]) -> Result<(), MaskError> {
    let is_object = |label: &u8| Label::OBJECT.contains(label);
    if !labels.iter().any(is_object) {
        return Err(MaskError::Empty);
    }
    if labels.iter().all(is_object) {
        return Err(MaskError::Everything);
    }
    Ok(())
}
