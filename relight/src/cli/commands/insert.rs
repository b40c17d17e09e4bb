//! `relight insert`: objects of photographs in a new picture.

use std::error::Error;
use std::fs;
use std::iter;
use std::path::{Path, PathBuf};

use clap::{ArgAction, Args};
use relight::asset::Asset;
use relight::decompose::{Photo, PhotoInput, PhotoReading};
use relight::image::{Extent, Linear, Planes, Rgb, StoredImage, Transfer};
use relight::insert::{
    LightDescription, LightSource, Matching, ObjectDescription, PanoramaView, Scene,
    SceneDescription, SceneObject, Subject, TrustFigures, TrustMap,
};
use relight::light::Panorama;
use relight::movie::{MovieFormat, MovieReader, MovieWriter};
use relight::render::exposure_for;
use serde_json::json;

use super::relight::{degrees, gloss_numbers, tint};
use crate::cli::console::{CommandResult, Console, Outcome};
use crate::cli::light::read_light;
use crate::cli::photos::{
    Bits, Network, NetworkArguments, OutputKind, at_most, not_an_input, own_mask, write_picture,
};

pub(in crate::cli) const EXAMPLES: &str = "\
Examples:
  relight insert cup.jpg --mask cup-mask.png --into room.jpg --at 0.4,0.9 --height 0.3 -o out.png
      the cup in another photograph, in the light that is taken from it
  relight insert bear.jpg cup.jpg --mask masks --into room.hdr --at 0.6,0.85 --height 0.5 \\
      --at 0.35,0.95 --height 0.3 -o out.png
      two objects, from back to front, in a panorama; their masks are masks/bear.png and masks/cup.png
  relight insert cup.jpg --mask cup-mask.png --into room.jpg --lamp 60,30 -o out.exr
      in the light of a lamp
  relight insert object.relit --into room.hdr -o out.png
      an object that relight turn --asset has written
  relight insert --scene scene.toml -o out.png
      all of it from a file (docs/insert.md)";

/// The part of the brightest light that a white matt surface has in a picture of a panorama: bright places clip, as in
/// photographs.
const WHITE: f32 = 1.4;
/// Photographs are brought to this much more than the size in which they are shown.
const RESERVE: f64 = 1.25;
/// Ground that is looked down on in a photograph, degrees.
const TILT: f64 = 20.0;
/// The least of a panorama's.
const LEAST_TILT: f64 = 5.0;

#[derive(Args)]
pub(in crate::cli) struct Arguments {
    /// Photographs of the objects, from back to front.
    #[arg(
        value_name = "PHOTO",
        required_unless_present = "scene",
        conflicts_with = "scene"
    )]
    photos: Vec<PathBuf>,
    /// A scene: background, light and objects in a TOML file.
    #[arg(long, value_name = "FILE.toml")]
    scene: Option<PathBuf>,
    /// The picture (.png, .exr), or a video (.mp4, .webm).
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// The background: a photograph, a panorama (HDR or EXR, twice as wide as high), or a video.
    #[arg(
        long,
        value_name = "FILE",
        required_unless_present = "scene",
        conflicts_with = "scene"
    )]
    into: Option<PathBuf>,
    #[command(flatten)]
    object: ObjectArguments,
    #[command(flatten)]
    light: LightArguments,
    /// Width and height of the picture that shows a part of a panorama.
    #[arg(long, value_name = "W,H", value_parser = size, conflicts_with = "scene")]
    size: Option<[u32; 2]>,
    /// How many degrees the picture's longer side shows [default: 60].
    #[arg(long, value_name = "DEGREES", value_parser = number, conflicts_with = "scene")]
    field: Option<f64>,
    /// How many degrees the camera looks down into a panorama [default: 10].
    #[arg(long, value_name = "DEGREES", value_parser = number, allow_hyphen_values = true, conflicts_with = "scene")]
    down: Option<f64>,
    /// How many degrees the camera looks down on the ground of the objects [default: 20, in a panorama as it is seen there].
    #[arg(long, value_name = "DEGREES", value_parser = number, conflicts_with = "scene")]
    tilt: Option<f64>,
    /// Leave brightness, white balance and grain of the objects as they are.
    #[arg(long, conflicts_with = "scene")]
    no_match: bool,
    /// Brightness of a panorama and its light in stops.
    #[arg(long, value_name = "STOPS", value_parser = number, allow_hyphen_values = true, conflicts_with = "scene")]
    exposure: Option<f64>,
    /// Turn a panorama and its light by so many degrees about the vertical, in a video.
    #[arg(long, value_name = "DEGREES", value_parser = degrees, allow_hyphen_values = true)]
    turn: Option<f64>,
    /// How long the turn takes, seconds.
    #[arg(long, value_name = "SECONDS", value_parser = number, default_value_t = 10.0, requires = "turn")]
    seconds: f64,
    /// Frames a second of a turn.
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=240))]
    fps: u32,
    /// Bits a channel of a PNG.
    #[arg(long, value_enum, default_value = "8")]
    bits: Bits,
    #[command(flatten)]
    network: NetworkArguments,
}

