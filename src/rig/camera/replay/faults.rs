//! Spoiling a replay's frames on purpose.

use std::path::Path;

use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::CameraError;
use crate::camera::{Encoding, Faults, Frame, GrantedMode};

/// Makes damaged frames and frames of another size.
#[derive(Debug)]
pub(super) struct Spoiler {
    /// The data of a frame of half the width and height.
    other_size: Vec<u8>,
}

impl Spoiler {
    pub(super) fn new(
        path: &Path,
        faults: &Faults,
        mode: &GrantedMode,
    ) -> Result<Self, CameraError> {
        let other_size = match faults.resize {
            None => Vec::new(),
            Some(_) => half_size(mode).ok_or_else(|| CameraError::Replay {
                path: path.to_owned(),
                why: format!("frames of {mode} cannot change their size; leave out `resize`"),
            })?,
        };
        Ok(Self { other_size })
    }

    /// The frame at this position as the faults have it.
    pub(super) fn spoil(&self, mut frame: Frame, position: u64, faults: &Faults) -> Frame {
        if faults.resize.is_some_and(|from| from <= position) {
            frame.data.clone_from(&self.other_size);
        }
        if faults.damage.contains(&position) {
            frame.data.truncate(frame.data.len() / 2);
        }
        frame.flagged |= faults.flag.contains(&position);
        frame
    }
}

/// A grey picture of half the width and height; `None` where frames cannot be that.
fn half_size(mode: &GrantedMode) -> Option<Vec<u8>> {
    let (width, height) = (mode.width / 2, mode.height / 2);
    if width == 0 || height == 0 {
        return None;
    }
    match mode.fourcc.encoding()? {
        Encoding::H264 => None,
        Encoding::Mjpeg => {
            let pixels = vec![128; Encoding::Grey.frame_bytes(width, height)?];
            let mut jpeg = Vec::new();
            let encoder = JpegEncoder::new(&mut jpeg);
            let written = encoder.write_image(&pixels, width, height, ExtendedColorType::L8);
            written.is_ok().then_some(jpeg)
        }
        raw => Some(vec![128; raw.frame_bytes(width, height)?]),
    }
}
