//! Pictures that are laid onto objects.

use std::path::Path;

use glam::{Vec2, Vec3};

use crate::SynthError;
use relight_core::image::{Extent, Linear, Rgb, Transfer};

/// A picture in linear light, which repeats itself in all directions.
#[derive(Debug, Clone)]
pub struct TextureImage {
    width: usize,
    height: usize,
    texels: Vec<Vec3>,
}

impl TextureImage {
    /// A picture of the colours that `at` gives for column and row.
    pub(crate) fn from_fn(width: usize, height: usize, at: impl Fn(usize, usize) -> Vec3) -> Self {
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
    /// [`SynthError::Image`] where it cannot be read or is no picture.
    pub fn read(path: &Path) -> Result<Self, SynthError> {
        let image = Rgb::<Linear>::read(path, Transfer::Srgb)?;
        let planes = image.planes();
        let Extent { width, height } = planes.extent();
        Ok(Self::from_fn(width, height, |x, y| {
            Vec3::from_array(planes.pixel(x, y))
        }))
    }

    /// The colour at a place; the picture is 1 wide and high, v runs upwards. Bilinear. A picture
    /// without pixels is black.
    pub(super) fn at(&self, place: Vec2) -> Vec3 {
        if self.texels.is_empty() {
            return Vec3::ZERO;
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_looked_up_between_its_texels_and_repeats_itself() {
        let picture = TextureImage::from_fn(2, 2, |x, y| Vec3::new(x as f32, y as f32, 0.0));
        assert_eq!(picture.at(Vec2::new(0.25, 0.75)), Vec3::ZERO);
        assert_eq!(picture.at(Vec2::new(0.75, 0.25)), Vec3::new(1.0, 1.0, 0.0));
        assert_eq!(picture.at(Vec2::new(0.5, 0.75)), Vec3::new(0.5, 0.0, 0.0));
        assert_eq!(
            picture.at(Vec2::new(-0.25, 5.25)),
            picture.at(Vec2::new(0.75, 0.25))
        );
        assert_eq!(
            TextureImage::from_fn(0, 3, |_, _| Vec3::ONE).at(Vec2::ZERO),
            Vec3::ZERO
        );
    }
}
