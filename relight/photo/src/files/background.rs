//! What objects are put before, out of a file.

use std::fs;
use std::path::Path;

use relight_core::image::{ColourImage, Extent, ImageError, Linear, Rgb};
use relight_core::light::Panorama;
use relit_data::file_names::{VIDEO_EXTENSIONS, has_extension};
use relit_data::still::Format;

use super::{FrameTiming, MovieReader};
use crate::compositing::SceneDescription;
use crate::decompose::{UsableImage, stated_extent};
use crate::relighting::{InsertError, PanoramaView};

/// A background out of a file.
#[derive(Debug)]
pub enum BackgroundFile {
    /// A photograph, and what a person may want to know of it.
    Photo(Rgb<Linear>, Vec<String>),
    /// A panorama, and what is seen of it.
    Panorama(Box<(PanoramaView, Panorama)>),
    /// A video.
    Movie(Box<MovieReader>),
}

impl BackgroundFile {
    /// The conversion of a video's colours to sRGB, in words; `None` if they are read as sRGB.
    pub fn colour_conversion(&self) -> Option<String> {
        match self {
            Self::Movie(movie) => movie.colour_conversion(),
            Self::Photo(..) | Self::Panorama(_) => None,
        }
    }

    /// What a person may want to know of a photograph, as clauses.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        match self {
            Self::Photo(_, notes) => notes,
            Self::Panorama(_) | Self::Movie(_) => &[],
        }
    }

    /// Reads the background of a scene: a video, an HDR or EXR file twice as wide as high as a panorama, or a photograph.
    ///
    /// # Errors
    /// If it cannot be read, or a panorama has a value that is negative or not finite.
    pub fn read(path: &Path, scene: &SceneDescription) -> Result<Self, InsertError> {
        if has_extension(path, &VIDEO_EXTENSIONS) {
            let movie = MovieReader::open(path, FrameTiming::Even)?;
            return Ok(Self::Movie(Box::new(movie)));
        }
        let bytes = fs::read(path).map_err(ImageError::open(path))?;
        if is_panorama(&bytes) {
            let panorama = Panorama::from_bytes(path, &bytes)?;
            return Ok(Self::from_panorama(panorama, scene));
        }
        Ok(Self::from_picture(ColourImage::from_bytes(
            path, &bytes, None,
        )?))
    }

    /// A panorama; the scene shows part of it.
    pub fn from_panorama(panorama: Panorama, scene: &SceneDescription) -> Self {
        let view = PanoramaView::new(scene.panorama_extent(), scene.fov, scene.down);
        Self::Panorama(Box::new((view, panorama)))
    }

    /// A photograph, made usable as by [`UsableImage`].
    #[must_use]
    pub fn from_picture(picture: ColourImage) -> Self {
        let usable = UsableImage::new(picture);
        Self::Photo(usable.image.into_light(), usable.notes)
    }
}

/// Whether a file is a picture of radiance that is twice as wide as high.
fn is_panorama(bytes: &[u8]) -> bool {
    let is_radiance = matches!(Format::sniff(bytes), Some(Format::Exr | Format::Radiance));
    let is_wide = |extent: Extent| extent.width == 2 * extent.height;
    is_radiance && stated_extent(bytes).is_some_and(is_wide)
}
