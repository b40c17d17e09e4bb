//! A lamp as light: a disc in the sky of even radiance.

use std::f64::consts::PI;
use std::str::FromStr;

use relight_core::image::{ColourSpace, Extent, Planes, Rgb, Srgb};
use relight_core::light::{Direction, Order, Panorama, ShLight, basis};

/// A lamp far away.
///
/// ```
/// use relight_photo::relighting::DiscLamp;
///
/// let lamp = DiscLamp { azimuth: 90.0, elevation: 0.0, ..DiscLamp::default() };
/// assert!(lamp.direction().components()[0] > 0.999); // from the right
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscLamp {
    /// Degrees about the vertical: 0 is at the viewer's side, 90 on the right, 180 behind the object, 270 on the left.
    pub azimuth: f64,
    /// Degrees above the horizon, -90 to 90.
    pub elevation: f64,
    /// Linear red, green and blue: the irradiance on a surface that faces it.
    pub colour: [f64; 3],
    /// How large it looks from the object, degrees across, 1 to 180: the larger, the softer are shadows and highlights.
    pub size: f64,
    /// Even light from all around, as a part of the lamp's irradiance.
    pub ambient: f64,
}

impl Default for DiscLamp {
    fn default() -> Self {
        Self {
            azimuth: 45.0,
            elevation: 45.0,
            colour: [1.0; 3],
            size: 30.0,
            ambient: 0.15,
        }
    }
}

impl DiscLamp {
    /// The direction in which it stands.
    pub fn direction(&self) -> Direction {
        let (sin, cos) = self.azimuth.to_radians().sin_cos();
        let (height, level) = self.elevation.to_radians().sin_cos();
        // All three vanish for no angles.
        Direction::new(sin * level, height, cos * level).unwrap_or(Direction::UP)
    }

    /// Its light, exact in all bands up to the order.
    ///
    /// The coefficients of a disc about an axis are those of the axis, times 2π ∫ P_l over the disc's cosines, which
    /// is 2π (P_(l-1) - P_(l+1)) / (2l + 1) at its edge.
    pub fn light(&self, order: Order) -> ShLight {
        let edge = self.edge();
        let radiance = self.radiance();
        let bands = legendre(order.get() + 1, edge);
        let mut light = ShLight::even(order, self.even());
        let values = basis(order, self.direction());
        for (at, (coefficient, value)) in
            light.coefficients_mut().iter_mut().zip(values).enumerate()
        {
            let l = at.isqrt();
            let integral = match l {
                0 => 1.0 - edge,
                _ => (bands[l - 1] - bands[l + 1]) / (2.0 * l as f64 + 1.0),
            };
            for (sum, radiance) in coefficient.iter_mut().zip(radiance) {
                *sum += 2.0 * PI * integral * value * radiance;
            }
        }
        light
    }

    /// Its light as a panorama. Pixels at the disc's edge are covered in part.
    ///
    /// # Panics
    /// Where `extent` has no pixels.
    pub fn panorama(&self, extent: Extent) -> Panorama {
        let frame = Panorama::from_light(&ShLight::dark(Order::TWO), extent);
        let (edge, towards) = (self.edge(), self.direction());
        let (radiance, even) = (self.radiance(), self.even());
        let places = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)];
        let planes = Planes::from_fn(extent, |x, y| {
            let covered = places.iter().filter(|(dx, dy)| {
                frame.direction(x as f64 + dx, y as f64 + dy).dot(towards) >= edge
            });
            let part = covered.count() as f64 / places.len() as f64;
            [0, 1, 2].map(|c| (part * radiance[c] + even[c]) as f32)
        });
        // All values are finite.
        Panorama::new(Rgb::new(planes)).unwrap_or(frame)
    }

    /// The cosine of the disc's radius.
    fn edge(&self) -> f64 {
        (self.size / 2.0).to_radians().cos()
    }

    /// The disc's radiance: its irradiance on a surface that faces it is π sin² of its radius times that.
    fn radiance(&self) -> [f64; 3] {
        let edge = self.edge();
        self.colour.map(|c| c / (PI * (1.0 - edge * edge)))
    }

    fn even(&self) -> [f64; 3] {
        self.colour.map(|c| c * self.ambient / PI)
    }
}

