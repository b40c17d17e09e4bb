//! A scene out of files and into one: objects, background and light are read, put together, and written.

use std::path::Path;

use relight_core::captured_object::CapturedObject;
use relight_core::image::{Linear, Planes, Rgb};
use relit_data::geometry::Rect;

use super::{
    BackgroundFile, MovieFormat, MovieReader, MovieWriter, OutputKind, PhotoInput, PhotoReading,
    write_picture,
};
use crate::compositing::{
    InsertScene, LightDescription, ObjectDescription, SceneBackground, SceneDescription,
    SceneEnvironment,
};
use crate::decompose::{DecomposeOptions, Decomposer, Photo};
use crate::export::{is_object, read_object};
use crate::relighting::{InsertError, LightSource, RelightableObject};

/// What an object is made of.
#[derive(Debug)]
pub enum InsertSource {
    /// A photograph, which is decomposed.
    Photo(Box<Photo>),
    /// A captured or decomposed object, whose maps are known.
    Captured(Box<CapturedObject>),
}

/// A background and the setting that follows from it, with the network that decomposes the objects.
#[derive(Debug)]
pub struct Insertion<'a> {
    background: BackgroundFile,
    /// The first frame of a video.
    first: Option<Rgb<Linear>>,
    environment: SceneEnvironment,
    /// How far the light is rotated, radians.
    angle: f64,
    decomposer: &'a Decomposer,
    options: DecomposeOptions,
}

/// The file that is written.
#[derive(Debug, Clone, Copy)]
pub struct InsertionOutput<'a> {
    /// A picture, or a video.
    pub path: &'a Path,
    /// By how many degrees a panorama rotates in a video.
    pub rotate: f64,
    /// In how many frames.
    pub frames: u32,
    /// Frames a second of such a video.
    pub frames_per_second: u32,
}

impl InsertSource {
    /// Reads an object of a scene; its paths are relative to `folder`. Without a mask, a photograph's object may be cut out
    /// within a rectangle.
    ///
    /// # Errors
    /// If a file cannot be read, or an object with maps is given a mask or a rectangle.
    pub fn read(
        object: &ObjectDescription,
        rectangle: Option<Rect>,
        folder: &Path,
    ) -> Result<Self, InsertError> {
        let path = folder.join(&object.photo);
        if is_object(&path) {
            if object.mask.is_some() || rectangle.is_some() {
                return Err(InsertError::Input(format!(
                    "{} has its own mask: give no mask and no rectangle",
                    path.display()
                )));
            }
            return Ok(Self::Captured(Box::new(read_object(&path)?)));
        }
        let reading = PhotoReading {
            mask: object.mask.as_ref().map(|mask| folder.join(mask)),
            rectangle,
            transfer: object.transfer,
        };
        let photo = PhotoInput { path }.load(&reading)?;
        Ok(Self::Photo(Box::new(photo)))
    }
}

impl<'a> Insertion<'a> {
    /// Everything but the objects: the first frame of a video is read, and the light, where the scene names one in files.
    ///
    /// # Errors
    /// If a file cannot be read, or the light is dark.
    pub fn new(
        scene: &SceneDescription,
        background: BackgroundFile,
        folder: &Path,
        decomposer: &'a Decomposer,
        options: DecomposeOptions,
    ) -> Result<Self, InsertError> {
        let light = given_light(&scene.light, folder)?;
        Self::in_light(scene, background, light, decomposer, options)
    }

    /// The same in a given light, which replaces that of the scene, or else in the background's.
    ///
    /// # Errors
    /// If the first frame of a video cannot be read, or the light is dark.
    pub fn in_light(
        scene: &SceneDescription,
        mut background: BackgroundFile,
        light: Option<LightSource>,
        decomposer: &'a Decomposer,
        options: DecomposeOptions,
    ) -> Result<Self, InsertError> {
        let first = first_of(&mut background)?;
        let still = still_of(&background, first.as_ref())?;
        let environment = SceneEnvironment::new(scene, still, light)?;
        Ok(Self {
            background,
            first,
            environment,
            angle: scene.light.angle.to_radians(),
            decomposer,
            options,
        })
    }

    /// Light, size, tilt and matching.
    pub const fn environment(&self) -> &SceneEnvironment {
        &self.environment
    }

    /// An object, decomposed no larger than it has to be.
    ///
    /// # Errors
    /// If it cannot be decomposed.
    pub fn relightable(
        &self,
        object: &ObjectDescription,
        source: InsertSource,
    ) -> Result<RelightableObject, InsertError> {
        Ok(match source {
            InsertSource::Photo(photo) => {
                let photo = self.environment.downscaled(object, *photo);
                RelightableObject::from_photo(&photo, self.decomposer, &self.options)?
            }
            InsertSource::Captured(object) => RelightableObject::from_captured(&object)?,
        })
    }

    /// How many frames are written; `None` if the background has as many as it has.
    pub fn frames(&self, output: &InsertionOutput<'_>) -> Option<u32> {
        match (OutputKind::from_path(output.path), &self.background) {
            (Some(OutputKind::Movie(_)), BackgroundFile::Movie(_)) => None,
            (Some(OutputKind::Movie(_)), _) => Some(output.frames),
            _ => Some(1),
        }
    }

