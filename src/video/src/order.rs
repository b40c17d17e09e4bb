//! From the packets of a file to frames in order of presentation.

use std::ops::Range;

use ffmpeg_next::codec::Id;
use ffmpeg_next::packet::Ref;
use ffmpeg_next::{Packet, Rational, ffi};

use super::ffv1::slices_are_whole;
use super::packet_contents::{Inspector, PacketContents};

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
    /// True if decoding can begin with it.
    key: bool,
    /// For FFV1: whether its checksums are right; `None` if it has none.
    checked: Option<bool>,
    contents: PacketContents,
    /// False if it is only decoded because others depend on it: the frames before the start of a
    /// clip that was trimmed without encoding it again.
    shown: bool,
}

impl Stamp {
    pub(super) fn from_packet(packet: &Packet, codec: Id, inspector: &mut Inspector) -> Self {
        let data = packet.data().filter(|_| codec == Id::FFV1);
        let (contents, key) = inspector.inspect(packet);
        Self {
            key,
            checked: data.and_then(slices_are_whole),
            pts: packet.pts(),
            dts: packet.dts(),
            damaged: packet.is_corrupt(),
            contents,
            shown: raw_flags(packet) & ffi::AV_PKT_FLAG_DISCARD == 0,
        }
    }

    fn is_picture(&self) -> bool {
        self.shown && self.contents != PacketContents::Hidden
    }
}

/// Whether the pictures of a file can only be known by decoding it: where a packet is unclear, where the file does not begin
/// with a key frame or shows pictures before it that need what came before, and where time stamps are missing or not
/// unique.
pub(super) fn needs_decoding(stamps: &[Stamp]) -> bool {
    let unclear = |stamp: &Stamp| stamp.contents == PacketContents::Unclear;
    let Some(first) = stamps.first() else {
        return false;
    };
    if !first.key || stamps.iter().any(unclear) || recordings(stamps).len() > 1 {
        return true;
    }
    let shown = stamps.iter().filter(|stamp| stamp.is_picture());
    let times: Option<Vec<i64>> = shown.map(|stamp| stamp.pts).collect();
    let Some(mut times) = times else {
        return true;
    };
    if times
        .iter()
        .any(|&time| first.pts.is_none_or(|first| time < first))
    {
        return true;
    }
    times.sort_unstable();
    times.windows(2).any(|pair| pair[0] == pair[1])
}

/// By how many frames the time of decoding must go back for a new recording to begin; less is jitter.
const MAX_JITTER: i64 = 4;

