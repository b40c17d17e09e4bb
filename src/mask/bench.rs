//! Masks of a folder of images with ground truth, ours and those of OpenCV's GrabCut, measured in one run.
//!
//! The folder has the form of the GrabCut data set: for an image `NAME.jpg` (or .png, .bmp), the ground truth
//! `NAME.gt.png` (0 background, 255 object, 128 does not count), and as hints `NAME.box.txt` with the
//! numbers `x1 y1 x2 y2`, corners included, or `NAME.scribble.png` (black unknown, red background, any light
//! colour object), or both. Rectangles can also be made from the ground truth, as people draw them: [`BoxKind`].

use std::fs;
use std::path::{Path, PathBuf};

use image::{GrayImage, Luma, RgbImage};
use relit_data::file_names::is_hidden;
use relit_data::geometry::Rect;
use relit_data::text;
use relit_grabcut::{
    Effort, Hints, Iterations, MaskError, MaskScore, Seeds, SegmentSettings, StartRule, score,
    segment_with, start_cuts,
};

use super::{MaskEngine, MaskingError, opencv_grab_cut};

/// Endings of the images.
const IMAGES: [&str; 4] = ["jpg", "jpeg", "png", "bmp"];
/// A channel of a scribble is set from this level on.
const SET_FROM: u8 = 100;

/// Background on each side of a [`BoxKind::Tight`] box, pixels.
const TIGHT_PX: i32 = 2;
/// Background on each side of a [`BoxKind::Loose`] box, of the object's longer side.
const LOOSE: f64 = 0.12;
/// What a [`BoxKind::Cut`] box leaves out of the object, of its width.
const CUT: f64 = 0.1;

/// A rectangle that is made from the ground truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoxKind {
    /// 2 pixels around the object.
    Tight,
    /// 12 % of the object's longer side around it.
    Loose,
    /// 2 pixels around the object, but for its left tenth, which is outside.
    Cut,
}

/// The kind of the hint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Prompt {
    /// `NAME.box.txt`.
    Box,
    /// A rectangle made from the ground truth.
    Made(BoxKind),
    /// `NAME.scribble.png`.
    Scribble,
}

impl Prompt {
    /// "box", "tight", "loose", "cut" or "scribble".
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Made(BoxKind::Tight) => "tight",
            Self::Made(BoxKind::Loose) => "loose",
            Self::Made(BoxKind::Cut) => "cut",
            Self::Scribble => "scribble",
        }
    }
}

/// What is measured beside our mask.
#[derive(Debug, Clone, Default)]
pub struct BenchOptions {
    /// Rectangles that are made from the ground truth; they replace `NAME.box.txt`.
    pub boxes: Vec<BoxKind>,
    /// Also our mask, cut at the image's own size.
    pub whole: bool,
    /// Also our masks by these rules, from rectangles.
    pub rules: Vec<StartRule>,
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
    /// Our masks by the rules that were asked for; empty with scribbles, to which they do not apply.
    pub by_rule: Vec<MaskScore>,
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
            && !is_hidden(&path)
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

/// Measures our mask, and OpenCV's if it is built in, on one image, for each hint that it has.
///
/// # Errors
/// [`MaskingError::Io`], [`MaskingError::Bench`] for a file that cannot be used, or the error of segmenting.
pub fn bench_image(
    entry: &BenchImage,
    options: &BenchOptions,
) -> Result<Vec<BenchRow>, MaskingError> {
    let image = open(&entry.path)?.into_rgb8();
    let truth_path = entry.beside("gt.png");
    let truth = open(&truth_path)?.into_luma8();
    let mut rows = Vec::new();
    for (prompt, hints, region) in entry.hints(&truth, options)? {
        let measure = |mask: &GrayImage| {
            score(mask, &truth, region).map_err(|fault| bench_error(&truth_path, fault.to_string()))
        };
        let by_rule = match prompt {
            Prompt::Scribble => Vec::new(),
            _ => by_rules(&image, &hints, &options.rules)?,
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
            whole: match options.whole {
                true => Some(measure(&ours(&image, &hints, Effort::Whole)?)?),
                false => None,
            },
            by_rule: by_rule.iter().map(measure).collect::<Result<_, _>>()?,
        });
    }
    Ok(rows)
}

