//! Masks of a folder of images with ground truth, ours and those of OpenCV's GrabCut, measured in one run.
//!
//! The folder has the form of the GrabCut data set: for an image `NAME.jpg` (or .png, .bmp), the ground truth
//! `NAME.gt.png` (0 background, 255 object, 128 does not count), and as hints `NAME.box.txt` with the
//! numbers `x1 y1 x2 y2`, corners included, or `NAME.scribble.png` (black unknown, red background, any light
//! colour object), or both.

use std::fs;
use std::path::{Path, PathBuf};

use image::{GrayImage, Luma, RgbImage};
use relit_data::geometry::Rect;
use relit_grabcut::{
    Effort, Hints, Iterations, MaskError, MaskScore, Seeds, SegmentSettings, score, segment_with,
};

use super::{MaskEngine, MaskingError, opencv_grab_cut};

/// Endings of the images.
const IMAGES: [&str; 4] = ["jpg", "jpeg", "png", "bmp"];
/// A channel of a scribble is set from this level on.
const SET_FROM: u8 = 100;

/// The kind of the hint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Prompt {
    /// `NAME.box.txt`.
    Box,
    /// `NAME.scribble.png`.
    Scribble,
}

impl Prompt {
    /// "box" or "scribble".
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Scribble => "scribble",
        }
    }
}

/// The figures of one image with one hint.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct BenchRow {
    /// The image's name, without folder and ending.
    pub image: String,
    /// The hint.
    pub prompt: Prompt,
    /// Our mask.
    pub ours: MaskScore,
    /// The mask of OpenCV's GrabCut after 5 iterations, if it is built in.
    pub opencv: Option<MaskScore>,
    /// Our mask, cut at the image's own size instead of coarse to fine; if it was asked for.
    pub whole: Option<MaskScore>,
}

/// One image of the folder.
#[derive(Debug)]
pub struct BenchImage {
    name: String,
    path: PathBuf,
}

/// The images of a folder that have a ground truth, in the order of their names.
///
/// # Errors
/// [`MaskingError::Io`]; [`MaskingError::Bench`] if there is none.
pub fn bench_images(folder: &Path) -> Result<Vec<BenchImage>, MaskingError> {
    let entries = fs::read_dir(folder).map_err(MaskingError::io(folder, "read"))?;
    let mut images = Vec::new();
    for entry in entries {
        let path = entry.map_err(MaskingError::io(folder, "read"))?.path();
        let stem = path.file_stem().and_then(|stem| stem.to_str());
        let ending = path.extension().and_then(|ending| ending.to_str());
        if let (Some(name), Some(ending)) = (stem, ending)
            && IMAGES.contains(&ending.to_ascii_lowercase().as_str())
            && path.with_file_name(format!("{name}.gt.png")).is_file()
        {
            let name = name.to_owned();
            images.push(BenchImage { name, path });
        }
    }
    images.sort_by(|a, b| a.name.cmp(&b.name));
    if images.is_empty() {
        let why =
            "it holds no image with its ground truth, as in mug.jpg and mug.gt.png".to_owned();
        return Err(bench_error(folder, why));
    }
    Ok(images)
}

/// Measures our mask, and OpenCV's if it is built in, on one image, for each hint that it has; with `whole` also ours cut at
/// the image's own size.
///
/// # Errors
/// [`MaskingError::Io`], [`MaskingError::Bench`] for a file that cannot be used, or the error of segmenting.
pub fn bench_image(entry: &BenchImage, whole: bool) -> Result<Vec<BenchRow>, MaskingError> {
    let image = open(&entry.path)?.into_rgb8();
    let truth_path = entry.beside("gt.png");
    let truth = open(&truth_path)?.into_luma8();
    let rect = entry.rect()?;
    let mut rows = Vec::new();
    for (prompt, hints) in [
        (Prompt::Box, rect.map(Hints::Rect)),
        (Prompt::Scribble, entry.seeds()?.map(Hints::Seeds)),
    ] {
        let Some(hints) = hints else { continue };
        let measure = |mask: &GrayImage| {
            score(mask, &truth, rect).map_err(|fault| bench_error(&truth_path, fault.to_string()))
        };
        rows.push(BenchRow {
            image: entry.name.clone(),
            prompt,
            ours: measure(&ours(&image, &hints, Effort::Fine)?)?,
            opencv: match MaskEngine::OpenCv.is_built_in() {
                true => {
                    let cut = opencv_grab_cut(&image, &hints, Iterations::default())?;
                    Some(measure(&cut)?)
                }
                false => None,
            },
            whole: match whole {
                true => Some(measure(&ours(&image, &hints, Effort::Whole)?)?),
                false => None,
            },
        });
    }
    Ok(rows)
}

/// A hint for which there is no mask leaves everything background.
fn ours(image: &RgbImage, hints: &Hints, effort: Effort) -> Result<GrayImage, MaskingError> {
    match segment_with(
        image,
        None,
        Some(hints),
        &SegmentSettings::default(),
        effort,
    ) {
        Ok(mask) => Ok(mask.image().clone()),
        Err(MaskError::Empty) => Ok(GrayImage::new(image.width(), image.height())),
        Err(error) => Err(error.into()),
    }
}

impl BenchImage {
    fn beside(&self, ending: &str) -> PathBuf {
        self.path.with_file_name(format!("{}.{ending}", self.name))
    }

    fn rect(&self) -> Result<Option<Rect>, MaskingError> {
        let path = self.beside("box.txt");
        if !path.is_file() {
            return Ok(None);
        }
        let text = fs::read_to_string(&path).map_err(MaskingError::io(&path, "read"))?;
        let numbers: Result<Vec<i32>, _> = text.split_whitespace().map(str::parse).collect();
        match numbers.as_deref() {
            Ok(&[left, top, right, bottom]) if right >= left && bottom >= top => {
                let (w, h) = (right.abs_diff(left), bottom.abs_diff(top));
                let (w, h) = (w.saturating_add(1), h.saturating_add(1));
                Ok(Some(Rect::new(left, top, w, h)))
            }
            _ => Err(bench_error(
                &path,
                "it does not hold the four numbers x1 y1 x2 y2 of a box".to_owned(),
            )),
        }
    }

    fn seeds(&self) -> Result<Option<Seeds>, MaskingError> {
        let path = self.beside("scribble.png");
        if !path.is_file() {
            return Ok(None);
        }
        let painted = open(&path)?.into_rgb8();
        let mark = |[red, green, _]: [u8; 3]| match (red >= SET_FROM, green >= SET_FROM) {
            (_, true) => 255,
            (true, false) => 0,
            (false, false) => 128,
        };
        let marks = GrayImage::from_fn(painted.width(), painted.height(), |x, y| {
            Luma([mark(painted.get_pixel(x, y).0)])
        });
        let seeds = Seeds::from_image(&marks.into());
        seeds
            .map(Some)
            .map_err(|fault| bench_error(&path, fault.to_string()))
    }
}

fn open(path: &Path) -> Result<image::DynamicImage, MaskingError> {
    image::open(path).map_err(|error| bench_error(path, error.to_string()))
}

fn bench_error(path: &Path, why: String) -> MaskingError {
    MaskingError::Bench {
        path: path.to_owned(),
        why,
    }
}
