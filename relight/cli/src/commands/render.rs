//! `relight render`: from maps and light to an image, a turn, a sweep of materials.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;
use rayon::prelude::*;
use relight_core::captured_object::CapturedObject;
use relight_core::files::{Map, MapFiles};
use relight_core::image::{ImageError, Linear, Rgb, Srgb, Transfer};
use relight_core::light::{Direction, NormalsFrame, Order, Panorama, Rotation, ShLight};
use relight_core::render::{DiffuseForm, Look, SpecularForm, Surface, exposure_for};
use relight_photo::files::{MovieWriter, OutputKind, write_picture};
use relight_photo::insert::InsertError;
use relit_console::{Console, Outcome};
use serde_json::json;

use crate::commands::CommandResult;
use crate::folder::make_empty_folder;
use crate::values::{Choices, DIFFUSE_FORMS, NORMALS_Y, TRANSFERS, degrees, one_of, within};

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight render --normals normal.png --albedo albedo.png --panorama studio.hdr -o lit.png
      the object in the light of a panorama
  relight render --normals normal.png --albedo albedo.png --reflectance 0.3 --smoothness 60 \\
      --light light.txt --turn 240 -o turn.mp4
      a glossy object, while the light turns once about the vertical
  relight render --normals normal.png --normals-y down --panorama studio.hdr --sweep -o materials.png
      the object in many materials; its map of normals has y down";

/// How many decimal places frames have in their names.
const PLACES: usize = 4;

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    object: ObjectArguments,
    #[command(flatten)]
    light: LightArguments,
    /// The image (.png, .exr), or for --turn a video (.mp4, .webm) or a folder for PNG frames.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Render this many frames, while the light turns once about the vertical, from the viewer to the right.
    #[arg(long, value_name = "FRAMES", value_parser = clap::value_parser!(u32).range(1..=100_000), conflicts_with = "sweep")]
    turn: Option<u32>,
    /// Frames a second of a video.
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=240))]
    fps: u32,
    /// Render one sheet of the object in many materials: smoothness 5 to 200 across, from 0 to 40 % of reflected light down.
    #[arg(long)]
    sweep: bool,
    /// Brightness in stops beyond a white diffuse surface under even light of radiance 1, or "auto": a white diffuse
    /// surface that faces the strongest light is white.
    #[arg(long, value_name = "STOPS", default_value = "auto", value_parser = exposure, allow_hyphen_values = true)]
    exposure: Exposure,
    /// The specular layer.
    #[arg(long, default_value = "lobe", value_parser = one_of(SPECULAR_FORMS))]
    specular: SpecularForm,
    /// The diffuse layer.
    #[arg(long, default_value = "irradiance", value_parser = one_of(DIFFUSE_FORMS))]
    diffuse: DiffuseForm,
}

#[derive(Args)]
struct ObjectArguments {
    /// A captured object, which relight turn has written (object.relit), in place of maps.
    #[arg(value_name = "OBJECT.relit", conflicts_with_all = ["normals", "mask", "albedo", "reflectance", "smoothness"])]
    asset: Option<PathBuf>,
    /// Normals: PNG of 8 or 16 bits, colours (n + 1) / 2, black outside; or EXR of vectors. x right, z to the viewer.
    #[arg(long, value_name = "FILE", required_unless_present = "asset")]
    normals: Option<PathBuf>,
    /// Which way y points in the map of normals.
    #[arg(long, value_name = "WAY", default_value = "up", value_parser = one_of(NORMALS_Y))]
    normals_y: NormalsFrame,
    /// A grey image; the object is where it is at least one half [default: where there are normals].
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
    /// Albedo: a file, or a linear value or three (0.8, or 0.8,0.5,0.3).
    #[arg(long, value_name = "FILE|VALUE", default_value = "0.8", value_parser = map)]
    albedo: Map,
    /// Specular reflectance s_p: a file, or a linear value or three; without it the object is diffuse.
    #[arg(long, value_name = "FILE|VALUE", value_parser = map)]
    reflectance: Option<Map>,
    /// Smoothness α: a value, an EXR, or an 8-bit PNG of values 0 to 255.
    #[arg(long, value_name = "FILE|VALUE", default_value = "50", value_parser = map)]
    smoothness: Map,
    /// How PNG and JPEG files of albedo and reflectance are encoded; EXR is linear.
    #[arg(long, default_value = "srgb", value_parser = one_of(TRANSFERS))]
    transfer: Transfer,
}

#[derive(Args)]
struct LightArguments {
    /// The light: an HDR or EXR panorama, whose middle is what the viewer sees behind the object.
    #[arg(
        long,
        value_name = "FILE",
        required_unless_present = "light",
        conflicts_with = "light"
    )]
    panorama: Option<PathBuf>,
    /// The light: coefficients of spherical harmonics, one line each of red, green, blue (nine for order 2).
    #[arg(long, value_name = "FILE")]
    light: Option<PathBuf>,
    /// The order of spherical harmonics to which a panorama is brought; the paper's is 2. Highlights need
    /// more, the smoother the surface is.
    #[arg(long, value_name = "0-64", default_value_t = Order::RENDER.get() as u8, value_parser = clap::value_parser!(u8).range(0..=Order::MAX as i64))]
    order: u8,
    /// Turn the light about the vertical first, from the viewer to the right.
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 0.0,
        value_parser = degrees(),
        allow_hyphen_values = true
    )]
    turned: f64,
    /// Write the coefficients of the light to this file, too.
    #[arg(long, value_name = "FILE")]
    save_light: Option<PathBuf>,
}

const SPECULAR_FORMS: Choices<SpecularForm> = &[
    (
        "lobe",
        "The Blinn-Phong lobe in zonal harmonics: close to the ground truth",
        SpecularForm::Lobe,
    ),
    (
        "power",
        "The paper's formula, for the first nine coefficients",
        SpecularForm::Power,
    ),
];

