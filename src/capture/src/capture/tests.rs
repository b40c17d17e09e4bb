//! What the tests of this module share.

use relit_data::session::FrameClock;

use relit_camera::{Fourcc, Frame};

/// Frame `n` of a camera of 30 frames/s.
pub(crate) fn frame(n: u64) -> Frame {
    Frame {
        fourcc: Fourcc::GREY,
        width: 2,
        height: 2,
        data: vec![n as u8; 4],
        sequence: Some(n),
        t_us: 33_333 * n as i64,
        clock: FrameClock::Driver,
        flagged: false,
    }
}
