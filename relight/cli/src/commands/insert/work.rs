//! The work of `relight insert`: background, light and objects are read, composed and written.

use std::error::Error;
use std::path::Path;

use relight_core::captured_object::CapturedObject;
use relight_core::files::{MovieFormat, MovieReader, MovieWriter};
use relight_core::image::{Extent, Linear, Planes, Rgb, StoredImage, Transfer};
use relight_core::light::Panorama;
use relight_core::render::exposure_for;
use relight_photo::decompose::Photo;
use relight_photo::files::{PhotoInput, PhotoReading};
use relight_photo::insert::{
    InsertScene, LightSource, Matching, ObjectDescription, PanoramaView, SceneDescription, Subject,
    TrustFigures, TrustMap,
};
use relit_console::Console;

use super::Arguments;
use crate::light::read_light;
use crate::photos::{Network, NetworkArguments, OutputKind, at_most, write_picture};

/// The part of the brightest light that a white matt surface has in a picture of a panorama: bright places clip, as in
/// photographs.
const WHITE: f32 = 1.4;
/// Photographs are brought to this much more than the size in which they are shown.
const RESERVE: f64 = 1.25;
/// Ground that is looked down on in a photograph, degrees.
const TILT: f64 = 20.0;
/// The least of a panorama's.
const LEAST_TILT: f64 = 5.0;

/// Whether a file is a captured object, which `relight turn --asset` writes.
pub(super) fn is_captured(path: &Path) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("relit"))
}

/// What objects are put before.
pub(super) enum Background {
    Photo(Rgb<Linear>),
    Panorama(Box<(PanoramaView, Panorama)>),
    Movie(Box<MovieReader>),
}

/// What an object is made of.
pub(super) enum Source {
    Photo(Box<Photo>),
    Captured(Box<CapturedObject>),
}

/// An object taken apart, and how far that can be trusted where somebody asks.
pub(super) struct ReadObject {
    pub(super) subject: Subject,
    pub(super) trust: Option<TrustFigures>,
}

pub(super) fn load(object: &ObjectDescription, folder: &Path) -> Result<Source, Box<dyn Error>> {
    let path = folder.join(&object.photo);
    if is_captured(&path) {
        if object.mask.is_some() {
            return Err(format!("{}: it has its own mask, give none", path.display()).into());
        }
        return Ok(Source::Captured(Box::new(CapturedObject::read(&path)?)));
    }
    let reading = PhotoReading {
        mask: object.mask.as_ref().map(|mask| folder.join(mask)),
        ..PhotoReading::default()
    };
    let photo = PhotoInput::File(path).load(&reading)?;
    Ok(Source::Photo(Box::new(photo)))
}

pub(super) fn read_background(
    path: &Path,
    scene: &SceneDescription,
) -> Result<Background, Box<dyn Error>> {
    let has = |names: &[&str]| {
        path.extension()
            .is_some_and(|e| names.iter().any(|name| e.eq_ignore_ascii_case(name)))
    };
    if has(&["mp4", "webm", "mov", "mkv", "avi", "m4v"]) {
        return Ok(Background::Movie(Box::new(MovieReader::open(path)?)));
    }
    if has(&["hdr", "exr"]) {
        let Extent { width, height } = StoredImage::read(path)?.planes.extent();
        if width == 2 * height {
            let [width, height] = scene.size.map(|side| side as usize);
            let view = PanoramaView::new(Extent::new(width, height), scene.field, scene.down);
            return Ok(Background::Panorama(Box::new((
                view,
                Panorama::read(path)?,
            ))));
        }
    }
    let picture = Rgb::<Linear>::read(path, Transfer::Srgb)?;
    let is_light = picture
        .planes()
        .planes()
        .into_iter()
        .flatten()
        .all(|v| v.is_finite() && *v >= 0.0);
    if !is_light {
        return Err(format!(
            "{} has a value that is negative, infinite or not a number",
            path.display()
        )
        .into());
    }
    Ok(Background::Photo(picture))
}

/// All that is known before the objects are.
pub(super) struct Work {
    background: Background,
    /// The first frame of a video.
    first: Option<Rgb<Linear>>,
    pub(super) extent: Extent,
    pub(super) light: LightSource,
    pub(super) tilt: f64,
    pub(super) matching: Matching,
    /// What a panorama's radiance is shown times.
    shown: f32,
    network: Network,
}

