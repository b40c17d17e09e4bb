//! Real-time bytes: commands of one byte that are never part of a line.
//!
//! They are picked out in the receive interrupt, so that a full line buffer delays none of them.
//! Knows no other module.

/// What one received byte is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Received {
    /// A byte of a line.
    Data(u8),
    /// A command of its own.
    Realtime(Realtime),
}

/// A command of one byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Realtime {
    /// `?`: report the status.
    Status,
    /// `!`: ramp to a stop and keep the plan.
    Hold,
    /// `~`: go on.
    Resume,
    /// 0x18: stop at once and start again.
    Reset,
    /// 0x85: ramp to a stop and drop the jog.
    JogCancel,
    /// One of Grbl's bytes that this table has no use for (overrides, door): taken out, no effect.
    Ignored,
}

/// Tells a real-time byte from a byte of a line.
pub fn classify(byte: u8) -> Received {
    let realtime = match byte {
        b'?' => Realtime::Status,
        b'!' => Realtime::Hold,
        b'~' => Realtime::Resume,
        0x18 => Realtime::Reset,
        0x85 => Realtime::JogCancel,
        0x80.. => Realtime::Ignored,
        _ => return Received::Data(byte),
    };
    Received::Realtime(realtime)
}