    /// Writes the picture or the video; how many frames it has. `written` is called after each.
    ///
    /// # Errors
    /// If a frame cannot be read, composed or written.
    pub fn write(
        &mut self,
        scene: &InsertScene<'_>,
        output: &InsertionOutput<'_>,
        written: impl FnMut(),
    ) -> Result<u32, InsertError> {
        match OutputKind::from_path(output.path) {
            Some(OutputKind::Movie(format)) => match &self.background {
                BackgroundFile::Movie(_) => self.film_over(scene, output.path, format, written),
                _ => self.film_rotation(scene, output, format, written),
            },
            _ => {
                write_picture(output.path, &self.picture(scene)?)?;
                Ok(1)
            }
        }
    }

    /// The picture; of a video its first frame.
    ///
    /// # Errors
    /// Those of the render layers.
    pub fn picture(&self, scene: &InsertScene<'_>) -> Result<Rgb<Linear>, InsertError> {
        let layers = scene.layers(self.angle)?;
        Ok(scene.compose(&self.still(self.angle), &layers, 0))
    }

    /// The background after a panorama was rotated.
    fn still(&self, angle: f64) -> Rgb<Linear> {
        match &self.background {
            BackgroundFile::Photo(picture, _) => picture.clone(),
            BackgroundFile::Panorama(parts) => self.environment.seen(&parts.0, &parts.1, angle),
            BackgroundFile::Movie(_) => self
                .first
                .clone()
                .unwrap_or_else(|| Rgb::new(Planes::zeros(self.environment.extent))),
        }
    }

    /// A video with still objects before its frames.
    fn film_over(
        &mut self,
        scene: &InsertScene<'_>,
        path: &Path,
        format: MovieFormat,
        mut written: impl FnMut(),
    ) -> Result<u32, InsertError> {
        let layers = scene.layers(self.angle)?;
        let mut next = Some(self.still(0.0));
        let BackgroundFile::Movie(movie) = &mut self.background else {
            return Err(no_frame());
        };
        let rate = movie.frame_rate();
        let mut film = MovieWriter::create(path, format, self.environment.extent, rate)?;
        let mut frames = 0;
        while let Some(background) = next {
            let picture = scene.compose(&background, &layers, u64::from(frames));
            film.push(&picture.encode())?;
            frames += 1;
            written();
            next = movie.frame()?.map(Rgb::to_linear);
        }
        film.finish()?;
        Ok(frames)
    }

    /// A video in which the panorama rotates.
    fn film_rotation(
        &self,
        scene: &InsertScene<'_>,
        output: &InsertionOutput<'_>,
        format: MovieFormat,
        mut written: impl FnMut(),
    ) -> Result<u32, InsertError> {
        let frames = output.frames;
        let (extent, rate) = (self.environment.extent, output.frames_per_second);
        let mut film = MovieWriter::create(output.path, format, extent, rate)?;
        for frame in 0..frames {
            let part = f64::from(frame) / f64::from(frames);
            let angle = self.angle + (output.rotate * part).to_radians();
            let picture =
                scene.compose(&self.still(angle), &scene.layers(angle)?, u64::from(frame));
            film.push(&picture.encode())?;
            written();
        }
        film.finish()?;
        Ok(frames)
    }
}

fn no_frame() -> InsertError {
    InsertError::Input("the video has no frame".to_owned())
}

/// The first frame of a video.
fn first_of(background: &mut BackgroundFile) -> Result<Option<Rgb<Linear>>, InsertError> {
    match background {
        BackgroundFile::Movie(movie) => first_frame(movie).map(Some),
        BackgroundFile::Photo(..) | BackgroundFile::Panorama(_) => Ok(None),
    }
}

/// The still part of a background.
fn still_of<'a>(
    background: &'a BackgroundFile,
    first: Option<&'a Rgb<Linear>>,
) -> Result<SceneBackground<'a>, InsertError> {
    match (background, first) {
        (BackgroundFile::Panorama(parts), _) => Ok(SceneBackground::Panorama(&parts.1)),
        (BackgroundFile::Photo(picture, _), _) | (BackgroundFile::Movie(_), Some(picture)) => {
            Ok(SceneBackground::Picture(picture))
        }
        (BackgroundFile::Movie(_), None) => Err(no_frame()),
    }
}

fn first_frame(movie: &mut MovieReader) -> Result<Rgb<Linear>, InsertError> {
    let frame = movie.frame()?.ok_or_else(no_frame)?;
    Ok(frame.to_linear())
}

/// The light that the scene names, if it names one.
fn given_light(
    light: &LightDescription,
    folder: &Path,
) -> Result<Option<LightSource>, InsertError> {
    if let Some(lamp) = light.lamp()? {
        return Ok(Some(LightSource::Lamp(lamp)));
    }
    let file = light.panorama.as_ref().or(light.coefficients.as_ref());
    file.map(|path| LightSource::read(&folder.join(path)))
        .transpose()
}
