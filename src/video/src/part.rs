//! A part of each frame, with as little work as its codec allows.

use std::ops::Range;

use ffmpeg_next::codec::Id;
use image::{Rgba, RgbaImage};
use yuv::YuvStandardMatrix;

use super::jpeg::decode_part;
use super::reader::Pending;
use super::scan::Video;
use super::track::Track;
use super::{DecodeFault, Picture};
use relit_data::geometry::Rect;

/// Rows that are reported together: few enough to be in the processor's cache still.
const BAND: u32 = 16;

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
        self.part_by_bands(pending, region, region, part, |_, _| {})
    }

    /// As [`Self::part`], but only what `needed` covers has to be decoded: other pixels hold anything. Meanwhile `seen`
    /// is called with the rows of the part that have come, from top to bottom, a few at a time: soon enough that their
    /// pixels are still in the processor's cache. They come from the top again if the frame needs another decoder.
    ///
    /// # Errors
    /// As [`Self::part`].
    pub fn part_by_bands(
        &self,
        pending: Pending,
        region: Rect,
        needed: Rect,
        part: &mut RgbaImage,
        mut seen: impl FnMut(&RgbaImage, Range<u32>),
    ) -> Result<(), DecodeFault> {
        if part.dimensions() != (region.w, region.h) {
            *part = RgbaImage::new(region.w, region.h);
        }
        if let Some(jpeg) = pending.coded().filter(|_| self.track.is_plain_jpeg()) {
            let size = self.track.coded;
            let rows = Rows::new(part, size, (region, needed), &mut seen);
            let decoded = rows.and_then(|mut rows| {
                let inside = rows.inside;
                decode_part(jpeg, size, inside, &mut |row| rows.push(row)).ok()?;
                rows.end();
                Some(())
            });
            if decoded.is_some() {
                return Ok(());
            }
        }
        let picture = self.picture(pending)?;
        let rows = Rows::new(part, picture.size(), (region, needed), &mut seen);
        let converted = rows.and_then(|mut rows| {
            let inside = rows.inside;
            picture.direct_rgba(inside, &mut |row| rows.push(row))?;
            rows.end();
            Some(())
        });
        if converted.is_none() {
            copy_part(&picture, region, part)?;
            seen(part, 0..region.h);
        }
        Ok(())
    }
}

/// A part that comes row by row.
struct Rows<'a, F> {
    part: &'a mut RgbaImage,
    /// What of the region is needed and lies in the picture.
    inside: Rect,
    /// The first byte of the next row.
    next: usize,
    /// The rows of the part that have come, and those of them that were reported.
    come: u32,
    told: u32,
    seen: &'a mut F,
}

impl<'a, F: FnMut(&RgbaImage, Range<u32>)> Rows<'a, F> {
    /// Everything is 0 where the region does not lie in the picture wholly; `None` if nothing of it does.
    fn new(
        part: &'a mut RgbaImage,
        size: (u32, u32),
        (region, needed): (Rect, Rect),
        seen: &'a mut F,
    ) -> Option<Self> {
        let inside = region.clipped_to(size.0, size.1)?;
        if inside != region {
            part.fill(0);
        }
        let inside = common(inside, needed)?;
        let left = usize::try_from(inside.x - region.x).ok()?;
        let come = u32::try_from(inside.y - region.y).ok()?;
        Some(Self {
            next: 4 * (part.width() as usize * come as usize + left),
            part,
            inside,
            come,
            told: 0,
            seen,
        })
    }

    /// `None` if it is a row too many.
    fn push(&mut self, row: &[u8]) -> Option<()> {
        let to = self.part.get_mut(self.next..self.next + row.len())?;
        to.copy_from_slice(row);
        self.next += 4 * self.part.width() as usize;
        self.come += 1;
        if self.come - self.told >= BAND {
            (self.seen)(self.part, self.told..self.come);
            self.told = self.come;
        }
        Some(())
    }

    /// No more rows come.
    fn end(self) {
        (self.seen)(self.part, self.told..self.part.height());
    }
}

impl Track {
    /// Whether its frames are JPEGs that are shown as they are, with JFIF's colours.
    fn is_plain_jpeg(&self) -> bool {
        let jfif = self.colour.full_range && self.colour.matrix == YuvStandardMatrix::Bt601;
        self.codec == Id::MJPEG && jfif && self.display.is_plain() && self.colour.is_srgb()
    }
}

/// The part of both; `None` if they have none.
fn common(a: Rect, b: Rect) -> Option<Rect> {
    let (x, y) = (a.x.max(b.x), a.y.max(b.y));
    let extent = |from: i32, end: i64| u32::try_from(end - i64::from(from)).ok();
    let w = extent(x, a.right().min(b.right()))?;
    let h = extent(y, a.bottom().min(b.bottom()))?;
    (w > 0 && h > 0).then_some(Rect::new(x, y, w, h))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_two_rectangles_have_in_common_lies_in_both() {
        let a = Rect::new(-3, 2, 10, 5);
        assert_eq!(
            common(a, Rect::new(1, 0, 20, 4)),
            Some(Rect::new(1, 2, 6, 2))
        );
        assert_eq!(common(a, a), Some(a));
        for apart in [
            Rect::new(7, 2, 3, 3),
            Rect::new(0, 7, 3, 3),
            Rect::new(30, 40, 2, 2),
        ] {
            assert_eq!(common(a, apart), None);
        }
    }
}
