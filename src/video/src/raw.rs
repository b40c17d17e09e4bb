//! A decoded frame in a camera's raw format.

use ffmpeg_next::format::Pixel;

use super::picture::{Picture, plane};
use super::{DecodeFault, PixelFormat};
use relit_data::geometry::Rect;

impl Picture {
    /// The picture in the raw format with the same samples, if there is one; otherwise, and if the
    /// picture is rotated or stretched, its YUV is full-range or not SDR, as RGB. Its size is [`Self::size`].
    ///
    /// # Errors
    /// [`DecodeFault::PixelFormat`] if the format cannot be converted.
    pub fn raw(&self) -> Result<(PixelFormat, Vec<u8>), DecodeFault> {
        if self.display.is_plain()
            && self.colour.is_srgb()
            && let Some(raw) = self.same_samples()
        {
            return Ok(raw);
        }
        let (width, height) = self.size();
        let rgb = self.rgb(Rect::new(0, 0, width, height))?;
        Ok((PixelFormat::Rgb24, rgb.into_raw()))
    }

    fn same_samples(&self) -> Option<(PixelFormat, Vec<u8>)> {
        let (width, height) = (self.frame.width() as usize, self.frame.height() as usize);
        let even = width.is_multiple_of(2);
        match self.frame.format() {
            Pixel::GRAY8 => Some((PixelFormat::Grey, self.rows(0, width, height)?)),
            Pixel::YUYV422 if even => Some((PixelFormat::Yuyv, self.rows(0, 2 * width, height)?)),
            _ if self.colour.full_range || !even => None,
            Pixel::YUV420P => Some((PixelFormat::Nv12, self.nv12(width, height)?)),
            Pixel::YUV422P => Some((PixelFormat::Yuyv, self.yuyv(width, height)?)),
            _ => None,
        }
    }

    /// The rows of a plane without padding.
    fn rows(&self, index: usize, row: usize, rows: usize) -> Option<Vec<u8>> {
        let mut tight = Vec::with_capacity(row * rows);
        for y in 0..rows {
            let (samples, _) = plane(&self.frame, index, 0, y)?;
            tight.extend_from_slice(samples.get(..row)?);
        }
        Some(tight)
    }

    fn nv12(&self, width: usize, height: usize) -> Option<Vec<u8>> {
        let mut picture = self.rows(0, width, height)?;
        let (half_width, half_height) = (width / 2, height.div_ceil(2));
        let blue = self.rows(1, half_width, half_height)?;
        let red = self.rows(2, half_width, half_height)?;
        picture.extend(blue.iter().zip(&red).flat_map(|(&blue, &red)| [blue, red]));
        Some(picture)
    }

    fn yuyv(&self, width: usize, height: usize) -> Option<Vec<u8>> {
        let luma = self.rows(0, width, height)?;
        let blue = self.rows(1, width / 2, height)?;
        let red = self.rows(2, width / 2, height)?;
        let pairs = luma.chunks_exact(2).zip(blue.iter().zip(&red));
        let packed = pairs.flat_map(|(luma, (&blue, &red))| [luma[0], blue, luma[1], red]);
        Some(packed.collect())
    }
}