/// The masks that the rules choose, from the cuts of all their starts.
fn by_rules(
    image: &RgbImage,
    hints: &Hints,
    rules: &[StartRule],
) -> Result<Vec<GrayImage>, MaskingError> {
    let mut shares: Vec<f64> = Vec::new();
    for share in rules.iter().flat_map(|rule| rule.shares) {
        if !shares.contains(share) {
            shares.push(*share);
        }
    }
    let nothing = || GrayImage::new(image.width(), image.height());
    match start_cuts(image, hints, &SegmentSettings::default(), &shares) {
        Ok(cuts) => Ok(rules
            .iter()
            .map(|&rule| {
                cuts.by(rule)
                    .map_or_else(nothing, |mask| mask.image().clone())
            })
            .collect()),
        Err(MaskError::Empty) => Ok(rules.iter().map(|_| nothing()).collect()),
        Err(error) => Err(error.into()),
    }
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

    /// The hints, and the region in which errors count.
    fn hints(
        &self,
        truth: &GrayImage,
        options: &BenchOptions,
    ) -> Result<Vec<(Prompt, Hints, Option<Rect>)>, MaskingError> {
        let given = self.rect()?;
        let mut hints = Vec::new();
        let object = object_bounds(truth).filter(|_| !options.boxes.is_empty());
        for &kind in &options.boxes {
            let Some(object) = object else { continue };
            if let Some(rect) = made_box(object, kind, truth.dimensions()) {
                let region = Some(around_both(rect, object));
                hints.push((Prompt::Made(kind), Hints::Rect(rect), region));
            }
        }
        if let (Some(rect), true) = (given, options.boxes.is_empty()) {
            hints.push((Prompt::Box, Hints::Rect(rect), given));
        }
        if let Some(seeds) = self.seeds()? {
            hints.push((Prompt::Scribble, Hints::Seeds(seeds), given));
        }
        Ok(hints)
    }

    fn rect(&self) -> Result<Option<Rect>, MaskingError> {
        let path = self.beside("box.txt");
        if !path.is_file() {
            return Ok(None);
        }
        let text = text::read(&path).map_err(MaskingError::io(&path, "read"))?;
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

/// The smallest rectangle around the pixels of the object, and those of which the ground truth is not sure.
fn object_bounds(truth: &GrayImage) -> Option<Rect> {
    let object = truth
        .enumerate_pixels()
        .filter(|(_, _, level)| level.0[0] >= 128);
    let (mut low, mut high) = ([u32::MAX; 2], [0; 2]);
    for (x, y, _) in object {
        low = [low[0].min(x), low[1].min(y)];
        high = [high[0].max(x), high[1].max(y)];
    }
    let is_there = low[0] <= high[0];
    is_there.then(|| {
        let (w, h) = (high[0] - low[0] + 1, high[1] - low[1] + 1);
        Rect::new(low[0] as i32, low[1] as i32, w, h)
    })
}

/// A rectangle as a person would draw it; none where it would hold all of the image, which says nothing.
fn made_box(object: Rect, kind: BoxKind, (width, height): (u32, u32)) -> Option<Rect> {
    let around = match kind {
        BoxKind::Tight | BoxKind::Cut => TIGHT_PX,
        BoxKind::Loose => (f64::from(object.w.max(object.h)) * LOOSE) as i32,
    };
    let grow = 2 * around.unsigned_abs();
    let mut rect = Rect::new(
        object.x.saturating_sub(around),
        object.y.saturating_sub(around),
        object.w.saturating_add(grow),
        object.h.saturating_add(grow),
    );
    if kind == BoxKind::Cut {
        let left_out = around + (f64::from(object.w) * CUT) as i32;
        rect.x = rect.x.saturating_add(left_out);
        rect.w = rect.w.saturating_sub(left_out.unsigned_abs());
    }
    let rect = rect.clipped_to(width, height)?;
    ((rect.w, rect.h) != (width, height)).then_some(rect)
}

fn around_both(a: Rect, b: Rect) -> Rect {
    let (x, y) = (a.x.min(b.x), a.y.min(b.y));
    let side = |end: i64, begin: i32| (end - i64::from(begin)).unsigned_abs() as u32;
    let (right, bottom) = (a.right().max(b.right()), a.bottom().max(b.bottom()));
    Rect::new(x, y, side(right, x), side(bottom, y))
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
