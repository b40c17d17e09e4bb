//! Frames that are blurred, by vibration or a push: less sharp than the frames around them, in a way that
//! moving light cannot explain.
//!
//! Light changes the variance of the Laplacian as much as a blur does, but not from one frame to the next and
//! back: the table turns by a quarter of a degree between two frames. And where a lamp flickers, the
//! brightness changes with it. So a frame is blurred if its sharpness is below that of the sharp frames before
//! it and of those after it, both as measured and relative to the squared brightness, by more than
//! [`MIN_DROP`] and more than the turn's usual change from frame to frame.

use std::collections::VecDeque;

use relit_data::shard::FrameRecord;
use relit_data::statistics::upper_median;

/// Fewest frames of a whole turn with which blur is measured: between fewer, the light moves too far.
const MIN_FRAMES: usize = 300;
/// Sharp frames on each side with which a frame is compared.
const AROUND: usize = 12;
/// Fewest of them.
const MIN_AROUND: usize = 4;
/// A blur is at least such a drop of the sharpness, base-2 logarithm.
const MIN_DROP: f64 = 0.45;
/// And so many times the usual change from frame to frame.
const BEYOND_USUAL: f64 = 6.0;
/// Longest blur, as a part of the turn: what lasts longer may be the light.
const MAX_PART: usize = 30;

/// How much less sharp than its surroundings a frame is, where it is blurred, base-2 logarithm to a
/// thousandth. `frames` are the turn's frames in order, each once; a whole turn would have `whole_turn` of them.
pub(super) fn blurs(frames: &[&FrameRecord], whole_turn: usize) -> Vec<Option<f64>> {
    let levels: Vec<Level> = frames
        .iter()
        .map(|record| Level::from_record(record))
        .collect();
    if whole_turn < MIN_FRAMES {
        return vec![None; frames.len()];
    }
    let changes = levels
        .windows(2)
        .map(|pair| (pair[1].raw - pair[0].raw).abs());
    let usual = upper_median(changes).unwrap_or_default();
    let limit = MIN_DROP.max(BEYOND_USUAL * usual);
    let longest = (whole_turn / MAX_PART).max(1);
    let before = drops(levels.iter(), limit, longest);
    let mut after = drops(levels.iter().rev(), limit, longest);
    after.reverse();
    let both = before.into_iter().zip(after);
    let least = |(before, after): (Option<f64>, Option<f64>)| Some(before?.min(after?));
    both.map(|pair| least(pair).filter(|&drop| drop > limit))
        .map(|drop| drop.map(|drop| (1000.0 * drop).round() / 1000.0))
        .collect()
}

/// A frame's sharpness, base-2 logarithm: as measured, and relative to the squared brightness.
#[derive(Clone, Copy)]
struct Level {
    raw: f64,
    relative: f64,
}

impl Level {
    fn from_record(record: &FrameRecord) -> Self {
        let [red, green, blue] = record.mean_rgb;
        let luma = 0.299 * red + 0.587 * green + 0.114 * blue;
        let raw = record.sharpness.max(1e-9).log2();
        Self {
            raw,
            relative: raw - 2.0 * luma.max(1.0).log2(),
        }
    }

    /// How far it is below the median of others, by the smaller of the two measures.
    fn below(self, others: &VecDeque<Self>) -> Option<f64> {
        let others = Some(others).filter(|others| others.len() >= MIN_AROUND)?;
        let raw = upper_median(others.iter().map(|level| level.raw))? - self.raw;
        let relative = upper_median(others.iter().map(|level| level.relative))?;
        Some(raw.min(relative - self.relative))
    }
}

/// Each frame's drop against the sharp frames before it; `None` if there are too few of them, and if the
/// drop lasts for more than `longest` frames.
fn drops<'a>(
    levels: impl Iterator<Item = &'a Level>,
    limit: f64,
    longest: usize,
) -> Vec<Option<f64>> {
    let mut sharp: VecDeque<Level> = VecDeque::with_capacity(AROUND + 1);
    let mut lasts = 0;
    let mut drops = Vec::new();
    for &level in levels {
        let drop = level.below(&sharp);
        drops.push(drop);
        if drop.is_some_and(|drop| drop > limit) {
            lasts += 1;
            if lasts <= longest {
                continue;
            }
            // This is how the turn goes on, so it is what further frames are compared with.
            let first = drops.len() - lasts;
            drops.iter_mut().skip(first).for_each(|drop| *drop = None);
            sharp.clear();
        }
        lasts = 0;
        sharp.push_back(level);
        if sharp.len() > AROUND {
            sharp.pop_front();
        }
    }
    drops
}

#[cfg(test)]
mod tests {
    use super::super::quality::record;
    use super::*;

    /// The samples found to be blurred in a turn of 600 frames, whose sharpness and brightness are given
    /// as factors of those of a light that moves.
    fn found(change: impl Fn(u32) -> (f64, f64)) -> Vec<u32> {
        let records: Vec<FrameRecord> = (0..600)
            .map(|n| {
                let angle = f64::from(n) * 0.01;
                let (sharper, brighter) = change(n);
                let mut record = record(n, (90.0 + 30.0 * angle.sin()) * brighter);
                // Grain of the sensor and the encoder.
                let grain = 1.0 + 0.02 * (f64::from(n * 7919 % 13) - 6.0) / 13.0;
                record.sharpness = (80.0 + 60.0 * (3.0 * angle).cos()) * grain * sharper;
                record
            })
            .collect();
        let frames: Vec<&FrameRecord> = records.iter().collect();
        let blurs = blurs(&frames, frames.len());
        (0..)
            .zip(blurs)
            .filter_map(|(n, blur)| blur.map(|_| n))
            .collect()
    }

    #[test]
    fn frames_blurred_by_a_jolt_or_a_short_vibration_are_found_and_no_others() {
        assert!(found(|_| (1.0, 1.0)).is_empty());
        assert_eq!(found(|n| (if n == 99 { 0.6 } else { 1.0 }, 1.0)), [99]);
        let shaken = |n| (300..318).contains(&n);
        let blurred = |n| {
            if shaken(n) {
                0.4 + 0.01 * f64::from(n % 5)
            } else {
                1.0
            }
        };
        assert_eq!(found(|n| (blurred(n), 1.0)), (300..318).collect::<Vec<_>>());
    }

    #[test]
    fn light_that_flickers_flashes_or_steps_is_no_blur() {
        // A lamp's flicker takes sharpness and brightness together, as squares.
        let flicker = |n: u32| if n % 50 < 3 { 0.6 } else { 1.0 };
        assert!(found(|n| (flicker(n) * flicker(n), flicker(n))).is_empty());
        // A flash on a smooth part makes the object brighter and not sharper.
        assert!(found(|n| (1.0, if n % 70 == 9 { 1.5 } else { 1.0 })).is_empty());
        // A shadow's edge passes: sharpness stays down for a large part of the turn.
        assert!(found(|n| (if (200..260).contains(&n) { 0.5 } else { 1.0 }, 1.0)).is_empty());
    }

    #[test]
    fn few_frames_of_a_turn_are_not_judged() {
        let mut records: Vec<FrameRecord> = (0..100).map(|n| record(n, 90.0)).collect();
        records[50].sharpness = 0.1;
        let frames: Vec<&FrameRecord> = records.iter().collect();
        assert!(blurs(&frames, 100).iter().all(Option::is_none));
        assert!(blurs(&frames, 1500)[50].is_some());
    }
}
