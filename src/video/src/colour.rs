//! How luma and colour differences become sRGB: range and matrix, and for other video than SDR of BT.709 the transfer
//! characteristics and primaries (ITU-T H.273).

use std::sync::Arc;

use ffmpeg_next::codec::decoder;
use ffmpeg_next::format::Pixel;
use ffmpeg_next::{color, ffi, frame};
use image::RgbImage;
use relit_data::colour::{ColourFault, ToSrgb, YuvDecoding};
use relit_data::geometry::Rect;
use yuv::{YuvRange, YuvStandardMatrix};

use super::picture::{convert, is_grey, is_jpeg_format, is_rgb, plane};

/// How a stream's values become sRGB.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Colour {
    pub(super) full_range: bool,
    pub(super) matrix: YuvStandardMatrix,
    /// False where the matrix was chosen by the picture's size.
    matrix_is_stated: bool,
    /// `None` where RGB is sRGB already.
    to_srgb: Option<Arc<ToSrgb>>,
}

/// What a stream or a frame states.
#[derive(Debug, Clone, Copy)]
pub(super) struct ColourProperties {
    format: Pixel,
    height: u32,
    range: color::Range,
    matrix: color::Space,
    transfer: color::TransferCharacteristic,
    primaries: color::Primaries,
}

impl ColourProperties {
    /// What a decoder states before its first frame, by the container.
    pub(super) fn by_stream(decoder: &decoder::Video) -> Self {
        Self {
            format: decoder.format(),
            height: decoder.height(),
            range: decoder.color_range(),
            matrix: decoder.color_space(),
            transfer: decoder.color_transfer_characteristic(),
            primaries: decoder.color_primaries(),
        }
    }

    pub(super) fn by_picture(picture: &frame::Video) -> Self {
        Self {
            format: picture.format(),
            height: picture.height(),
            range: picture.color_range(),
            matrix: picture.color_space(),
            transfer: picture.color_transfer_characteristic(),
            primaries: picture.color_primaries(),
        }
    }

    /// With what another source states, where this one states nothing.
    pub(super) fn or(self, other: Self) -> Self {
        use color::{Primaries, Range, Space, TransferCharacteristic as Transfer};
        Self {
            range: match self.range {
                Range::Unspecified => other.range,
                stated => stated,
            },
            matrix: match self.matrix {
                Space::Unspecified => other.matrix,
                stated => stated,
            },
            transfer: match self.transfer {
                Transfer::Unspecified => other.transfer,
                stated => stated,
            },
            primaries: match self.primaries {
                Primaries::Unspecified => other.primaries,
                stated => stated,
            },
            ..self
        }
    }

    /// JPEG's own colours are full-range BT.601 (JFIF); of other video that states no matrix, up to 576 rows are BT.601 and
    /// more are BT.709, as players do.
    ///
    /// # Errors
    /// [`ColourFault`] for a matrix, transfer characteristics or primaries that are not known here.
    pub(super) fn colour(self) -> Result<Colour, ColourFault> {
        let (format, jpeg) = (self.format, is_jpeg_format(self.format));
        let has_matrix = !is_rgb(format) && !is_grey(format);
        let stated = match self.matrix {
            color::Space::BT709 => Some(YuvStandardMatrix::Bt709),
            color::Space::BT470BG | color::Space::SMPTE170M => Some(YuvStandardMatrix::Bt601),
            color::Space::BT2020NCL => Some(YuvStandardMatrix::Bt2020),
            color::Space::SMPTE240M => Some(YuvStandardMatrix::Smpte240),
            color::Space::FCC => Some(YuvStandardMatrix::Fcc),
            _ if jpeg => Some(YuvStandardMatrix::Bt601),
            color::Space::Unspecified | color::Space::Reserved | color::Space::RGB => None,
            other if has_matrix => return Err(ColourFault::Matrix(format!("{other:?}"))),
            _ => None,
        };
        let by_size = if self.height > 576 {
            YuvStandardMatrix::Bt709
        } else {
            YuvStandardMatrix::Bt601
        };
        // Grey pictures are full-range unless the file states otherwise.
        let full_grey = is_grey(format) && self.range != color::Range::MPEG;
        let transfer = ffi::AVColorTransferCharacteristic::from(self.transfer) as u32;
        let primaries = ffi::AVColorPrimaries::from(self.primaries) as u32;
        Ok(Colour {
            full_range: jpeg || full_grey || self.range == color::Range::JPEG,
            matrix: stated.unwrap_or(by_size),
            matrix_is_stated: stated.is_some() || !has_matrix,
            to_srgb: ToSrgb::new(transfer, primaries)?.map(Arc::new),
        })
    }
}

