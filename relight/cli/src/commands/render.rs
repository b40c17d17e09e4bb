//! `relight render`: from maps and light to an image, a turn, a sweep of materials.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;
use rayon::prelude::*;
use relight_core::captured_object::CapturedObject;
use relight_core::files::{Map, MapFiles};
use relight_core::files::{MovieFormat, MovieWriter};
use relight_core::image::{Linear, Rgb, Transfer};
use relight_core::light::{Direction, NormalsFrame, Order, Panorama, Rotation, ShLight};
use relight_core::render::{DiffuseForm, Look, SpecularForm, Surface, exposure_for};
use relit_console::{Console, Outcome};
use serde_json::json;

use crate::commands::CommandResult;
use crate::folder::make_empty_folder;
use crate::values::{Choices, DIFFUSE_FORMS, NORMALS_Y, TRANSFERS, one_of};

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
        value_parser = degrees,
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

/// The kinds of file that come out.
enum Target<'a> {
    Png(&'a Path),
    Exr(&'a Path),
    Movie(&'a Path, MovieFormat),
    Folder(&'a Path),
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
        let wanted = match self.target() {
            Target::Png(_) | Target::Exr(_) if is_turn => "a folder, .mp4 or .webm for --turn",
            Target::Movie(..) | Target::Folder(_) if !is_turn => ".png or .exr",
            Target::Folder(path) if path.extension().is_some() => {
                "a folder without an extension, .mp4 or .webm for --turn"
            }
            _ => return None,
        };
        Some(format!("--output {}: give {wanted}", self.output.display()))
    }

    fn target(&self) -> Target<'_> {
        let path = self.output.as_path();
        let has = |name: &str| {
            path.extension()
                .is_some_and(|e| e.eq_ignore_ascii_case(name))
        };
        match MovieFormat::of(path) {
            Some(format) => Target::Movie(path, format),
            None if has("png") => Target::Png(path),
            None if has("exr") => Target::Exr(path),
            None => Target::Folder(path),
        }
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
    let frames = arguments.turn.unwrap_or(1);
    match arguments.target() {
        Target::Png(path) => still(arguments, &look, &surface, &light)?
            .encode()
            .write_png(path)?,
        Target::Exr(path) => still(arguments, &look, &surface, &light)?.write_exr(path)?,
        Target::Folder(folder) => {
            let bar = console.progress(frames.into(), "frames");
            make_empty_folder(folder)?;
            (0..frames).into_par_iter().try_for_each(|frame| {
                let image = look.turned(&surface, &light, part(frame, frames))?;
                let name = format!("{frame:0PLACES$}.png");
                bar.inc(1);
                image.encode().write_png(&folder.join(name))
            })?;
            bar.finish_and_clear();
        }
        Target::Movie(path, format) => {
            let bar = console.progress(frames.into(), "frames");
            let mut movie = MovieWriter::create(path, format, surface.extent(), arguments.fps)?;
            for frame in 0..frames {
                let image = look.turned(&surface, &light, part(frame, frames))?;
                movie.push(&image.encode())?;
                bar.inc(1);
            }
            movie.finish()?;
            bar.finish_and_clear();
        }
    }
    let output = arguments.output.display().to_string();
    console.say(
        &output,
        &json!({ "event": "rendered", "output": output, "frames": frames, "exposure": look.exposure }),
    );
    Ok(Outcome::Whole)
}

/// The one image that is asked for.
fn still(
    arguments: &Arguments,
    look: &Look,
    surface: &Surface,
    light: &ShLight,
) -> Result<Rgb<Linear>, relight_core::image::ImageError> {
    const REFLECTED: [f32; 4] = [0.0, 0.04, 0.15, 0.4];
    const SMOOTHNESSES: [f32; 6] = [5.0, 10.0, 20.0, 50.0, 100.0, 200.0];
    if arguments.sweep {
        look.sweep(surface, light, &REFLECTED, &SMOOTHNESSES)
    } else {
        look.image(surface, light)
    }
}

/// How far the light has turned at a frame.
fn part(frame: u32, frames: u32) -> f64 {
    f64::from(frame) / f64::from(frames)
}

fn degrees(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(degrees) if (-36_000.0..=36_000.0).contains(&degrees) => Ok(degrees),
        _ => Err("give degrees from -36000 to 36000".to_owned()),
    }
}

fn exposure(text: &str) -> Result<Exposure, String> {
    match text.parse::<f32>() {
        _ if text == "auto" => Ok(Exposure::Auto),
        Ok(stops) if (-30.0..=30.0).contains(&stops) => Ok(Exposure::Stops(stops)),
        _ => Err("give stops from -30 to 30, or auto".to_owned()),
    }
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
