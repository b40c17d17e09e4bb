//! `relight render`: from maps and light to an image, or a video in which the light rotates.

mod object;

use std::error::Error;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use relight_core::light::{Direction, Order, Rotation, ShLight};
use relight_core::render::{RenderSettings, Surface, exposure_for};
use relight_photo::files::{MovieFormat, MovieWriter, OutputKind, write_picture};
use relight_photo::relighting::{InsertError, LightSource, exposure_for_object};
use relit_console::{Console, Outcome};
use serde_json::json;

use self::object::{Map, ObjectArguments};
use crate::commands::CommandResult;
use crate::lighting::{LightArguments, RotationArguments, ShadingArgument};
use crate::photos::not_an_input;
use crate::values::within;

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight render image mug --light studio.hdr -o lit.png
      the object of relight turn or relight decompose in the light of a panorama
  relight render image --normals normal.png --albedo albedo.png --lamp 60,30 -o lit.png
      the same from maps, in the light of a lamp
  relight render image --normals normal.png --albedo albedo.png --reflectance 0.3 --smoothness 60 \\
      --light light.txt --rotate 360 --seconds 8 -o rotation.mp4
      a glossy object, while the light rotates once about the vertical";

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    result: RenderedResult,
}

#[derive(Subcommand)]
enum RenderedResult {
    /// An image, or with --rotate a video in which the light rotates.
    Image(Box<ImageArguments>),
}

#[derive(Args)]
struct ImageArguments {
    /// The image (.png, .exr), or with --rotate a video (.mp4, .webm).
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
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
    #[command(flatten, next_help_heading = "Video")]
    rotation: RotationArguments,
}

#[derive(Clone, Copy)]
enum Exposure {
    Auto,
    Stops(f32),
}

impl Arguments {
    /// The fault of the combination of arguments, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        let RenderedResult::Image(arguments) = &self.result;
        arguments.fault()
    }
}

impl ImageArguments {
    fn fault(&self) -> Option<String> {
        if self.light.is_empty() {
            return Some("give the light with --light FILE or --lamp AZIMUTH,ELEVATION".to_owned());
        }
        if let Map::Even([first, others @ ..]) = &self.object.smoothness
            && others.iter().any(|value| value != first)
        {
            return Some("--smoothness: give one value or a file".to_owned());
        }
        let rotates = self.rotation.rotate.is_some();
        let wanted = match OutputKind::from_path(&self.output) {
            Some(OutputKind::Png | OutputKind::Exr) if !rotates => return None,
            Some(OutputKind::Movie(_)) if rotates => return None,
            _ if rotates => ".mp4 or .webm for --rotate",
            _ => ".png or .exr",
        };
        Some(format!("--output {}: give {wanted}", self.output.display()))
    }

    /// Refuses to overwrite what is read, and one result by the other.
    fn check_outputs(&self) -> Result<(), String> {
        if self.save_light.as_ref() == Some(&self.output) {
            let output = self.output.display();
            return Err(format!(
                "{output} is named twice: give the light another name"
            ));
        }
        let mut inputs = self.object.inputs();
        inputs.extend(self.light.light.clone());
        let mut outputs = self.save_light.iter().chain([&self.output]);
        outputs.try_for_each(|output| not_an_input(output, &inputs))
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

    fn settings(&self, light: &ShLight) -> RenderSettings {
        RenderSettings {
            diffuse: self.shading.diffuse(),
            specular: self.shading.specular(),
            exposure: match self.exposure {
                // Of light that does not rotate the side is known.
                Exposure::Auto if self.rotation.rotate.is_none() => exposure_for_object(light),
                Exposure::Auto => exposure_for(light),
                Exposure::Stops(stops) => stops.exp2() * relight_core::render::EXPOSURE,
            },
        }
    }
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let RenderedResult::Image(arguments) = &arguments.result;
    arguments.check_outputs()?;
    let scene = LitObject::read(arguments, console)?;
    let frames = match OutputKind::from_path(&arguments.output) {
        Some(OutputKind::Movie(format)) => film(arguments, format, &scene, console)?,
        _ => {
            let picture = scene.settings.image(&scene.surface, &scene.light)?;
            write_picture(&arguments.output, &picture)?;
            1
        }
    };
    let output = arguments.output.display().to_string();
    let event = json!({
        "event": "rendered", "output": output, "frames": frames, "exposure": scene.settings.exposure,
    });
    console.print(&output, &event);
    Ok(Outcome::Success)
}

/// An object in its light.
struct LitObject {
    surface: Surface,
    light: ShLight,
    settings: RenderSettings,
}

impl LitObject {
    fn read(arguments: &ImageArguments, console: Console) -> Result<Self, Box<dyn Error>> {
        let surface = arguments.object.read(console)?;
        let light = arguments.read_light()?;
        let settings = arguments.settings(&light);
        Ok(Self {
            surface,
            light,
            settings,
        })
    }
}

/// Writes a video in which the light rotates; how many frames it has.
fn film(
    arguments: &ImageArguments,
    format: MovieFormat,
    scene: &LitObject,
    console: Console,
) -> Result<u32, InsertError> {
    let rotation = &arguments.rotation;
    let frame = |at: u32| {
        let part = rotation.degrees_at(at) / 360.0;
        let image = scene.settings.turned(&scene.surface, &scene.light, part)?;
        Ok::<_, InsertError>(image.encode())
    };
    let frames = rotation.frames();
    let bar = console.progress(frames.into(), "frames");
    let encoding = (format, rotation.fps);
    MovieWriter::write_frames(&arguments.output, encoding, frames, frame, || bar.inc(1))?;
    bar.finish_and_clear();
    Ok(frames)
}

fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    let stops = within(-30.0..=30.0, "auto, or stops")(text)?;
    Ok(Exposure::Stops(stops))
}
