//! The light by a ball.

use relight_core::image::{Linear, Planes, Rgb};
use relight_core::light::{Normals, ShLight};
use relight_core::render::Surface;

use crate::error::TurnError;
use crate::fit::environment::fit_turn_light;
use crate::fit::probe_check::{Circle, check, max_residual};
use crate::model::frame::TableFrame;
use crate::model::material::MaterialKind;
use crate::observe::conditioning::Conditioning;
use crate::observe::mirror_panorama::MirrorPanorama;
use crate::observe::probe::{Probe, ProbeBall, ProbeBuilder, middle_of};

/// Share of the variation beyond the second harmonic from which a ball looks like chrome, 0 to 1. By hand.
const SHARP: f64 = 0.06;

/// The light that a ball measured.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbeLight {
    /// In the viewer's frame at the table's angle 0: of order 2 by a grey ball, in units in which the ball's albedo is
    /// 1; of order 6 by a chrome one, in units in which it reflects everything and a white Lambertian surface has
    /// albedo 1.
    pub light: ShLight,
    /// How many frames it was measured in.
    pub frames: u32,
    /// The kind of ball assumed.
    pub ball: ProbeBall,
    /// What it looks like.
    pub looks: ProbeBall,
    /// The part of what varies in the ball, over the turn and from place to place, that this light does not fit, 0 to
    /// 1.
    pub residual: f64,
}

impl ProbeLight {
    /// Whether the light fits the ball so badly that its place is to be checked.
    pub fn is_doubtful(&self) -> bool {
        self.residual > max_residual(self.ball) / 2.0
    }
}

