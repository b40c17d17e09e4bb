//! `relight render`: from maps and light to an image, a video in which the light rotates, a sheet of materials.

mod object;

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use rayon::prelude::*;
use relight_core::light::{Direction, Order, Rotation, ShLight};
use relight_core::render::{RenderSettings, Surface, exposure_for};
use relight_photo::files::{MovieWriter, OutputKind, write_picture};
use relight_photo::relighting::{InsertError, LightSource, exposure_for_object};
use relit_console::{Console, Outcome};
use serde_json::json;

use self::object::{Map, ObjectArguments};
use crate::commands::CommandResult;
use crate::folder::make_empty_folder;
use crate::lighting::{LightArguments, RotationArguments, ShadingArgument};
use crate::values::within;

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight render image mug --light studio.hdr -o lit.png
      the object of relight turn or relight decompose in the light of a panorama
  relight render image --normals normal.png --albedo albedo.png --lamp 60,30 -o lit.png
      the same from maps, in the light of a lamp
  relight render image --normals normal.png --albedo albedo.png --reflectance 0.3 --smoothness 60 \\
      --light light.txt --rotate 360 --seconds 8 -o rotation.mp4
      a glossy object, while the light rotates once about the vertical
  relight render materials --normals normal.png --normals-y down --light studio.hdr -o materials.png
      the object in many materials; its map of normals has y down";

/// How many decimal places frames have in their names.
const PLACES: usize = 4;

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    result: RenderedResult,
}

#[derive(Subcommand)]
enum RenderedResult {
    /// An image, or with --rotate a video in which the light rotates.
    Image(Box<ImageArguments>),
    /// The object in many materials: smoothness 5 to 200 across, reflectance 0 to 40 % down.
    Materials(Box<MaterialsArguments>),
}

#[derive(Args)]
struct ImageArguments {
    /// The image (.png, .exr), or with --rotate a video (.mp4, .webm) or a folder for PNG frames.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    #[command(flatten)]
    render: RenderArguments,
    #[command(flatten, next_help_heading = "Video")]
    rotation: RotationArguments,
}

#[derive(Args)]
struct MaterialsArguments {
    /// The image (.png, .exr).
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    #[command(flatten)]
    render: RenderArguments,
}

/// The object, its light, and how it is shown.
#[derive(Args)]
struct RenderArguments {
    /// Brightness in stops: 0 shows a white surface in even light of radiance 1 as white; auto, one that faces the strongest
    /// light, and without --rotate more if that comes from behind.
    #[arg(long, value_name = "STOPS", default_value = "auto", value_parser = exposure, allow_hyphen_values = true)]
    exposure: Exposure,
    #[command(flatten)]
    shading: ShadingArgument,
    #[command(flatten, next_help_heading = "Object")]
    object: ObjectArguments,
    #[command(flatten, next_help_heading = "Light")]
    light: LightArguments,
    /// Order of the light's spherical harmonics; the paper's is 2, highlights need more [default: that of the coefficients, else
    /// 48].
    #[arg(long, value_name = "0-64", value_parser = clap::value_parser!(u8).range(0..=Order::MAX as i64))]
    order: Option<u8>,
    /// Also write the light's coefficients to this file.
    #[arg(long, value_name = "FILE")]
    save_light: Option<PathBuf>,
}

#[derive(Clone, Copy)]
enum Exposure {
    Auto,
    Stops(f32),
}

impl Arguments {
    /// The fault of the combination of arguments, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        match &self.result {
            RenderedResult::Image(arguments) => {
                let rotates = arguments.rotation.rotate.is_some();
                let fault = arguments.render.fault();
                fault.or_else(|| output_fault(&arguments.output, rotates))
            }
            RenderedResult::Materials(arguments) => {
                let fault = arguments.render.fault();
                fault.or_else(|| output_fault(&arguments.output, false))
            }
        }
    }
}

/// The fault of the output's name, if there is one.
fn output_fault(output: &Path, rotates: bool) -> Option<String> {
    let is_folder = output.extension().is_none();
    let wanted = match OutputKind::from_path(output) {
        Some(OutputKind::Png | OutputKind::Exr) if !rotates => return None,
        Some(OutputKind::Movie(_)) if rotates => return None,
        None if rotates && is_folder => return None,
        _ if rotates => "a folder without an extension, .mp4 or .webm for --rotate",
        _ => ".png or .exr",
    };
    Some(format!("--output {}: give {wanted}", output.display()))
}

