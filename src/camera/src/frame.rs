//! One frame as a camera delivered it, and what can be wrong with it.

use relit_data::session::FrameClock;
use relit_data::still::jpeg;
use relit_video::PixelFormat;

use super::format::Fourcc;

/// One frame as the camera delivered it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// The pixel format that was agreed.
    pub fourcc: Fourcc,
    /// The width that was agreed, pixels.
    pub width: u32,
    /// The height that was agreed, pixels.
    pub height: u32,
    /// The bytes that the driver reports as used; raw rows without padding.
    pub data: Vec<u8>,
    /// The driver's counter without its wraps at 2^32; `None` if the camera has none.
    pub sequence: Option<u64>,
    /// When the frame was taken, microseconds of the monotonic clock (for a replay, of the
    /// given clock).
    pub t_us: i64,
    /// What made the time stamp: the driver (at the frame's end, or where its exposure began), or this
    /// program when it got the frame.
    pub clock: FrameClock,
    /// True if the driver marked the frame's data as damaged.
    pub flagged: bool,
}

/// Counts a driver's 32-bit frame counter on where it wraps.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SequenceUnwrapper {
    /// The driver's last value, and the same without wraps.
    last: Option<(u32, u64)>,
}

impl SequenceUnwrapper {
    /// The next value. A step of less than half the range is forward, any other is backward: some
    /// drivers repeat a number, or deliver one late.
    pub(crate) fn next(&mut self, raw: u32) -> u64 {
        let unwrapped = match self.last {
            None => u64::from(raw),
            Some((last_raw, last)) => {
                let step = raw.wrapping_sub(last_raw).cast_signed();
                last.saturating_add_signed(i64::from(step))
            }
        };
        self.last = Some((raw, unwrapped));
        unwrapped
    }
}

/// What is wrong with a frame's data, as far as it shows without decoding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum FrameFault {
    /// The driver marked it.
    #[error("the driver marked it as damaged")]
    Flagged,
    /// No data at all.
    #[error("it is empty")]
    Empty,
    /// A JPEG that does not begin as one.
    #[error("it does not begin as a JPEG")]
    NoStart,
    /// A JPEG without its end.
    #[error("it is a JPEG without an end")]
    NoEnd,
    /// A JPEG of another size than was agreed.
    #[error("it is {width} x {height} pixels, which is not the agreed size")]
    OtherSize {
        /// Its width, pixels.
        width: u32,
        /// Its height, pixels.
        height: u32,
    },
    /// A raw frame with the wrong number of bytes.
    #[error("it has {found} bytes, but its size needs {expected}")]
    Bytes {
        /// Bytes it needs.
        expected: usize,
        /// Bytes it has.
        found: usize,
    },
}

impl Frame {
    /// The first sign of damage, or of a size other than agreed.
    pub fn fault(&self) -> Option<FrameFault> {
        if self.flagged {
            return Some(FrameFault::Flagged);
        }
        if self.data.is_empty() {
            return Some(FrameFault::Empty);
        }
        match self.fourcc.pixel_format()? {
            PixelFormat::Mjpeg => jpeg_fault(&self.data, self.width, self.height),
            PixelFormat::H264 => None,
            raw => {
                let expected = raw.frame_bytes(self.width, self.height)?;
                let found = self.data.len();
                (expected != found).then_some(FrameFault::Bytes { expected, found })
            }
        }
    }
}

fn jpeg_fault(data: &[u8], width: u32, height: u32) -> Option<FrameFault> {
    if !data.starts_with(&[0xff, 0xd8]) {
        return Some(FrameFault::NoStart);
    }
    // Cameras pad after the end. Compressed data do not contain these two bytes: 0xff is stuffed.
    if !data.windows(2).rev().any(|pair| pair == [0xff, 0xd9]) {
        return Some(FrameFault::NoEnd);
    }
    match jpeg::size(data) {
        Some(found) if found == (width, height) => None,
        Some((width, height)) => Some(FrameFault::OtherSize { width, height }),
        None => Some(FrameFault::NoStart),
    }
}