impl Work {
    pub(super) fn new(
        scene: &SceneDescription,
        mut background: Background,
        folder: &Path,
        network: &NetworkArguments,
    ) -> Result<Self, Box<dyn Error>> {
        let first = match &mut background {
            Background::Movie(movie) => {
                let frame = movie.frame()?.ok_or("the video has no frame")?;
                Some(frame.to_linear())
            }
            _ => None,
        };
        let still = match &background {
            Background::Photo(picture) => Some(picture),
            Background::Movie(_) => first.as_ref(),
            Background::Panorama(_) => None,
        };
        let network = network.read()?;
        let light = given_light(scene, folder, still, &network)?;
        let (light, is_given) = match (light, &background, still) {
            (Some(light), _, _) => (light, true),
            (None, Background::Panorama(parts), _) => {
                (LightSource::Panorama(parts.1.clone()), false)
            }
            (None, _, Some(picture)) => (LightSource::of_picture(picture, scene.field), false),
            (None, _, None) => return Err("there is no light".into()),
        };
        let shown =
            exposure_for(&light.light()?) * WHITE * std::f32::consts::PI * scene.exposure.exp2();
        let mut matching = match still {
            Some(picture) if scene.matches => Matching::of(picture),
            _ => Matching::default(),
        };
        if !is_given {
            // Light that was taken from the background has its colour.
            matching.balance = [1.0; 3];
        }
        if still.is_none() {
            matching.level = scene.exposure.exp2();
        }
        let extent = match &background {
            Background::Panorama(_) => {
                let [width, height] = scene.size.map(|side| side as usize);
                Extent::new(width, height)
            }
            _ => still.map_or(Extent::new(0, 0), |picture| picture.planes().extent()),
        };
        let tilt = scene.tilt.unwrap_or_else(|| tilt_of(scene, &background));
        Ok(Self {
            first,
            extent,
            light,
            tilt,
            matching,
            shown,
            network,
            background,
        })
    }

    /// The objects, each no larger than it has to be.
    pub(super) fn subjects(
        &self,
        scene: &SceneDescription,
        sources: Vec<Source>,
        with_trust: bool,
    ) -> Result<Vec<ReadObject>, Box<dyn Error>> {
        let subject = |(object, source): (&ObjectDescription, Source)| {
            let photo = match source {
                Source::Photo(photo) => *photo,
                // It was measured, and not estimated.
                Source::Captured(asset) => {
                    return Ok(ReadObject {
                        subject: Subject::of_captured(&asset)?,
                        trust: None,
                    });
                }
            };
            let wanted = object.height * self.extent.height as f64 * RESERVE;
            let Extent { width, height } = photo.picture.planes().extent();
            let own = object_height(&photo.mask) as f64;
            let longest = (width.max(height) as f64 * wanted / own).ceil();
            let photo = at_most(photo, Some((longest as usize).max(32)));
            let subject = self.network.subject(&photo)?;
            let options = photo.options(&self.network.options);
            // It takes three more looks.
            let trust = with_trust
                .then(|| TrustMap::of(&subject, &self.network.decomposer, &options))
                .transpose()?;
            let trust = trust.map(|trust| trust.figures());
            Ok(ReadObject { subject, trust })
        };
        scene.objects.iter().zip(sources).map(subject).collect()
    }

    /// Writes the picture or the video; how many frames it has.
    pub(super) fn write(
        &mut self,
        scene: &InsertScene<'_>,
        arguments: &Arguments,
        console: Console,
    ) -> Result<u32, Box<dyn Error>> {
        let output = arguments.output.as_path();
        match OutputKind::of(output) {
            Some(OutputKind::Movie(format)) => match &self.background {
                Background::Movie(_) => self.film_over(scene, output, format, console),
                _ => self.film_turn(scene, arguments, format, console),
            },
            _ => {
                let picture = scene.compose(&self.still(0.0), &scene.layers(0.0)?, 0);
                write_picture(output, &picture, arguments.bits)?;
                Ok(1)
            }
        }
    }

    /// The background after a panorama has turned.
    fn still(&self, turn: f64) -> Rgb<Linear> {
        match &self.background {
            Background::Photo(picture) => picture.clone(),
            Background::Panorama(parts) => {
                let (view, panorama) = parts.as_ref();
                let seen = view.picture(panorama, turn).into_planes();
                Rgb::new(seen.map(|v| v.max(0.0) * self.shown))
            }
            Background::Movie(_) => self
                .first
                .clone()
                .unwrap_or_else(|| Rgb::new(Planes::zeros(self.extent))),
        }
    }

