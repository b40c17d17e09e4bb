//! The arguments of `relight insert`, and the scene that they describe.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::{ArgAction, Args};
use relight_photo::compositing::{LightDescription, ObjectDescription, SceneDescription};
use relight_photo::export::is_object;
use relight_photo::files::{InsertionOutput, OutputKind, PhotoReading};
use relit_data::geometry::Rect;
use relit_data::text;

use crate::lighting::{LightArguments, RotationArguments, is_own};
use crate::photos::NetworkArguments;

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight insert cup.jpg --mask cup-mask.png --into room.jpg --at 0.4,0.9 --height 0.3 -o out.png
      the cup in another photograph, in the light estimated from it
  relight insert bear.jpg cup.jpg --mask masks --into room.hdr --at 0.6,0.85 --height 0.5 \\
      --at 0.35,0.95 --height 0.3 -o out.png
      two objects, from back to front, in a panorama; their masks are masks/bear.png and masks/cup.png
  relight insert cup.jpg --mask cup-mask.png --into room.jpg --lamp 60,30 -o out.exr
      in the light of a lamp
  relight insert mug --into room.hdr -o out.png
      an object that relight turn or relight decompose has written: its folder, or mug/object.relit
  relight insert --scene scene.toml -o out.png
      everything from a file (docs/guide/photograph.md)";

#[derive(Args)]
pub(crate) struct Arguments {
    /// The objects, from back to front: photographs, or objects with maps (object.relit, or a folder of relight turn or relight
    /// decompose).
    #[arg(value_name = "PHOTO", required_unless_present = "scene")]
    photos: Vec<PathBuf>,
    /// A scene file with background, light and objects, in place of the options below.
    #[arg(
        long,
        value_name = "FILE.toml",
        conflicts_with_all = ["photos", "into", "mask", "rect", "at", "height", "light", "lamp", "light_angle"]
    )]
    scene: Option<PathBuf>,
    /// The picture (.png, .jpg, .exr) or video (.mp4, .webm); its folder is created if missing.
    #[arg(short, long, value_name = "OUT")]
    pub(super) output: PathBuf,
    /// The background: a photograph, a panorama (HDR or EXR, twice as wide as high), or a video.
    #[arg(long, value_name = "FILE", required_unless_present = "scene")]
    into: Option<PathBuf>,
    #[command(
        flatten,
        next_help_heading = "Objects (once for all, or once for each)"
    )]
    object: ObjectArguments,
    #[command(flatten, next_help_heading = "Light [default: that of the background]")]
    light: LightArguments,
    #[command(flatten, next_help_heading = "Video before a panorama")]
    pub(super) rotation: RotationArguments,
    #[command(flatten, next_help_heading = "Network")]
    pub(super) network: NetworkArguments,
}

/// Options of the objects: given once, an option applies to all; given once for each object, to one each.
#[derive(Args)]
struct ObjectArguments {
    /// A mask, white on the object, or a folder of masks, PHOTO.png.
    #[arg(long, value_name = "FILE|DIR", action = ArgAction::Append)]
    mask: Vec<PathBuf>,
    /// A rectangle around the object in its photograph, pixels: the object is cut out within it, as by relit-mask --rect.
    #[arg(long, value_name = "X,Y,W,H", conflicts_with = "mask", action = ArgAction::Append)]
    rect: Vec<Rect>,
    /// Centre of the object's lower edge, in parts of width and height from the upper left.
    #[arg(long, value_name = "X,Y", value_parser = place, action = ArgAction::Append)]
    at: Vec<[f64; 2]>,
    /// The object's height, as a part of the picture's.
    #[arg(long, value_name = "PART", value_parser = number, action = ArgAction::Append)]
    height: Vec<f64>,
}

impl Arguments {
    /// The fault of the combination of arguments, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        let count = self.photos.len();
        let object = &self.object;
        let lists = [
            ("--mask", object.mask.len()),
            ("--rect", object.rect.len()),
            ("--at", object.at.len()),
            ("--height", object.height.len()),
        ];
        let odd = lists
            .into_iter()
            .find(|&(_, given)| given > 1 && given != count);
        if let Some((name, given)) = odd {
            return Some(format!(
                "{name} is given {given} times for {count} photographs: give it once, or once for each"
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
        if self.light.light.as_deref().is_some_and(is_own) {
            return Some(
                "--light own is for relight relight: without --light, objects are in the light of the background"
                    .to_owned(),
            );
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
        (self.rotation.rotate.is_some() && !is_movie).then(|| {
            format!(
                "--output {}: give .mp4 or .webm for --rotate",
                self.output.display()
            )
        })
    }

    /// The rectangle around an object in its photograph.
    pub(super) fn rectangle(&self, number: usize) -> Option<Rect> {
        of(&self.object.rect, number)
    }

    /// The file that is asked for.
    pub(super) fn written(&self) -> InsertionOutput<'_> {
        InsertionOutput {
            path: &self.output,
            rotate: self.rotation.rotate.unwrap_or(0.0),
            frames: self.rotation.frames(),
            frames_per_second: self.rotation.fps,
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
        let (coefficients, panorama) = self.light.files();
        let scene = SceneDescription {
            light: LightDescription {
                panorama: panorama.map(Path::to_owned),
                lamp: self.light.lamp.as_ref().map(|lamp| lamp.text.clone()),
                coefficients: coefficients.map(Path::to_owned),
                angle: self.light.light_angle,
                ..LightDescription::default()
            },
            ..SceneDescription::new(self.into.clone().unwrap_or_default(), objects)
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
        let mask = of(&self.mask, number)
            // A folder of masks is for the photographs.
            .filter(|mask| !(is_object(&photo) && mask.is_dir()))
            .map(|mask| {
                let name = photo.file_stem().unwrap_or_default();
                PhotoReading::mask_path(&mask, &name.to_string_lossy())
            });
        let default = ObjectDescription::new(photo);
        ObjectDescription {
            mask,
            at: of(&self.at, number).unwrap_or([across, default.at[1]]),
            height: of(&self.height, number).unwrap_or(default.height),
            ..default
        }
    }
}

/// The value for an object: its own, or the one for all.
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

fn place(text: &str) -> Result<[f64; 2], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y]) => Ok([x, y]),
        _ => Err("give X,Y: parts of the picture's width and height, such as 0.5,0.9".to_owned()),
    }
}
