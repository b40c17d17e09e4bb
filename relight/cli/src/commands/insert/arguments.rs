//! The arguments of `relight insert`, and the scene that they describe.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::{ArgAction, Args};
use relight_core::captured_object::CapturedObject;
use relight_core::image::Transfer;
use relight_photo::compositing::{LightDescription, ObjectDescription, SceneDescription};
use relight_photo::files::{InsertionOutput, OutputKind, PhotoReading};
use relight_photo::relighting::{LightSource, WhiteBalance};
use relit_data::text;

use crate::photos::NetworkArguments;
use crate::values::{TRANSFERS, WHITE_BALANCES, degrees, one_of};

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight insert cup.jpg --mask cup-mask.png --into room.jpg --at 0.4,0.9 --height 0.3 -o out.png
      the cup in another photograph, in the light that is taken from it
  relight insert bear.jpg cup.jpg --mask masks --into room.hdr --at 0.6,0.85 --height 0.5 \\
      --at 0.35,0.95 --height 0.3 -o out.png
      two objects, from back to front, in a panorama; their masks are masks/bear.png and masks/cup.png
  relight insert cup.jpg --mask cup-mask.png --into room.jpg --lamp 60,30 -o out.exr
      in the light of a lamp
  relight insert object.relit --into room.hdr -o out.png
      an object that relight turn has written (object.relit)
  relight insert --scene scene.toml -o out.png
      all of it from a file (docs/relight-insert.md)";

#[derive(Args)]
pub(crate) struct Arguments {
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
    /// The picture (.png, .jpg, .exr), or a video (.mp4, .webm). Its folder is made where there is none.
    #[arg(short, long, value_name = "OUT")]
    pub(super) output: PathBuf,
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
    /// Leave brightness, white balance and grain of the objects as they are.
    #[arg(long, conflicts_with = "scene")]
    no_match: bool,
    /// How the colour of the light is shown [default: light].
    #[arg(long, value_parser = one_of(WHITE_BALANCES), conflicts_with = "scene")]
    white_balance: Option<WhiteBalance>,
    /// Turn the light about the vertical first, from the viewer to the right, and a panorama behind the objects with it.
    #[arg(long, value_name = "DEGREES", value_parser = number, allow_hyphen_values = true, conflicts_with = "scene")]
    turned: Option<f64>,
    /// Turn a panorama and its light by so many degrees about the vertical, in a video.
    #[arg(long, value_name = "DEGREES", value_parser = degrees(), allow_hyphen_values = true)]
    pub(super) turn: Option<f64>,
    /// How long the turn takes, seconds.
    #[arg(long, value_name = "SECONDS", value_parser = number, default_value_t = 10.0, requires = "turn")]
    seconds: f64,
    /// Frames a second of a turn.
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=240))]
    fps: u32,
    #[command(flatten)]
    pub(super) network: NetworkArguments,
}

/// What is said of the objects; what is given once holds for all, what is given as often as there are objects for one each.
#[derive(Args)]
struct ObjectArguments {
    /// How the photograph is encoded, where it is a PNG, JPEG or WebP; EXR and HDR are linear [default: what the file says, or
    /// sRGB].
    #[arg(long, value_parser = one_of(TRANSFERS), action = ArgAction::Append, conflicts_with = "scene")]
    transfer: Vec<Transfer>,
    /// A mask, white on the object, or a folder of masks, <photo's name>.png.
    #[arg(long, value_name = "FILE|DIR", action = ArgAction::Append, conflicts_with = "scene")]
    mask: Vec<PathBuf>,
    /// The middle of the object's lower edge in the picture, in parts of its width and height from the upper left corner.
    #[arg(long, value_name = "X,Y", value_parser = place, action = ArgAction::Append, conflicts_with = "scene")]
    at: Vec<[f64; 2]>,
    /// The object's height in parts of the picture's.
    #[arg(long, value_name = "PART", value_parser = number, action = ArgAction::Append, conflicts_with = "scene")]
    height: Vec<f64>,
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
}

impl Arguments {
    /// What is wrong with the combination of arguments, if anything is.
    pub(crate) fn fault(&self) -> Option<String> {
        let count = self.photos.len();
        let object = &self.object;
        let lists = [
            ("--mask", object.mask.len()),
            ("--transfer", object.transfer.len()),
            ("--at", object.at.len()),
            ("--height", object.height.len()),
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
        if OutputKind::from_path(&self.output).is_none() {
            return Some(format!(
                "--output {}: give .png, .jpg, .exr, .mp4 or .webm",
                self.output.display()
            ));
        }
        let is_movie = matches!(
            OutputKind::from_path(&self.output),
            Some(OutputKind::Movie(_))
        );
        (self.turn.is_some() && !is_movie).then(|| {
            format!(
                "--output {}: give .mp4 or .webm for --turn",
                self.output.display()
            )
        })
    }

    /// The file that is asked for.
    pub(super) fn written(&self) -> InsertionOutput<'_> {
        InsertionOutput {
            path: &self.output,
            turn: self.turn.unwrap_or(360.0),
            seconds: self.seconds,
            frames_per_second: self.fps,
        }
    }

    /// The scene that is asked for, and the folder that its paths are relative to.
    pub(super) fn description(&self) -> Result<(SceneDescription, PathBuf), Box<dyn Error>> {
        if let Some(path) = &self.scene {
            let text = text::read(path)
                .map_err(|error| format!("{} cannot be read: {error}", path.display()))?;
            let scene = SceneDescription::parse(&text)
                .map_err(|error| format!("{}: {error}", path.display()))?;
            let folder = path.parent().unwrap_or(Path::new("")).to_owned();
            return Ok((scene, folder));
        }
        let objects = (0..self.photos.len())
            .map(|number| self.object.describe(&self.photos, number))
            .collect();
        let (coefficients, panorama) = match &self.light.light {
            Some(path) if LightSource::is_text(path) => (Some(path.clone()), None),
            other => (None, other.clone()),
        };
        let scene = SceneDescription {
            background: self.into.clone().unwrap_or_default(),
            size: self.size.unwrap_or([1280, 960]),
            field: 60.0,
            down: 10.0,
            tilt: None,
            light: LightDescription {
                panorama,
                lamp: self.light.lamp.clone(),
                ambient: None,
                coefficients,
                object: None,
                turn: self.turned.unwrap_or(0.0),
            },
            matches: !self.no_match,
            white_balance: self.white_balance.unwrap_or(WhiteBalance::Light),
            exposure: 0.0,
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
                .filter(|mask| !(CapturedObject::is_named(&photo) && mask.is_dir()))
                .map(|mask| {
                    let name = photo.file_stem().unwrap_or_default();
                    PhotoReading::mask_path(&mask, &name.to_string_lossy())
                }),
            transfer: of(&self.transfer, number),
            at: of(&self.at, number).unwrap_or([across, 0.9]),
            height: of(&self.height, number).unwrap_or(0.4),
            rotation: 0.0,
            tint: [1.0; 3],
            gloss: None,
            exposure: 0.0,
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
