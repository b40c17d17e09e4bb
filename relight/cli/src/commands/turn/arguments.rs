//! The arguments of `relight turn`.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use relight_core::light::NormalsFrame;
use relight_photo::nets::{NetError, Weights};
use relight_turn::{
    Elevation, Filmed, MaterialKind, NormalsSource, Probe, ProbeBall, ProbePlace,
    RotationDirection, TableRotation, TurnNetwork, TurnOptions,
};

use crate::shipped;
use crate::values::{DirectionName, normals_frame};

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight turn 20261120T093015Z-mug.tar --elevation 18 -o mug
      a turn in unknown light: mug/normal.png, albedo.png, light.json, contact.png, relit.mp4 ...
  relight turn mug.tar --elevation 18 --light light.txt -o mug
      the light was measured: coefficients in the viewer's frame at the table's angle 0, or a panorama
  relight turn mug.tar --rim 812,251 --normals none -o mug
      the table's rim is an ellipse of 812 x 251 pixels; no network, but the outline to initialise";

#[derive(Args)]
pub(crate) struct Arguments {
    /// The shard of one turn (.tar), or a folder that holds one turn.
    #[arg(value_name = "SHARD")]
    pub(super) shard: PathBuf,
    /// The folder for the results.
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: PathBuf,
    /// How high the camera looks down on the table, degrees: 0 from the side, 90 from above [default: by the table's
    /// rim in the session's video; else 18, and 8 either way].
    #[arg(long, value_name = "DEGREES", value_parser = elevation, conflicts_with = "rim")]
    elevation: Option<Elevation>,
    /// Width and height, pixels, of the ellipse that the table's rim is in the video: another way to say the
    /// elevation.
    #[arg(long, value_name = "W,H", value_parser = rim)]
    rim: Option<Elevation>,
    /// The light where it is known, in the viewer's frame at the table's angle 0: coefficients of spherical harmonics
    /// (nine lines of red, green and blue, or more, up to order 6), or a panorama (.hdr, .exr).
    #[arg(long, value_name = "FILE")]
    pub(super) light: Option<PathBuf>,
    /// The session from which the shard was made, or its video: to see the surroundings (room.png), which way the table
    /// turns, the table's rim, and the ball of --probe. Needs the program ffmpeg [default: the session that the shard
    /// names, where it lies beside the shard or its folder, or in sessions there].
    #[arg(long, value_name = "PATH")]
    pub(super) session: Option<PathBuf>,
    /// Do not look for the session.
    #[arg(long, conflicts_with = "session")]
    pub(super) no_session: bool,
    /// A ball on the table, diffuse grey or chrome, which measures the light: its middle and radius in the video,
    /// pixels. The light is then in units in which the ball's albedo is 1.
    #[arg(long, value_name = "X,Y,R", value_parser = probe, requires = "session", conflicts_with = "light")]
    pub(super) probe: Option<ProbePlace>,
    /// What the ball is made of: without it, what it looks like.
    #[arg(long, value_enum, value_name = "KIND", requires = "probe")]
    pub(super) probe_ball: Option<BallName>,
    /// Normals that initialise: "turn" (the network that sees the whole turn), "photo" (that of relight decompose, which
    /// sees single frames), "none", a network (.onnx, or weights of decompose: .safetensors), a map of normals
    /// (.png, .exr), or a folder with normal.png [default: turn, and none with --light].
    #[arg(long, value_name = "FROM")]
    normals: Option<String>,
    /// Which way y points in these normals.
    #[arg(long, value_name = "WAY", default_value = "up", value_parser = normals_frame())]
    pub(super) normals_y: NormalsFrame,
    /// How much these normals count beside what the turn says.
    #[arg(long, value_name = "WEIGHT", default_value_t = TurnOptions::default().prior_weight, value_parser = weight)]
    pub(super) normals_weight: f64,
    /// Weights of the network of turns, as relight train turn writes them [default: those that come with the program].
    #[arg(long, value_name = "FILE")]
    turn_network: Option<PathBuf>,
    /// The object's material: without it, the one that fits the turn.
    #[arg(long, alias = "body", value_enum, value_name = "KIND")]
    pub(super) material: Option<MaterialName>,
    /// The table's rotation direction as its angle grows, seen from above [default: by the background in the session's
    /// video; else the one in which the network of turns is clearly surer; else counter-clockwise].
    #[arg(long, alias = "sense", value_enum)]
    direction: Option<DirectionName>,
    /// Write the object as one file that can be lit, object.relit.
    #[arg(long, value_name = "FILE")]
    pub(super) asset: Option<PathBuf>,
    /// Write twelve frames with what was fitted as labels, in the layout of synth, for train to read.
    #[arg(long, value_name = "DIR")]
    pub(super) labels: Option<PathBuf>,
    /// The least confidence, 0 to 1, of pixels in the labels.
    #[arg(long, value_name = "PART", default_value_t = 0.3, value_parser = part, requires = "labels")]
    pub(super) labels_confidence: f32,
    /// Do not write the video, which needs the program ffmpeg.
    #[arg(long)]
    pub(super) no_video: bool,
}

