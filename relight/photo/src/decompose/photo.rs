//! A photograph with its mask, out of the content of its file.

use std::path::Path;

use super::decomposer::{DecomposeOptions, check_mask_size, check_size};
use super::error::DecomposeError;
use super::mask::{MaskSource, NoObject, before_black, cut_out_within, is_empty, mask_of_alpha};
use super::usable_image::UsableImage;
use relight_core::image::{ColourImage, Extent, Linear, Planes, Rgb, StoredImage, Transfer};
use relit_data::causes::with_causes;
use relit_data::geometry::Rect;
use relit_data::image_stats::SATURATED_VALUE;

/// A picture with its mask.
#[derive(Debug, Clone)]
pub struct Photo {
    /// Its name: the file's without ending.
    pub name: String,
    /// The light.
    pub picture: Rgb<Linear>,
    /// 1 on the object, else 0.
    pub mask: Planes<1>,
    /// What said so.
    pub mask_source: MaskSource,
    /// What the values of the file were multiplied with, so that 1 is white: 1 as a rule.
    pub scale: f32,
    /// What a person may want to know of the file and its mask, as clauses.
    pub notes: Vec<String>,
    /// The file's alpha, 0 to 1.
    pub alpha: Option<Planes<1>>,
    saturated_from: f32,
}

/// What is known about a photograph besides its file.
#[derive(Debug, Clone, Copy, Default)]
pub struct PhotoHints<'a> {
    /// A picture of the mask, and how errors name it.
    pub mask: Option<(&'a Path, &'a StoredImage)>,
    /// A rectangle around the object.
    pub rectangle: Option<Rect>,
    /// How integers are encoded, where the file is not to be asked.
    pub transfer: Option<Transfer>,
}

impl Photo {
    /// Decodes the content of a file, and finds its mask: that of `hints`, or its alpha, or the object that is cut out within
    /// the rectangle, or what is not black before a black background. Floating point values are made usable as by
    /// [`UsableImage`]. Errors name it as `path`, and its stem is the photograph's name.
    ///
    /// # Errors
    /// If it is not a picture, is too large or encoded in an unknown way, or does not show where the object is.
    pub fn from_bytes(
        path: &Path,
        bytes: &[u8],
        hints: &PhotoHints<'_>,
    ) -> Result<Self, DecomposeError> {
        if let Some(extent) = stated_extent(bytes) {
            check_size(extent)?;
        }
        let image = ColourImage::from_bytes(path, bytes, hints.transfer)?;
        if let Some((_, mask)) = hints.mask {
            let expected = image.stored().planes.extent();
            check_extent(mask.planes.extent(), expected, bytes)?;
        }
        Self::from_image(path, image, hints)
    }

    /// The same of a picture in memory, called `path`.
    ///
    /// # Errors
    /// If it is too large, or the object's place is unknown.
    pub fn from_image(
        path: &Path,
        image: ColourImage,
        hints: &PhotoHints<'_>,
    ) -> Result<Self, DecomposeError> {
        let extent = image.stored().planes.extent();
        check_size(extent)?;
        let UsableImage {
            image,
            scale,
            mut notes,
        } = UsableImage::new(image);
        let alpha = image.stored().alpha.clone();
        let (mask, mask_source) = match hints.mask {
            Some((path, mask)) => {
                check_mask_size(mask.planes.extent(), extent)?;
                let (mask, note) = mask.object_mask(path)?;
                notes.extend(note.map(|note| format!("the mask {note}")));
                (mask, MaskSource::File)
            }
            None => match (&alpha, hints.rectangle) {
                (Some(alpha), rectangle) => (mask_of_alpha(alpha, rectangle), MaskSource::Alpha),
                (None, Some(rectangle)) => {
                    let (mask, warnings) = cut_out_within(image.to_srgb().planes(), rectangle)
                        .map_err(|fault| {
                            DecomposeError::Photo(format!(
                                "no object can be cut out within the rectangle {rectangle}: {}",
                                with_causes(&fault)
                            ))
                        })?;
                    notes.extend(warnings);
                    (mask, MaskSource::Rectangle)
                }
                (None, None) => {
                    let mask = before_black(image.to_srgb().planes()).map_err(|why| {
                        let path = path.to_owned();
                        match why {
                            NoObject::Background => DecomposeError::NoMask { path },
                            NoObject::Black => DecomposeError::Black { path },
                        }
                    })?;
                    (mask, MaskSource::BlackBackground)
                }
            },
        };
        check_mask(&mask, hints.rectangle)?;
        Ok(Self {
            name: stem(path),
            // There is no largest value in floating point: what a screen shows as white counts.
            saturated_from: image.light_at(SATURATED_VALUE),
            picture: image.into_light(),
            mask,
            mask_source,
            scale,
            notes,
            alpha,
        })
    }

    /// The photograph, reduced to a longest side.
    #[must_use]
    pub fn at_most(mut self, longest: usize) -> Self {
        let own = self.picture.planes().extent();
        let extent = own.at_most(longest);
        if extent == own {
            return self;
        }
        self.picture = Rgb::new(self.picture.planes().resized(extent));
        let share = self.mask.resized(extent);
        self.mask = share.map(|m| f32::from(u8::from(m >= 0.5)));
        self.alpha = self.alpha.map(|alpha| alpha.resized(extent));
        self
    }

    /// These options with the light that is saturated in the photograph.
    pub fn options(&self, options: &DecomposeOptions) -> DecomposeOptions {
        DecomposeOptions {
            saturated_from: self.saturated_from,
            ..*options
        }
    }
}

/// What a photograph is called: its file's name without ending.
pub(crate) fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    stem.to_string_lossy().into_owned()
}

/// The size that a file states; `None` if it cannot be read.
pub fn stated_extent(bytes: &[u8]) -> Option<Extent> {
    let (width, height) = relit_data::still::stored_size(bytes)?;
    Some(Extent::new(width as usize, height as usize))
}

/// Checks that a mask has the photograph's size. A mask of the photograph before its Exif orientation was applied gets its own
/// message.
fn check_extent(found: Extent, expected: Extent, bytes: &[u8]) -> Result<(), DecomposeError> {
    let is_turned = found == Extent::new(expected.height, expected.width) && found != expected;
    // Exif's orientations from 5 on swap the sides.
    let orientation =
        relit_data::still::orientation(bytes).map(relit_data::still::Orientation::to_exif);
    if is_turned && orientation.is_some_and(|number| number >= 5) {
        return Err(DecomposeError::Photo(format!(
            "the mask has {} x {} pixels, as stored; the photograph is displayed rotated, {} x {}: rotate the mask, or make \
             it again with relit-mask",
            found.width, found.height, expected.width, expected.height
        )));
    }
    check_mask_size(found, expected)
}

fn check_mask(mask: &Planes<1>, rectangle: Option<Rect>) -> Result<(), DecomposeError> {
    if !is_empty(mask) {
        return Ok(());
    }
    let Some(rectangle) = rectangle else {
        return Err(DecomposeError::EmptyMask);
    };
    let [width, height] = mask.extent().sides();
    Err(DecomposeError::Photo(
        if rectangle.clipped_to(width, height).is_some() {
            format!(
                "the rectangle {rectangle} contains nothing of the object: the photograph's alpha places it elsewhere"
            )
        } else {
            format!(
                "the rectangle {rectangle} does not touch the photograph of {width} x {height} pixels"
            )
        },
    ))
}
