//! A decoded frame, and its conversion to RGB.

use ffmpeg_next::format::Pixel;
use ffmpeg_next::frame;
use ffmpeg_next::software::scaling;
use image::{GenericImage, RgbImage};
use yuv::{YuvGrayImage, YuvPlanarImage};

use super::DecodeFault;
use super::colour::Colour;
use super::display::Display;
use relit_data::geometry::Rect;

pub(super) fn is_jpeg_format(format: Pixel) -> bool {
    use Pixel::{YUVJ411P, YUVJ420P, YUVJ422P, YUVJ440P, YUVJ444P};
    matches!(format, YUVJ411P | YUVJ420P | YUVJ422P | YUVJ440P | YUVJ444P)
}

fn name_of(format: Pixel) -> &'static str {
    format
        .descriptor()
        .map_or("unknown", |descriptor| descriptor.name())
}

pub(super) fn is_rgb(format: Pixel) -> bool {
    let name = name_of(format);
    ["rgb", "bgr", "gbr", "bayer", "pal8", "mono"]
        .iter()
        .any(|part| name.contains(part))
}

pub(super) fn is_grey(format: Pixel) -> bool {
    let name = name_of(format);
    name.starts_with("gray") || name.starts_with("ya8") || name.starts_with("ya16")
}

/// One decoded frame.
pub struct Picture {
    number: u64,
    pub(super) frame: frame::Video,
    pub(super) colour: Colour,
    pub(super) display: Display,
}

impl std::fmt::Debug for Picture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let format = self.frame.format();
        write!(
            f,
            "Picture {{ number: {}, format: {format:?} }}",
            self.number
        )
    }
}

impl Picture {
    pub(super) fn new(number: u64, frame: frame::Video, colour: Colour, display: Display) -> Self {
        Self {
            number,
            frame,
            colour,
            display,
        }
    }

    /// The frame's position in the video, 0-based, in order of presentation.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// Width and height as displayed, pixels.
    pub fn size(&self) -> (u32, u32) {
        self.display
            .displayed(self.frame.width(), self.frame.height())
    }

    /// The part of the displayed picture under `region` as 8-bit RGB, `region.w` x `region.h`
    /// pixels; 0 where the region reaches beyond the picture.
    ///
    /// # Errors
    /// [`DecodeFault::PixelFormat`] if the format cannot be converted.
    pub fn rgb(&self, region: Rect) -> Result<RgbImage, DecodeFault> {
        let (width, height) = self.size();
        let Some(inside) = region.clipped_to(width, height) else {
            return Ok(RgbImage::new(region.w, region.h));
        };
        let coded = (self.frame.width(), self.frame.height());
        let piece = self
            .display
            .part(inside, coded, |rect| self.coded_rgb(rect))?;
        if inside == region {
            return Ok(piece);
        }
        let mut whole = RgbImage::new(region.w, region.h);
        let (left, top) = (inside.x - region.x, inside.y - region.y);
        // `inside` lies within `region`, so that the copy fits.
        let _ = whole.copy_from(&piece, left as u32, top as u32);
        Ok(whole)
    }

    /// The RGB of a rectangle that lies inside the coded picture.
    fn coded_rgb(&self, rect: Rect) -> Result<RgbImage, DecodeFault> {
        let format = self.frame.format();
        if !self.colour.is_srgb() && !is_rgb(format) && !is_grey(format) {
            let rgb = self.colour.wide_rgb(&self.frame, rect);
            return rgb.ok_or_else(|| unconvertible(format));
        }
        let rgb = self.plain_rgb(rect);
        let mut rgb = rgb.ok_or_else(|| unconvertible(format))?;
        self.colour.make_srgb(&mut rgb);
        Ok(rgb)
    }

    /// As coded, with 8 bits a value.
    fn plain_rgb(&self, rect: Rect) -> Option<RgbImage> {
        let format = self.frame.format();
        if is_direct(format) && strides_are_forward(&self.frame) {
            return planes_to_rgb(&self.frame, format, &self.colour, rect);
        }
        let plain = plain_format(format, self.colour.full_range);
        let converted = convert(&self.frame, plain).ok()?;
        planes_to_rgb(&converted, plain, &self.colour, rect)
    }
}

