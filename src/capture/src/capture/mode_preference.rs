//! Which of a camera's modes to record in.

use std::fmt;
use std::str::FromStr;

use super::error::CaptureError;
use relit_camera::{CameraMode, Fourcc, Mode, Rate, Rates};

/// Formats from the one that is preferred: what the camera compresses by frames comes first.
const PREFERRED: [Fourcc; 5] = [
    Fourcc::MJPG,
    Fourcc::H264,
    Fourcc::YUYV,
    Fourcc::NV12,
    Fourcc::RGB3,
];
/// Rates that differ by less count as the same, frames a second: 29.97 is requested as 30.
const SAME_RATE: f64 = 0.05;
/// Frames a second that can be requested.
const MIN_FPS: f64 = 1.0;
const MAX_FPS: f64 = 1000.0;

/// What is preferred of a camera's mode; what is not given is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModePreference {
    /// Pixel format.
    pub fourcc: Option<Fourcc>,
    /// Frame width and height, pixels.
    pub size: Option<(u32, u32)>,
    /// Frames a second.
    pub fps: f64,
}

impl Default for ModePreference {
    fn default() -> Self {
        Self {
            fourcc: None,
            size: None,
            fps: 30.0,
        }
    }
}

/// Parses a camera's mode, such as `MJPG:1920x1080@30`; each part may be left out.
impl FromStr for ModePreference {
    type Err = CaptureError;

    fn from_str(text: &str) -> Result<Self, CaptureError> {
        let mut preference = Self::default();
        let format_and_size = match text.split_once('@') {
            Some((rest, rate)) => {
                preference.fps = fps_of(rate)?;
                rest
            }
            None => text,
        };
        match format_and_size.split_once(':') {
            Some((format, size)) => {
                preference.fourcc = Some(fourcc_of(format)?);
                preference.size = Some(size_of(size)?);
            }
            None if format_and_size.contains('x') => {
                preference.size = Some(size_of(format_and_size)?);
            }
            None if !format_and_size.is_empty() => {
                preference.fourcc = Some(fourcc_of(format_and_size)?);
            }
            None if text.is_empty() => {
                let empty = "write a mode as MJPG:1920x1080@30, or a part of that";
                return Err(CaptureError::Refused(empty.to_owned()));
            }
            None => {}
        }
        Ok(preference)
    }
}

fn fourcc_of(text: &str) -> Result<Fourcc, CaptureError> {
    let fourcc = text.as_bytes().try_into().map(Fourcc).ok();
    let recorded = fourcc.filter(|fourcc| fourcc.pixel_format().is_some());
    recorded.ok_or_else(|| {
        CaptureError::Refused(format!(
            "{text:?} frames cannot be recorded: give four characters such as MJPG, H264 or YUYV"
        ))
    })
}

fn size_of(text: &str) -> Result<(u32, u32), CaptureError> {
    let side = |text: &str| text.parse().ok().filter(|&pixels: &u32| pixels > 0);
    let sides = text.split_once('x');
    let size = sides.and_then(|(width, height)| Some((side(width)?, side(height)?)));
    size.ok_or_else(|| {
        CaptureError::Refused(format!("{text:?} is not a frame size: write 1920x1080"))
    })
}

fn fps_of(text: &str) -> Result<f64, CaptureError> {
    let rate = text.parse().ok();
    let rate = rate.filter(|rate| (MIN_FPS..=MAX_FPS).contains(rate));
    rate.ok_or_else(|| {
        CaptureError::Refused(format!(
            "{text:?} is not a frame rate: give {MIN_FPS} to {MAX_FPS} frames a second"
        ))
    })
}

impl fmt::Display for ModePreference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.fourcc {
            Some(fourcc) => write!(f, "{fourcc}")?,
            None => f.write_str("any format")?,
        }
        match self.size {
            Some((width, height)) => write!(f, " {width}x{height}")?,
            None => f.write_str(" of any size")?,
        }
        write!(f, " at {} frames/s", self.fps)
    }
}

impl ModePreference {
    /// The mode to ask the camera for: of those that are as preferred the largest, and of those the
    /// one whose frames take the least space.
    ///
    /// # Errors
    /// [`CaptureError::Refused`] with what there is.
    pub fn choose(&self, modes: &[Mode]) -> Result<CameraMode, CaptureError> {
        let requests = modes.iter().filter_map(|mode| self.of(mode));
        let rank = |fourcc: Fourcc| PREFERRED.iter().position(|&known| known == fourcc);
        requests
            .min_by_key(|request| {
                let pixels = u64::from(request.width) * u64::from(request.height);
                let rank = rank(request.fourcc).unwrap_or(PREFERRED.len());
                (std::cmp::Reverse(pixels), rank)
            })
            .ok_or_else(|| {
                let offered: Vec<String> = modes.iter().map(Mode::to_string).collect();
                CaptureError::Refused(format!(
                    "the camera does not offer {self}; it offers {}",
                    first_of(&offered)
                ))
            })
    }