impl ProbeBuilder {
    /// The light.
    ///
    /// # Errors
    /// If the frames show too little, or the ball is not at the given place: [`TurnError::Misplaced`] and
    /// [`TurnError::NoBall`].
    pub(crate) fn finish(self) -> Result<ProbeLight, TurnError> {
        let Probe {
            place,
            ball,
            elevation,
        } = self.probe;
        let frame = TableFrame::new(elevation);
        let around = self.curves()?;
        let width = around.extent().width;
        let normals = Planes::from_fn(around.extent(), |x, y| {
            let normal = Circle::GIVEN.normal(middle_of(y * width + x));
            normal.unwrap_or_default().map(|value| value as f32)
        });
        let curves = around.only(|at| normals.pixel(at % width, at / width) != [0.0; 3]);
        let looks = if Conditioning::from_curves(&curves).beyond > SHARP {
            ProbeBall::Chrome
        } else {
            ProbeBall::Grey
        };
        let ball = ball.unwrap_or(looks);
        let residual = check(&around, frame, place, ball).map_err(|error| match error {
            // Of a ball of the other kind, its place is not observable.
            TurnError::Misplaced {
                given, explained, ..
            } if ball != looks => TurnError::NoBall {
                given,
                explained: explained[0],
            },
            error => error,
        })?;
        let light = match ball {
            ProbeBall::Grey => {
                let albedo = Rgb::<Linear>::new(Planes::filled(normals.extent(), [1.0; 3]));
                let surface = Surface::new(Normals::new(normals), albedo, None)?;
                fit_turn_light(&curves, &surface, MaterialKind::Diffuse, &frame)?
            }
            ProbeBall::Chrome => {
                let light = MirrorPanorama::from_curves(&curves, &normals, frame).light()?;
                light.rotated(&frame.rotation().inverse())
            }
        };
        Ok(ProbeLight {
            light,
            frames: curves.frames(),
            ball,
            looks,
            residual,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::directions::reflected;
    use crate::{Elevation, ProbePlace};
    use relight_core::image::{ColourSpace, Extent, Srgb};
    use relight_core::light::Rotation;
    use relight_core::light::{Direction, Order, basis};
    use relight_core::render::{DiffuseForm, DiffuseLayer};
    use std::f64::consts::FRAC_1_PI;

    const ELEVATION: f64 = 22.0;

    fn probe(ball: Option<ProbeBall>) -> Probe {
        Probe {
            place: ProbePlace::new([61.0, 40.0], 30.0).unwrap(),
            ball,
            elevation: Elevation::measured(ELEVATION).unwrap(),
        }
    }

    /// An environment with windows: beyond band 2 too.
    fn environment() -> ShLight {
        let values = [2.0, 0.3, 0.24, 0.36, 0.07, -0.06, 0.03, 0.12, 0.09];
        let light = ShLight::new(values.map(|v| [v, 0.9 * v, 0.8 * v]).to_vec()).unwrap();
        let mut light = light.with_order(Order::new(4).unwrap());
        for (at, values) in light.coefficients_mut().iter_mut().enumerate().skip(9) {
            *values = [0.15 * (1.7 * at as f64).sin(); 3];
        }
        light
    }

    /// The surroundings of the ball in the picture: above, an environment that moves past; below, the table.
    fn behind(angle_deg: f64, x: usize, y: usize) -> [f32; 3] {
        if y > 50 {
            return [0.5, 0.45, 0.4];
        }
        let azimuth = (angle_deg + 0.5 * x as f64).to_radians();
        let wall = 0.5 + 0.2 * (3.0 * azimuth).sin() + 0.2 * (11.0 * azimuth).cos();
        [wall as f32; 3]
    }

    /// Films a ball that shows of a light what `shown` says, pixel by pixel.
    fn measure(
        ball: Option<ProbeBall>,
        shown: impl Fn(&ShLight, &Normals) -> Planes<3>,
    ) -> ProbeLight {
        try_measure(probe(ball), shown).unwrap()
    }

    /// The same for a ball at another given place.
    fn try_measure(
        probe: Probe,
        shown: impl Fn(&ShLight, &Normals) -> Planes<3>,
    ) -> Result<ProbeLight, TurnError> {
        let mut builder = ProbeBuilder::new(probe);
        let normals = Normals::sphere(60);
        let frame = TableFrame::new(Elevation::measured(ELEVATION).unwrap());
        let [x, y, z] = frame.axis();
        let axis = Direction::new(x, y, z).unwrap();
        for k in 0..60 {
            let angle = 6.0 * f64::from(k);
            let turned = environment().rotated(&Rotation::about(axis, -angle.to_radians()));
            let light = shown(&turned, &normals);
            let picture = Planes::from_fn(Extent::new(120, 90), |x, y| {
                let (at_x, at_y) = (x.wrapping_sub(31), y.wrapping_sub(10));
                if at_x < 60 && at_y < 60 && normals.planes().pixel(at_x, at_y)[2] > 0.0 {
                    light.pixel(at_x, at_y).map(Srgb::from_linear)
                } else {
                    behind(angle, x, y)
                }
            });
            builder.push(angle, &Rgb::new(picture)).unwrap();
        }
        builder.finish()
    }

    fn grey(light: &ShLight, normals: &Normals) -> Planes<3> {
        let shading = DiffuseLayer::new(light, DiffuseForm::Irradiance).shading(normals);
        shading.into_planes().map(|v| 0.2 * v)
    }

    fn chrome(light: &ShLight, normals: &Normals) -> Planes<3> {
        Planes::from_fn(normals.extent(), |x, y| {
            let normal = normals.planes().pixel(x, y).map(f64::from);
            let [x, y, z] = reflected(normal);
            let Some(to) = Direction::new(x, y, z) else {
                return [0.0; 3];
            };
            let values = basis(light.order(), to);
            [0, 1, 2].map(|c| {
                let pairs = light.coefficients().iter().zip(&values);
                let sum: f64 = pairs.map(|(light, value)| light[c] * value).sum();
                (0.5 * sum) as f32
            })
        })
    }

    fn check(found: &ShLight, factor: f64, count: usize) {
        let wanted = environment();
        assert!(found.coefficients().len() >= count);
        for (found, light) in found
            .coefficients()
            .iter()
            .zip(wanted.coefficients())
            .take(count)
        {
            for (found, light) in found.iter().zip(light) {
                assert!(
                    (found - factor * light).abs() < 0.03 * factor,
                    "{found} {light}"
                );
            }
        }
    }

    #[test]
    fn a_grey_ball_tells_the_light_in_units_of_its_albedo() {
        let found = measure(None, grey);
        assert_eq!(
            (found.frames, found.ball, found.looks),
            (60, ProbeBall::Grey, ProbeBall::Grey)
        );
        check(&found.light, 0.2, 9);
    }

    #[test]
    fn a_chrome_ball_tells_more_of_the_light_in_units_of_what_it_reflects() {
        let found = measure(None, chrome);
        assert_eq!(
            (found.ball, found.looks),
            (ProbeBall::Chrome, ProbeBall::Chrome)
        );
        check(&found.light, 0.5 * FRAC_1_PI, 25);
    }

    #[test]
    fn a_ball_that_is_not_of_what_is_said_of_it_is_refused() {
        for refused in [
            try_measure(probe(Some(ProbeBall::Chrome)), grey),
            try_measure(probe(Some(ProbeBall::Grey)), chrome),
        ] {
            let refused = refused.unwrap_err();
            assert!(matches!(refused, TurnError::NoBall { .. }), "{refused}");
        }
    }

    #[test]
    fn a_ball_beside_its_place_is_refused_with_where_it_is() {
        type Shown = fn(&ShLight, &Normals) -> Planes<3>;
        for (ball, shown) in [
            (ProbeBall::Grey, grey as Shown),
            (ProbeBall::Chrome, chrome as Shown),
        ] {
            let there = measure(Some(ball), shown);
            assert!(there.residual < 0.05 && !there.is_doubtful(), "{there:?}");
            for (middle, radius) in [
                ([69.0, 40.0], 30.0),
                ([61.0, 34.0], 30.0),
                ([61.0, 40.0], 24.0),
                ([57.0, 43.0], 36.0),
            ] {
                let place = ProbePlace::new(middle, radius).unwrap();
                let other = Probe {
                    place,
                    ..probe(Some(ball))
                };
                let refused = try_measure(other, shown).unwrap_err();
                let TurnError::Misplaced { better, .. } = &refused else {
                    panic!("{ball:?} at {place}: {refused}");
                };
                let apart = [0, 1, 2].map(|i| (better[i] - [61.0, 40.0, 30.0][i]).abs());
                assert!(apart.iter().all(|&apart| apart <= 2.0), "{refused}");
            }
        }
    }

    #[test]
    fn what_is_no_ball_is_refused() {
        // A board that leans to the camera.
        let flat = |light: &ShLight, normals: &Normals| {
            let board = Planes::filled(normals.extent(), [0.0, 0.6, 0.8]);
            grey(light, &Normals::new(board))
        };
        let refused = try_measure(probe(Some(ProbeBall::Grey)), flat).unwrap_err();
        assert!(matches!(refused, TurnError::NoBall { .. }), "{refused}");
    }

    #[test]
    fn a_ball_beyond_the_picture_is_refused() {
        assert!(ProbePlace::new([10.0, 10.0], f64::NAN).is_err());
        assert!(ProbePlace::new([10.0, 10.0], 2.0).is_err());
        let beyond = Probe {
            place: ProbePlace::new([10.0, 10.0], 20.0).unwrap(),
            ..probe(None)
        };
        let picture = Rgb::<Srgb>::new(Planes::zeros(Extent::new(100, 100)));
        let refused = ProbeBuilder::new(beyond).push(0.0, &picture);
        assert!(matches!(refused, Err(TurnError::Refused(_))));
    }
}