impl FromStr for DiscLamp {
    type Err = String;

    /// Reads `AZIMUTH,ELEVATION[,COLOUR][,SIZE]`, the colour as `#rrggbb` (sRGB) or as a temperature such as `3200K`.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut parts = text.split(',').map(str::trim);
        let mut angle = |name: &str, most: f64| {
            let angle = parts.next().and_then(|part| part.parse::<f64>().ok());
            let angle = angle.ok_or(
                "give AZIMUTH,ELEVATION[,COLOUR][,SIZE], such as 60,30 or -45,40,3200K,10",
            )?;
            if (-most..=most).contains(&angle) {
                Ok(angle)
            } else {
                Err(format!("give an {name} from -{most} to {most} degrees"))
            }
        };
        let mut lamp = Self {
            azimuth: angle("azimuth", 36_000.0)?,
            elevation: angle("elevation", 90.0)?,
            ..Self::default()
        };
        for part in parts {
            match part.parse::<f64>() {
                Ok(size) if (1.0..=180.0).contains(&size) => lamp.size = size,
                Ok(_) => return Err("give a size from 1 to 180 degrees".to_owned()),
                Err(_) => {
                    lamp.colour = colour(part).ok_or_else(|| {
                        format!("{part:?} is not a colour: give #rrggbb, or 1667K to 25000K")
                    })?;
                }
            }
        }
        Ok(lamp)
    }
}

/// A colour as #rrggbb or as a temperature, linear.
fn colour(text: &str) -> Option<[f64; 3]> {
    if let Some(kelvin) = text.strip_suffix(['K', 'k']) {
        let kelvin: f64 = kelvin.parse().ok()?;
        return TEMPERATURES
            .contains(&kelvin)
            .then(|| colour_of_temperature(kelvin));
    }
    let digits = text.strip_prefix('#').unwrap_or(text);
    if digits.len() != 6 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let number = u32::from_str_radix(digits, 16).ok()?;
    let channel = |shift: u32| (number >> shift & 0xff) as f32 / 255.0;
    Some([16, 8, 0].map(|shift| f64::from(Srgb::to_linear(channel(shift)))))
}

/// The temperatures for which the approximation of black bodies holds, kelvin.
const TEMPERATURES: std::ops::RangeInclusive<f64> = 1667.0..=25_000.0;

/// The Legendre polynomials P_0 to P_last at a place.
fn legendre(last: usize, x: f64) -> Vec<f64> {
    let mut values = vec![1.0, x];
    for l in 1..last {
        let degree = l as f64;
        let next = ((2.0 * degree + 1.0) * x * values[l] - degree * values[l - 1]) / (degree + 1.0);
        values.push(next);
    }
    values
}

