//! The background of a scene: a photograph, or part of a panorama.

use std::path::Path;

use relight_core::image::{ColourSpace, Extent, Linear, Planes, Rgb, Samples, Srgb, encode_exr};
use relight_core::light::Panorama;
use relight_photo::compositing::{SceneBackground, SceneDescription, SceneEnvironment};
use relight_photo::decompose::UsableImage;
use relight_photo::relighting::PanoramaView;
use relit_data::statistics::upper_median;

use super::error::{StudioError, refused};
use super::object::{OpenedFile, png_of, stem};
use super::pixels::rgba;
use super::request::BackgroundRequest;

/// The most columns of a panorama.
const MAX_COLUMNS: usize = 1024;
/// The size of a panorama's little picture.
const THUMBNAIL: Extent = Extent::new(96, 48);
/// The mean brightness in which it is shown.
const THUMBNAIL_MEAN: f32 = 0.22;

/// A background.
pub(super) struct StudioBackground {
    /// The name of its file.
    pub(super) name: String,
    /// What a person may want to know of its file, as clauses.
    pub(super) notes: Vec<String>,
    content: Content,
}

enum Content {
    Photo(PhotoBackground),
    Panorama(PanoramaBackground),
}

struct PhotoBackground {
    file: Vec<u8>,
    picture: Rgb<Linear>,
    /// In the size in which it was shown last.
    downscaled: Option<(u32, Rgb<Linear>)>,
}

struct PanoramaBackground {
    file: Vec<u8>,
    panorama: Panorama,
    /// The last camera, and what it depends on.
    view: Option<(ViewKey, PanoramaView)>,
}

type ViewKey = ([u32; 2], [u64; 2]);

impl StudioBackground {
    /// The background that the page asks for, whose file or pixels are these.
    ///
    /// # Errors
    /// If it cannot be read, or is not a panorama.
    pub(super) fn open(asked: &BackgroundRequest, bytes: &[u8]) -> Result<Self, StudioError> {
        match asked {
            BackgroundRequest::Photo { name } => Self::photo(name, bytes.to_vec()),
            BackgroundRequest::PhotoPixels {
                name,
                width,
                height,
            } => {
                let png = png_of(name, [*width, *height], bytes)?;
                Self::photo(&format!("{}.png", stem(name)), png)
            }
            BackgroundRequest::PanoramaFile { name } => Self::panorama(name, bytes.to_vec()),
        }
    }

    /// A photograph.
    ///
    /// # Errors
    /// If it cannot be read.
    fn photo(name: &str, bytes: Vec<u8>) -> Result<Self, StudioError> {
        let opened = OpenedFile::read(name, bytes)?;
        let (name, file) = (opened.name, opened.bytes);
        let usable = UsableImage::new(opened.image);
        let picture = usable.image.into_light();
        Ok(Self {
            name,
            notes: usable.notes,
            content: Content::Photo(PhotoBackground {
                file,
                picture,
                downscaled: None,
            }),
        })
    }

    /// A panorama: linear light in HDR or EXR, or any picture that is twice as wide as high.
    ///
    /// # Errors
    /// If it cannot be read or has another shape.
    fn panorama(name: &str, bytes: Vec<u8>) -> Result<Self, StudioError> {
        let opened = OpenedFile::read(name, bytes)?;
        let Extent { width, height } = opened.image.stored().planes.extent();
        // Making it smaller rounds its sides.
        if width.abs_diff(2 * height) > 2 || height < 4 {
            return refused(format!(
                "{name} has {width} x {height} pixels: a panorama is twice as wide as high"
            ));
        }
        let is_float = opened.image.stored().samples == Samples::Float;
        let own_file = opened.bytes;
        let mut panorama = Panorama::new(opened.image.into_light())?;
        let columns = width.min(MAX_COLUMNS) / 2 * 2;
        let wanted = Extent::new(columns, columns / 2);
        let is_of_size = wanted == Extent::new(width, height);
        if !is_of_size {
            panorama = panorama.resized(wanted);
        }
        let (name, file) = if is_float && is_of_size {
            (name.to_owned(), own_file)
        } else {
            let file = encode_exr(Path::new(name), panorama.image().planes())?;
            (format!("{}.exr", stem(name)), file)
        };
        Ok(Self {
            name,
            notes: Vec::new(),
            content: Content::Panorama(PanoramaBackground {
                file,
                panorama,
                view: None,
            }),
        })
    }

