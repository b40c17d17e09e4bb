//! `relight render`: from maps and light to an image, a turn, a sweep of materials.

mod object;

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use rayon::prelude::*;
use relight_core::image::{ImageError, Linear, Rgb, Srgb};
use relight_core::light::{Direction, Order, Panorama, Rotation, ShLight};
use relight_core::render::{DiffuseForm, Look, SpecularForm, Surface, exposure_for};
use relight_photo::files::{MovieWriter, OutputKind, write_picture};
use relight_photo::relighting::InsertError;
use relit_console::{Console, Outcome};
use serde_json::json;

use self::object::{Map, ObjectArguments};
use crate::commands::CommandResult;
use crate::folder::make_empty_folder;
use crate::values::{Choices, DIFFUSE_FORMS, degrees, one_of, within};

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
        let wanted = match OutputKind::from_path(&self.output) {
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
    Ok(Outcome::Success)
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
    if let Some(OutputKind::Movie(format)) = OutputKind::from_path(path) {
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
