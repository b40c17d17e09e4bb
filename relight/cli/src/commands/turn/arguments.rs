//! The arguments of `relight turn`.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use relight_photo::nets::Weights;
use relight_turn::{
    Elevation, MaterialKind, ProbeBall, ProbePlace, TurnLight, TurnNetwork, TurnNetworks,
    TurnOptions, read_given_light,
};
use relit_data::rig::RotationDirection;

use crate::shipped;
use crate::values::{Choices, one_of};

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight turn 20261120T093015Z-mug.tar -o mug
      a turn in unknown light: mug/normal.png, albedo.png, light.txt, object.relit ...
  relight turn mug.tar --elevation 18 --rotation counter-clockwise -o mug
      the turn of a bare clip: its data set does not say how the rig is built
  relight turn mug.tar --light light.txt -o mug
      the light was measured: coefficients in the viewer's frame at the table's angle 0, or a panorama";

#[derive(Args)]
pub(crate) struct Arguments {
    /// The shard of one turn (.tar), or a folder that holds one turn.
    #[arg(value_name = "SHARD")]
    pub(super) shard: PathBuf,
    /// The folder for the results.
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: PathBuf,
    /// How high the camera looks down on the table, degrees: 0 from the side, 90 from above [default: as the data set
    /// or the session says; else 18, and 8 either way].
    #[arg(long, value_name = "DEGREES", value_parser = elevation)]
    elevation: Option<Elevation>,
    /// Which way the table turns as its angle grows, seen from above: the background moves to the right, or to
    /// the left [default: as the data set or the session says; else the one in which the network of turns is clearly surer; else
    /// counter-clockwise].
    #[arg(long, value_name = "WAY", value_parser = one_of(ROTATIONS))]
    rotation: Option<RotationDirection>,
    /// The light where it is known, in the viewer's frame at the table's angle 0: coefficients of spherical harmonics
    /// (nine lines of red, green and blue, or more, up to order 6), or a panorama (.hdr, .exr).
    #[arg(long, value_name = "FILE")]
    pub(super) light: Option<PathBuf>,
    /// With --probe: the session from which the shard was made, or its video. Needs the program ffmpeg.
    #[arg(long, value_name = "PATH", requires = "probe")]
    session: Option<PathBuf>,
    /// A ball on the table, diffuse grey or chrome, which measures the light: its middle and radius in the video,
    /// pixels. The light is then in units in which the ball's albedo is 1.
    #[arg(long, value_name = "X,Y,R", value_parser = probe, requires = "session", conflicts_with = "light")]
    probe: Option<ProbePlace>,
    /// What the ball is made of: without it, what it looks like.
    #[arg(long, value_name = "KIND", value_parser = one_of(BALLS), requires = "probe")]
    probe_ball: Option<ProbeBall>,
    /// Weights of the network of turns, as relight train turn writes them [default: those that come with the program].
    #[arg(long, value_name = "FILE")]
    turn_network: Option<PathBuf>,
    /// The object's material.
    #[arg(long, value_name = "KIND", value_parser = one_of(MATERIALS), default_value = "diffuse")]
    material: MaterialKind,
}

impl Arguments {
    /// What is known of the turn beforehand.
    pub(super) fn options(&self) -> Result<TurnOptions<'_>, Box<dyn Error>> {
        let light = match (&self.light, &self.session, self.probe) {
            (Some(path), ..) => TurnLight::Given(read_given_light(path)?),
            (None, Some(session), Some(place)) => TurnLight::Ball {
                session,
                place,
                ball: self.probe_ball,
            },
            _ => TurnLight::Unknown,
        };
        Ok(TurnOptions {
            rotation: self.rotation,
            elevation: self.elevation,
            light,
            material: self.material,
        })
    }

    pub(super) fn networks(&self) -> Result<TurnNetworks, Box<dyn Error>> {
        let weights = match &self.turn_network {
            Some(path) => Weights::read(path)?,
            None => shipped::turn_weights()?,
        };
        Ok(TurnNetworks {
            turn: TurnNetwork::new(&weights)?,
            photo: shipped::weights()?,
        })
    }
}

const ROTATIONS: Choices<RotationDirection> = &[
    (
        "counter-clockwise",
        "The background moves to the right",
        RotationDirection::CounterClockwise,
    ),
    (
        "clockwise",
        "The background moves to the left",
        RotationDirection::Clockwise,
    ),
];

const BALLS: Choices<ProbeBall> = &[
    ("grey", "It is diffuse", ProbeBall::Grey),
    ("chrome", "It mirrors", ProbeBall::Chrome),
];

const MATERIALS: Choices<MaterialKind> = &[
    (
        "diffuse",
        "It scatters light, with gloss or without",
        MaterialKind::Diffuse,
    ),
    (
        "metal",
        "It only reflects, in its own colour",
        MaterialKind::Metal,
    ),
];

fn elevation(text: &str) -> Result<Elevation, String> {
    let degrees = text.parse().map_err(|_| "give degrees".to_owned())?;
    Elevation::given(degrees).map_err(|error| error.to_string())
}

fn probe(text: &str) -> Result<ProbePlace, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(str::parse).collect();
    match numbers.as_deref() {
        Ok(&[x, y, radius]) => ProbePlace::new([x, y], radius).map_err(|error| error.to_string()),
        _ => Err("give X,Y,R: middle and radius of the ball, pixels".to_owned()),
    }
}
