//! libjpeg-turbo's decoder, from the copy in the crate `mozjpeg-sys`.
//!
//! The library reports errors by a function that must not return: it unwinds through the library, which is
//! compiled for that, and is caught here.
#![allow(unsafe_code)]

use std::ffi::{c_int, c_ulong};
use std::mem;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use mozjpeg_sys::{
    J_COLOR_SPACE, J_DCT_METHOD, JPEG_LIB_VERSION, jpeg_CreateDecompress, jpeg_common_struct,
    jpeg_crop_scanline, jpeg_decompress_struct, jpeg_destroy_decompress, jpeg_error_mgr,
    jpeg_finish_decompress, jpeg_mem_src, jpeg_read_header, jpeg_read_scanlines,
    jpeg_skip_scanlines, jpeg_start_decompress, jpeg_std_error,
};

use super::NotDecoded;
use super::layout::size_of_plain;
use relit_data::geometry::Rect;

/// Bytes of a pixel: red, green, blue, 255.
const PIXEL: usize = 4;

/// The library writes a row that begins at a multiple of this past the caches, from where it would have to be fetched.
const CACHED: usize = 32;

/// The first byte of a buffer at which the library writes into the caches; less than [`CACHED`].
fn cached_start(buffer: *const u8) -> usize {
    if buffer.addr().is_multiple_of(CACHED) {
        CACHED / 2
    } else {
        0
    }
}

/// Decodes the pixels of a JPEG of this size under `part`, which lies inside, and gives `take` row after row: red,
/// green, blue and 255. `None` from there ends the decoding.
pub(in super::super) fn decode_part(
    jpeg: &[u8],
    size: (u32, u32),
    part: Rect,
    take: &mut dyn FnMut(&[u8]) -> Option<()>,
) -> Result<(), NotDecoded> {
    if size_of_plain(jpeg)? != size || part.clipped_to(size.0, size.1) != Some(part) {
        return Err(NotDecoded);
    }
    let mut library = Library::new();
    // What was unwound through is only freed afterwards.
    catch_unwind(AssertUnwindSafe(|| library.decode(jpeg, part, take))).unwrap_or(Err(NotDecoded))
}

/// The library's state for one picture. It is freed when this is dropped.
struct Library {
    // In boxes: the library keeps addresses of both.
    state: Box<jpeg_decompress_struct>,
    _errors: Box<jpeg_error_mgr>,
}

impl Library {
    fn new() -> Self {
        // SAFETY: both are plain C structures, for which all bytes 0 is a valid value (optional functions
        // and pointers). The library fills them in, keeps no address but those of the boxes, and does not
        // fail here except without memory, where it calls `fail`.
        unsafe {
            let mut errors: Box<jpeg_error_mgr> = Box::new(mem::zeroed());
            jpeg_std_error(&mut errors);
            errors.error_exit = Some(fail);
            errors.emit_message = Some(judge);
            errors.output_message = Some(ignore);
            let mut state: Box<jpeg_decompress_struct> = Box::new(mem::zeroed());
            state.common.err = &mut *errors;
            let bytes = mem::size_of::<jpeg_decompress_struct>();
            jpeg_CreateDecompress(&mut *state, JPEG_LIB_VERSION, bytes);
            Self {
                state,
                _errors: errors,
            }
        }
    }

    fn decode(
        &mut self,
        jpeg: &[u8],
        part: Rect,
        take: &mut dyn FnMut(&[u8]) -> Option<()>,
    ) -> Result<(), NotDecoded> {
        let state = &mut *self.state;
        let (x, y) = (part.x.unsigned_abs(), part.y.unsigned_abs());
        let length = c_ulong::try_from(jpeg.len()).map_err(|_| NotDecoded)?;
        // SAFETY: the data outlive the calls, which read no further than their length.
        unsafe {
            jpeg_mem_src(state, jpeg.as_ptr(), length);
            jpeg_read_header(state, 1);
        }
        if !matches!(
            state.jpeg_color_space,
            J_COLOR_SPACE::JCS_YCbCr | J_COLOR_SPACE::JCS_GRAYSCALE
        ) {
            return Err(NotDecoded);
        }
        state.out_color_space = J_COLOR_SPACE::JCS_EXT_RGBA;
        state.dct_method = J_DCT_METHOD::JDCT_ISLOW;
        state.do_fancy_upsampling = 0;
        let (mut left, mut width) = (x, part.w);
        // SAFETY: the header is read; the part lies inside the picture, whose size was compared.
        unsafe {
            jpeg_start_decompress(state);
            jpeg_crop_scanline(state, &mut left, &mut width);
            if y > 0 {
                jpeg_skip_scanlines(state, y);
            }
        }
        // The library begins at a whole block, up to 15 columns before the part.
        let surplus = PIXEL * (x - left) as usize;
        let bytes = PIXEL * part.w as usize;
        let mut line = vec![0; PIXEL * width as usize + CACHED];
        let start = cached_start(line.as_ptr());
        let line = line.get_mut(start..).ok_or(NotDecoded)?;
        for _ in 0..part.h {
            let mut at = line.as_mut_ptr();
            // SAFETY: the line holds `width` pixels of the output's format.
            if unsafe { jpeg_read_scanlines(state, &mut at, 1) } != 1 {
                return Err(NotDecoded);
            }
            take(line.get(surplus..surplus + bytes).ok_or(NotDecoded)?).ok_or(NotDecoded)?;
        }
        finish(state, line)
    }
}

/// Reads what follows the part. Damaged data are mostly noticed only at their end: some are left over, or missing.
fn finish(state: &mut jpeg_decompress_struct, line: &mut [u8]) -> Result<(), NotDecoded> {
    let rows = state.output_height - state.output_scanline;
    let mut at = line.as_mut_ptr();
    // SAFETY: decoding has begun, and the line holds a row of the part's width. The last row is read, because the
    // library does not look at rows that are skipped up to the end.
    unsafe {
        if rows > 1 {
            jpeg_skip_scanlines(state, rows - 1);
        }
        if rows > 0 && jpeg_read_scanlines(state, &mut at, 1) != 1 {
            return Err(NotDecoded);
        }
        match jpeg_finish_decompress(state) {
            0 => Err(NotDecoded),
            _ => Ok(()),
        }
    }
}

impl Drop for Library {
    fn drop(&mut self) {
        // SAFETY: the state was created and is freed once.
        unsafe { jpeg_destroy_decompress(&mut self.state) }
    }
}

/// Ends the decoding. Unlike a panic, this prints nothing.
extern "C-unwind" fn fail(_: &mut jpeg_common_struct) {
    resume_unwind(Box::new(NotDecoded));
}

/// A negative level is a warning: data are damaged, and the library would go on with what it makes of them.
extern "C-unwind" fn judge(state: &mut jpeg_common_struct, level: c_int) {
    if level < 0 {
        fail(state);
    }
}

extern "C-unwind" fn ignore(_: &mut jpeg_common_struct) {}
