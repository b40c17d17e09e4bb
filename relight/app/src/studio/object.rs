//! An object of the page: its file, its mask, and its results.

use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, GrayImage, ImageEncoder, RgbImage};
use relight_core::captured_object::CapturedObject;
use relight_core::image::{ColourImage, DownscaledFile, Extent, ImageError};
use relight_photo::compositing::{ObjectDescription, SceneEnvironment};
use relight_photo::decompose::{
    DecomposeError, DecomposeOptions, Decomposer, Decomposition, Photo, PhotoHints, UsableImage,
    stated_extent,
};
use relight_photo::relighting::RelightableObject;
use relit_data::geometry::Rect;
use relit_grabcut::{
    Effort, Hints, Mask, SegmentSettings, Stroke, Strokes, segment, segment_on_plain,
};

use super::error::{StudioError, refused};
use super::pixels::{levels, on_screen, opaque, shown, stored, without_alpha};

/// Larger photographs are made smaller: the page keeps several, on a phone.
pub(super) const MAX_PIXELS: usize = 2_000_000;
/// Photographs that would take too much memory while they are decoded.
const MAX_READ: usize = 100_000_000;
/// How errors name the mask of a photograph.
const MASK: &str = "mask.png";
/// The height of an object in the preview, while the scene is edited, pixels.
const PREVIEW_ROWS: usize = 320;
/// The most that the longest side of its photograph has then.
const PREVIEW_SIDE: usize = 1024;

/// An object.
pub(super) struct StudioObject {
    /// The name of its file.
    pub(super) name: String,
    /// The file, as it is kept with a scene.
    pub(super) file: Vec<u8>,
    /// Whether the photograph was larger.
    pub(super) downscaled: bool,
    content: Content,
}

enum Content {
    Photo(Box<Cut>),
    Captured(Box<(CapturedObject, RelightableObject)>),
}

/// A photograph, as far as it is cut out.
struct Cut {
    /// As a screen shows it, and as GrabCut sees it.
    shown: RgbImage,
    /// The user's mask; without one, the file's own, if it has one.
    mask: Option<GrayImage>,
    /// The photograph with its mask.
    photo: Option<Photo>,
    /// The object in the size in which the scene is worked on.
    preview: Option<RelightableObject>,
}

impl StudioObject {
    /// What a person may want to know of its file and its mask, as clauses.
    pub(super) fn notes(&self) -> &[String] {
        match &self.content {
            Content::Photo(cut) => cut.photo.as_ref().map_or(&[], |photo| &photo.notes),
            Content::Captured(_) => &[],
        }
    }

    /// Opens a file.
    ///
    /// # Errors
    /// If it is neither a photograph nor a captured object, or is too large.
    pub(super) fn open(name: &str, bytes: Vec<u8>) -> Result<Self, StudioError> {
        if is_captured(name) {
            let captured = CapturedObject::from_bytes(&bytes)?;
            let relightable = RelightableObject::from_captured(&captured)?;
            return Ok(Self {
                name: name.to_owned(),
                file: bytes,
                downscaled: false,
                content: Content::Captured(Box::new((captured, relightable))),
            });
        }
        let opened = OpenedFile::read(name, bytes)?;
        let mut object = Self {
            name: opened.name,
            file: opened.bytes,
            downscaled: opened.downscaled,
            content: Content::Photo(Box::new(Cut {
                shown: on_screen(&UsableImage::new(opened.image).image),
                mask: None,
                photo: None,
                preview: None,
            })),
        };
        // A photograph may show by itself where its object is.
        object.read_photo()?;
        Ok(object)
    }

    /// A photograph that a browser has decoded.
    ///
    /// # Errors
    /// If the pixels are not as many as they should be.
    pub(super) fn from_pixels(
        name: &str,
        size: [u32; 2],
        rgba: &[u8],
    ) -> Result<Self, StudioError> {
        Self::open(&format!("{}.png", stem(name)), png_of(name, size, rgba)?)
    }