    /// The file that is kept with a scene.
    pub(super) fn file(&self) -> &[u8] {
        match &self.content {
            Content::Photo(photo) => &photo.file,
            Content::Panorama(panorama) => &panorama.file,
        }
    }

    /// The size of a scene's picture, from the given size for a panorama.
    pub(super) fn extent(&self, of_panorama: [u32; 2]) -> Extent {
        match &self.content {
            Content::Photo(photo) => photo.picture.planes().extent(),
            Content::Panorama(_) => Extent::new(of_panorama[0] as usize, of_panorama[1] as usize),
        }
    }

    /// Makes ready what a scene shows of it, `longest` pixels at most: the size of that picture.
    pub(super) fn prepare(&mut self, scene: &SceneDescription, longest: Option<u32>) {
        match &mut self.content {
            Content::Photo(photo) => {
                let Some(longest) = longest else {
                    photo.downscaled = None;
                    return;
                };
                if photo
                    .downscaled
                    .as_ref()
                    .is_none_or(|(was, _)| *was != longest)
                {
                    let extent = downscaled(photo.picture.planes().extent(), Some(longest));
                    let planes = photo.picture.planes().resized(extent);
                    photo.downscaled = Some((longest, Rgb::new(planes)));
                }
            }
            Content::Panorama(panorama) => {
                let key = (scene.size, [scene.fov, scene.down].map(f64::to_bits));
                if panorama.view.as_ref().is_none_or(|(was, _)| *was != key) {
                    let extent = scene.panorama_extent();
                    let view = PanoramaView::new(extent, scene.fov, scene.down);
                    panorama.view = Some((key, view));
                }
            }
        }
    }

    /// The background as a scene takes it, after [`StudioBackground::prepare`].
    pub(super) fn for_scene(&self) -> SceneBackground<'_> {
        match &self.content {
            Content::Photo(photo) => SceneBackground::Picture(photo.shown()),
            Content::Panorama(panorama) => SceneBackground::Panorama(&panorama.panorama),
        }
    }

    /// The visible part after the light has rotated by so many radians, after [`StudioBackground::prepare`].
    pub(super) fn seen(&self, environment: &SceneEnvironment, turn: f64) -> Rgb<Linear> {
        match &self.content {
            Content::Photo(photo) => photo.shown().clone(),
            Content::Panorama(panorama) => match &panorama.view {
                Some((_, view)) => environment.seen(view, &panorama.panorama, turn),
                None => Rgb::new(Planes::zeros(environment.extent)),
            },
        }
    }

    /// A little picture of it.
    pub(super) fn thumbnail(&self) -> Vec<u8> {
        match &self.content {
            Content::Photo(photo) => {
                let planes = photo.picture.planes().resized(THUMBNAIL);
                rgba(&planes.map(Srgb::from_linear))
            }
            Content::Panorama(panorama) => thumbnail(&panorama.panorama),
        }
    }
}

impl PhotoBackground {
    fn shown(&self) -> &Rgb<Linear> {
        self.downscaled
            .as_ref()
            .map_or(&self.picture, |(_, downscaled)| downscaled)
    }
}

/// A panorama exposed for a screen by its median, so that a sun does not make everything else black.
fn thumbnail(panorama: &Panorama) -> Vec<u8> {
    let planes = panorama.image().planes().resized(THUMBNAIL);
    let middle = upper_median(planes.plane(1).iter().copied()).unwrap_or(1.0);
    let gain = THUMBNAIL_MEAN / middle.max(1e-6);
    rgba(&planes.map(|value| Srgb::from_linear((value * gain).max(0.0))))
}

/// A size whose longer side is at most so many pixels.
pub(super) fn downscaled(extent: Extent, longest: Option<u32>) -> Extent {
    let Extent { width, height } = extent;
    let most = longest.map_or(usize::MAX, |longest| longest.max(16) as usize);
    let own = width.max(height).max(1);
    if own <= most {
        return extent;
    }
    let side = |side: usize| ((side * most + own / 2) / own).max(1);
    Extent::new(side(width), side(height))
}
