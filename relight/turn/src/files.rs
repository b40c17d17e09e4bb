//! What is written of a turn: a folder that appears when it is whole.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;

use relit_data::durable::write_whole;
use serde::Serialize;

use super::light::TERMS;
use super::maps::AngleFigure;
use super::{
    BodyFigure, BodyKind, Conditioning, Elevation, ExposureStep, ReadTurn, RoomStrip, SenseFigure,
    StartFigure, StripFigures, TableLight, TurnCurves, TurnError, TurnMaps, TurnSolution,
};
use relight_core::captured_object::CapturedObject;
use relight_core::files::ResultFolder;
use relight_core::files::write_png;
use relight_core::files::{MovieFormat, MovieWriter};
use relight_core::image::{ColourSpace, Depth, Extent, Linear, Planes, Rgb, Srgb};
use relight_core::light::{Direction, Normals, Order, ShLight, basis};
use relight_core::render::{DiffuseForm, DiffuseLayer, Look, SpecularForm, Surface, exposure_for};
use relight_photo::files::{bright, write_light};

/// The file of figures.
const FIGURES: &str = "turn.json";
/// The object as a file that can be lit.
const ASSET: &str = "object.relit";
/// What is written beside it.
const FILES: [&str; 13] = [
    "normal.png",
    "albedo.png",
    "shading.png",
    "highlight.png",
    "shadow.png",
    "confidence.png",
    "mask.png",
    "light.txt",
    "light.json",
    "contact.png",
    "relit.mp4",
    "room.png",
    ASSET,
];
const RESULTS: ResultFolder = ResultFolder {
    marker: FIGURES,
    holds: |name| name == FIGURES || FILES.contains(&name),
};
/// What it says it is.
const SCHEMA: &str = "relight.solved_turn/1";
/// Width and height of the pictures of the sheet, pixels, and how many stand in a row.
const TILE: usize = 256;
const COLUMNS: usize = 4;
/// Frames of the video, and frames a second.
const MOVIE_FRAMES: u32 = 90;
const MOVIE_RATE: u32 = 30;
/// Order of the lamp that goes around the object in the video, how wide it is, radians: a smaller one would have rings in this
/// order, and how high it stands, radians.
const LAMP_ORDER: usize = 8;
const LAMP_SPREAD: f64 = 0.3;
const LAMP_HEIGHT: f64 = 0.6;

/// A solved turn with all that is written of it.
#[derive(Debug, Clone, Copy)]
pub struct TurnFiles<'a> {
    /// What was read.
    pub turn: &'a ReadTurn,
    /// What was found.
    pub solution: &'a TurnSolution,
    /// What it leaves over.
    pub maps: &'a TurnMaps,
    /// Where the light is from: a file's name, or none where it was found.
    pub light_source: Option<&'a str>,
    /// Where the normals to start from are from.
    pub normals_source: Option<&'a str>,
    /// The room, where the video was read.
    pub strip: Option<&'a RoomStrip>,
    /// The object, where it is to be among the files, as `object.relit`.
    pub asset: Option<&'a CapturedObject>,
    /// Whether to write the video.
    pub has_movie: bool,
}

/// The figures of a turn, as `turn.json` holds them.
#[derive(Debug, Clone, Serialize)]
pub struct TurnFigures {
    schema: &'static str,
    software: String,
    turn: String,
    size: [usize; 2],
    pixels: usize,
    frames: u32,
    lost: Vec<String>,
    has_angles: bool,
    clipped: f64,
    elevation: Elevation,
    conditioning: Conditioning,
    advice: Option<&'static str>,
    normals: Option<String>,
    /// Whether these normals were left out: a body inflated out of the outline agrees with the turn better.
    normals_left_out: bool,
    light: FigureLight,
    /// What the object is taken for, and what each kind that was tried leaves.
    body: BodyKind,
    bodies: Vec<BodyFigure>,
    /// How well both senses of turning explain the turn; none where that is not told.
    sense: Option<SenseFigure>,
    /// What is left of a curve, over the energy of its variation, the median.
    residual: f64,
    /// The angle that normals are expected to be off, degrees, the median.
    expected_error_deg: f64,
    /// Specular reflectance and smoothness of the whole object, as `relight render` takes them; none for a matt one.
    gloss: Option<FigureGloss>,
    /// Which ambiguity nothing broke.
    ambiguity: Option<&'static str>,
    exposure_steps: Vec<ExposureStep>,
    /// What the room's strip says; none where the video was not read, or its sides do not show the same room.
    room: Option<FigureRoom>,
    white: FigureWhites,
    over_angle: Vec<AngleFigure>,
}