/// What is said of the objects; what is given once holds for all, what is given as often as there are objects for one each.
#[derive(Args)]
struct ObjectArguments {
    /// A mask, white on the object, or a folder of masks, <photo's name>.png.
    #[arg(long, value_name = "FILE|DIR", action = ArgAction::Append, conflicts_with = "scene")]
    mask: Vec<PathBuf>,
    /// The middle of the object's lower edge in the picture, in parts of its width and height from the upper left corner.
    #[arg(long, value_name = "X,Y", value_parser = place, action = ArgAction::Append, conflicts_with = "scene")]
    at: Vec<[f64; 2]>,
    /// The object's height in parts of the picture's.
    #[arg(long, value_name = "PART", value_parser = number, action = ArgAction::Append, conflicts_with = "scene")]
    height: Vec<f64>,
    /// Turn the object in the plane, counter-clockwise.
    #[arg(long, value_name = "DEGREES", value_parser = number, allow_hyphen_values = true, action = ArgAction::Append, conflicts_with = "scene")]
    rotate: Vec<f64>,
    /// Multiply the object's albedo with a colour, linear.
    #[arg(long, value_name = "R,G,B", value_parser = tint, action = ArgAction::Append, conflicts_with = "scene")]
    tint: Vec<[f32; 3]>,
    /// Make the object glossy: the part of even light that it reflects, and its smoothness α (5 to 200); 0,1 is matt.
    #[arg(long, value_name = "PART,SMOOTHNESS", value_parser = gloss_numbers, action = ArgAction::Append, conflicts_with = "scene")]
    gloss: Vec<[f32; 2]>,
    /// The object's brightness in stops.
    #[arg(long, value_name = "STOPS", value_parser = number, allow_hyphen_values = true, action = ArgAction::Append, conflicts_with = "scene")]
    brighter: Vec<f64>,
    /// How much of the object's shadow is seen, 0 to 1.
    #[arg(long, value_name = "PART", value_parser = number, action = ArgAction::Append, conflicts_with = "scene")]
    shadow: Vec<f64>,
}

/// The light; without any it is taken from the background.
#[derive(Args)]
#[group(multiple = false)]
struct LightArguments {
    /// The light: a panorama, or a text file of coefficients [default: taken from the background].
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    light: Option<PathBuf>,
    /// The light: a lamp (see relight relight --help).
    #[arg(
        long,
        value_name = "AZIMUTH,ELEVATION[,COLOUR][,SIZE]",
        allow_hyphen_values = true,
        conflicts_with = "scene"
    )]
    lamp: Option<String>,
    /// The light that falls on an object of the background, of which this is the mask.
    #[arg(long, value_name = "MASK", conflicts_with = "scene")]
    light_object: Option<PathBuf>,
}

impl Arguments {
    /// What is wrong with the combination of arguments, if anything is.
    pub(in crate::cli) fn fault(&self) -> Option<String> {
        let count = self.photos.len();
        let object = &self.object;
        let lists = [
            ("--mask", object.mask.len()),
            ("--at", object.at.len()),
            ("--height", object.height.len()),
            ("--rotate", object.rotate.len()),
            ("--tint", object.tint.len()),
            ("--gloss", object.gloss.len()),
            ("--brighter", object.brighter.len()),
            ("--shadow", object.shadow.len()),
        ];
        let odd = lists
            .into_iter()
            .find(|&(_, given)| given > 1 && given != count);
        if let Some((name, given)) = odd {
            return Some(format!(
                "{name} is given {given} times for {count} photographs: give it once, or for each"
            ));
        }
        if let [mask] = object.mask.as_slice()
            && count > 1
            && !mask.is_dir()
        {
            return Some(format!(
                "--mask {}: give a folder of masks, or one for each photograph",
                mask.display()
            ));
        }
        if OutputKind::of(&self.output).is_none() {
            return Some(format!(
                "--output {}: give .png, .exr, .mp4 or .webm",
                self.output.display()
            ));
        }
        let is_movie = matches!(OutputKind::of(&self.output), Some(OutputKind::Movie(_)));
        (self.turn.is_some() && !is_movie).then(|| {
            format!(
                "--output {}: give .mp4 or .webm for --turn",
                self.output.display()
            )
        })
    }