impl Colour {
    pub(super) fn range(&self) -> YuvRange {
        if self.full_range {
            YuvRange::Full
        } else {
            YuvRange::Limited
        }
    }

    /// Whether RGB is sRGB, without another conversion.
    pub(super) fn is_srgb(&self) -> bool {
        self.to_srgb.is_none()
    }

    /// The conversion to sRGB, in words.
    pub(super) fn conversion(&self) -> Option<String> {
        self.to_srgb.as_ref().map(|by| by.to_string())
    }

    /// What had to be assumed or is converted, as remarks for the user.
    pub(super) fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if !self.matrix_is_stated {
            let matrix = self.matrix;
            notes.push(format!(
                "the file does not state its colour matrix; {matrix:?} is assumed from the picture's size"
            ));
        }
        if let Some(conversion) = self.conversion() {
            notes.push(format!("the colours are converted: {conversion}"));
        }
        notes
    }

    /// sRGB of `rect`, which lies inside a YUV frame whose RGB is not sRGB, with all bits that it has. `None` if its
    /// pixel format cannot be converted.
    pub(super) fn wide_rgb(&self, frame: &frame::Video, rect: Rect) -> Option<RgbImage> {
        let to_srgb = self.to_srgb.as_ref()?;
        let format = frame.format();
        // Colour differences stay as they are; each counts for the pixels that share it.
        let halved = format.descriptor();
        let halved = halved.map(|format| (format.log2_chroma_w(), format.log2_chroma_h()));
        let (deep, (across, down)) = match halved {
            Some((1, 1)) => (Pixel::YUV420P16LE, (1, 1)),
            Some((1, 0)) => (Pixel::YUV422P16LE, (1, 0)),
            _ => (Pixel::YUV444P16LE, (0, 0)),
        };
        let yuv = convert(frame, deep).ok()?;
        // swscale expands no range, except of the formats that are full-range by name, which it makes limited.
        let full_range = self.full_range && !is_jpeg_format(format);
        let decoding = YuvDecoding::new(matrix_code(self.matrix), full_range).ok()?;
        let (left, top) = (usize::try_from(rect.x).ok()?, usize::try_from(rect.y).ok()?);
        let mut rgb = RgbImage::new(rect.w, rect.h);
        for (y, row) in rgb.rows_mut().enumerate() {
            let (luma, _) = plane(&yuv, 0, 0, top + y)?;
            let (blue, _) = plane(&yuv, 1, 0, (top + y) >> down)?;
            let (red, _) = plane(&yuv, 2, 0, (top + y) >> down)?;
            for (x, to) in row.enumerate() {
                let (x, halved) = (left + x, (left + x) >> across);
                let yuv = [
                    sample(luma, x)?,
                    sample(blue, halved)?,
                    sample(red, halved)?,
                ];
                to.0 = to_srgb.levels(decoding.rgb(yuv));
            }
        }
        Some(rgb)
    }

    /// Makes coded RGB sRGB.
    pub(super) fn make_srgb(&self, rgb: &mut RgbImage) {
        let Some(to_srgb) = &self.to_srgb else {
            return;
        };
        for pixel in rgb.pixels_mut() {
            pixel.0 = to_srgb.levels(pixel.0.map(|level| f32::from(level) / 255.0));
        }
    }
}

/// The number of ITU-T H.273.
fn matrix_code(matrix: YuvStandardMatrix) -> u32 {
    match matrix {
        YuvStandardMatrix::Bt709 => 1,
        YuvStandardMatrix::Fcc => 4,
        YuvStandardMatrix::Smpte240 => 7,
        YuvStandardMatrix::Bt2020 => 9,
        _ => 6,
    }
}

/// A sample of 16 bits.
fn sample(row: &[u8], at: usize) -> Option<f32> {
    let bytes = row.get(2 * at..2 * at + 2)?;
    Some(f32::from(u16::from_le_bytes(bytes.try_into().ok()?)))
}