    /// Its source: a photograph, which is decomposed, or measured maps.
    pub(super) const fn kind(&self) -> &'static str {
        match self.content {
            Content::Photo(_) => "photo",
            Content::Captured(_) => "captured",
        }
    }

    /// Its picture for the page, with its size.
    pub(super) fn picture(&self) -> (Extent, Vec<u8>) {
        match &self.content {
            Content::Photo(cut) => {
                let (width, height) = cut.shown.dimensions();
                let extent = Extent::new(width as usize, height as usize);
                (extent, opaque(&cut.shown))
            }
            Content::Captured(object) => {
                let albedo = object.0.surface().albedo();
                (object.0.extent(), shown(albedo))
            }
        }
    }

    /// Its mask for the page; `None` until the object is marked or found.
    pub(super) fn mask(&self) -> Option<Vec<u8>> {
        match &self.content {
            Content::Photo(cut) => {
                let photo = cut.photo.as_ref()?;
                Some(levels(&photo.mask))
            }
            Content::Captured(object) => Some(levels(object.0.alpha())),
        }
    }

    /// The mask that a person made, as a file that is kept with the photograph.
    pub(super) fn mask_file(&self) -> Option<&GrayImage> {
        match &self.content {
            Content::Photo(cut) => cut.mask.as_ref(),
            Content::Captured(_) => None,
        }
    }

    /// Cuts the object out by hints; with `auto` and without a rectangle by its plain background.
    ///
    /// # Errors
    /// If the hints do not fit, the background is not plain, or nothing is left.
    pub(super) fn cut_out(
        &mut self,
        rect: Option<[i32; 4]>,
        auto: bool,
        strokes: Vec<Stroke>,
    ) -> Result<Mask, StudioError> {
        let Content::Photo(cut) = &mut self.content else {
            return refused(captured(&self.name));
        };
        let rect = rect.map(|[x, y, width, height]| {
            Rect::new(x, y, width.max(0) as u32, height.max(0) as u32)
        });
        let strokes = Strokes::new(strokes)?;
        let settings = SegmentSettings::default();
        let mask = if auto && rect.is_none() {
            segment_on_plain(&cut.shown, &strokes, &settings, Effort::Fine)?.mask
        } else {
            let hints = Hints {
                rect,
                seeds: None,
                strokes,
            };
            segment(&cut.shown, &hints, &settings)?
        };
        cut.mask = Some(mask.image.clone());
        (cut.photo, cut.preview) = (None, None);
        Ok(mask)
    }

    /// Reads the photograph with its mask, if it has one, as `relight` reads its files.
    fn read_photo(&mut self) -> Result<(), StudioError> {
        let Content::Photo(cut) = &mut self.content else {
            return Ok(());
        };
        if cut.photo.is_some() {
            return Ok(());
        }
        let mask = cut.mask.as_ref().map(stored).transpose()?;
        let hints = PhotoHints {
            mask: mask.as_ref().map(|mask| (Path::new(MASK), mask)),
            transfer: None,
            rectangle: None,
        };
        match Photo::from_bytes(Path::new(&self.name), &self.file, &hints) {
            Ok(photo) => cut.photo = Some(photo),
            Err(DecomposeError::NoMask { .. } | DecomposeError::Black { .. }) => {}
            Err(fault) => return Err(fault.into()),
        }
        Ok(())
    }

    fn photo(&mut self) -> Result<&Photo, StudioError> {
        self.read_photo()?;
        let name = &self.name;
        match &self.content {
            Content::Captured(_) => refused(captured(name)),
            Content::Photo(cut) => cut.photo.as_ref().ok_or_else(|| {
                StudioError(format!(
                    "{name}: mark the object first, by a rectangle or strokes"
                ))
            }),
        }
    }

    /// The decomposed photograph; `None` for a captured object.
    ///
    /// # Errors
    /// If it is not cut out yet, or cannot be decomposed.
    pub(super) fn decomposed(
        &mut self,
        decomposer: &Decomposer,
    ) -> Result<Decomposition, StudioError> {
        let photo = self.photo()?.clone().at_most(PREVIEW_SIDE);
        let options = photo.options(&DecomposeOptions::default());
        Ok(decomposer.decompose(&photo.picture, &photo.mask, &options)?)
    }

    /// Makes the object ready to be shown while the scene is worked on.
    ///
    /// # Errors
    /// If it is not cut out yet, or cannot be decomposed.
    pub(super) fn prepare(&mut self, decomposer: &Decomposer) -> Result<(), StudioError> {
        if self.prepared().is_some() {
            return Ok(());
        }
        let photo = self.photo()?;
        let width = photo.mask.extent().width.max(1);
        let lines = photo.mask.plane(0).chunks_exact(width);
        let rows = lines.filter(|line| line.contains(&1.0)).count().max(1);
        let longest = width.max(photo.mask.extent().height);
        let longest = (longest * PREVIEW_ROWS / rows).min(PREVIEW_SIDE);
        let photo = photo.clone().at_most(longest.max(PREVIEW_ROWS));
        let relightable =
            RelightableObject::from_photo(&photo, decomposer, &DecomposeOptions::default())?;
        if let Content::Photo(cut) = &mut self.content {
            cut.preview = Some(relightable);
        }
        Ok(())
    }

    /// The object as it is shown while the scene is worked on, after [`StudioObject::prepare`].
    pub(super) fn prepared(&self) -> Option<&RelightableObject> {
        match &self.content {
            Content::Photo(cut) => cut.preview.as_ref(),
            Content::Captured(object) => Some(&object.1),
        }
    }

    /// The object as `relight insert` puts it into a scene.
    ///
    /// # Errors
    /// If it is not cut out yet, or cannot be decomposed.
    pub(super) fn relightable(
        &mut self,
        environment: &SceneEnvironment,
        described: &ObjectDescription,
        decomposer: &Decomposer,
    ) -> Result<RelightableObject, StudioError> {
        if let Content::Captured(object) = &self.content {
            return Ok(object.1.clone());
        }
        let photo = environment.downscaled(described, self.photo()?.clone());
        let options = DecomposeOptions::default();
        Ok(RelightableObject::from_photo(&photo, decomposer, &options)?)
    }
}