    /// A video whose frames have the objects before them, which do not move.
    fn film_over(
        &mut self,
        scene: &InsertScene<'_>,
        output: &Path,
        format: MovieFormat,
        console: Console,
    ) -> Result<u32, Box<dyn Error>> {
        let layers = scene.layers(0.0)?;
        let mut next = Some(self.still(0.0));
        let Background::Movie(movie) = &mut self.background else {
            return Err("the background is no video".into());
        };
        let mut written =
            MovieWriter::create(output, format, self.extent, movie.frames_per_second())?;
        let bar = console.progress(0, "frames");
        let mut frames = 0;
        while let Some(background) = next {
            let picture = scene.compose(&background, &layers, u64::from(frames));
            written.push(&picture.encode())?;
            frames += 1;
            bar.inc(1);
            next = movie.frame()?.map(Rgb::to_linear);
        }
        written.finish()?;
        bar.finish_and_clear();
        Ok(frames)
    }

    /// A video in which the panorama turns.
    fn film_turn(
        &self,
        scene: &InsertScene<'_>,
        arguments: &Arguments,
        format: MovieFormat,
        console: Console,
    ) -> Result<u32, Box<dyn Error>> {
        let frames = (arguments.seconds * f64::from(arguments.fps))
            .round()
            .clamp(1.0, 100_000.0) as u32;
        let all = arguments.turn.unwrap_or(360.0);
        let mut written =
            MovieWriter::create(&arguments.output, format, self.extent, arguments.fps)?;
        let bar = console.progress(frames.into(), "frames");
        for frame in 0..frames {
            let turn = (all * f64::from(frame) / f64::from(frames)).to_radians();
            let picture = scene.compose(&self.still(turn), &scene.layers(turn)?, u64::from(frame));
            written.push(&picture.encode())?;
            bar.inc(1);
        }
        written.finish()?;
        bar.finish_and_clear();
        Ok(frames)
    }
}

/// The light that the scene names, if it names one.
fn given_light(
    scene: &SceneDescription,
    folder: &Path,
    still: Option<&Rgb<Linear>>,
    network: &Network,
) -> Result<Option<LightSource>, Box<dyn Error>> {
    let light = &scene.light;
    if let Some(lamp) = light.lamp()? {
        return Ok(Some(LightSource::Lamp(lamp)));
    }
    if let Some(path) = light.panorama.as_ref().or(light.coefficients.as_ref()) {
        return read_light(&folder.join(path)).map(Some);
    }
    let Some(mask) = &light.object else {
        return Ok(None);
    };
    let picture = still
        .ok_or("light.object: a panorama shows its light itself; give a photograph or a video")?;
    let path = folder.join(mask);
    let grey = StoredImage::read(&path)?.planes;
    let [mask, ..] = grey.clone().into_planes();
    let mask = Planes::from_planes(grey.extent(), [mask])?.map(|m| f32::from(u8::from(m >= 0.5)));
    let subject = Subject::new(picture, &mask, None, &network.decomposer, &network.options)
        .map_err(|error| {
            format!(
                "{}: {}",
                path.display(),
                relit_data::causes::with_causes(&error)
            )
        })?;
    Ok(Some(LightSource::Coefficients(subject.light().clone())))
}

/// How far the camera looks down on the ground of the first object, degrees.
fn tilt_of(scene: &SceneDescription, background: &Background) -> f64 {
    let (Background::Panorama(_), Some(object)) = (background, scene.objects.first()) else {
        return TILT;
    };
    let [width, height] = scene.size.map(f64::from);
    let tangent = (scene.field / 2.0).to_radians().tan();
    let below = (object.at[1] - 0.5) * height * 2.0 * tangent / width.max(height);
    (scene.down + below.atan().to_degrees()).clamp(LEAST_TILT, 89.0)
}

/// Rows that a mask covers.
fn object_height(mask: &Planes<1>) -> usize {
    let width = mask.extent().width.max(1);
    let covers = |line: &[f32]| line.iter().any(|&m| m >= 0.5);
    let lines = || mask.plane(0).chunks_exact(width);
    match (lines().position(covers), lines().rposition(covers)) {
        (Some(first), Some(last)) => last + 1 - first,
        _ => 1,
    }
}