impl Picture {
    /// Gives `take` the rows of `rect`, which lies inside the picture, one after the other: red, green, blue and 255.
    /// `None` if that takes more than a conversion of its planes, or from `take`.
    pub(super) fn direct_rgba(
        &self,
        rect: Rect,
        take: &mut dyn FnMut(&[u8]) -> Option<()>,
    ) -> Option<()> {
        let format = self.frame.format();
        let direct = is_planar(format) && strides_are_forward(&self.frame);
        if !direct || !self.display.is_plain() || !self.colour.is_srgb() {
            return None;
        }
        let (left, top) = (usize::try_from(rect.x).ok()?, usize::try_from(rect.y).ok()?);
        let end = usize::try_from(rect.right()).ok()?.next_multiple_of(BLOCK);
        // As in `planes_to_rgb`: in blocks from the frame's edge.
        let x = left - left % BLOCK;
        let width = end.min(self.frame.width() as usize) - x;
        let (_, shift_y) = chroma_shifts(format);
        let (skipped, bytes) = (4 * (left - x), 4 * rect.w as usize);
        let mut strip = vec![0; 4 * width * STRIP];
        let mut y = top - (top & shift_y);
        while y < top + rect.h as usize {
            let height = STRIP.min(top + rect.h as usize - y);
            let strip = &mut strip[..4 * width * height];
            let size = (u32::try_from(width).ok()?, u32::try_from(height).ok()?);
            planes_to_rgba(&self.frame, format, &self.colour, (x, y), size, strip)?;
            for row in strip.chunks_exact(4 * width).skip(top.saturating_sub(y)) {
                take(row.get(skipped..skipped + bytes)?)?;
            }
            y += height;
        }
        Some(())
    }
}

/// Rows that are converted at a time: few enough for the processor's nearest cache.
const STRIP: usize = 4;

/// RGBA of part of a planar YUV picture, from a pixel on that a chroma sample begins with.
fn planes_to_rgba(
    frame: &frame::Video,
    format: Pixel,
    colour: &Colour,
    (x, y): (usize, usize),
    (width, height): (u32, u32),
    rgba: &mut [u8],
) -> Option<()> {
    let shifts = chroma_shifts(format);
    let planes = yuv_planes(frame, shifts, (x, y), (width, height))?;
    let to_rgba = match shifts {
        (1, 1) => yuv::yuv420_to_rgba,
        (1, 0) => yuv::yuv422_to_rgba,
        _ => yuv::yuv444_to_rgba,
    };
    to_rgba(&planes, rgba, 4 * width, colour.range(), colour.matrix).ok()
}

/// Part of a planar YUV picture, from a pixel on that a chroma sample begins with.
fn yuv_planes(
    frame: &frame::Video,
    (shift_x, shift_y): (usize, usize),
    (x, y): (usize, usize),
    (width, height): (u32, u32),
) -> Option<YuvPlanarImage<'_, u8>> {
    let (y_plane, y_stride) = plane(frame, 0, x, y)?;
    let (u_plane, u_stride) = plane(frame, 1, x >> shift_x, y >> shift_y)?;
    let (v_plane, v_stride) = plane(frame, 2, x >> shift_x, y >> shift_y)?;
    Some(YuvPlanarImage {
        y_plane,
        y_stride,
        u_plane,
        u_stride,
        v_plane,
        v_stride,
        width,
        height,
    })
}

/// Halvings of the chroma planes of a planar format, across and down.
fn chroma_shifts(format: Pixel) -> (usize, usize) {
    use Pixel::{YUV420P, YUV422P, YUVJ420P, YUVJ422P};
    match format {
        YUV420P | YUVJ420P => (1, 1),
        YUV422P | YUVJ422P => (1, 0),
        _ => (0, 0),
    }
}

fn is_planar(format: Pixel) -> bool {
    is_direct(format) && !matches!(format, Pixel::GRAY8 | Pixel::RGB24)
}

fn unconvertible(format: Pixel) -> DecodeFault {
    DecodeFault::PixelFormat(name_of(format).to_owned())
}

/// Formats that are converted to RGB in one step.
fn is_direct(format: Pixel) -> bool {
    use Pixel::{GRAY8, RGB24, YUV420P, YUV422P, YUV444P, YUVJ420P, YUVJ422P, YUVJ444P};
    matches!(
        format,
        GRAY8 | RGB24 | YUV420P | YUV422P | YUV444P | YUVJ420P | YUVJ422P | YUVJ444P
    )
}

/// The direct format that keeps all of what `format` holds in 8 bits: chroma is only ever
/// upsampled, and the range stays what it is.
fn plain_format(format: Pixel, full_range: bool) -> Pixel {
    if is_rgb(format) {
        return Pixel::RGB24;
    }
    if is_grey(format) {
        return Pixel::GRAY8;
    }
    let halved = format
        .descriptor()
        .map(|d| (d.log2_chroma_w(), d.log2_chroma_h()));
    // swscale takes the range from the name of the format; the same one on both sides keeps it.
    match (halved, is_jpeg_format(format) && full_range) {
        (Some((1, 1)), false) => Pixel::YUV420P,
        (Some((1, 1)), true) => Pixel::YUVJ420P,
        (Some((1, 0)), false) => Pixel::YUV422P,
        (Some((1, 0)), true) => Pixel::YUVJ422P,
        (_, false) => Pixel::YUV444P,
        (_, true) => Pixel::YUVJ444P,
    }
}

