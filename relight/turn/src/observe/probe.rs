//! A ball on the table, diffuse grey or chrome, which measures the light.

use std::fmt;

use relight_core::image::{Extent, Planes, Rgb, Srgb};
use relight_core::light::{Normals, YUp};

use crate::error::TurnError;
use crate::model::frame::{Elevation, TableFrame};
use crate::observe::curves::CurveBuilder;
use crate::observe::mirror_panorama::MirrorPanorama;
use crate::observe::probe_place::ProbePlace;
use crate::observe::surroundings::Surroundings;
use crate::setting_error::SettingError;

/// Side of the square to which the ball is brought, pixels. By hand.
const SIDE: usize = 48;
/// Share of the ball's radius that is looked at, 0 to 1. By hand: the rim also shows the background and reflects
/// it.
const RADIUS_SHARE: f32 = 0.92;

/// What a ball is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProbeBall {
    /// Diffuse grey.
    Grey,
    /// It mirrors.
    Chrome,
}

/// A ball that measures the light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Probe {
    /// Where it is.
    pub(crate) place: ProbePlace,
    /// What it is made of; what it looks like where that is not known.
    pub(crate) ball: Option<ProbeBall>,
    /// The camera over the table.
    pub(crate) elevation: Elevation,
}

/// Gathers what a ball shows over a turn.
#[derive(Debug)]
pub(crate) struct ProbeBuilder {
    pub(crate) probe: Probe,
    pub(crate) normals: Normals<YUp>,
    pub(crate) builder: CurveBuilder,
    pub(crate) panorama: MirrorPanorama,
    /// From the first frame on.
    pub(crate) surroundings: Option<Surroundings>,
}

impl ProbeBuilder {
    /// For a ball at a place.
    ///
    /// # Errors
    /// None for a ball.
    pub(crate) fn new(probe: Probe) -> Result<Self, TurnError> {
        let extent = Extent::new(SIDE, SIDE);
        let mask = Planes::from_fn(extent, |x, y| {
            let from_middle = |at: usize| 2.0 * (at as f32 + 0.5) / SIDE as f32 - 1.0;
            let inside = from_middle(x).hypot(from_middle(y)) < RADIUS_SHARE;
            [f32::from(u8::from(inside))]
        });
        Ok(Self {
            probe,
            normals: Normals::sphere(SIDE).masked(&mask)?,
            builder: CurveBuilder::new(extent, mask.plane(0))?,
            panorama: MirrorPanorama::new(TableFrame::new(probe.elevation)),
            surroundings: None,
        })
    }

    /// Takes up a frame at an angle of the table, degrees.
    ///
    /// # Errors
    /// [`TurnError::Setting`] where the ball is not in it.
    pub(crate) fn push(&mut self, angle_deg: f64, frame: &Rgb<Srgb>) -> Result<(), TurnError> {
        let planes = frame.planes();
        let place = self.probe.place;
        if !place.is_within(planes.extent()) {
            return Err(TurnError::Setting(SettingError {
                what: "the radius of the ball",
                value: place.radius,
                allowed: "so small that all of the ball is in the picture",
            }));
        }
        let surroundings = match &mut self.surroundings {
            Some(surroundings) => surroundings,
            none => none.insert(Surroundings::new(place, planes.extent())?),
        };
        surroundings.push(angle_deg, planes)?;
        let ball = Planes::from_fn(Extent::new(SIDE, SIDE), |x, y| {
            light_at(place, planes, x, y)
        });
        self.add_to_panorama(angle_deg, &ball);
        self.builder.push(angle_deg, ball.extent(), ball.planes())
    }

    /// Adds what the ball shows were it a mirror.
    fn add_to_panorama(&mut self, angle_deg: f64, ball: &Planes<3>) {
        if !angle_deg.is_finite() {
            return;
        }
        let [x, y, z] = self.normals.planes().planes();
        for at in (0..z.len()).filter(|&at| z[at] > 0.0) {
            let normal = [x[at], y[at], z[at]].map(f64::from);
            let value = ball.planes().map(|plane| f64::from(plane[at]));
            self.panorama.add(angle_deg.to_radians(), normal, value);
        }
    }
}

/// The light at a pixel of the square that the ball fills.
fn light_at(place: ProbePlace, planes: &Planes<3>, x: usize, y: usize) -> [f32; 3] {
    let from = |at: usize| (2 * at + 1) as f64 / SIDE as f64 - 1.0;
    let pixel = 2.0 * place.radius / SIDE as f64;
    place.mean_light(planes, place.in_picture([from(x), -from(y)]), pixel)
}

impl fmt::Display for ProbeBall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Grey => "grey",
            Self::Chrome => "chrome",
        })
    }
}
