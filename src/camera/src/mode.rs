//! The mode that is requested of a camera, or that it granted.

use std::fmt;
use std::str::FromStr;

use super::{CameraError, Fourcc, Rate};

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

impl FromStr for CameraMode {
    type Err = CameraError;

    fn from_str(text: &str) -> Result<Self, CameraError> {
        parse_request(text).ok_or_else(|| CameraError::Address {
            text: text.to_owned(),
            fault: "a mode is written as format:widthxheight@rate, such as MJPG:1920x1080@30"
                .to_owned(),
        })
    }
}

fn parse_request(text: &str) -> Option<CameraMode> {
    let (fourcc, rest) = text.split_once(':')?;
    let (size, rate) = rest.split_once('@')?;
    let (width, height) = size.split_once('x')?;
    let size = |text: &str| text.parse().ok().filter(|&pixels: &u32| pixels > 0);
    Some(CameraMode {
        fourcc: Fourcc(fourcc.as_bytes().try_into().ok()?),
        width: size(width)?,
        height: size(height)?,
        rate: Rate::from_per_second(rate.parse().ok()?)?,
    })
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
    use proptest::prelude::*;

    use super::*;

    fn request(text: &str) -> CameraMode {
        text.parse().unwrap()
    }

    #[test]
    fn a_request_is_read_as_it_is_shown() {
        for text in ["MJPG:1920x1080@30", "YUYV:640x480@29.970", "GREY:1x1@7.500"] {
            assert_eq!(request(text).to_string(), text);
        }
        let ntsc = Rate::new(30_000, 1001).unwrap();
        assert!(request("YUYV:640x480@29.97").rate.equals(ntsc));
        for wrong in [
            "",
            "MJPG",
            "MJPG:1920x1080",
            "MJPEG:1x1@1",
            "MJPG:0x1@1",
            "MJPG:1x1@0",
        ] {
            assert!(wrong.parse::<CameraMode>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn differences_from_the_request_are_listed() {
        let asked = request("MJPG:1280x720@30");
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

    proptest! {
        #[test]
        fn no_text_makes_the_parser_panic(text in "[A-Z0-9:x@.-]{0,30}", size in any::<u64>()) {
            let _ = text.parse::<CameraMode>();
            let _ = format!("MJPG:{size}x{size}@{size}").parse::<CameraMode>();
        }
    }
}
