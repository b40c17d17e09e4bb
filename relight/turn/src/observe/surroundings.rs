//! What the picture shows at and around a ball, over a turn.

use relight_core::image::{Extent, Planes};

use crate::error::TurnError;
use crate::observe::curves::CurveBuilder;
use crate::observe::probe_place::ProbePlace;

/// How far from the ball's middle is looked at, in radii. By hand.
pub(crate) const REACH: f64 = 1.75;
/// Pixels along the diameter of the given circle. By hand.
pub(crate) const ACROSS: usize = 24;

/// What the picture shows at and around a ball, over a turn.
#[derive(Debug)]
pub(crate) struct Surroundings {
    pub(crate) place: ProbePlace,
    /// Width and height of the square that is looked at, pixels.
    pub(crate) side: usize,
    pub(crate) builder: CurveBuilder,
}

impl Surroundings {
    /// For a ball at a place in pictures of this size.
    pub(crate) fn new(place: ProbePlace, picture: Extent) -> Result<Self, TurnError> {
        let side = (REACH * ACROSS as f64).ceil() as usize;
        let mask: Vec<f32> = (0..side * side)
            .map(|at| {
                let [x, y] = place.in_picture(middle_of(side, at));
                let is_in = |at: f64, size: usize| at > 0.0 && at < size as f64;
                f32::from(u8::from(
                    is_in(x, picture.width) && is_in(y, picture.height),
                ))
            })
            .collect();
        Ok(Self {
            place,
            side,
            builder: CurveBuilder::new(Extent::new(side, side), &mask)?,
        })
    }

    /// Takes up a frame at an angle of the table, degrees.
    pub(crate) fn push(&mut self, angle_deg: f64, picture: &Planes<3>) -> Result<(), TurnError> {
        let pixel = 2.0 * self.place.radius / ACROSS as f64;
        let extent = Extent::new(self.side, self.side);
        let shown = Planes::from_fn(extent, |x, y| {
            let at = self
                .place
                .in_picture(middle_of(self.side, y * self.side + x));
            self.place.mean_light(picture, at, pixel)
        });
        self.builder.push(angle_deg, extent, shown.planes())
    }
}

/// The middle of a pixel of the square, in radii from the ball's middle: to the right and up.
pub(crate) fn middle_of(side: usize, at: usize) -> [f64; 2] {
    let from = |at: usize| (2.0 * at as f64 + 1.0 - side as f64) / ACROSS as f64;
    [from(at % side), -from(at / side)]
}
