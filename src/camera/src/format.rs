//! What a camera offers: pixel formats, sizes and rates.

use std::fmt;

use relit_video::{BayerPattern, PixelFormat};

use super::Rate;

/// A pixel format's four characters, as V4L2 writes them.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Fourcc(pub [u8; 4]);

impl Fourcc {
    /// Motion JPEG.
    pub const MJPG: Self = Self(*b"MJPG");
    /// H.264 with start codes.
    pub const H264: Self = Self(*b"H264");
    /// Packed 4:2:2.
    pub const YUYV: Self = Self(*b"YUYV");
    /// 4:2:0, luma plane, then interleaved colour differences.
    pub const NV12: Self = Self(*b"NV12");
    /// Packed red, green, blue.
    pub const RGB3: Self = Self(*b"RGB3");
    /// Luma alone.
    pub const GREY: Self = Self(*b"GREY");

    /// The format of the kernel's 32-bit code.
    pub fn from_code(code: u32) -> Self {
        Self(code.to_le_bytes())
    }

    /// The kernel's 32-bit code.
    pub fn code(self) -> u32 {
        u32::from_le_bytes(self.0)
    }

    /// The code by which cameras offer a format.
    pub fn from_pixel_format(format: PixelFormat) -> Self {
        match format {
            PixelFormat::Mjpeg => Self::MJPG,
            PixelFormat::H264 => Self::H264,
            PixelFormat::Yuyv => Self::YUYV,
            PixelFormat::Nv12 => Self::NV12,
            PixelFormat::Rgb24 => Self::RGB3,
            PixelFormat::Grey => Self::GREY,
            PixelFormat::Bayer(BayerPattern::Bggr) => Self(*b"BA81"),
            PixelFormat::Bayer(BayerPattern::Gbrg) => Self(*b"GBRG"),
            PixelFormat::Bayer(BayerPattern::Grbg) => Self(*b"GRBG"),
            PixelFormat::Bayer(BayerPattern::Rggb) => Self(*b"RGGB"),
        }
    }

    /// How frames of this code are coded; `None` if they cannot be recorded.
    pub fn pixel_format(self) -> Option<PixelFormat> {
        let usual = if self == Self(*b"JPEG") {
            Self::MJPG
        } else {
            self
        };
        let mut formats = PixelFormat::ALL.into_iter();
        formats.find(|&format| Self::from_pixel_format(format) == usual)
    }
}

impl fmt::Display for Fourcc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for byte in self.0 {
            match byte {
                b' '..=b'~' => write!(f, "{}", char::from(byte))?,
                _ => f.write_str(".")?,
            }
        }
        Ok(())
    }
}

impl fmt::Debug for Fourcc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Fourcc({self})")
    }
}

/// The frame sizes of a mode, pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sizes {
    /// This one.
    One(u32, u32),
    /// Any between two, in steps.
    Range {
        /// Smallest width and height.
        min: (u32, u32),
        /// Largest width and height.
        max: (u32, u32),
        /// Steps of width and height, at least 1.
        step: (u32, u32),
    },
}

impl Sizes {
    /// True if this size is among them.
    pub fn contains(self, width: u32, height: u32) -> bool {
        let within = |value: u32, min: u32, max: u32, step: u32| {
            (min..=max).contains(&value) && (value - min).is_multiple_of(step.max(1))
        };
        match self {
            Self::One(w, h) => (w, h) == (width, height),
            Self::Range { min, max, step } => {
                within(width, min.0, max.0, step.0) && within(height, min.1, max.1, step.1)
            }
        }
    }

    /// The largest size.
    pub fn largest(self) -> (u32, u32) {
        match self {
            Self::One(width, height) => (width, height),
            Self::Range { max, .. } => max,
        }
    }
}

impl fmt::Display for Sizes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::One(width, height) => write!(f, "{width}x{height}"),
            Self::Range { min, max, step } => write!(
                f,
                "{}x{} to {}x{} in steps of {}x{}",
                min.0, min.1, max.0, max.1, step.0, step.1
            ),
        }
    }
}

/// The frame rates of a mode.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Rates {
    /// These.
    List(Vec<Rate>),
    /// Any between two.
    Range {
        /// The lowest.
        slowest: Rate,
        /// The highest.
        fastest: Rate,
    },
    /// The camera does not state them.
    Unknown,
}

impl fmt::Display for Rates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::List(rates) => {
                let rates: Vec<String> = rates.iter().map(Rate::to_string).collect();
                write!(f, "{} frames/s", rates.join(", "))
            }
            Self::Range { slowest, fastest } => write!(f, "{slowest} to {fastest} frames/s"),
            Self::Unknown => f.write_str("unknown rates"),
        }
    }
}

/// A mode that a camera offers: a pixel format with sizes and rates.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mode {
    /// The pixel format.
    pub fourcc: Fourcc,
    /// Its sizes.
    pub sizes: Sizes,
    /// The rates at these sizes; at the largest where sizes are a range.
    pub rates: Rates,
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}, {}", self.fourcc, self.sizes, self.rates)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_in_steps_are_known() {
        let range = Sizes::Range {
            min: (2, 1),
            max: (8, 4),
            step: (2, 1),
        };
        assert!(range.contains(4, 3) && range.contains(8, 4));
        assert!(!range.contains(5, 3) && !range.contains(10, 3) && !range.contains(0, 1));
        assert_eq!(range.largest(), (8, 4));
    }

    #[test]
    fn a_fourcc_is_shown_as_text() {
        assert_eq!(Fourcc::from_code(0x5659_5559).to_string(), "YUYV");
        assert_eq!(Fourcc(*b"Y1\0\xff").to_string(), "Y1..");
        assert_eq!(Fourcc::from_code(Fourcc::NV12.code()), Fourcc::NV12);
    }
}