pub(super) fn convert(
    source: &frame::Video,
    plain: Pixel,
) -> Result<frame::Video, ffmpeg_next::Error> {
    use scaling::Flags;
    let (width, height) = (source.width(), source.height());
    let flags = Flags::BILINEAR | Flags::ACCURATE_RND | Flags::BITEXACT | Flags::FULL_CHR_H_INP;
    let mut scaler =
        scaling::Context::get(source.format(), width, height, plain, width, height, flags)?;
    let mut target = frame::Video::empty();
    scaler.run(source, &mut target)?;
    Ok(target)
}

/// False for pictures that are stored from the bottom up: their strides are negative.
#[allow(unsafe_code)]
fn strides_are_forward(frame: &frame::Video) -> bool {
    // SAFETY: the pointer is that of a live frame, and `linesize` is a plain array in it.
    unsafe { (*frame.as_ptr()).linesize.iter().all(|&stride| stride >= 0) }
}

/// Columns that are converted at a time.
const BLOCK: usize = 32;

/// One plane of samples, from the sample (x, y) on.
pub(super) fn plane(
    frame: &frame::Video,
    index: usize,
    x: usize,
    y: usize,
) -> Option<(&[u8], u32)> {
    if index >= frame.planes() {
        return None;
    }
    let stride = frame.stride(index);
    let samples = frame.data(index).get(y * stride + x..)?;
    Some((samples, u32::try_from(stride).ok()?))
}

/// RGB of `rect`, which lies inside the frame. `None` if the frame's planes are not what the
/// format says.
fn planes_to_rgb(
    frame: &frame::Video,
    format: Pixel,
    colour: &Colour,
    rect: Rect,
) -> Option<RgbImage> {
    use Pixel::{GRAY8, RGB24};
    let (shift_x, shift_y) = chroma_shifts(format);
    // The converter works in blocks, and rounds differently in a block that is not full. The blocks
    // start at the frame's edge, so that a pixel's value does not depend on the region; the region
    // then also starts at a chroma sample.
    let (x, y) = (usize::try_from(rect.x).ok()?, usize::try_from(rect.y).ok()?);
    let (surplus_x, surplus_y) = (x % BLOCK, y & shift_y);
    let (x, y) = (x - surplus_x, y - surplus_y);
    let end = (usize::try_from(rect.right()).ok()?).next_multiple_of(BLOCK);
    let width = u32::try_from(end.min(frame.width() as usize) - x).ok()?;
    let height = rect.h + surplus_y as u32;
    if format == RGB24 {
        let left = 3 * (x + surplus_x);
        return copy_rgb(frame, left, y, rect.w, rect.h);
    }
    let mut rgb = RgbImage::new(width, height);
    let range = colour.range();
    let stride = width * 3;
    let converted = if format == GRAY8 {
        let (y_plane, y_stride) = plane(frame, 0, x, y)?;
        let grey = YuvGrayImage {
            y_plane,
            y_stride,
            width,
            height,
        };
        yuv::yuv400_to_rgb(&grey, &mut rgb, stride, range, colour.matrix)
    } else {
        let planes = yuv_planes(frame, (shift_x, shift_y), (x, y), (width, height))?;
        let to_rgb = match (shift_x, shift_y) {
            (1, 1) => yuv::yuv420_to_rgb,
            (1, 0) => yuv::yuv422_to_rgb,
            _ => yuv::yuv444_to_rgb,
        };
        to_rgb(&planes, &mut rgb, stride, range, colour.matrix)
    };
    converted.ok()?;
    if rgb.dimensions() == (rect.w, rect.h) {
        return Some(rgb);
    }
    let (left, top) = (surplus_x as u32, surplus_y as u32);
    Some(image::imageops::crop_imm(&rgb, left, top, rect.w, rect.h).to_image())
}

fn copy_rgb(
    frame: &frame::Video,
    left: usize,
    y: usize,
    width: u32,
    height: u32,
) -> Option<RgbImage> {
    let (samples, stride) = plane(frame, 0, left, y)?;
    let row = 3 * width as usize;
    let mut pixels = Vec::with_capacity(row * height as usize);
    for line in 0..height as usize {
        let start = line * stride as usize;
        pixels.extend_from_slice(samples.get(start..start + row)?);
    }
    RgbImage::from_raw(width, height, pixels)
}