#[derive(Clone, Copy)]
enum Exposure {
    Auto,
    Stops(f32),
}

impl Arguments {
    /// What is wrong with the combination of arguments, if anything is.
    pub(crate) fn fault(&self) -> Option<String> {
        let is_turn = self.turn.is_some();
        if let Map::Even([first, others @ ..]) = &self.object.smoothness
            && others.iter().any(|value| value != first)
        {
            return Some("--smoothness: give one value or a file".to_owned());
        }
        let is_folder = self.output.extension().is_none();
        let wanted = match OutputKind::of(&self.output) {
            Some(OutputKind::Png | OutputKind::Exr) if !is_turn => return None,
            Some(OutputKind::Movie(_)) if is_turn => return None,
            None if is_turn && is_folder => return None,
            _ if is_turn => "a folder without an extension, .mp4 or .webm for --turn",
            _ => ".png or .exr",
        };
        Some(format!("--output {}: give {wanted}", self.output.display()))
    }

    fn look(&self, light: &ShLight) -> Look {
        Look {
            diffuse: self.diffuse,
            specular: self.specular,
            exposure: match self.exposure {
                Exposure::Auto => exposure_for(light),
                Exposure::Stops(stops) => stops.exp2() * relight_core::render::EXPOSURE,
            },
        }
    }
}

impl ObjectArguments {
    fn read(&self) -> Result<Surface, Box<dyn Error>> {
        match (&self.asset, &self.normals) {
            (Some(path), _) => Ok(CapturedObject::read(path)?.surface().clone()),
            (None, Some(normals)) => Ok(self.files(normals).read()?),
            (None, None) => Err("give an object (.relit), or --normals".into()),
        }
    }

    fn files(&self, normals: &Path) -> MapFiles {
        MapFiles {
            normals: normals.to_owned(),
            frame: self.normals_y,
            mask: self.mask.clone(),
            albedo: self.albedo.clone(),
            reflectance: self.reflectance.clone(),
            smoothness: self.smoothness.clone(),
            transfer: self.transfer,
        }
    }
}

impl LightArguments {
    fn read(&self) -> Result<ShLight, Box<dyn Error>> {
        let light = match (&self.panorama, &self.light) {
            (Some(path), _) => Panorama::read(path)?.project(Order::new(self.order.into())?),
            (None, Some(path)) => ShLight::read(path)?,
            (None, None) => return Err("give --panorama or --light".into()),
        };
        let turn = Rotation::about(Direction::UP, self.turned.to_radians());
        let light = light.rotated(&turn);
        if let Some(path) = &self.save_light {
            light.write(path)?;
        }
        Ok(light)
    }
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let surface = arguments.object.read()?;
    let light = arguments.light.read()?;
    let look = arguments.look(&light);
    let path = &arguments.output;
    if let Some(frames) = arguments.turn {
        turn(arguments, frames, console, |part| {
            Ok(look.turned(&surface, &light, part)?.encode())
        })?;
    } else {
        write_picture(path, &still(arguments, &look, &surface, &light)?)?;
    }
    let output = path.display().to_string();
    console.say(
        &output,
        &json!({ "event": "rendered", "output": output, "frames": arguments.turn.unwrap_or(1), "exposure": look.exposure }),
    );
    Ok(Outcome::Whole)
}

/// The one image that is asked for.
fn still(
    arguments: &Arguments,
    look: &Look,
    surface: &Surface,
    light: &ShLight,
) -> Result<Rgb<Linear>, ImageError> {
    const REFLECTED: [f32; 4] = [0.0, 0.04, 0.15, 0.4];
    const SMOOTHNESSES: [f32; 6] = [5.0, 10.0, 20.0, 50.0, 100.0, 200.0];
    if arguments.sweep {
        look.sweep(surface, light, &REFLECTED, &SMOOTHNESSES)
    } else {
        look.image(surface, light)
    }
}

/// Writes the frames of a turn; `frame` makes one, after a part of the turn.
fn turn(
    arguments: &Arguments,
    frames: u32,
    console: Console,
    frame: impl Fn(f64) -> Result<Rgb<Srgb>, InsertError> + Sync,
) -> Result<(), Box<dyn Error>> {
    let frame = |at: u32| frame(f64::from(at) / f64::from(frames));
    let path = &arguments.output;
    let bar = console.progress(frames.into(), "frames");
    if let Some(OutputKind::Movie(format)) = OutputKind::of(path) {
        let encoding = (format, arguments.fps);
        MovieWriter::write_frames(path, encoding, frames, frame, || bar.inc(1))?;
    } else {
        make_empty_folder(path)?;
        (0..frames).into_par_iter().try_for_each(|at| {
            frame(at)?.write_png(&path.join(format!("{at:0PLACES$}.png")))?;
            bar.inc(1);
            Ok::<_, InsertError>(())
        })?;
    }
    bar.finish_and_clear();
    Ok(())
}

fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    let stops = within(-30.0..=30.0, "auto, or stops")(text)?;
    Ok(Exposure::Stops(stops))
}

/// One number, three numbers parted by commas, or else a file.
fn map(text: &str) -> Result<Map, String> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(str::parse).collect();
    match numbers.as_deref() {
        Err(_) => Ok(Map::File(text.into())),
        Ok(&[value]) if is_value(value) => Ok(Map::Even([value; 3])),
        Ok(&[r, g, b]) if [r, g, b].into_iter().all(is_value) => Ok(Map::Even([r, g, b])),
        Ok(_) => Err("give a file, or one or three numbers that are not negative".to_owned()),
    }
}

fn is_value(number: f32) -> bool {
    number.is_finite() && number >= 0.0
}