impl RenderArguments {
    fn fault(&self) -> Option<String> {
        if self.light.is_empty() {
            return Some("give the light with --light FILE or --lamp AZIMUTH,ELEVATION".to_owned());
        }
        match &self.object.smoothness {
            Map::Even([first, others @ ..]) if others.iter().any(|value| value != first) => {
                Some("--smoothness: give one value or a file".to_owned())
            }
            _ => None,
        }
    }

    /// The light, rotated; written to a file on request.
    fn read_light(&self) -> Result<ShLight, Box<dyn Error>> {
        let order = self.order.map(|order| Order::new(order.into()));
        let order = order.transpose()?;
        let light = match self.light.read()? {
            Some(LightSource::Panorama(panorama)) => {
                panorama.project(order.unwrap_or(Order::RENDER))
            }
            Some(LightSource::Lamp(lamp)) => lamp.light(order.unwrap_or(Order::RENDER)),
            Some(LightSource::Coefficients(light)) => {
                let order = order.unwrap_or(light.order());
                light.with_order(order)
            }
            None => return Err("give --light or --lamp".into()),
        };
        let light = light.rotated(&Rotation::about(Direction::UP, self.light.angle()));
        if let Some(path) = &self.save_light {
            light.write(path)?;
        }
        Ok(light)
    }

    /// `is_still` says that the light does not rotate, so that its side is known.
    fn settings(&self, light: &ShLight, is_still: bool) -> RenderSettings {
        RenderSettings {
            diffuse: self.shading.diffuse(),
            specular: self.shading.specular(),
            exposure: match self.exposure {
                Exposure::Auto if is_still => exposure_for_object(light),
                Exposure::Auto => exposure_for(light),
                Exposure::Stops(stops) => stops.exp2() * relight_core::render::EXPOSURE,
            },
        }
    }
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    match &arguments.result {
        RenderedResult::Image(arguments) => image(arguments, console),
        RenderedResult::Materials(arguments) => materials(arguments, console),
    }
}

fn image(arguments: &ImageArguments, console: Console) -> CommandResult {
    let scene = LitObject::read(&arguments.render, arguments.rotation.rotate.is_none())?;
    let frames = if arguments.rotation.rotate.is_some() {
        rotation(arguments, &scene, console)?;
        arguments.rotation.frames()
    } else {
        let picture = scene.settings.image(&scene.surface, &scene.light)?;
        write_picture(&arguments.output, &picture)?;
        1
    };
    report(&arguments.output, frames, &scene.settings, console);
    Ok(Outcome::Success)
}

fn materials(arguments: &MaterialsArguments, console: Console) -> CommandResult {
    const REFLECTED: [f32; 4] = [0.0, 0.04, 0.15, 0.4];
    const SMOOTHNESSES: [f32; 6] = [5.0, 10.0, 20.0, 50.0, 100.0, 200.0];
    let LitObject {
        surface,
        light,
        settings,
    } = LitObject::read(&arguments.render, true)?;
    let sheet = settings.sweep(&surface, &light, &REFLECTED, &SMOOTHNESSES)?;
    write_picture(&arguments.output, &sheet)?;
    report(&arguments.output, 1, &settings, console);
    Ok(Outcome::Success)
}

/// An object in its light.
struct LitObject {
    surface: Surface,
    light: ShLight,
    settings: RenderSettings,
}

impl LitObject {
    fn read(arguments: &RenderArguments, is_still: bool) -> Result<Self, Box<dyn Error>> {
        let surface = arguments.object.read()?;
        let light = arguments.read_light()?;
        let settings = arguments.settings(&light, is_still);
        Ok(Self {
            surface,
            light,
            settings,
        })
    }
}

fn report(output: &Path, frames: u32, settings: &RenderSettings, console: Console) {
    let output = output.display().to_string();
    let event = json!({ "event": "rendered", "output": output, "frames": frames, "exposure": settings.exposure });
    console.print(&output, &event);
}

/// Writes the frames of a video in which the light rotates.
fn rotation(
    arguments: &ImageArguments,
    scene: &LitObject,
    console: Console,
) -> Result<(), Box<dyn Error>> {
    let rotation = &arguments.rotation;
    let frame = |at: u32| {
        let part = rotation.degrees_at(at) / 360.0;
        let image = scene.settings.turned(&scene.surface, &scene.light, part)?;
        Ok::<_, InsertError>(image.encode())
    };
    let (path, frames) = (&arguments.output, rotation.frames());
    let bar = console.progress(frames.into(), "frames");
    if let Some(OutputKind::Movie(format)) = OutputKind::from_path(path) {
        let encoding = (format, rotation.fps);
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