/// The room by the background of the video, beside the light that was found.
#[derive(Debug, Clone, Copy, Serialize)]
struct FigureRoom {
    #[serde(flatten)]
    strip: StripFigures,
    /// The light's bright side, as that of the strip.
    light_azimuth_deg: f64,
    /// How far the two are apart, degrees.
    apart_deg: f64,
}

impl FigureRoom {
    fn new(strip: &RoomStrip, light: &TableLight) -> Self {
        let strip = *strip.figures();
        let light_azimuth_deg = light.bright_azimuth_deg();
        let apart = (strip.bright_azimuth_deg - light_azimuth_deg).rem_euclid(360.0);
        Self {
            strip,
            light_azimuth_deg,
            apart_deg: apart.min(360.0 - apart),
        }
    }
}

#[derive(Debug, Clone, Copy, Serialize)]
struct FigureGloss {
    reflectance: f32,
    smoothness: f32,
    /// What no such gloss explains of the one that was found, as a part of it, effective value.
    residual: f64,
}

#[derive(Debug, Clone, Serialize)]
struct FigureLight {
    source: Option<String>,
    starts: Vec<StartFigure>,
}

/// The light that the largest value of a file stands for.
#[derive(Debug, Clone, Copy, Serialize)]
struct FigureWhites {
    albedo: f32,
    shading: f32,
    highlight: f32,
}

/// The light, as `light.json` holds it.
#[derive(Serialize)]
struct LightFile {
    schema: &'static str,
    frame: &'static str,
    order: usize,
    /// Red, green and blue of each coefficient (l, m), at l (l + 1) + m.
    coefficients: Vec<[f64; 3]>,
    /// e, f, g, Re a, Im a, Re b, Im b, Re d, Im d of each channel.
    terms: [[f64; TERMS]; 3],
    elevation: Elevation,
}

impl TurnFigures {
    /// How many frames were read.
    #[must_use]
    pub const fn frames(&self) -> u32 {
        self.frames
    }
}