/// The recordings that were joined into a file, one after the other: where the time of decoding begins again.
fn recordings(stamps: &[Stamp]) -> Vec<Range<usize>> {
    let timed = (0..)
        .zip(stamps)
        .filter_map(|(at, stamp)| Some((at, stamp.dts?)));
    let timed: Vec<(usize, i64)> = timed.collect();
    let steps = timed
        .windows(2)
        .map(|pair| pair[1].1.saturating_sub(pair[0].1));
    let mut forward: Vec<i64> = steps.clone().filter(|&step| step > 0).collect();
    forward.sort_unstable();
    let step = forward.get(forward.len() / 2).copied().unwrap_or(0);
    let least = -step.saturating_mul(MAX_JITTER);
    let joints = timed.iter().skip(1).zip(steps);
    let joints = joints.filter(|&(_, step)| step < least);
    let begins: Vec<usize> = [0]
        .into_iter()
        .chain(joints.map(|(&(at, _), _)| at))
        .collect();
    let ends = begins.iter().copied().skip(1).chain([stamps.len()]);
    begins
        .iter()
        .zip(ends)
        .map(|(&from, to)| from..to)
        .collect()
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

/// All flags; the crate's own type keeps only two.
#[allow(unsafe_code)]
fn raw_flags(packet: &Packet) -> i32 {
    // SAFETY: the pointer is that of a live packet, and `flags` is a plain number in it.
    unsafe { (*packet.as_ptr()).flags }
}

/// Frames in order of presentation, and their numbers by packet and by time stamp.
#[derive(Debug)]
pub(super) struct PresentationOrder {
    pub(super) frames: Vec<FrameInfo>,
    /// The frame number of each packet, in the order of the file; `None` if it is not shown.
    pub(super) number_of_packet: Vec<Option<u64>>,
    /// The time stamp of each frame, by number.
    pub(super) stamps: Vec<Option<i64>>,
    /// Numbers of the frames with which decoding can begin, sorted.
    pub(super) keys: Vec<u64>,
    /// What had to be assumed, for the user.
    pub(super) note: Option<String>,
}

impl PresentationOrder {
    /// `rate` is the stream's frames per second, or 0 / anything where it is not known.
    pub(super) fn from(stamps: &[Stamp], time_base: Rational, rate: Rational) -> Self {
        let mut order = Vec::with_capacity(stamps.len());
        let recordings = recordings(stamps);
        for range in &recordings {
            let mut part: Vec<usize> = range
                .clone()
                .filter(|&at| stamps[at].is_picture())
                .collect();
            if part.iter().all(|&at| stamps[at].pts.is_some()) {
                part.sort_by_key(|&at| stamps[at].pts);
            }
            order.extend(part);
        }
        let pts: Vec<Option<i64>> = order.iter().map(|&at| stamps[at].pts).collect();
        let (times, mut note) = frame_times(&pts, stamps, time_base, rate);
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
        let shared = pts
            .windows(2)
            .any(|pair| pair[0].is_some() && pair[0] == pair[1]);
        if recordings.len() > 1 {
            note = Some(JOINED.to_owned());
        } else if shared {
            note =
                Some("some frames share a time stamp: is this more than one recording?".to_owned());
        }
        Self {
            frames,
            number_of_packet,
            stamps: pts,
            keys,
            note,
        }
    }

    /// Whether every frame has a time stamp of its own.
    pub(super) fn stamps_are_unique(&self) -> bool {
        let mut stamps = self.stamps.clone();
        stamps.sort_unstable();
        let unique = stamps.windows(2).all(|pair| pair[0] < pair[1]);
        unique && stamps.first().is_none_or(Option::is_some)
    }

    /// The frames that a decoder returned, with their time stamps and whether each is damaged.
    pub(super) fn from_pictures(
        pictures: &[(Option<i64>, bool)],
        stamps: &[Stamp],
        time_base: Rational,
        rate: Rational,
    ) -> Self {
        let pts: Vec<Option<i64>> = pictures.iter().map(|&(stamp, _)| stamp).collect();
        let (times, mut note) = frame_times(&pts, stamps, time_base, rate);
        let mut incomplete: Vec<Option<i64>> = Vec::new();
        if recordings(stamps).len() > 1 {
            // To the container, the last packet before a joint looks incomplete.
            note = Some(JOINED.to_owned());
        } else {
            incomplete.extend(stamps.iter().filter(|s| s.damaged).map(|s| s.pts));
        }
        let numbered = (0_u64..).zip(pictures).zip(times);
        let frames = numbered.map(|((number, &(stamp, damaged)), t_us)| FrameInfo {
            number,
            t_us,
            damaged: damaged || (stamp.is_some() && incomplete.contains(&stamp)),
        });
        Self {
            frames: frames.collect(),
            number_of_packet: Vec::new(),
            stamps: pts,
            keys: Vec::new(),
            note,
        }
    }
}

const JOINED: &str = "its time stamps begin again: several recordings were joined; their frames are numbered one after the other";

/// The time of each frame, microseconds, and what had to be assumed for it. `pts`: their time stamps, in order of
/// presentation.
fn frame_times(
    pts: &[Option<i64>],
    stamps: &[Stamp],
    time_base: Rational,
    rate: Rational,
) -> (Vec<i64>, Option<String>) {
    let in_us = |units: &i64| microseconds(*units, time_base);
    let shown = || stamps.iter().filter(|stamp| stamp.is_picture());
    let all = filled_at_the_end(pts);
    // A decoder guesses those that packets lack, from some that are stated and from the times of decoding.
    let stated = shown().all(|stamp| stamp.pts.is_some());
    let guessed = |all: &[i64]| {
        let rising = all.windows(2).all(|pair| pair[0] < pair[1]);
        rising && shown().any(|stamp| stamp.pts.is_some())
    };
    if let Some(all) = all.as_ref().filter(|all| stated || guessed(all)) {
        return (in_one_run(all.iter().map(in_us).collect()), None);
    }
    let dts: Option<Vec<i64>> = shown().map(|stamp| stamp.dts).collect();
    if let Some(mut dts) = dts.filter(|dts| dts.len() == pts.len()) {
        if recordings(stamps).len() == 1 {
            dts.sort_unstable();
        }
        return (in_one_run(dts.iter().map(in_us).collect()), None);
    }
    match all.filter(|all| all.is_sorted()) {
        Some(all) => (all.iter().map(in_us).collect(), None),
        None => by_rate(pts.len(), rate),
    }
}

/// Fills in missing time stamps at the end, where the decoder had no packet left; `None` if others are missing.
fn filled_at_the_end(stamps: &[Option<i64>]) -> Option<Vec<i64>> {
    let mut filled: Vec<i64> = stamps.iter().map_while(|&stamp| stamp).collect();
    let missing = stamps.get(filled.len()..).unwrap_or_default();
    if missing.is_empty() {
        return Some(filled);
    }
    let (&first, &last) = (filled.first()?, filled.last()?);
    let step = last.saturating_sub(first) / (filled.len() as i64 - 1).max(1);
    if missing.iter().any(Option::is_some) || step == 0 {
        return None;
    }
    let further = (1..=missing.len() as i64).map(|at| last.saturating_add(step.saturating_mul(at)));
    filled.extend(further);
    Some(filled)
}

/// Where times go back, a joined recording begins: it is moved behind the one before.
fn in_one_run(mut times: Vec<i64>) -> Vec<i64> {
    let (mut begin, mut offset) = (0, 0_i64);
    for at in 1..times.len() {
        let moved = times[at].saturating_add(offset);
        if moved < times[at - 1] {
            let steps = (at - 1 - begin).max(1) as i64;
            let step = times[at - 1].saturating_sub(times[begin]) / steps;
            offset =
                offset.saturating_add(times[at - 1].saturating_add(step).saturating_sub(moved));
            begin = at;
        }
        times[at] = times[at].saturating_add(offset);
    }
    times
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
            contents: PacketContents::Picture,
            shown: true,
        }
    }

    fn ordered(stamps: &[Stamp]) -> PresentationOrder {
        PresentationOrder::from(stamps, Rational::new(1, 1000), Rational::new(25, 1))
    }

    fn times(ordered: &PresentationOrder) -> Vec<i64> {
        ordered.frames.iter().map(|frame| frame.t_us).collect()
    }

    #[test]
    fn frames_are_numbered_by_the_time_at_which_they_are_shown() {
        let found = ordered(&[0, 80, 40].map(|pts| stamp(Some(pts), None)));
        assert_eq!(found.number_of_packet, [Some(0), Some(2), Some(1)]);
        assert_eq!(times(&found), [0, 40_000, 80_000]);
        assert_eq!(found.stamps, [Some(0), Some(40), Some(80)]);
        assert_eq!(found.keys, [0, 1, 2]);
    }

    #[test]
    fn where_only_decoding_times_are_known_the_decoders_order_counts() {
        let found = ordered(&[0, 40, 80].map(|dts| stamp(None, Some(dts))));
        assert!(found.note.is_none());
        assert_eq!(times(&found), [0, 40_000, 80_000]);
    }

    #[test]
    fn without_any_time_the_stream_s_rate_is_assumed_and_told() {
        let found = ordered(&[stamp(None, None); 3]);
        assert_eq!(times(&found), [0, 40_000, 80_000]);
        assert!(found.note.unwrap().contains("25.00"));
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
    fn shared_time_stamps_are_told_and_only_a_decoder_can_tell_the_frames() {
        let stamps = [0, 40, 40].map(|pts| stamp(Some(pts), None));
        let found = ordered(&stamps);
        assert!(found.note.is_some() && needs_decoding(&stamps));
        assert_eq!(found.frames.len(), 3);
    }

    #[test]
    fn hidden_pictures_have_no_number() {
        let mut stamps = [0, 40, 41, 80].map(|pts| stamp(Some(pts), Some(pts)));
        stamps[2].contents = PacketContents::Hidden;
        assert!(!needs_decoding(&stamps));
        let found = ordered(&stamps);
        assert_eq!(times(&found), [0, 40_000, 80_000]);
        assert_eq!(found.number_of_packet, [Some(0), Some(1), None, Some(2)]);
    }

    #[test]
    fn what_a_decoder_has_to_tell_is_noticed() {
        let whole = [0, 80, 40].map(|pts| stamp(Some(pts), None));
        assert!(!needs_decoding(&whole));
        let mut begins_late = whole;
        begins_late[0].key = false;
        let mut field = whole;
        field[1].contents = PacketContents::Unclear;
        let mut without_time = whole;
        without_time[2].pts = None;
        let mut leading = whole;
        leading[2].pts = Some(-40);
        for stamps in [begins_late, field, without_time, leading] {
            assert!(needs_decoding(&stamps));
        }
    }

    #[test]
    fn joined_recordings_follow_each_other() {
        let both = [0, 80, 40, 160, 120, 200, 3, 83, 43];
        let dts = [0, 40, 80, 120, 160, 200, 0, 40, 80];
        let stamps = both
            .into_iter()
            .zip(dts)
            .map(|(pts, dts)| stamp(Some(pts), Some(dts)));
        let stamps: Vec<Stamp> = stamps.collect();
        assert!(needs_decoding(&stamps) && !needs_decoding(&stamps[..6]));
        let found = ordered(&stamps);
        assert_eq!(times(&found)[5..], [200_000, 240_000, 280_000, 320_000]);
        assert_eq!(found.number_of_packet[6..], [Some(6), Some(8), Some(7)]);
        assert!(found.note.is_some());
    }

    #[test]
    fn the_times_of_decoded_pictures_are_those_of_the_packets() {
        let stamps = [0, 40, 80].map(|dts| stamp(None, Some(dts)));
        let pictures = [(Some(40), false), (Some(0), false), (Some(90), true)];
        let base = (Rational::new(1, 1000), Rational::new(25, 1));
        let found = PresentationOrder::from_pictures(&pictures, &stamps, base.0, base.1);
        assert_eq!(times(&found), [0, 40_000, 80_000]);
        assert!(found.frames[2].damaged);
        let found = PresentationOrder::from_pictures(&pictures[..2], &stamps, base.0, base.1);
        assert_eq!(times(&found), [0, 40_000]);
        assert!(found.note.is_some());
        // Where some packets have time stamps, the decoder's count, and the last ones that it lacks follow.
        let stamps = [None, Some(40), None].map(|pts| stamp(pts, Some(0)));
        let pictures = [Some(40), Some(80), None].map(|stamp| (stamp, false));
        let found = PresentationOrder::from_pictures(&pictures, &stamps, base.0, base.1);
        assert_eq!(times(&found), [40_000, 80_000, 120_000]);
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
