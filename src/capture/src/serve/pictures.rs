//! Pictures out of recorded videos: a small one for the list, and any frame for the player.

use std::sync::Arc;

use axum::body::Bytes;
use image::codecs::jpeg::JpegEncoder;
use image::{RgbImage, imageops};
use relit_data::causes::with_causes;
use relit_video::Video;

use super::cache::Cache;
use super::library::VideoFile;
use relit_web::Failure;

/// Width of a thumbnail, pixels.
const THUMBNAIL: u32 = 192;
/// JPEG quality, 1 to 100.
const QUALITY: u8 = 80;
/// Videos that are kept open: each knows where its frames are, some 50 bytes a frame.
const VIDEOS: usize = 3;

/// Makes pictures. Browsers keep them.
#[derive(Debug)]
pub(super) struct Pictures {
    videos: Cache<VideoFile, Arc<Video>>,
}

impl Pictures {
    pub(super) fn new() -> Self {
        Self {
            videos: Cache::new(VIDEOS),
        }
    }

    /// The video's first frame, small. Reads no more of the file than that frame.
    pub(super) fn thumbnail(file: &VideoFile) -> Result<Bytes, Failure> {
        let picture = relit_video::first_picture(&file.path).map_err(failed)?;
        encode(&picture, THUMBNAIL)
    }

    /// Frame `number`, at most `width` pixels wide.
    pub(super) fn frame(&self, file: VideoFile, number: u64, width: u32) -> Result<Bytes, Failure> {
        let open = |file: &VideoFile| Video::open(&file.path).map(Arc::new).map_err(failed);
        let video = self.videos.get_or_make(file, open)?;
        encode(&video.frame(number).map_err(failed)?, width)
    }
}

fn failed(error: relit_video::VideoError) -> Failure {
    match error {
        relit_video::VideoError::NoSuchFrame { .. } => Failure::not_found(with_causes(&error)),
        _ => Failure::internal(with_causes(&error)),
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
        .encode_image(picture)
        .map_err(|error| {
            let why = with_causes(&error);
            Failure::internal(format!("the picture cannot be encoded: {why}"))
        })?;
    Ok(jpeg.into())
}