impl TurnFiles<'_> {
    /// Whether results may be written to the folder `out`: it is not there, empty, or holds earlier results and nothing else.
    ///
    /// # Errors
    /// Where it holds something else, or cannot be read or written.
    pub fn check(out: &Path) -> Result<(), TurnError> {
        Ok(RESULTS.check(out)?)
    }

    /// Writes all files into the folder `out`, which appears when they are there; an earlier result in it is
    /// replaced.
    ///
    /// # Errors
    /// Where the folder holds something else or a file cannot be written: then the folder is as it was.
    pub fn write(&self, out: &Path) -> Result<TurnFigures, TurnError> {
        RESULTS.write(out, |folder| self.write_files(folder))
    }

    fn write_files(&self, folder: &Path) -> Result<TurnFigures, TurnError> {
        let Self { solution, maps, .. } = *self;
        let curves = &self.turn.curves;
        let path = |name: &str| folder.join(name);
        let surface = solution.surface(curves)?;
        let albedo = solution.albedo(curves);
        let shading = solution.shading(curves);
        surface
            .normals()
            .write_png(&path("normal.png"), Depth::Sixteen)?;
        let white = FigureWhites {
            albedo: write_light(&path("albedo.png"), &albedo)?,
            shading: write_light(&path("shading.png"), &shading)?,
            highlight: write_light(&path("highlight.png"), &grey(&maps.highlight))?,
        };
        let confidence = grey(&solution.confidence(curves));
        write_png(
            &path("shadow.png"),
            grey(&maps.shadow).planes(),
            Depth::Eight,
        )?;
        write_png(&path("confidence.png"), confidence.planes(), Depth::Eight)?;
        write_png(
            &path("mask.png"),
            grey(&self.turn.mask).planes(),
            Depth::Eight,
        )?;
        let light = solution.light().to_viewer(solution.frame())?;
        light.write(&path("light.txt"))?;
        write_json(&path("light.json"), &self.light_file()?)?;
        let sheet = self.sheet(&surface, &light)?;
        write_png(&path("contact.png"), &sheet, Depth::Eight)?;
        if let Some(strip) = self.strip {
            strip.write_png(&path("room.png"))?;
        }
        if let Some(asset) = self.asset {
            asset.write(&path(ASSET))?;
        }
        if self.has_movie {
            let white = bright(albedo.planes(), &self.turn.mask);
            write_movie(&path("relit.mp4"), &surface, white)?;
        }
        let figures = self.figures(white)?;
        write_json(&path(FIGURES), &figures)?;
        Ok(figures)
    }

    fn light_file(&self) -> Result<LightFile, TurnError> {
        let light = self.solution.light();
        Ok(LightFile {
            schema: "relight.table_light/1",
            frame: "table: x right, y away from the camera, z up the axis; at the table's angle 0",
            order: Order::TWO.get(),
            coefficients: light.coefficients()?.coefficients().to_vec(),
            terms: *light.terms(),
            elevation: self.solution.elevation,
        })
    }

    fn figures(&self, white: FigureWhites) -> Result<TurnFigures, TurnError> {
        let Self { turn, solution, .. } = *self;
        let Extent { width, height } = turn.curves.extent();
        let is_open = self.light_source.is_none() && !solution.has_prior;
        let gloss = solution.gloss(&turn.curves)?.map(|gloss| FigureGloss {
            reflectance: gloss.reflectance,
            smoothness: gloss.smoothness,
            residual: gloss.residual,
        });
        Ok(TurnFigures {
            schema: SCHEMA,
            software: format!("relight {}", env!("CARGO_PKG_VERSION")),
            turn: turn.name.clone(),
            size: [width, height],
            pixels: turn.curves.pixels(),
            frames: turn.curves.frames(),
            lost: turn.damage.clone(),
            has_angles: turn.has_angles,
            clipped: turn.curves.clipped(),
            elevation: solution.elevation,
            conditioning: solution.conditioning(),
            advice: solution.conditioning().verdict.advice(),
            normals: self.normals_source.map(str::to_owned),
            normals_left_out: solution.is_prior_left_out(),
            light: FigureLight {
                source: self.light_source.map(str::to_owned),
                starts: solution.starts().to_vec(),
            },
            body: solution.body(),
            bodies: solution.bodies().to_vec(),
            sense: solution.sense(),
            residual: solution.residual(),
            expected_error_deg: solution.expected_error_deg(),
            gloss,
            ambiguity: is_open.then_some(
                "light and shape are both unknown: the outline says that the object bulges, \
                 but how steep it is as a whole is open",
            ),
            exposure_steps: turn.curves.exposure_steps().to_vec(),
            room: self
                .strip
                .map(|strip| FigureRoom::new(strip, solution.light())),
            white,
            over_angle: self.maps.over_angle.clone(),
        })
    }

    /// One sheet: a frame, normals, albedo and shading; highlight, shadow, confidence, and a ball in the light.
    fn sheet(&self, surface: &Surface, light: &ShLight) -> Result<Planes<3>, TurnError> {
        let Self {
            turn,
            solution,
            maps,
            ..
        } = *self;
        let curves = &turn.curves;
        let lit = |planes: &Planes<3>| {
            let white = bright(planes, &turn.mask);
            let shown = planes
                .clone()
                .map(|v| Srgb::from_linear((v / white).clamp(0.0, 1.0)));
            shown.resized(tile(curves))
        };
        let plain = |planes: &Planes<3>| planes.resized(tile(curves));
        let picture = turn.first.first().map(|first| lit(first.planes()));
        let shading = solution.shading(curves);
        let ball = DiffuseLayer::new(light, DiffuseForm::Irradiance);
        let exposure = exposure_for(light);
        let side = tile(curves).height;
        let ball = ball.shading(&Normals::sphere(side)).into_planes();
        let ball = Rgb::<Linear>::new(ball.map(|value| value * exposure));
        let mut ball_tile = Planes::zeros(tile(curves));
        let ball = ball.encode::<Srgb>();
        for y in 0..side {
            for x in 0..side.min(tile(curves).width) {
                ball_tile.set_pixel(x, y, ball.planes().pixel(x, y));
            }
        }
        let tiles = [
            picture.unwrap_or_else(|| Planes::zeros(tile(curves))),
            plain(&surface.normals().to_colours()),
            lit(solution.albedo(curves).planes()),
            lit(shading.planes()),
            lit(grey(&maps.highlight).planes()),
            plain(grey(&maps.shadow).planes()),
            plain(grey(&solution.confidence(curves)).planes()),
            ball_tile,
        ];
        Ok(Planes::sheet(&tiles, COLUMNS)?)
    }
}

