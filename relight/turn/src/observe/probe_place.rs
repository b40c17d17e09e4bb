//! Where a ball is in the picture.

use std::fmt;

use relight_core::image::{ColourSpace, Extent, Planes, Srgb};

use crate::error::TurnError;

/// Least width of a pixel that counts as covered, pixels. Numerical: one that is only touched, by rounding, is not.
const MIN_COVER: f64 = 1e-6;

/// Where a ball is in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbePlace {
    /// Its middle, pixels from the left and from the top.
    pub middle: [f64; 2],
    /// Its radius, pixels.
    pub radius: f64,
}

impl fmt::Display for ProbePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.middle;
        write!(f, "{x},{y},{}", self.radius)
    }
}

impl ProbePlace {
    /// A ball with its middle at `x`, `y`.
    ///
    /// # Errors
    /// If the radius is less than 4 pixels or a number is not finite.
    pub fn new([x, y]: [f64; 2], radius: f64) -> Result<Self, TurnError> {
        if !(x.is_finite() && y.is_finite() && radius.is_finite() && radius >= 4.0) {
            return Err(TurnError::setting(
                "the radius of the ball",
                radius,
                "at least 4 pixels, and its middle a place in the picture",
            ));
        }
        Ok(Self {
            middle: [x, y],
            radius,
        })
    }

    /// Whether all of it is in a picture of this size.
    pub(crate) fn is_within(&self, extent: Extent) -> bool {
        let [x, y] = self.middle;
        let fits = |at: f64, size: usize| at >= self.radius && at + self.radius <= size as f64;
        fits(x, extent.width) && fits(y, extent.height)
    }

    /// Where a place is in the picture that is given in radii from the ball's middle, to the right and up.
    pub(crate) fn in_picture(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            self.middle[0] + self.radius * x,
            self.middle[1] - self.radius * y,
        ]
    }

    /// The light of a square of the picture, the mean of the pixels that it covers; white where one of them is.
    pub(crate) fn mean_light(&self, planes: &Planes<3>, [x, y]: [f64; 2], size: f64) -> [f32; 3] {
        let range = |middle: f64| {
            // A pixel that is only touched, by rounding, is not covered.
            let from = (middle - size / 2.0 + MIN_COVER).max(0.0) as usize;
            from..((middle + size / 2.0 - MIN_COVER).ceil().max(0.0) as usize).max(from + 1)
        };
        let Extent { width, height } = planes.extent();
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for row in range(y).filter(|&row| row < height) {
            for column in range(x).filter(|&column| column < width) {
                for (sum, value) in sum.iter_mut().zip(planes.pixel(column, row)) {
                    *sum += Srgb::to_linear(value);
                }
                count += 1.0;
            }
        }
        sum.map(|sum: f32| if count > 0.0 { sum / count } else { 0.0 })
    }
}
