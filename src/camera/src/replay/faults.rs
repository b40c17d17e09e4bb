//! Injecting faults into a replay's frames.

use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::CameraError;
use crate::{CameraMode, Frame, ReplayAddress, ReplayFaults};
use relit_video::PixelFormat;

/// Makes damaged frames and frames of another size.
#[derive(Debug)]
pub(super) struct FaultInjector {
    faults: ReplayFaults,
    /// The data of a frame of half the width and height.
    other_size: Vec<u8>,
}

impl FaultInjector {
    pub(super) fn new(address: &ReplayAddress, mode: &CameraMode) -> Result<Self, CameraError> {
        let faults = address.faults.clone();
        let other_size = match faults.resize {
            None => Vec::new(),
            Some(_) => half_size(mode).ok_or_else(|| CameraError::Replay {
                path: address.path.clone(),
                why: format!("frames of {mode} cannot change their size; leave out `resize`"),
            })?,
        };
        Ok(Self { faults, other_size })
    }

    /// The frame at this position with its faults.
    pub(super) fn inject(&self, mut frame: Frame, position: u64) -> Frame {
        let faults = &self.faults;
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

/// A grey picture of half the width and height; `None` if the format or size has none.
fn half_size(mode: &CameraMode) -> Option<Vec<u8>> {
    let (width, height) = (mode.width / 2, mode.height / 2);
    if width == 0 || height == 0 {
        return None;
    }
    match mode.fourcc.pixel_format()? {
        PixelFormat::H264 => None,
        PixelFormat::Mjpeg => {
            let pixels = vec![128; PixelFormat::Grey.frame_bytes(width, height)?];
            let mut jpeg = Vec::new();
            let encoder = JpegEncoder::new(&mut jpeg);
            let written = encoder.write_image(&pixels, width, height, ExtendedColorType::L8);
            written.is_ok().then_some(jpeg)
        }
        raw => Some(vec![128; raw.frame_bytes(width, height)?]),
    }
}