/// The size of the sheet's pictures: the frame's shape, [`TILE`] high.
fn tile(curves: &TurnCurves) -> Extent {
    let Extent { width, height } = curves.extent();
    Extent::new((TILE * width / height.max(1)).clamp(1, 8 * TILE), TILE)
}

/// A colour image of one plane.
fn grey(plane: &Planes<1>) -> Rgb<Linear> {
    let [values] = plane.planes();
    let width = plane.extent().width;
    Rgb::new(Planes::from_fn(plane.extent(), |x, y| {
        [values[y * width + x]; 3]
    }))
}

fn write_json(path: &Path, value: &impl Serialize) -> Result<(), TurnError> {
    let mut json = serde_json::to_vec_pretty(value).unwrap_or_default();
    json.push(b'\n');
    write_whole(path, &json).map_err(TurnError::write(path))
}

/// The object while a lamp goes around it once; `white`: the albedo that is shown as white.
fn write_movie(path: &Path, surface: &Surface, white: f32) -> Result<(), TurnError> {
    let lamp = lamp();
    let look = Look {
        diffuse: DiffuseForm::Irradiance,
        specular: SpecularForm::Lobe,
        exposure: exposure_for(&lamp) / white,
    };
    let extent = surface.extent();
    let mut movie = MovieWriter::create(path, MovieFormat::Mp4, extent, MOVIE_RATE)?;
    for frame in 0..MOVIE_FRAMES {
        let part = f64::from(frame) / f64::from(MOVIE_FRAMES);
        movie.push(&look.turned(surface, &lamp, part)?.encode())?;
    }
    Ok(movie.finish()?)
}

/// A lamp high before the object, and weak light from everywhere.
fn lamp() -> ShLight {
    let order = Order::new(LAMP_ORDER).unwrap_or(Order::TWO);
    let from = Direction::from_angles(LAMP_HEIGHT, FRAC_PI_2);
    let mut light = ShLight::even(order, [0.15; 3]);
    let values = basis(order, from);
    let pairs = light.coefficients_mut().iter_mut().zip(values);
    for (at, (coefficient, value)) in pairs.enumerate() {
        let l = at.isqrt() as f64;
        let blur = (-0.5 * l * (l + 1.0) * LAMP_SPREAD * LAMP_SPREAD).exp();
        for channel in coefficient {
            *channel += TAU * blur * value;
        }
    }
    light
}