    /// The scene that is asked for, and the folder that its paths are relative to.
    fn description(&self) -> Result<(SceneDescription, PathBuf), Box<dyn Error>> {
        if let Some(path) = &self.scene {
            let text = fs::read_to_string(path)
                .map_err(|error| format!("{} cannot be read: {error}", path.display()))?;
            let scene = SceneDescription::parse(&text)
                .map_err(|error| format!("{}: {error}", path.display()))?;
            let folder = path.parent().unwrap_or(Path::new("")).to_owned();
            return Ok((scene, folder));
        }
        let objects = (0..self.photos.len())
            .map(|number| self.object.describe(&self.photos, number))
            .collect();
        let is_text = |path: &Path| {
            path.extension()
                .is_some_and(|e| e.eq_ignore_ascii_case("txt"))
        };
        let (coefficients, panorama) = match &self.light.light {
            Some(path) if is_text(path) => (Some(path.clone()), None),
            other => (None, other.clone()),
        };
        let scene = SceneDescription {
            background: self.into.clone().unwrap_or_default(),
            size: self.size.unwrap_or([1280, 960]),
            field: self.field.unwrap_or(60.0),
            down: self.down.unwrap_or(10.0),
            tilt: self.tilt,
            light: LightDescription {
                panorama,
                lamp: self.light.lamp.clone(),
                ambient: None,
                coefficients,
                object: self.light.light_object.clone(),
            },
            matches: !self.no_match,
            exposure: self.exposure.unwrap_or(0.0) as f32,
            objects,
        };
        scene.check()?;
        Ok((scene, PathBuf::new()))
    }
}

impl ObjectArguments {
    fn describe(&self, photos: &[PathBuf], number: usize) -> ObjectDescription {
        let photo = photos[number].clone();
        // Beside each other, where nothing is said.
        let across = (number as f64 + 0.5) / photos.len() as f64;
        ObjectDescription {
            mask: of(&self.mask, number)
                // A folder of masks is for the photographs.
                .filter(|mask| !(is_captured(&photo) && mask.is_dir()))
                .map(|mask| {
                    let name = photo.file_stem().unwrap_or_default();
                    own_mask(&mask, &name.to_string_lossy())
                }),
            at: of(&self.at, number).unwrap_or([across, 0.9]),
            height: of(&self.height, number).unwrap_or(0.4),
            rotation: of(&self.rotate, number).unwrap_or(0.0),
            tint: of(&self.tint, number).unwrap_or([1.0; 3]),
            gloss: of(&self.gloss, number),
            exposure: of(&self.brighter, number).unwrap_or(0.0) as f32,
            shadow: of(&self.shadow, number).unwrap_or(1.0) as f32,
            photo,
        }
    }
}

/// What is said of an object: for it alone, or for all.
fn of<T: Clone>(given: &[T], number: usize) -> Option<T> {
    match given {
        [one] => Some(one.clone()),
        many => many.get(number).cloned(),
    }
}

/// Whether a file is a captured object, which `relight turn --asset` writes.
fn is_captured(path: &Path) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("relit"))
}

/// What objects are put before.
enum Background {
    Photo(Rgb<Linear>),
    Panorama(Box<(PanoramaView, Panorama)>),
    Movie(Box<MovieReader>),
}

pub(in crate::cli) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let (scene, folder) = arguments.description()?;
    let file = |path: &Path| folder.join(path);
    let sources = scene
        .objects
        .iter()
        .map(|object| load(object, &folder))
        .collect::<Result<Vec<_>, _>>()?;
    let background = read_background(&file(&scene.background), &scene)?;
    let is_movie = matches!(
        OutputKind::of(&arguments.output),
        Some(OutputKind::Movie(_))
    );
    check_output(&background, is_movie, arguments)?;
    not_an_input(&arguments.output, &files_of(&scene, &folder))?;
    let mut work = Work::new(&scene, background, &folder, &arguments.network)?;
    let subjects = work.subjects(&scene, sources, console.is_json())?;
    let objects = scene.objects.iter().zip(&subjects);
    let objects = objects.map(|(object, read)| SceneObject {
        subject: &read.subject,
        placement: object.placement(),
        change: object.change(),
        exposure: object.exposure,
        shadow: object.shadow,
        relit: true,
    });
    let set = Scene::new(
        work.extent,
        &work.light,
        work.tilt,
        work.matching,
        objects.collect(),
    )?;
    let frames = work.write(&set, arguments, console)?;
    let output = &arguments.output;
    let trust: Vec<Option<TrustFigures>> = subjects.iter().map(|read| read.trust).collect();
    console.say(
        &format!("{}: {} object(s), {frames} frame(s)", output.display(), scene.objects.len()),
        &json!({
            "event": "inserted", "output": output, "objects": scene.objects.len(), "frames": frames,
            "trust": trust, "tilt": work.tilt, "level": work.matching.level, "balance": work.matching.balance, "grain": work.matching.grain,
        }),
    );
    Ok(Outcome::Whole)
}

