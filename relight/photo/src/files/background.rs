//! What objects are put before, out of a file.

use std::path::Path;

use relight_core::files::MovieReader;
use relight_core::image::{Extent, Linear, Rgb, StoredImage, Transfer};
use relight_core::light::Panorama;
use relit_data::file_names::{VIDEO_EXTENSIONS, has_extension};

use super::InsertionError;
use crate::insert::{PanoramaView, SceneDescription};

/// How the files of panoramas end.
const PANORAMAS: [&str; 2] = ["hdr", "exr"];

/// A background out of a file.
#[derive(Debug)]
pub enum BackgroundFile {
    /// A photograph.
    Photo(Rgb<Linear>),
    /// A panorama, and what is seen of it.
    Panorama(Box<(PanoramaView, Panorama)>),
    /// A video.
    Movie(Box<MovieReader>),
}

impl BackgroundFile {
    /// Reads the background of a scene: a video, an HDR or EXR file twice as wide as high as a panorama, or a photograph.
    ///
    /// # Errors
    /// Where it cannot be read, or has values that are no light.
    pub fn read(path: &Path, scene: &SceneDescription) -> Result<Self, InsertionError> {
        if has_extension(path, &VIDEO_EXTENSIONS) {
            return Ok(Self::Movie(Box::new(MovieReader::open(path)?)));
        }
        if has_extension(path, &PANORAMAS) {
            let Extent { width, height } = StoredImage::read(path)?.planes.extent();
            if width == 2 * height {
                let view = PanoramaView::new(scene.panorama_extent(), scene.field, scene.down);
                return Ok(Self::Panorama(Box::new((view, Panorama::read(path)?))));
            }
        }
        let picture = Rgb::<Linear>::read(path, Transfer::Srgb)?;
        let is_light = |plane: &[f32]| plane.iter().all(|v| v.is_finite() && *v >= 0.0);
        if !picture.planes().planes().into_iter().all(is_light) {
            return Err(InsertionError::NotLight {
                path: path.to_owned(),
            });
        }
        Ok(Self::Photo(picture))
    }
}
