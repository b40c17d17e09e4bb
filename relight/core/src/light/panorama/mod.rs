//! Panoramas: light as an image of everything around.

mod projection;
mod resample;
mod sampler;

use std::f64::consts::PI;
use std::path::Path;

use super::{Direction, LightError, ShLight};
pub use sampler::{LightSample, LightSampler};

use crate::image::{ColourImage, Extent, ImageError, Linear, Planes, Rgb, Samples};

/// Linear radiance from all around, as an equirectangular image whose every pixel has one radiance.
///
/// The middle column is behind the object (-z), right of it is to the right (+x),
/// the left and right edge meet at the viewer's back (+z); rows go down from the zenith (+y).
///
/// ```
/// use relight_core::image::Extent;
/// use relight_core::light::{Direction, Order, Panorama, ShLight};
///
/// let sky = ShLight::even(Order::TWO, [0.2, 0.4, 1.0]);
/// let panorama = Panorama::from_light(&sky, Extent::new(32, 16));
/// assert!((panorama.radiance(Direction::UP)[2] - 1.0).abs() < 1e-6);
/// assert_eq!(panorama.pixel_towards(Direction::RIGHT), (24, 8));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Panorama {
    image: Rgb<Linear>,
}

/// Files with fewer rows are refused.
const MIN_HEIGHT: usize = 4;

impl Panorama {
    /// The panorama that an image of radiance shows.
    ///
    /// # Errors
    /// If it has no pixels, or a value is infinite or not a number.
    pub fn new(image: Rgb<Linear>) -> Result<Self, LightError> {
        if image.planes().extent().pixels() == 0 {
            return Err(LightError::Empty);
        }
        let planes = image.planes().planes();
        if planes.into_iter().flatten().all(|value| value.is_finite()) {
            Ok(Self { image })
        } else {
            Err(LightError::NotFinite)
        }
    }

    /// Decodes the content of an HDR (Radiance) or EXR file; errors name it as `path`.
    ///
    /// # Errors
    /// If it is not an image, holds integers, is not twice as wide as high, or has values that are not finite.
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, ImageError> {
        let image = ColourImage::from_bytes(path, bytes, None)?;
        let wrong = |fault: String| ImageError::file(path, fault);
        if image.stored().samples == Samples::Integer {
            let fault =
                "holds 8- or 16-bit integers: give a panorama in linear radiance, HDR or EXR";
            return Err(wrong(fault.to_owned()));
        }
        let Extent { width, height } = image.stored().planes.extent();
        if width != 2 * height || height < MIN_HEIGHT {
            return Err(wrong(format!(
                "has {width} x {height} pixels; a panorama is twice as wide as high, and at least {MIN_HEIGHT} pixels high"
            )));
        }
        Self::new(image.into_light()).map_err(|error| wrong(format!("is not a panorama: {error}")))
    }

    /// The light as it is seen in the middle of each pixel.
    ///
    /// # Panics
    /// Where `extent` has no pixels.
    pub fn from_light(light: &ShLight, extent: Extent) -> Self {
        assert!(extent.pixels() > 0, "a panorama has pixels");
        let mut planes = Planes::zeros(extent);
        planes.fill_rows(|y, row| {
            let [red, green, blue] = row;
            for (x, ((r, g), b)) in red.iter_mut().zip(green).zip(blue).enumerate() {
                let direction = direction_at(extent, x as f64 + 0.5, y as f64 + 0.5);
                [*r, *g, *b] = light.radiance(direction).map(|value| value as f32);
            }
        });
        Self {
            image: Rgb::new(planes),
        }
    }

    /// The radiance, as an image.
    pub const fn image(&self) -> &Rgb<Linear> {
        &self.image
    }

    /// Width and height.
    pub const fn extent(&self) -> Extent {
        self.image.planes().extent()
    }

