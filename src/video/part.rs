//! A part of each frame, with as little work as its codec allows.

use ffmpeg_next::codec::Id;
use image::{Rgba, RgbaImage};
use yuv::YuvStandardMatrix;

use super::jpeg::decode_part;
use super::orientation::Orientation;
use super::reader::Pending;
use super::scan::Video;
use super::track::Track;
use super::{DecodeFault, Picture};
use relit_data::geometry::Rect;

impl Video {
    /// Decodes the part of the displayed picture under `region` into `part`, which takes its size: red, green,
    /// blue and 255, and all 0 where the region reaches beyond the picture. May be called from many threads at
    /// once; a `part` that is kept for the next frame needs no new memory.
    ///
    /// Of Motion JPEG only what the part needs is decoded, by libjpeg-turbo with its accurate transform. The
    /// result is the same for any region, and within two levels of FFmpeg's in nearly every pixel
    /// ([`Video::picture`]), whose transform rounds otherwise. A JPEG that is unusual or in which something is
    /// wrong is left to FFmpeg.
    ///
    /// # Errors
    /// [`DecodeFault`] where the frame yields no picture.
    pub fn part(
        &self,
        pending: Pending,
        region: Rect,
        part: &mut RgbaImage,
    ) -> Result<(), DecodeFault> {
        if part.dimensions() != (region.w, region.h) {
            *part = RgbaImage::new(region.w, region.h);
        }
        if let Some(jpeg) = pending.coded().filter(|_| self.track.is_plain_jpeg())
            && jpeg_part(jpeg, self.track.coded, region, part).is_some()
        {
            return Ok(());
        }
        let picture = self.picture(pending)?;
        match direct_part(&picture, region, part) {
            Some(()) => Ok(()),
            None => copy_part(&picture, region, part),
        }
    }
}

impl Track {
    /// Whether its frames are JPEGs that are shown as they are, with JFIF's colours.
    fn is_plain_jpeg(&self) -> bool {
        let jfif = self.colour.full_range && self.colour.matrix == YuvStandardMatrix::Bt601;
        self.codec == Id::MJPEG && jfif && self.orientation == Orientation::default()
    }
}

/// `None` if the JPEG is to be decoded by FFmpeg.
fn jpeg_part(jpeg: &[u8], size: (u32, u32), region: Rect, part: &mut RgbaImage) -> Option<()> {
    let (inside, start) = cleared(size, region, part)?;
    let rows = part.get_mut(start..)?;
    decode_part(jpeg, size, inside, rows, 4 * region.w as usize).ok()
}

/// `None` if the picture is to be converted in another way.
fn direct_part(picture: &Picture, region: Rect, part: &mut RgbaImage) -> Option<()> {
    let (inside, start) = cleared(picture.size(), region, part)?;
    let rows = part.get_mut(start..)?;
    picture.direct_rgba(inside, rows, 4 * region.w as usize)
}

/// The part of the region that lies in the picture, and its first byte; everything is 0 where it is not all.
fn cleared(size: (u32, u32), region: Rect, part: &mut RgbaImage) -> Option<(Rect, usize)> {
    let inside = region.clipped_to(size.0, size.1)?;
    if inside != region {
        part.fill(0);
    }
    let left = usize::try_from(inside.x - region.x).ok()?;
    let top = usize::try_from(inside.y - region.y).ok()?;
    Some((inside, 4 * (region.w as usize * top + left)))
}

fn copy_part(picture: &Picture, region: Rect, part: &mut RgbaImage) -> Result<(), DecodeFault> {
    let rgb = picture.rgb(region)?;
    for (to, pixel) in part.pixels_mut().zip(rgb.pixels()) {
        let [r, g, b] = pixel.0;
        *to = Rgba([r, g, b, 255]);
    }
    let (width, height) = picture.size();
    if region.clipped_to(width, height) != Some(region) {
        for (x, y, pixel) in part.enumerate_pixels_mut() {
            let at = Rect::new(
                region.x.saturating_add_unsigned(x),
                region.y.saturating_add_unsigned(y),
                1,
                1,
            );
            if at.clipped_to(width, height).is_none() {
                *pixel = Rgba([0; 4]);
            }
        }
    }
    Ok(())
}
