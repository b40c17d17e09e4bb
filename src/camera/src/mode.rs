//! The mode that is requested of a camera, or that it granted.

use std::fmt;

use super::{Fourcc, Rate};

/// The mode that is requested of a camera, or that it granted: drivers take the nearest that they have. Written
/// `MJPG:1920x1080@30`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CameraMode {
    /// The pixel format.
    pub fourcc: Fourcc,
    /// Frame width, pixels.
    pub width: u32,
    /// Frame height, pixels.
    pub height: u32,
    /// Frames per second.
    pub rate: Rate,
}

impl fmt::Display for CameraMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            fourcc,
            width,
            height,
            rate,
        } = self;
        write!(f, "{fourcc}:{width}x{height}@{rate}")
    }
}

impl CameraMode {
    /// The differences from the request, in words; empty if there are none.
    pub fn differences(&self, asked: &Self) -> Vec<String> {
        let mut found = Vec::new();
        if self.fourcc != asked.fourcc {
            found.push(format!("{} instead of {}", self.fourcc, asked.fourcc));
        }
        if (self.width, self.height) != (asked.width, asked.height) {
            found.push(format!(
                "{} x {} instead of {} x {} pixels",
                self.width, self.height, asked.width, asked.height
            ));
        }
        if !self.rate.equals(asked.rate) {
            found.push(format!("{} instead of {} frames/s", self.rate, asked.rate));
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_from_the_request_are_listed() {
        let asked = CameraMode {
            fourcc: Fourcc::MJPG,
            width: 1280,
            height: 720,
            rate: Rate::new(30, 1).unwrap(),
        };
        let granted = CameraMode {
            rate: Rate::new(60, 2).unwrap(),
            ..asked
        };
        assert_eq!(granted.differences(&asked), [] as [&str; 0]);
        let other = CameraMode {
            fourcc: Fourcc::YUYV,
            width: 640,
            height: 480,
            rate: Rate::new(25, 2).unwrap(),
        };
        assert_eq!(
            other.differences(&asked),
            [
                "YUYV instead of MJPG",
                "640 x 480 instead of 1280 x 720 pixels",
                "12.500 instead of 30 frames/s"
            ]
        );
    }
}
