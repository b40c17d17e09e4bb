//! The arguments of `relight turn`.

use std::error::Error;
use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use relight_turn::{
    Elevation, MaterialKind, ProbeBall, ProbePlace, TurnLight, TurnNetwork, TurnNetworks,
    TurnOptions, read_given_light,
};
use relit_data::rig::RotationDirection;

use crate::folder::OutputFolder;
use crate::inputs::WeightsArgument;
use crate::shipped;
use crate::values::{Choices, one_of};

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight turn 20261120T093015Z-mug.tar -o mug
      a turn in unknown light: mug/normal.png, albedo.png, light.txt, object.relit ...
  relight turn mug.tar --elevation 18 --rotation counter-clockwise -o mug
      the turn of a video clip, whose data set does not describe the rig
  relight turn mug.tar --light light.txt -o mug
      the light was measured: coefficients in the viewer's frame at table angle 0, or a panorama";

#[derive(Args)]
pub(crate) struct Arguments {
    /// The shard of one turn (.tar), or a folder that holds one turn.
    #[arg(value_name = "SHARD")]
    pub(super) shard: PathBuf,
    #[command(flatten)]
    pub(super) folder: OutputFolder,
    /// The camera's elevation, degrees: 0 from the side, 90 from above [default: that of the data set or session, else 18 ± 8].
    #[arg(long, value_name = "DEGREES", value_parser = elevation, help_heading = "Rig")]
    elevation: Option<Elevation>,
    /// Direction in which the table turns as its angle grows, from above [default: that of the data set or session, else the
    /// network's if clear, else counter-clockwise].
    #[arg(long, value_name = "WAY", value_parser = one_of(ROTATIONS), help_heading = "Rig")]
    rotation: Option<RotationDirection>,
    /// Known light, in the viewer's frame at table angle 0: a panorama (.hdr, .exr), or coefficients up to order 6 (.txt).
    #[arg(long, value_name = "FILE", help_heading = "Light")]
    pub(super) light: Option<PathBuf>,
    /// A ball on the table that measures the light: centre and radius in the video, pixels, and material [default: as it looks];
    /// its albedo counts as 1.
    #[arg(
        long,
        value_name = "X,Y,R[,grey|chrome]",
        conflicts_with = "light",
        help_heading = "Light"
    )]
    light_ball: Option<LightBall>,
    /// With --light-ball: the session of the shard, or its video [default: named by dataset.json, next to the data set]; needs
    /// ffmpeg.
    #[arg(
        long,
        value_name = "PATH",
        requires = "light_ball",
        help_heading = "Light"
    )]
    session: Option<PathBuf>,
    /// The object's material.
    #[arg(long, value_name = "KIND", value_parser = one_of(MATERIALS), default_value = "diffuse")]
    material: MaterialKind,
    #[command(flatten)]
    weights: WeightsArgument,
}

/// A ball that measures the light.
#[derive(Debug, Clone, Copy)]
struct LightBall {
    place: ProbePlace,
    kind: Option<ProbeBall>,
}

impl Arguments {
    /// What is known about the turn beforehand.
    pub(super) fn options(&self) -> Result<TurnOptions<'_>, Box<dyn Error>> {
        let light = match (&self.light, self.light_ball) {
            (Some(path), _) => TurnLight::Given(read_given_light(path)?),
            (None, Some(ball)) => TurnLight::Ball {
                session: self.session.as_deref(),
                place: ball.place,
                ball: ball.kind,
            },
            (None, None) => TurnLight::Unknown,
        };
        Ok(TurnOptions {
            rotation: self.rotation,
            elevation: self.elevation,
            light,
            material: self.material,
        })
    }

    pub(super) fn networks(&self) -> Result<TurnNetworks, Box<dyn Error>> {
        let (weights, _) = self.weights.read_or(shipped::turn_weights)?;
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

const MATERIALS: Choices<MaterialKind> = &[
    (
        "diffuse",
        "Scatters light, with or without gloss",
        MaterialKind::Diffuse,
    ),
    (
        "metal",
        "Only reflects light, in its own colour",
        MaterialKind::Metal,
    ),
];

fn elevation(text: &str) -> Result<Elevation, String> {
    let degrees = text.parse().map_err(|_| "give degrees".to_owned())?;
    Elevation::measured(degrees).map_err(|error| error.to_string())
}

impl FromStr for LightBall {
    type Err = String;

    /// Reads `X,Y,R[,grey|chrome]`.
    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = "give X,Y,R: middle and radius of the ball in pixels, and grey or chrome";
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        let (numbers, kind) = match parts.as_slice() {
            [numbers @ .., "grey"] => (numbers, Some(ProbeBall::Grey)),
            [numbers @ .., "chrome"] => (numbers, Some(ProbeBall::Chrome)),
            numbers => (numbers, None),
        };
        let numbers: Result<Vec<f64>, _> = numbers.iter().map(|part| part.parse()).collect();
        let Ok(&[x, y, radius]) = numbers.as_deref() else {
            return Err(wanted.to_owned());
        };
        let place = ProbePlace::new([x, y], radius).map_err(|error| error.to_string())?;
        Ok(Self { place, kind })
    }
}
