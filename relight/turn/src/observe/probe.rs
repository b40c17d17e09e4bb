//! A ball on the table, diffuse grey or chrome, that measures the light, and the picture at and around it.

use std::fmt;

use relight_core::image::{Extent, Planes, Rgb, Srgb};

use crate::error::TurnError;
use crate::model::frame::Elevation;
use crate::observe::curves::{CurveBuilder, NOTHING, TurnCurves};
use crate::observe::probe_place::ProbePlace;

/// Pixels along the diameter of the given circle. By hand.
pub(crate) const ACROSS: usize = 24;
/// Width and height of the square that is looked at, pixels. By hand: 1.75 radii to each side.
const SIDE: usize = 42;

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
    /// Its material; by default as it looks.
    pub(crate) ball: Option<ProbeBall>,
    /// The camera over the table.
    pub(crate) elevation: Elevation,
}

/// Gathers what the picture shows at and around a ball over a turn.
#[derive(Debug)]
pub(crate) struct ProbeBuilder {
    pub(crate) probe: Probe,
    /// From the first frame on.
    builder: Option<CurveBuilder>,
}

impl ProbeBuilder {
    /// For a ball at a place.
    pub(crate) const fn new(probe: Probe) -> Self {
        Self {
            probe,
            builder: None,
        }
    }

    /// Takes up a frame at an angle of the table, degrees.
    ///
    /// # Errors
    /// If the ball is not in it.
    pub(crate) fn push(&mut self, angle_deg: f64, frame: &Rgb<Srgb>) -> Result<(), TurnError> {
        let (picture, place) = (frame.planes(), self.probe.place);
        if !place.is_within(picture.extent()) {
            return Err(TurnError::setting(
                "the radius of the ball",
                place.radius,
                "so small that all of the ball is in the picture",
            ));
        }
        let builder = match &mut self.builder {
            Some(builder) => builder,
            none => none.insert(builder(place, picture.extent())?),
        };
        let pixel = 2.0 * place.radius / ACROSS as f64;
        let extent = Extent::new(SIDE, SIDE);
        let shown = Planes::from_fn(extent, |x, y| {
            let at = place.in_picture(middle_of(y * SIDE + x));
            place.mean_light(picture, at, pixel)
        });
        builder.push(angle_deg, extent, shown.planes())
    }

    /// The curves of the square.
    ///
    /// # Errors
    /// If the frames show too little.
    pub(crate) fn curves(self) -> Result<TurnCurves, TurnError> {
        let nothing = || TurnError::Refused(NOTHING.to_owned());
        self.builder.ok_or_else(nothing)?.finish()
    }
}

/// For the pixels of the square that are in pictures of this size.
fn builder(place: ProbePlace, picture: Extent) -> Result<CurveBuilder, TurnError> {
    let mask: Vec<f32> = (0..SIDE * SIDE)
        .map(|at| {
            let [x, y] = place.in_picture(middle_of(at));
            let is_in = |at: f64, size: usize| at > 0.0 && at < size as f64;
            f32::from(u8::from(
                is_in(x, picture.width) && is_in(y, picture.height),
            ))
        })
        .collect();
    CurveBuilder::new(Extent::new(SIDE, SIDE), &mask)
}

/// The middle of a pixel of the square, in radii from the ball's middle: to the right and up.
pub(crate) fn middle_of(at: usize) -> [f64; 2] {
    let from = |at: usize| (2.0 * at as f64 + 1.0 - SIDE as f64) / ACROSS as f64;
    [from(at % SIDE), -from(at / SIDE)]
}

impl fmt::Display for ProbeBall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Grey => "grey",
            Self::Chrome => "chrome",
        })
    }
}
