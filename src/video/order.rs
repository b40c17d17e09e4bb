//! From the packets of a file to frames in order of presentation.

use ffmpeg_next::codec::Id;
use ffmpeg_next::packet::Ref;
use ffmpeg_next::{Packet, Rational, ffi};

use super::ffv1::slices_are_whole;

/// What is known of one frame before it is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameInfo {
    /// Position in the video, 0-based, in order of presentation.
    pub number: u64,
    /// When it is shown, microseconds from the zero of the file's clock.
    pub t_us: i64,
    /// True if, according to the container, its data are incomplete.
    pub damaged: bool,
}

/// What a packet states about its frame. Time stamps are in units of the stream's time base.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stamp {
    /// When it is shown.
    pts: Option<i64>,
    /// When it is decoded.
    dts: Option<i64>,
    damaged: bool,
    /// True if it can be decoded without any other frame.
    key: bool,
    /// For FFV1: whether its checksums are right; `None` where it has none.
    checked: Option<bool>,
    /// False if it is only decoded because others depend on it: the frames before the start of a
    /// clip that was trimmed without encoding it again.
    shown: bool,
}

impl Stamp {
    pub(super) fn of(packet: &Packet, codec: Id) -> Self {
        let data = packet.data().filter(|_| codec == Id::FFV1);
        Self {
            key: packet.is_key(),
            checked: data.and_then(slices_are_whole),
            pts: packet.pts(),
            dts: packet.dts(),
            damaged: packet.is_corrupt(),
            shown: raw_flags(packet) & ffi::AV_PKT_FLAG_DISCARD == 0,
        }
    }
}

/// Marks packets with wrong FFV1 checksums, if the file has checksums, and those after them up to the
/// next key frame, which are decoded from the damaged state.
pub(super) fn mark_wrong_checksums(stamps: &mut [Stamp]) {
    if !stamps.iter().any(|stamp| stamp.checked == Some(true)) {
        return;
    }
    let mut broken = false;
    for stamp in stamps {
        broken = stamp.checked != Some(true) || (broken && !stamp.key);
        stamp.damaged |= broken;
    }
}

/// All flags, of which the crate's own type keeps only two.
#[allow(unsafe_code)]
fn raw_flags(packet: &Packet) -> i32 {
    // SAFETY: the pointer is that of a live packet, and `flags` is a plain number in it.
    unsafe { (*packet.as_ptr()).flags }
}

/// Frames in order of presentation, and their numbers by packet and by time stamp.
#[derive(Debug)]
pub(super) struct Ordered {
    pub(super) frames: Vec<FrameInfo>,
    /// The frame number of each packet, in the order of the file; `None` if it is not shown.
    pub(super) number_of_packet: Vec<Option<u64>>,
    /// Time stamps and numbers, sorted; empty if frames have none or share them. Frames are then
    /// numbered in the order in which the decoder returns them.
    pub(super) number_at: Vec<(i64, u64)>,
    /// Numbers of the frames that can be decoded without any other, sorted.
    pub(super) keys: Vec<u64>,
    /// What had to be assumed, for the user.
    pub(super) note: Option<String>,
}

impl Ordered {
    /// `rate` is the stream's frames per second, or 0 / anything where it is not known.
    pub(super) fn from(stamps: &[Stamp], time_base: Rational, rate: Rational) -> Self {
        let mut order: Vec<usize> = (0..stamps.len()).filter(|&at| stamps[at].shown).collect();
        let all_pts: Option<Vec<i64>> = order.iter().map(|&at| stamps[at].pts).collect();
        if all_pts.is_some() {
            order.sort_by_key(|&at| stamps[at].pts);
        }
        let (times, note) = match all_pts.clone().or_else(|| all_dts(&order, stamps)) {
            Some(mut times) => {
                times.sort_unstable();
                let in_us = |&units: &i64| microseconds(units, time_base);
                (times.iter().map(in_us).collect(), None)
            }
            None => by_rate(order.len(), rate),
        };
        let mut number_of_packet = vec![None; stamps.len()];
        let mut frames = Vec::with_capacity(order.len());
        let mut keys = Vec::new();
        for ((number, &at), t_us) in (0_u64..).zip(&order).zip(times) {
            number_of_packet[at] = Some(number);
            if stamps[at].key {
                keys.push(number);
            }
            frames.push(FrameInfo {
                number,
                t_us,
                damaged: stamps[at].damaged,
            });
        }
        let mut sorted = all_pts.unwrap_or_default();
        sorted.sort_unstable();
        let mut note = note;
        if sorted.windows(2).any(|pair| pair[0] == pair[1]) {
            sorted.clear();
            let shared = "some frames share a time stamp: is this more than one recording?";
            note = Some(shared.to_owned());
        }
        let number_at = sorted.into_iter().zip(0..).collect();
        Self {
            frames,
            number_of_packet,
            number_at,
            keys,
            note,
        }
    }
}