/// What an object is made of.
enum Source {
    Photo(Box<Photo>),
    Captured(Box<Asset>),
}

/// An object taken apart, and how far that can be trusted where somebody asks.
struct ReadObject {
    subject: Subject,
    trust: Option<TrustFigures>,
}

fn load(object: &ObjectDescription, folder: &Path) -> Result<Source, Box<dyn Error>> {
    let path = folder.join(&object.photo);
    if is_captured(&path) {
        if object.mask.is_some() {
            return Err(format!("{}: it has its own mask, give none", path.display()).into());
        }
        return Ok(Source::Captured(Box::new(Asset::read(&path)?)));
    }
    let reading = PhotoReading {
        mask: object.mask.as_ref().map(|mask| folder.join(mask)),
        ..PhotoReading::default()
    };
    let photo = PhotoInput::File(path).load(&reading)?;
    Ok(Source::Photo(Box::new(photo)))
}

fn read_background(path: &Path, scene: &SceneDescription) -> Result<Background, Box<dyn Error>> {
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

/// What is read.
fn files_of(scene: &SceneDescription, folder: &Path) -> Vec<PathBuf> {
    let light = &scene.light;
    let lights = [&light.panorama, &light.coefficients, &light.object];
    let objects = scene
        .objects
        .iter()
        .flat_map(|object| iter::once(&object.photo).chain(&object.mask));
    iter::once(&scene.background)
        .chain(lights.into_iter().flatten())
        .chain(objects)
        .map(|path| folder.join(path))
        .collect()
}

/// Whether this background can become that output.
fn check_output(
    background: &Background,
    is_movie: bool,
    arguments: &Arguments,
) -> Result<(), String> {
    let output = arguments.output.display();
    match background {
        Background::Photo(_) if is_movie => Err(format!(
            "{output}: a photograph does not move; give .png or .exr"
        )),
        Background::Panorama(_) if is_movie && arguments.turn.is_none() => Err(format!(
            "{output}: a panorama moves with --turn DEGREES; give it, or .png or .exr"
        )),
        Background::Movie(_) if !is_movie => {
            Err(format!("{output}: give .mp4 or .webm for a video"))
        }
        Background::Photo(_) | Background::Movie(_) if arguments.turn.is_some() => {
            Err("--turn: only a panorama can be turned".to_owned())
        }
        _ => Ok(()),
    }
}

/// All that is known before the objects are.
struct Work {
    background: Background,
    /// The first frame of a video.
    first: Option<Rgb<Linear>>,
    extent: Extent,
    light: LightSource,
    tilt: f64,
    matching: Matching,
    /// What a panorama's radiance is shown times.
    shown: f32,
    network: Network,
}

impl Work {
    fn new(
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
    fn subjects(
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
                        subject: Subject::of_asset(&asset)?,
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
    fn write(
        &mut self,
        scene: &Scene<'_>,
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
        scene: &Scene<'_>,
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
        scene: &Scene<'_>,
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

fn number(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| "give a number".to_owned())
}

fn pair<T: std::str::FromStr>(text: &str) -> Option<[T; 2]> {
    let numbers: Vec<T> = text
        .split(',')
        .map(|part| part.trim().parse().ok())
        .collect::<Option<_>>()?;
    numbers.try_into().ok()
}

fn place(text: &str) -> Result<[f64; 2], String> {
    pair(text).ok_or_else(|| {
        "give X,Y: parts of the picture's width and height, such as 0.5,0.9".to_owned()
    })
}

fn size(text: &str) -> Result<[u32; 2], String> {
    pair(text).ok_or_else(|| "give W,H in pixels".to_owned())
}
