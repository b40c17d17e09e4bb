//! A grey ball on the table, which measures the light.

use super::{BodyKind, CurveBuilder, TableFrame, TurnCurves, TurnError, fit_turn_light};
use crate::image::{ColourSpace, Extent, Linear, Planes, Rgb, Srgb};
use crate::light::{Normals, ShLight};
use crate::render::Surface;

/// The side of the square to which the ball is brought, pixels.
const SIDE: usize = 48;
/// The part of the ball's radius that is looked at: its rim shows the background too, and reflects it.
const PART: f32 = 0.92;

/// Where a ball is in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbePlace {
    /// Its middle, pixels from the left and from the top.
    pub middle: [f64; 2],
    /// Its radius, pixels.
    pub radius: f64,
}

/// Gathers what a ball shows over a turn.
#[derive(Debug)]
pub struct ProbeBuilder {
    place: ProbePlace,
    builder: CurveBuilder,
}

impl ProbePlace {
    /// A ball with its middle at `x`, `y`.
    ///
    /// # Errors
    /// [`TurnError::Setting`] where the radius is less than 4 pixels or a number is not finite.
    pub fn new([x, y]: [f64; 2], radius: f64) -> Result<Self, TurnError> {
        if !(x.is_finite() && y.is_finite() && radius.is_finite() && radius >= 4.0) {
            return Err(TurnError::Setting {
                what: "the radius of the ball",
                value: radius,
                allowed: "at least 4 pixels, and its middle a place in the picture",
            });
        }
        Ok(Self {
            middle: [x, y],
            radius,
        })
    }

    /// Whether all of it is in a picture of this size.
    fn is_within(&self, extent: Extent) -> bool {
        let [x, y] = self.middle;
        let fits = |at: f64, size: usize| at >= self.radius && at + self.radius <= size as f64;
        fits(x, extent.width) && fits(y, extent.height)
    }
}

impl ProbeBuilder {
    /// For a ball at a place.
    ///
    /// # Errors
    /// None for a ball.
    pub fn new(place: ProbePlace) -> Result<Self, TurnError> {
        let extent = Extent::new(SIDE, SIDE);
        let mask = Planes::from_fn(extent, |x, y| {
            let from_middle = |at: usize| 2.0 * (at as f32 + 0.5) / SIDE as f32 - 1.0;
            let inside = from_middle(x).hypot(from_middle(y)) < PART;
            [f32::from(u8::from(inside))]
        });
        Ok(Self {
            place,
            builder: CurveBuilder::new(extent, mask.plane(0))?,
        })
    }

    /// Takes up a frame at an angle of the table, degrees.
    ///
    /// # Errors
    /// [`TurnError::Setting`] where the ball is not in it.
    pub fn push(&mut self, angle_deg: f64, frame: &Rgb<Srgb>) -> Result<(), TurnError> {
        let planes = frame.planes();
        if !self.place.is_within(planes.extent()) {
            return Err(TurnError::Setting {
                what: "the radius of the ball",
                value: self.place.radius,
                allowed: "so small that all of the ball is in the picture",
            });
        }
        let ball = Planes::from_fn(Extent::new(SIDE, SIDE), |x, y| {
            self.place.light(planes, x, y)
        });
        self.builder.push(angle_deg, ball.extent(), ball.planes())
    }

    /// The light, in the viewer's frame at the table's angle 0, in units in which the ball's albedo is 1, and the ball's curves.
    ///
    /// # Errors
    /// Where the frames tell too little.
    pub fn finish(self, frame: &TableFrame) -> Result<(ShLight, TurnCurves), TurnError> {
        let curves = self.builder.finish()?;
        let normals = Normals::sphere(SIDE);
        let albedo = Rgb::<Linear>::new(Planes::filled(normals.extent(), [1.0; 3]));
        let surface = Surface::new(normals, albedo, None)?;
        let light = fit_turn_light(&curves, &surface, BodyKind::Diffuse, frame)?;
        Ok((light, curves))
    }
}

impl ProbePlace {
    /// The light at a pixel of the square that the ball fills, the mean of the picture's pixels that it covers; white where
    /// one of them is.
    fn light(&self, planes: &Planes<3>, x: usize, y: usize) -> [f32; 3] {
        let pixel = 2.0 * self.radius / SIDE as f64;
        let range = |middle: f64, at: usize| {
            let first = middle - self.radius + pixel * at as f64;
            let from = first as usize;
            from..((first + pixel).ceil() as usize).max(from + 1)
        };
        let Extent { width, height } = planes.extent();
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for row in range(self.middle[1], y).filter(|&row| row < height) {
            for column in range(self.middle[0], x).filter(|&column| column < width) {
                for (sum, value) in sum.iter_mut().zip(planes.pixel(column, row)) {
                    *sum += Srgb::to_linear(value);
                }
                count += 1.0;
            }
        }
        sum.map(|sum: f32| if count > 0.0 { sum / count } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{Direction, Rotation};
    use crate::render::{DiffuseForm, DiffuseLayer};
    use crate::turn::Elevation;

    #[test]
    fn a_ball_tells_the_light_in_units_of_its_albedo() {
        let frame = TableFrame::new(Elevation::given(22.0).unwrap());
        let values = [1.1, 0.3, 0.24, 0.36, 0.07, -0.06, 0.03, 0.12, 0.09];
        let light = ShLight::new(values.map(|v| [v, 0.9 * v, 0.8 * v]).to_vec()).unwrap();
        let place = ProbePlace::new([61.0, 40.0], 30.0).unwrap();
        let mut probe = ProbeBuilder::new(place).unwrap();
        let normals = Normals::sphere(60);
        let [x, y, z] = frame.axis();
        let axis = Direction::new(x, y, z).unwrap();
        for k in 0..60 {
            let angle = 6.0 * f64::from(k);
            let turned = light.rotated(&Rotation::about(axis, -angle.to_radians()));
            let shading = DiffuseLayer::new(&turned, DiffuseForm::Irradiance).shading(&normals);
            let picture = Planes::from_fn(Extent::new(120, 90), |x, y| {
                let (at_x, at_y) = (x.wrapping_sub(31), y.wrapping_sub(10));
                if at_x < 60 && at_y < 60 && normals.planes().pixel(at_x, at_y)[2] > 0.0 {
                    let light = shading.planes().pixel(at_x, at_y);
                    light.map(|v| Srgb::from_linear(0.2 * v))
                } else {
                    [0.9; 3]
                }
            });
            probe.push(angle, &Rgb::new(picture)).unwrap();
        }
        let (found, curves) = probe.finish(&frame).unwrap();
        assert_eq!(curves.frames(), 60);
        for (found, light) in found.coefficients().iter().zip(light.coefficients()) {
            for (found, light) in found.iter().zip(light) {
                assert!((found - 0.2 * light).abs() < 0.2 * 0.03, "{found} {light}");
            }
        }
    }

    #[test]
    fn a_ball_beyond_the_picture_is_refused() {
        assert!(ProbePlace::new([10.0, 10.0], f64::NAN).is_err());
        assert!(ProbePlace::new([10.0, 10.0], 2.0).is_err());
        let place = ProbePlace::new([10.0, 10.0], 20.0).unwrap();
        let picture = Rgb::<Srgb>::new(Planes::zeros(Extent::new(100, 100)));
        let refused = ProbeBuilder::new(place).unwrap().push(0.0, &picture);
        assert!(matches!(refused, Err(TurnError::Setting { .. })));
    }
}
