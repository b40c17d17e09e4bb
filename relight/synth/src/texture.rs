//! Pictures that are laid onto objects.

use std::io::Cursor;
use std::path::Path;

use glam::{Vec2, Vec3};
use image::{ImageError as FileError, ImageReader, RgbImage};

use super::SynthError;
use relight_core::image::{ColourImage, ColourSpace, Extent, Srgb};

/// Longest side of a mesh's own pictures in memory: larger ones are made smaller.
const LONGEST_SIDE: usize = 1024;

/// A picture in linear light, which repeats itself in all directions.
#[derive(Debug, Clone)]
pub(crate) struct TextureImage {
    width: usize,
    height: usize,
    texels: Vec<Vec3>,
    mean: Vec3,
}

impl TextureImage {
    /// A picture of the colours that `at` gives for column and row.
    pub(crate) fn from_fn(width: usize, height: usize, at: impl Fn(usize, usize) -> Vec3) -> Self {
        let texels: Vec<Vec3> = (0..width * height)
            .map(|k| at(k % width, k / width))
            .collect();
        let mean = texels.iter().sum::<Vec3>() / texels.len().max(1) as f32;
        Self {
            width,
            height,
            texels,
            mean,
        }
    }

    /// Reads a picture, whose values are sRGB where it says nothing else.
    ///
    /// # Errors
    /// [`SynthError::Image`] where it cannot be read or is no picture.
    pub(crate) fn read(path: &Path) -> Result<Self, SynthError> {
        let image = ColourImage::read(path, None)?.into_light();
        let planes = image.planes();
        let Extent { width, height } = planes.extent();
        Ok(Self::from_fn(width, height, |x, y| {
            Vec3::from_array(planes.pixel(x, y))
        }))
    }

    /// A picture of a mesh's own, PNG, JPEG or WebP, whose values are sRGB: glTF has readers leave out what a file says
    /// of its colours and its orientation.
    pub(super) fn of_colours(bytes: &[u8]) -> Result<Self, FileError> {
        let image = decoded(bytes)?;
        Ok(Self::reduced(&image, Srgb::to_linear))
    }

    /// The same of values that are no colours: they are in proportion.
    pub(super) fn of_numbers(bytes: &[u8]) -> Result<Self, FileError> {
        let image = decoded(bytes)?;
        Ok(Self::reduced(&image, |value| value))
    }

    /// Means over squares of the picture, so that no side is longer than [`LONGEST_SIDE`].
    fn reduced(image: &RgbImage, value: impl Fn(f32) -> f32) -> Self {
        let values: [f32; 256] = std::array::from_fn(|level| value(level as f32 / 255.0));
        let (width, height) = (image.width() as usize, image.height() as usize);
        let side = width.max(height).div_ceil(LONGEST_SIDE).max(1);
        Self::from_fn(width.div_ceil(side), height.div_ceil(side), |x, y| {
            let rows = y * side..((y + 1) * side).min(height);
            let columns = x * side..((x + 1) * side).min(width);
            let count = (rows.len() * columns.len()).max(1) as f32;
            let places = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
            let texels = places.map(|(x, y)| {
                let levels = image.get_pixel(x as u32, y as u32).0;
                Vec3::from_array(levels.map(|level| values[usize::from(level)]))
            });
            texels.sum::<Vec3>() / count
        })
    }

    /// The mean of all its colours; black without pixels.
    pub(super) fn mean(&self) -> Vec3 {
        self.mean
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

fn decoded(bytes: &[u8]) -> Result<RgbImage, FileError> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
    Ok(reader.decode()?.to_rgb8())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_picture_is_made_smaller_by_means_of_its_light() {
        let image = RgbImage::from_fn(2048, 4, |x, _| {
            image::Rgb([if x % 2 == 0 { 255 } else { 0 }; 3])
        });
        let mut png = Vec::new();
        image
            .write_to(&mut Cursor::new(&mut png), image::ImageFormat::Png)
            .unwrap();
        let picture = TextureImage::of_colours(&png).unwrap();
        assert_eq!((picture.width, picture.height), (1024, 2));
        assert!(
            picture
                .texels
                .iter()
                .all(|texel| (texel.x - 0.5).abs() < 1e-6)
        );
        assert_eq!(picture.mean(), picture.texels[0]);
        assert!(TextureImage::of_numbers(&png[..40]).is_err());
    }

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
