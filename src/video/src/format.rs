//! The one type for how a camera's frames are coded, from the camera's driver to the video file.

use std::fmt;

/// How the frames of a stream are coded. Uncompressed formats have 8 bits a value and rows without
/// padding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PixelFormat {
    /// Each frame a JPEG.
    Mjpeg,
    /// H.264 with start codes, one frame a packet, in the order in which frames are shown.
    H264,
    /// Packed 4:2:2: Y, Cb, Y, Cr for two pixels.
    Yuyv,
    /// 4:2:0 in two planes: luma, then interleaved Cb and Cr.
    Nv12,
    /// Packed red, green, blue.
    Rgb24,
    /// Luma alone, one byte a pixel.
    Grey,
    /// A sensor's mosaic, one byte a pixel.
    Bayer(BayerPattern),
}

/// The colours of a mosaic's first two rows, in reading order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BayerPattern {
    /// Blue, green / green, red.
    Bggr,
    /// Green, blue / red, green.
    Gbrg,
    /// Green, red / blue, green.
    Grbg,
    /// Red, green / green, blue.
    Rggb,
}

impl fmt::Display for BayerPattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bggr => "blue, green / green, red",
            Self::Gbrg => "green, blue / red, green",
            Self::Grbg => "green, red / blue, green",
            Self::Rggb => "red, green / green, blue",
        })
    }
}

impl PixelFormat {
    /// All formats.
    pub const ALL: [Self; 10] = [
        Self::Mjpeg,
        Self::H264,
        Self::Yuyv,
        Self::Nv12,
        Self::Rgb24,
        Self::Grey,
        Self::Bayer(BayerPattern::Bggr),
        Self::Bayer(BayerPattern::Gbrg),
        Self::Bayer(BayerPattern::Grbg),
        Self::Bayer(BayerPattern::Rggb),
    ];

    /// The codec by which a video file keeps it: `mjpeg` and `h264` as they come, `ffv1` for
    /// uncompressed frames.
    pub fn codec(self) -> &'static str {
        match self {
            Self::Mjpeg => "mjpeg",
            Self::H264 => "h264",
            _ => "ffv1",
        }
    }

    /// Bytes of a row and number of rows of an uncompressed frame, all planes counted; `None` for
    /// compressed formats and for sizes that no memory holds. An odd width or height shares its last
    /// colour difference with nobody.
    pub fn rows(self, width: u32, height: u32) -> Option<(usize, usize)> {
        let (width, height) = (usize::try_from(width).ok()?, usize::try_from(height).ok()?);
        Some(match self {
            Self::Mjpeg | Self::H264 => return None,
            Self::Yuyv => (width.div_ceil(2).checked_mul(4)?, height),
            Self::Nv12 => (
                width.div_ceil(2).checked_mul(2)?,
                height.checked_add(height.div_ceil(2))?,
            ),
            Self::Rgb24 => (width.checked_mul(3)?, height),
            Self::Grey | Self::Bayer(_) => (width, height),
        })
    }

    /// Bytes of an uncompressed frame; `None` as for [`Self::rows`].
    pub fn frame_bytes(self, width: u32, height: u32) -> Option<usize> {
        let (row, rows) = self.rows(width, height)?;
        row.checked_mul(rows)
    }
}

/// What a camera was set to deliver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StreamFormat {
    /// How its frames are coded.
    pub format: PixelFormat,
    /// Frame width, pixels.
    pub width: u32,
    /// Frame height, pixels.
    pub height: u32,
    /// Nominal frames a second.
    pub fps: f64,
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn an_uncompressed_frame_has_the_bytes_of_its_size() {
        for (format, bytes) in [
            (PixelFormat::Yuyv, 4 * 3),
            (PixelFormat::Nv12, 2 * 5),
            (PixelFormat::Rgb24, 6 * 3),
            (PixelFormat::Grey, 2 * 3),
            (PixelFormat::Bayer(BayerPattern::Rggb), 2 * 3),
        ] {
            assert_eq!(format.frame_bytes(2, 3), Some(bytes), "{format:?}");
            assert_eq!(format.codec(), "ffv1");
        }
        for compressed in [PixelFormat::Mjpeg, PixelFormat::H264] {
            assert_eq!(compressed.frame_bytes(2, 3), None);
        }
    }

    proptest! {
        #[test]
        fn no_size_overflows(width in any::<u32>(), height in any::<u32>()) {
            for format in PixelFormat::ALL {
                let _ = format.frame_bytes(width, height);
            }
        }
    }
}