/// The colour of a black body of this temperature in kelvin, 1667 to 25000, linear sRGB of luminance 1: the cubic approximation
/// of the Planckian locus by Kim et al. (US patent 7024034), as CIE xy.
pub fn colour_of_temperature(kelvin: f64) -> [f64; 3] {
    let t = kelvin.clamp(*TEMPERATURES.start(), *TEMPERATURES.end());
    let cubic =
        |c: [f64; 4]| c[0] * 1e9 / t.powi(3) + c[1] * 1e6 / t.powi(2) + c[2] * 1e3 / t + c[3];
    let x = if t < 4000.0 {
        cubic([-0.266_123_9, -0.234_358_9, 0.877_695_6, 0.179_910])
    } else {
        cubic([-3.025_846_9, 2.107_037_9, 0.222_634_7, 0.240_390])
    };
    let polynomial = |c: [f64; 4]| ((c[0] * x + c[1]) * x + c[2]) * x + c[3];
    let y = if t < 2222.0 {
        polynomial([-1.106_381_4, -1.348_110_20, 2.185_558_32, -0.202_196_83])
    } else if t < 4000.0 {
        polynomial([-0.954_947_6, -1.374_185_93, 2.091_370_15, -0.167_488_67])
    } else {
        polynomial([3.081_758_0, -5.873_386_70, 3.751_129_97, -0.370_014_83])
    };
    let [x, y, z] = [x / y, 1.0, (1.0 - x - y) / y];
    [
        3.240_97 * x - 1.537_383 * y - 0.498_611 * z,
        -0.969_244 * x + 1.875_968 * y + 0.041_555 * z,
        0.055_63 * x - 0.203_977 * y + 1.056_972 * z,
    ]
    .map(|v| v.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::light::Normals;
    use relight_core::render::{DiffuseForm, DiffuseLayer};

    fn plain() -> DiscLamp {
        DiscLamp {
            azimuth: 0.0,
            elevation: 0.0,
            ambient: 0.0,
            ..DiscLamp::default()
        }
    }

    #[test]
    fn coefficients_are_those_of_the_panorama() {
        let lamp = DiscLamp {
            azimuth: 130.0,
            elevation: 25.0,
            colour: [1.0, 0.5, 0.2],
            size: 60.0,
            ambient: 0.3,
        };
        let order = Order::new(8).unwrap();
        let exact = lamp.light(order);
        let seen = lamp.panorama(Extent::new(512, 256)).project(order);
        for (a, b) in exact.coefficients().iter().zip(seen.coefficients()) {
            assert!(
                (a[0] - b[0]).abs() < 2e-3 && (a[2] - b[2]).abs() < 1e-3,
                "{a:?} {b:?}"
            );
        }
    }

    #[test]
    fn a_surface_that_faces_it_receives_its_colour() {
        let light = plain().light(Order::TWO);
        let shading =
            DiffuseLayer::new(&light, DiffuseForm::Irradiance).shading(&Normals::sphere(33));
        // Order 2 holds 1.06 of a small lamp's irradiance at most.
        assert!((shading.planes().pixel(16, 16)[1] - 1.0).abs() < 0.07);
        assert!(shading.planes().pixel(32, 16)[1] < 0.4);
    }

    #[test]
    fn angles_go_from_the_viewer_to_the_right_and_up() {
        let at = |azimuth, elevation| {
            let lamp = DiscLamp {
                azimuth,
                elevation,
                ..plain()
            };
            lamp.direction()
        };
        assert!(at(0.0, 0.0).dot(Direction::VIEWER) > 0.999);
        assert!(at(90.0, 0.0).dot(Direction::RIGHT) > 0.999);
        assert!(at(10.0, 90.0).dot(Direction::UP) > 0.999);
        assert!(at(180.0, 0.0).dot(Direction::VIEWER) < -0.999);
    }

    #[test]
    fn warm_light_is_red_and_daylight_is_white() {
        let [r, _, b] = colour_of_temperature(2700.0);
        assert!(r > 1.5 && b < 0.4, "{r} {b}");
        let white = colour_of_temperature(6500.0);
        assert!(white.iter().all(|v| (v - 1.0).abs() < 0.06), "{white:?}");
    }

    #[test]
    fn a_lamp_has_two_angles_and_may_have_a_colour_and_a_size() {
        let lamp = |text: &str| text.parse::<DiscLamp>();
        let plain = lamp("60,-30").unwrap();
        assert_eq!(
            (plain.azimuth, plain.elevation, plain.size),
            (60.0, -30.0, 30.0)
        );
        let warm = lamp("-45, 40, 3200K, 10").unwrap();
        assert!(warm.colour[0] > warm.colour[2]);
        assert_eq!(warm.size, 10.0);
        assert_eq!(lamp("0,0,#ff0000").unwrap().colour, [1.0, 0.0, 0.0]);
        assert_eq!(lamp("0,0,5").unwrap().size, 5.0);
        for odd in [
            "",
            "60",
            "60,100",
            "60,30,blue",
            "60,30,0",
            "60,30,100K",
            "nan,0",
        ] {
            assert!(lamp(odd).is_err(), "{odd}");
        }
    }
}
