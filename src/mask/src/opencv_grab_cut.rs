//! OpenCV's GrabCut as it is: a reference.

use image::{GrayImage, RgbImage};
use opencv::core::{self, Mat, Vec3b};
use opencv::imgproc;
use relit_grabcut::{Hints, ITERATIONS, Mark};

use super::MaskingError;

/// Seed of OpenCV's random numbers, from which GrabCut draws its first clusters; any fixed number.
const RNG_SEED: i32 = 1;

/// The version of the OpenCV that is linked.
pub(super) fn opencv_version() -> Option<String> {
    core::get_version_string().ok()
}

/// The mask that OpenCV's `grabCut` makes of the same painted hints, which fit the image, without any clean-up: 255
/// object, 0 background. With a rectangle, what is outside is background; without one, unmarked pixels start as
/// probable background.
///
/// # Errors
/// [`MaskingError::OpenCv`].
pub(super) fn opencv_grab_cut(image: &RgbImage, hints: &Hints) -> Result<GrayImage, MaskingError> {
    let (width, height) = image.dimensions();
    let mut labels = initial(hints, (width, height));
    let pixels: Vec<Vec3b> = image
        .pixels()
        .map(|pixel| Vec3b::from([pixel.0[2], pixel.0[1], pixel.0[0]]))
        .collect();
    run(&pixels, (width, height), &mut labels)
        .map_err(|error| MaskingError::OpenCv(Box::new(error)))?;
    let is_object =
        |label: u8| i32::from(label) == imgproc::GC_FGD || i32::from(label) == imgproc::GC_PR_FGD;
    let levels = labels
        .into_iter()
        .map(|label| if is_object(label) { 255 } else { 0 });
    Ok(GrayImage::from_raw(width, height, levels.collect()).unwrap_or_default())
}

fn initial(hints: &Hints, size: (u32, u32)) -> Vec<u8> {
    let (marks, rect) = (hints.marks(), hints.rect);
    let label = |at: usize| match (marks.get(at), rect) {
        (Some(Mark::Object), _) => imgproc::GC_FGD,
        (Some(Mark::Background), _) => imgproc::GC_BGD,
        (_, Some(rect)) if rect.contains(at, size.0) => imgproc::GC_PR_FGD,
        (_, Some(_)) => imgproc::GC_BGD,
        (_, None) => imgproc::GC_PR_BGD,
    };
    let pixels = size.0 as usize * size.1 as usize;
    (0..pixels).map(|at| label(at) as u8).collect()
}

fn run(pixels: &[Vec3b], (width, height): (u32, u32), labels: &mut [u8]) -> opencv::Result<()> {
    core::set_rng_seed(RNG_SEED)?;
    let (rows, columns) = (height as i32, width as i32);
    let picture = Mat::new_rows_cols_with_data(rows, columns, pixels)?;
    let mut map = Mat::new_rows_cols_with_data_mut(rows, columns, labels)?;
    let (mut background, mut object) = (Mat::default(), Mat::default());
    imgproc::grab_cut(
        &picture,
        &mut map,
        core::Rect::default(),
        &mut background,
        &mut object,
        ITERATIONS as i32,
        imgproc::GC_INIT_WITH_MASK,
    )
}