    /// The direction of a point of the image, in pixels from the left and from the top: (0.5, 0.5) is
    /// the middle of the first pixel.
    pub fn direction(&self, x: f64, y: f64) -> Direction {
        direction_at(self.extent(), x, y)
    }

    /// Column and row of the pixel that lies in a direction.
    pub fn pixel_towards(&self, direction: Direction) -> (usize, usize) {
        let Extent { width, height } = self.extent();
        let [x, y, z] = direction.components();
        let across = x.atan2(-z) / (2.0 * PI) + 0.5;
        let down = y.clamp(-1.0, 1.0).acos() / PI;
        // Neither is negative.
        let nearest = |part: f64, pixels: usize| ((part * pixels as f64) as usize).min(pixels - 1);
        (nearest(across, width), nearest(down, height))
    }

    /// The radiance from a direction: that of its pixel.
    pub fn radiance(&self, from: Direction) -> [f32; 3] {
        let (x, y) = self.pixel_towards(from);
        self.image.planes().pixel(x, y)
    }

    /// The solid angle of each pixel of a row, steradian.
    pub fn solid_angle(&self, row: usize) -> f64 {
        let Extent { width, height } = self.extent();
        let [above, below] = [row, row + 1].map(|edge| (PI * edge as f64 / height as f64).cos());
        (above - below) * 2.0 * PI / width as f64
    }
}

fn direction_at(extent: Extent, x: f64, y: f64) -> Direction {
    let azimuth = (x / extent.width as f64 - 0.5) * 2.0 * PI;
    let (sin, cos) = (PI * y / extent.height as f64).sin_cos();
    Direction::from_unit([sin * azimuth.sin(), cos, -sin * azimuth.cos()])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn black(extent: Extent) -> Panorama {
        Panorama::new(Rgb::new(Planes::zeros(extent))).unwrap()
    }

    #[test]
    fn every_pixel_s_middle_is_found_again() {
        let panorama = black(Extent::new(12, 6));
        for y in 0..6 {
            for x in 0..12 {
                let towards = panorama.direction(x as f64 + 0.5, y as f64 + 0.5);
                assert_eq!(panorama.pixel_towards(towards), (x, y));
            }
        }
    }

    #[test]
    fn all_pixels_together_are_the_sphere() {
        let panorama = black(Extent::new(9, 7));
        let all: f64 = (0..7).map(|row| panorama.solid_angle(row) * 9.0).sum();
        assert!((all - 4.0 * PI).abs() < 1e-12);
    }

    #[test]
    fn the_middle_is_behind_the_object_and_the_edge_at_the_viewer() {
        let panorama = black(Extent::new(8, 4));
        let middle = panorama.direction(4.0, 2.0).components();
        assert!((middle[2] + 1.0).abs() < 1e-12);
        assert!(panorama.direction(0.0, 2.0).dot(Direction::VIEWER) > 1.0 - 1e-12);
        assert!(panorama.direction(6.0, 2.0).dot(Direction::RIGHT) > 1.0 - 1e-12);
        assert!(panorama.direction(3.0, 0.0).dot(Direction::UP) > 1.0 - 1e-12);
    }

    #[test]
    fn what_is_no_light_is_refused() {
        let image = |value| Rgb::new(Planes::filled(Extent::new(2, 1), [value, 0.0, 0.0]));
        assert_eq!(Panorama::new(image(f32::NAN)), Err(LightError::NotFinite));
        let empty = Rgb::new(Planes::zeros(Extent::new(0, 1)));
        assert_eq!(Panorama::new(empty), Err(LightError::Empty));
    }

    #[test]
    fn a_file_of_integers_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sky.png");
        let grey = Planes::filled(Extent::new(2, 1), [0.5; 3]);
        crate::files::write_png(&path, &grey, crate::image::Depth::Eight).unwrap();
        let error = Panorama::read(&path).unwrap_err();
        assert!(error.to_string().contains("sky.png"), "{error}");
    }
}