/// Removes the padding of a raw frame's rows, which are `stride` bytes apart and have `row` bytes
/// each. Data without padding, or without all rows, stay as they are.
#[cfg(any(target_os = "linux", test))]
pub(super) fn without_padding(data: Vec<u8>, stride: usize, row: usize, rows: usize) -> Vec<u8> {
    let needed = rows
        .checked_sub(1)
        .and_then(|full| full.checked_mul(stride)?.checked_add(row));
    if stride <= row || needed.is_none_or(|needed| data.len() < needed) {
        return data;
    }
    let mut tight = Vec::with_capacity(row * rows);
    for line in data.chunks(stride).take(rows) {
        tight.extend_from_slice(&line[..row]);
    }
    tight
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    fn unwrapped(raw: &[u32]) -> Vec<u64> {
        let mut counter = SequenceUnwrapper::default();
        raw.iter().map(|&raw| counter.next(raw)).collect()
    }

    #[test]
    fn a_wrapped_counter_goes_on_and_a_late_frame_goes_back() {
        let wrap = [u32::MAX - 1, u32::MAX, 0, 1, 5];
        let counted: Vec<u64> = vec![
            0xffff_fffe,
            0xffff_ffff,
            1 << 32,
            (1 << 32) + 1,
            (1 << 32) + 5,
        ];
        assert_eq!(unwrapped(&wrap), counted);
        assert_eq!(unwrapped(&[7, 7, 9, 8, 10]), [7, 7, 9, 8, 10]);
        assert_eq!(unwrapped(&[3, 0, u32::MAX]), [3, 0, 0], "never below 0");
    }

    /// Start, quantisation table of 3 bytes, frame header of 2 x 3 pixels, scan, end.
    const JPEG: [u8; 25] = [
        0xff, 0xd8, 0xff, 0xdb, 0, 3, 9, 0xff, 0xff, 0xc0, 0, 9, 8, 0, 3, 0, 2, 1, 0, 0xff, 0xda,
        0, 2, 0xff, 0xd9,
    ];

    fn jpeg(data: &[u8]) -> Frame {
        Frame {
            fourcc: Fourcc::MJPG,
            width: 2,
            height: 3,
            data: data.to_vec(),
            sequence: None,
            t_us: 0,
            clock: FrameClock::Host,
            flagged: false,
        }
    }

    #[test]
    fn damage_of_a_jpeg_is_found() {
        assert_eq!(jpeg(&JPEG).fault(), None);
        assert_eq!(
            jpeg(&[&JPEG[..], &[0; 40]].concat()).fault(),
            None,
            "padded"
        );
        assert_eq!(jpeg(&JPEG[..23]).fault(), Some(FrameFault::NoEnd));
        assert_eq!(jpeg(&JPEG[1..]).fault(), Some(FrameFault::NoStart));
        assert_eq!(jpeg(&[]).fault(), Some(FrameFault::Empty));
        let other = Frame {
            width: 3,
            ..jpeg(&JPEG)
        };
        let size = FrameFault::OtherSize {
            width: 2,
            height: 3,
        };
        assert_eq!(other.fault(), Some(size));
        let flagged = Frame {
            flagged: true,
            ..jpeg(&JPEG)
        };
        assert_eq!(flagged.fault(), Some(FrameFault::Flagged));
    }

    #[test]
    fn a_raw_frame_has_the_bytes_of_its_size() {
        for (fourcc, bytes) in [
            (Fourcc::YUYV, 4 * 3),
            (Fourcc::NV12, 2 * 5),
            (Fourcc::RGB3, 6 * 3),
            (Fourcc::GREY, 2 * 3),
            (Fourcc(*b"RGGB"), 2 * 3),
        ] {
            let whole = Frame {
                fourcc,
                ..jpeg(&vec![0; bytes])
            };
            assert_eq!(whole.fault(), None, "{fourcc}");
            let short = Frame {
                fourcc,
                ..jpeg(&vec![0; bytes - 1])
            };
            let (expected, found) = (bytes, bytes - 1);
            assert_eq!(short.fault(), Some(FrameFault::Bytes { expected, found }));
        }
    }

    #[test]
    fn padding_is_taken_out_of_rows() {
        let padded = vec![1, 2, 0, 3, 4, 0, 5, 6];
        assert_eq!(without_padding(padded.clone(), 3, 2, 3), [1, 2, 3, 4, 5, 6]);
        assert_eq!(without_padding(padded.clone(), 2, 2, 4), padded);
        assert_eq!(
            without_padding(padded.clone(), 3, 2, 4),
            padded,
            "too short"
        );
        assert_eq!(
            without_padding(padded.clone(), 0, 2, 3),
            padded,
            "unknown stride"
        );
    }

    proptest! {
        #[test]
        fn no_bytes_make_the_check_of_a_jpeg_panic(data in vec(any::<u8>(), 0..80), cut in 0..25_usize) {
            let _ = jpeg(&data).fault();
            let _ = jpeg(&[&JPEG[..cut], &data].concat()).fault();
        }

        #[test]
        fn small_steps_are_counted_through_any_wrap(
            start in any::<u32>(),
            steps in vec(1_u32..1000, 1..50),
        ) {
            let mut raw = vec![start];
            for step in &steps {
                raw.push(raw[raw.len() - 1].wrapping_add(*step));
            }
            let counted = unwrapped(&raw);
            for (pair, step) in counted.windows(2).zip(steps) {
                prop_assert_eq!(pair[1] - pair[0], u64::from(step));
            }
        }

        #[test]
        fn rows_stay_what_they_are_whatever_the_padding(
            row in 1_usize..9,
            rows in 1_usize..9,
            padding in 0_usize..5,
        ) {
            let tight: Vec<u8> = (0..row * rows).map(|at| at as u8 + 1).collect();
            let mut padded = Vec::new();
            for line in tight.chunks(row) {
                padded.extend_from_slice(line);
                padded.resize(padded.len() + padding, 0);
            }
            prop_assert_eq!(without_padding(padded, row + padding, row, rows), tight);
        }
    }
}