/// A photograph's file, no larger than the page works on.
pub(super) struct OpenedFile {
    pub(super) name: String,
    pub(super) bytes: Vec<u8>,
    pub(super) image: ColourImage,
    pub(super) downscaled: bool,
}

impl OpenedFile {
    /// Decodes a file, reduced if it is too large.
    ///
    /// # Errors
    /// If it cannot be read as a picture.
    pub(super) fn read(name: &str, bytes: Vec<u8>) -> Result<Self, StudioError> {
        let path = Path::new(name);
        let extent = stated_extent(&bytes);
        let has_at_most = |most: usize| {
            extent.is_some_and(|Extent { width, height }| width.saturating_mul(height) <= most)
        };
        if let Some(Extent { width, height }) = extent
            && !has_at_most(MAX_READ)
        {
            return refused(format!(
                "{name} has {width} x {height} pixels: the limit is {} million",
                MAX_READ / 1_000_000
            ));
        }
        // What says that it is small is not decoded to see whether it is.
        let smaller = if has_at_most(MAX_PIXELS) {
            None
        } else {
            DownscaledFile::new(path, &bytes, MAX_PIXELS, None)?
        };
        let downscaled = smaller.is_some();
        let (name, bytes) = match smaller {
            Some(smaller) => (format!("{}.{}", stem(name), smaller.ending), smaller.bytes),
            None => (name.to_owned(), bytes),
        };
        Ok(Self {
            image: ColourImage::from_bytes(Path::new(&name), &bytes, None)?,
            name,
            bytes,
            downscaled,
        })
    }
}

/// The pixels that a browser has decoded, in a PNG.
///
/// # Errors
/// If they are not as many as they should be.
pub(super) fn png_of(
    name: &str,
    [width, height]: [u32; 2],
    rgba: &[u8],
) -> Result<Vec<u8>, StudioError> {
    if rgba.len() as u64 != 4 * u64::from(width) * u64::from(height) || rgba.is_empty() {
        return refused("the request has no pixels of its size");
    }
    let (colours, has_alpha) = without_alpha(rgba);
    let (pixels, kind) = if has_alpha {
        (rgba, ExtendedColorType::Rgba8)
    } else {
        (&colours[..], ExtendedColorType::Rgb8)
    };
    let mut file = Vec::new();
    PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Adaptive)
        .write_image(pixels, width, height, kind)
        .map_err(ImageError::encode(Path::new(name)))?;
    Ok(file)
}

fn captured(name: &str) -> String {
    format!("{name} is a captured object: it has its own mask")
}

/// Whether a file is called as a captured object.
fn is_captured(name: &str) -> bool {
    name.rsplit_once('.')
        .is_some_and(|(_, ending)| ending.eq_ignore_ascii_case("relit"))
}

/// A file's name without its ending.
pub(super) fn stem(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}