    fn of(&self, mode: &Mode) -> Option<CameraMode> {
        if self.fourcc.is_some_and(|fourcc| fourcc != mode.fourcc) {
            return None;
        }
        let (width, height) = match self.size {
            Some((width, height)) if !mode.sizes.contains(width, height) => return None,
            Some(size) => size,
            None => mode.sizes.largest(),
        };
        Some(CameraMode {
            fourcc: mode.fourcc,
            width,
            height,
            rate: self.rate(&mode.rates)?,
        })
    }

    fn rate(&self, rates: &Rates) -> Option<Rate> {
        match rates {
            Rates::List(rates) => {
                let distance = |rate: &Rate| (rate.per_second() - self.fps).abs();
                let nearest = rates.iter().copied();
                let nearest = nearest.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
                (distance(&nearest) < SAME_RATE).then_some(nearest)
            }
            Rates::Range { slowest, fastest } => {
                let rate = Rate::from_per_second(self.fps)?;
                let (low, high) = (slowest.per_second(), fastest.per_second());
                (low - SAME_RATE..=high + SAME_RATE)
                    .contains(&self.fps)
                    .then_some(rate)
            }
            Rates::Unknown => Rate::from_per_second(self.fps),
        }
    }
}

/// The first of a long list.
fn first_of(offered: &[String]) -> String {
    const MAX_LISTED: usize = 12;
    match offered.len() {
        0 => "nothing that can be recorded".to_owned(),
        n if n > MAX_LISTED => format!(
            "{} and {} more",
            offered[..MAX_LISTED].join("; "),
            n - MAX_LISTED
        ),
        _ => offered.join("; "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relit_camera::Sizes;

    fn mode(fourcc: Fourcc, width: u32, height: u32, rates: &[u32]) -> Mode {
        Mode {
            fourcc,
            sizes: Sizes::One(width, height),
            rates: Rates::List(
                rates
                    .iter()
                    .filter_map(|&rate| Rate::new(rate, 1))
                    .collect(),
            ),
        }
    }

    #[test]
    fn the_largest_mode_at_the_rate_is_chosen_and_compressed_ones_before_raw_ones() {
        let modes = [
            mode(Fourcc::YUYV, 1920, 1080, &[5, 30]),
            mode(Fourcc::MJPG, 1920, 1080, &[30, 60]),
            mode(Fourcc::MJPG, 3840, 2160, &[15]),
        ];
        let chosen = ModePreference::default().choose(&modes).unwrap();
        assert_eq!(chosen.to_string(), "MJPG:1920x1080@30");
        let preference = ModePreference {
            fourcc: Some(Fourcc::YUYV),
            ..ModePreference::default()
        };
        assert_eq!(preference.choose(&modes).unwrap().fourcc, Fourcc::YUYV);
        let preference = ModePreference {
            fps: 15.0,
            ..ModePreference::default()
        };
        assert_eq!(preference.choose(&modes).unwrap().width, 3840);
    }

    #[test]
    fn each_part_of_a_mode_may_be_left_out() {
        let vga = Some((640, 480));
        for (text, fourcc, size, fps) in [
            ("MJPG:640x480@15", Some(Fourcc::MJPG), vga, 15.0),
            ("MJPG:640x480", Some(Fourcc::MJPG), vga, 30.0),
            ("MJPG@29.97", Some(Fourcc::MJPG), None, 29.97),
            ("MJPG", Some(Fourcc::MJPG), None, 30.0),
            ("640x480@15", None, vga, 15.0),
            ("640x480", None, vga, 30.0),
            ("@15", None, None, 15.0),
        ] {
            let preference: ModePreference = text.parse().unwrap();
            assert_eq!(preference, ModePreference { fourcc, size, fps }, "{text}");
        }
        for text in [
            "",
            "@",
            "@0",
            "@2000",
            ":",
            "MJPG:",
            ":640x480",
            "0x480",
            "640x",
            "1x2x3",
            "MJPEG",
            "ABCD",
            "640x480@x",
            "@30@15",
        ] {
            assert!(text.parse::<ModePreference>().is_err(), "{text}");
        }
    }

    #[test]
    fn a_wish_that_no_mode_fulfils_is_told_with_what_there_is() {
        let modes = [mode(Fourcc::MJPG, 640, 480, &[25])];
        let error = ModePreference::default()
            .choose(&modes)
            .unwrap_err()
            .to_string();
        assert!(error.contains("30 frames/s"), "{error}");
        assert!(error.contains("MJPG 640x480, 25 frames/s"), "{error}");
    }
}
