//! Pictures that are laid onto objects.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::super::Error;

/// A picture in linear light, which repeats itself in all directions.
#[derive(Debug, Clone)]
pub struct Picture {
    width: usize,
    height: usize,
    texels: Vec<Vec3>,
}

impl Picture {
    /// A picture of the colours that `at` gives for column and row.
    pub(in crate::synth) fn from_fn(
        width: usize,
        height: usize,
        at: impl Fn(usize, usize) -> Vec3,
    ) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        let texels = (0..width * height)
            .map(|k| at(k % width, k / width))
            .collect();
        Self {
            width,
            height,
            texels,
        }
    }

    /// Reads a PNG or JPEG, whose values are sRGB.
    ///
    /// # Errors
    /// [`Error::Picture`] where it is no such picture, [`Error::Read`] where it cannot be read.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let bytes = std::fs::read(path).map_err(Error::read(path))?;
        let image = image::load_from_memory(&bytes).map_err(|source| Error::Picture {
            path: path.to_owned(),
            source,
        })?;
        let image = image.into_rgb32f();
        let (width, height) = image.dimensions();
        Ok(Self::from_fn(width as usize, height as usize, |x, y| {
            let [r, g, b] = image.get_pixel(x as u32, y as u32).0;
            Vec3::new(r, g, b).map(linear)
        }))
    }

    /// The colour at a place; the picture is 1 wide and high, v runs upwards. Bilinear.
    pub(super) fn at(&self, place: Vec2) -> Vec3 {
        let x = (place.x - place.x.floor()) * self.width as f32 - 0.5;
        let y = (1.0 - (place.y - place.y.floor())) * self.height as f32 - 0.5;
        let (left, above) = (x.floor(), y.floor());
        let texel = |dx: i64, dy: i64| {
            let column = (left as i64 + dx).rem_euclid(self.width as i64) as usize;
            let row = (above as i64 + dy).rem_euclid(self.height as i64) as usize;
            self.texels[row * self.width + column]
        };
        let upper = texel(0, 0).lerp(texel(1, 0), x - left);
        let lower = texel(0, 1).lerp(texel(1, 1), x - left);
        upper.lerp(lower, y - above)
    }
}

/// The light of an sRGB value (IEC 61966-2-1).
fn linear(value: f32) -> f32 {
    if value <= 0.040_45 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}
