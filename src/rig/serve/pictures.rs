//! Pictures out of recorded videos: a small one for the list, and any frame for the player.

use std::sync::Arc;

use axum::body::Bytes;
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, RgbImage, imageops};

use super::answer::Failure;
use super::library::Footage;
use super::recent::Recent;
use relit_video::Video;

/// Width of a thumbnail, pixels.
const THUMBNAIL: u32 = 192;
/// JPEG quality, 1 to 100.
const QUALITY: u8 = 80;
/// Videos that are kept open: each knows where its frames are, some 50 bytes a frame.
const VIDEOS: usize = 3;
/// Frames of a few hundred kB that are kept.
const FRAMES: usize = 64;
/// Thumbnails of a few kB that are kept.
const THUMBNAILS: usize = 512;

/// Makes pictures, and keeps those that were asked for last.
#[derive(Debug)]
pub(super) struct Pictures {
    videos: Recent<Footage, Arc<Video>>,
    frames: Recent<(Footage, u64, u32), Bytes>,
    thumbnails: Recent<Footage, Bytes>,
}

impl Pictures {
    pub(super) fn new() -> Self {
        Self {
            videos: Recent::new(VIDEOS),
            frames: Recent::new(FRAMES),
            thumbnails: Recent::new(THUMBNAILS),
        }
    }

    /// The video's first frame, small. Reads no more of the file than that frame.
    pub(super) fn thumbnail(&self, footage: Footage) -> Result<Bytes, Failure> {
        if let Some(known) = self.thumbnails.get(&footage) {
            return Ok(known);
        }
        let picture = relit_video::first_picture(&footage.path).map_err(failed)?;
        let jpeg = encode(&picture, THUMBNAIL)?;
        self.thumbnails.put(footage, jpeg.clone());
        Ok(jpeg)
    }

    /// Frame `number`, at most `width` pixels wide.
    pub(super) fn frame(
        &self,
        footage: Footage,
        number: u64,
        width: u32,
    ) -> Result<Bytes, Failure> {
        let key = (footage, number, width);
        if let Some(known) = self.frames.get(&key) {
            return Ok(known);
        }
        let picture = self.video(&key.0)?.frame(number).map_err(failed)?;
        let jpeg = encode(&picture, width)?;
        self.frames.put(key, jpeg.clone());
        Ok(jpeg)
    }

    fn video(&self, footage: &Footage) -> Result<Arc<Video>, Failure> {
        if let Some(known) = self.videos.get(footage) {
            return Ok(known);
        }
        let video = Arc::new(Video::open(&footage.path).map_err(failed)?);
        self.videos.put(footage.clone(), video.clone());
        Ok(video)
    }
}

fn failed(error: relit_video::VideoError) -> Failure {
    match error {
        relit_video::VideoError::NoSuchFrame { .. } => Failure::not_found(error.to_string()),
        _ => Failure::broken(error.to_string()),
    }
}

/// A JPEG of the picture, scaled to `width` where it is wider.
fn encode(picture: &RgbImage, width: u32) -> Result<Bytes, Failure> {
    let scaled = (picture.width() > width).then(|| {
        let ratio = f64::from(width) / f64::from(picture.width());
        let height = (f64::from(picture.height()) * ratio).round().max(1.0);
        imageops::thumbnail(picture, width, height as u32)
    });
    let picture = scaled.as_ref().unwrap_or(picture);
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, QUALITY)
        .encode(
            picture.as_raw(),
            picture.width(),
            picture.height(),
            ExtendedColorType::Rgb8,
        )
        .map_err(|error| Failure::broken(format!("the picture cannot be encoded: {error}")))?;
    Ok(jpeg.into())
}