/// Where normals come from that a turn is solved from.
pub(super) enum InitialNormals {
    /// The network that sees the whole turn.
    Turn,
    /// What sees single frames, or a file.
    Photo(NormalsSource),
}

#[derive(Clone, Copy, ValueEnum)]
pub(super) enum BallName {
    /// It is diffuse.
    Grey,
    /// It mirrors.
    Chrome,
}

impl From<BallName> for ProbeBall {
    fn from(name: BallName) -> Self {
        match name {
            BallName::Grey => Self::Grey,
            BallName::Chrome => Self::Chrome,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
pub(super) enum MaterialName {
    /// It scatters light, with gloss or without.
    Diffuse,
    /// It only reflects, in its own colour.
    Metal,
}

impl From<MaterialName> for MaterialKind {
    fn from(name: MaterialName) -> Self {
        match name {
            MaterialName::Diffuse => Self::Diffuse,
            MaterialName::Metal => Self::Metal,
        }
    }
}

impl Arguments {
    /// The rotation that was given, or what is usual.
    pub(super) fn rotation(&self) -> TableRotation {
        let given = self.direction.map(RotationDirection::from);
        given.map_or_else(TableRotation::default, TableRotation::given)
    }

    /// The normals that initialise, and how they are named.
    pub(super) fn normals(&self) -> Option<(InitialNormals, &str)> {
        match self.normals.as_deref() {
            None if self.light.is_some() || self.probe.is_some() => None,
            Some("none") => None,
            None | Some("turn") => Some((InitialNormals::Turn, "turn")),
            // "shipped" was its name before there was a network of turns.
            Some("photo" | "shipped") => Some((InitialNormals::Photo(NormalsSource::Own), "photo")),
            Some(path) => {
                let source = NormalsSource::of(Path::new(path));
                Some((InitialNormals::Photo(source), path))
            }
        }
    }

    /// The network of turns, where normals are to be its own.
    pub(super) fn turn_network(&self) -> Result<Option<TurnNetwork>, NetError> {
        if !matches!(self.normals(), Some((InitialNormals::Turn, _))) {
            return Ok(None);
        }
        let weights = match &self.turn_network {
            Some(path) => Weights::read(path)?,
            None => shipped::turn_weights()?,
        };
        TurnNetwork::new(&weights).map(Some)
    }

    pub(super) fn probe(&self) -> Option<Probe> {
        self.probe.map(|place| Probe {
            place,
            ball: self.probe_ball.map(ProbeBall::from),
            elevation: self.given_elevation().unwrap_or_else(Elevation::assumed),
        })
    }

    fn given_elevation(&self) -> Option<Elevation> {
        self.elevation.or(self.rim)
    }

    /// The elevation that was given, or else that of the table's rim in the video.
    pub(super) fn elevation(&self, filmed: Option<&Filmed>) -> Elevation {
        let seen = filmed
            .and_then(Filmed::elevation)
            // A light by a ball was measured with the elevation that was known then.
            .filter(|_| self.probe.is_none());
        let known = self.given_elevation().or(seen);
        known.unwrap_or_else(Elevation::assumed)
    }
}

fn elevation(text: &str) -> Result<Elevation, String> {
    let degrees = text.parse().map_err(|_| "give degrees".to_owned())?;
    Elevation::given(degrees).map_err(|error| error.to_string())
}

fn rim(text: &str) -> Result<Elevation, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(str::parse).collect();
    match numbers.as_deref() {
        Ok(&[width, height]) => Elevation::of_rim(width, height).map_err(|error| error.to_string()),
        _ => Err("give W,H: width and height of the ellipse, pixels".to_owned()),
    }
}

fn probe(text: &str) -> Result<ProbePlace, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(str::parse).collect();
    match numbers.as_deref() {
        Ok(&[x, y, radius]) => ProbePlace::new([x, y], radius).map_err(|error| error.to_string()),
        _ => Err("give X,Y,R: middle and radius of the ball, pixels".to_owned()),
    }
}

fn weight(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(weight) if (0.0..=100.0).contains(&weight) => Ok(weight),
        _ => Err("give a number from 0 to 100".to_owned()),
    }
}

fn part(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(part) if (0.0..=1.0).contains(&part) => Ok(part),
        _ => Err("give a number from 0 to 1".to_owned()),
    }
}