fn all_dts(order: &[usize], stamps: &[Stamp]) -> Option<Vec<i64>> {
    order.iter().map(|&at| stamps[at].dts).collect()
}

/// Evenly spaced times for a file without time stamps.
fn by_rate(frames: usize, rate: Rational) -> (Vec<i64>, Option<String>) {
    let known = rate.numerator() > 0 && rate.denominator() > 0;
    let rate = if known { rate } else { Rational::new(30, 1) };
    let frame = Rational::new(rate.denominator(), rate.numerator());
    let times = (0..frames as i64).map(|n| microseconds(n, frame)).collect();
    let per_second = f64::from(rate.numerator()) / f64::from(rate.denominator());
    let note = format!(
        "the file has no time stamps for its frames; {per_second:.2} evenly spaced frames a second are assumed"
    );
    (times, Some(note))
}

/// `units` of `time_base` seconds in microseconds, rounded.
pub(super) fn microseconds(units: i64, time_base: Rational) -> i64 {
    let numerator = i128::from(units) * i128::from(time_base.numerator()) * 1_000_000;
    let denominator = i128::from(time_base.denominator()).max(1);
    let rounded = (2 * numerator + denominator).div_euclid(2 * denominator);
    let clamped = rounded.clamp(i128::from(i64::MIN), i128::from(i64::MAX));
    clamped as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamp(pts: Option<i64>, dts: Option<i64>) -> Stamp {
        Stamp {
            pts,
            dts,
            damaged: false,
            key: true,
            checked: None,
            shown: true,
        }
    }

    fn ordered(stamps: &[Stamp]) -> Ordered {
        Ordered::from(stamps, Rational::new(1, 1000), Rational::new(25, 1))
    }

    fn times(ordered: &Ordered) -> Vec<i64> {
        ordered.frames.iter().map(|frame| frame.t_us).collect()
    }

    #[test]
    fn frames_are_numbered_by_the_time_at_which_they_are_shown() {
        let found = ordered(&[0, 80, 40].map(|pts| stamp(Some(pts), None)));
        assert_eq!(found.number_of_packet, [Some(0), Some(2), Some(1)]);
        assert_eq!(times(&found), [0, 40_000, 80_000]);
        assert_eq!(found.number_at, [(0, 0), (40, 1), (80, 2)]);
        assert_eq!(found.keys, [0, 1, 2]);
    }

    #[test]
    fn where_only_decoding_times_are_known_the_decoders_order_counts() {
        let found = ordered(&[0, 40, 80].map(|dts| stamp(None, Some(dts))));
        assert!(found.number_at.is_empty() && found.note.is_none());
        assert_eq!(times(&found), [0, 40_000, 80_000]);
    }

    #[test]
    fn without_any_time_the_stream_s_rate_is_assumed_and_told() {
        let found = ordered(&[stamp(None, None); 3]);
        assert_eq!(times(&found), [0, 40_000, 80_000]);
        assert!(
            found
                .note
                .unwrap()
                .contains("25.00 evenly spaced frames a second")
        );
    }

    #[test]
    fn frames_that_are_not_to_be_shown_have_no_number() {
        let mut stamps = [0, 40, 80].map(|pts| stamp(Some(pts), None));
        stamps[0].shown = false;
        let found = ordered(&stamps);
        assert_eq!(found.number_of_packet, [None, Some(0), Some(1)]);
        assert_eq!(found.frames.len(), 2);
    }

    #[test]
    fn a_wrong_checksum_damages_the_frames_up_to_the_next_key_frame() {
        let mut stamps = [stamp(None, None); 6];
        for (at, stamp) in stamps.iter_mut().enumerate() {
            stamp.checked = Some(at != 2);
            stamp.key = at % 4 == 0;
        }
        mark_wrong_checksums(&mut stamps);
        assert_eq!(
            stamps.map(|stamp| stamp.damaged),
            [false, false, true, true, false, false]
        );
        let mut unchecked = [stamp(None, None); 3];
        mark_wrong_checksums(&mut unchecked);
        assert!(unchecked.iter().all(|stamp| !stamp.damaged));
    }

    #[test]
    fn shared_time_stamps_identify_no_frame() {
        let found = ordered(&[0, 40, 40].map(|pts| stamp(Some(pts), None)));
        assert!(found.number_at.is_empty());
        assert_eq!(found.frames.len(), 3);
    }

    #[test]
    fn no_time_is_out_of_range() {
        for units in [i64::MIN, -1, 0, i64::MAX] {
            microseconds(units, Rational::new(i32::MAX, 1));
        }
        assert_eq!(microseconds(i64::MIN, Rational::new(1, 1)), i64::MIN);
        assert_eq!(microseconds(i64::MAX, Rational::new(1, 1)), i64::MAX);
    }
}
