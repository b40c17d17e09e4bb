//! What the records of a turn show of the camera and its stand: pictures that were delivered twice, steps of
//! the exposure, and blurred frames.

use std::collections::HashMap;

use relit_data::counts::count_of;
use relit_data::session::Notice;
use relit_data::shard::{Digest, FrameRecord};
use relit_data::srgb::to_linear;
use relit_data::statistics::upper_median;

use super::blur::blurs;

/// Samples on each side with which a step is compared.
const AROUND: usize = 12;
/// A step is at least this large, stops.
const MIN_STEP: f64 = 0.1;
/// And so many times the median change around it, which is the light's.
const BEYOND_LIGHT: f64 = 6.0;
/// Linear light, of all channels together, below which nothing is compared: steps of 8 bits are large there.
const DARKEST: f64 = 1e-3;

/// What only the whole turn shows of a sample: fields of its record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TurnFinding {
    pub(super) index: u32,
    pub(super) exposure_step: Option<f64>,
    pub(super) identical_to: Option<u64>,
    pub(super) blur: Option<f64>,
}

/// The samples with something to report; `samples` are sorted by index, each with the digest of its
/// image. A whole turn would have `whole_turn` of them.
pub(super) fn findings(samples: &[(&FrameRecord, Digest)], whole_turn: u32) -> Vec<TurnFinding> {
    // Several samples of one source frame are one picture, in which nothing changes.
    let frames = samples.iter().map(|&(record, _)| record);
    let frames: Vec<&FrameRecord> = frames.filter(|record| !record.duplicate).collect();
    let distinct = frames.len() * whole_turn as usize / samples.len().max(1);
    let steps = exposure_steps(&frames);
    let blurs = blurs(&frames, distinct);
    let of_frame = |values: Vec<Option<f64>>| -> HashMap<u64, f64> {
        let numbers = frames.iter().map(|record| record.source_frame);
        let found = numbers.zip(values);
        found
            .filter_map(|(number, value)| Some((number, value?)))
            .collect()
    };
    let (steps, blurs) = (of_frame(steps), of_frame(blurs));
    let all = samples.iter().zip(identical(samples));
    let findings = all.map(|(&(record, _), identical_to)| TurnFinding {
        index: record.index,
        exposure_step: steps
            .get(&record.source_frame)
            .copied()
            .filter(|_| !record.duplicate),
        identical_to,
        blur: blurs.get(&record.source_frame).copied(),
    });
    let says =
        |f: &TurnFinding| f.exposure_step.is_some() || f.identical_to.is_some() || f.blur.is_some();
    findings.filter(says).collect()
}

/// What a user should know of them.
pub(super) fn notices(findings: &[TurnFinding]) -> Vec<Notice> {
    let mut notices = Vec::new();
    let twins = || findings.iter().filter(|f| f.identical_to.is_some());
    if let Some(first) = twins().next() {
        let (count, index) = (twins().count(), first.index);
        notices.push(Notice::Warning(format!(
            "{} {} the same picture as an earlier frame, pixel for pixel, the first is sample {index}: the camera repeats frames",
            count_of(count as u64, "sample"),
            if count == 1 { "shows" } else { "show" },
        )));
    }
    let steps = || {
        findings
            .iter()
            .filter_map(|f| Some((f.index, f.exposure_step?)))
    };
    if let Some((index, step)) = steps().next() {
        let count = steps().count();
        notices.push(Notice::Warning(format!(
            "the exposure jumps at {}, the first is sample {index} ({step:+.2} stops): switch the camera's automatic exposure and gain off",
            count_of(count as u64, "sample"),
        )));
    }
    let blurred = || findings.iter().filter_map(|f| Some((f.index, f.blur?)));
    if let Some((index, _)) = blurred().next() {
        let count = blurred().count();
        notices.push(Notice::Warning(format!(
            "{} {} blurred, the first is sample {index}: check that nothing shakes camera or table",
            count_of(count as u64, "sample"),
            if count == 1 { "is" } else { "are" },
        )));
    }
    notices
}

/// The nearest earlier source frame with the same picture, for each sample.
fn identical(samples: &[(&FrameRecord, Digest)]) -> Vec<Option<u64>> {
    // A picture is the same if its image and its exact figures, taken on source pixels, are.
    let mut seen = HashMap::new();
    let same = |&(record, image): &(&FrameRecord, Digest)| {
        let [red, green, blue] = record.mean_rgb.map(f64::to_bits);
        let figures = (red, green, blue, record.sharpness.to_bits());
        let earlier = seen.insert((image, figures), record.source_frame);
        earlier.filter(|&frame| frame != record.source_frame && !record.duplicate)
    };
    samples.iter().map(same).collect()
}

/// The change against the frame before, where it is a step, for each frame.
fn exposure_steps(frames: &[&FrameRecord]) -> Vec<Option<f64>> {
    let brightness = |record: &&FrameRecord| {
        let light: f64 = record
            .mean_rgb
            .iter()
            .map(|&mean| to_linear(mean / 255.0))
            .sum();
        light.max(DARKEST).log2()
    };
    let levels: Vec<f64> = frames.iter().map(brightness).collect();
    let changes: Vec<f64> = std::iter::once(0.0)
        .chain(levels.windows(2).map(|pair| pair[1] - pair[0]))
        .collect();
    let step = |(at, &change): (usize, &f64)| {
        let around = at.saturating_sub(AROUND)..(at + AROUND + 1).min(changes.len());
        let middle = upper_median(changes.get(around)?.iter().map(|c| c.abs()))?;
        let is_step = change.abs() > MIN_STEP.max(BEYOND_LIGHT * middle);
        is_step.then_some((1000.0 * change).round() / 1000.0)
    };
    changes.iter().enumerate().map(step).collect()
}

#[cfg(test)]
pub(super) use tests::record;

#[cfg(test)]
mod tests {
    use super::*;
    use relit_data::geometry::Rect;
    use relit_data::image_stats::Measures;
    use relit_data::spec_net_gate::SPEC_NET_GATE;

    /// A sample whose brightness is `level`, of its own picture.
    pub(in super::super) fn record(index: u32, level: f64) -> FrameRecord {
        let measures = Measures {
            mask_px: 1,
            saturated_px: 0,
            saturated_any_px: 0,
            mean_rgb: [level; 3],
            sharpness: 1.0,
        };
        let pixel = Rect::new(0, 0, 1, 1);
        FrameRecord::new("s", "o", index, pixel, &measures, SPEC_NET_GATE)
    }

    fn found(levels: impl Iterator<Item = f64>) -> Vec<TurnFinding> {
        let records: Vec<FrameRecord> = (0..).zip(levels).map(|(n, l)| record(n, l)).collect();
        let digest = |record: &FrameRecord| Digest::hash(&record.index.to_le_bytes());
        let samples: Vec<_> = records.iter().map(|r| (r, digest(r))).collect();
        findings(&samples, samples.len() as u32)
    }

    #[test]
    fn a_step_of_the_exposure_is_found_and_a_light_that_moves_is_not() {
        let light = |n: i32| 100.0 + 40.0 * (f64::from(n) * 0.2).sin();
        assert!(found((0..60).map(light)).is_empty());
        let stepped = |n: i32| light(n) * if n >= 30 { 1.4 } else { 1.0 };
        let findings = found((0..60).map(stepped));
        assert_eq!(findings.len(), 1, "{findings:?}");
        assert_eq!(findings[0].index, 30);
        assert!(notices(&findings)[0].text().contains("sample 30"));
    }

    #[test]
    fn a_step_is_told_in_stops_of_light() {
        let shown = |light: f64| 255.0 * relit_data::srgb::from_linear(light);
        let findings = found((0..60).map(|n| shown(if n >= 30 { 0.1 } else { 0.2 })));
        assert_eq!(findings.len(), 1, "{findings:?}");
        assert_eq!(findings[0].exposure_step, Some(-1.0));
    }

    #[test]
    fn a_picture_that_was_delivered_twice_is_found_and_a_duplicate_sample_is_not() {
        let mut records: Vec<FrameRecord> = (0..4).map(|n| record(n, 9.0)).collect();
        records[3].duplicate = true;
        let image = |n: usize| Digest::hash(&[[0, 1, 1, 1][n]]);
        let samples: Vec<_> = records
            .iter()
            .enumerate()
            .map(|(n, r)| (r, image(n)))
            .collect();
        let findings = findings(&samples, 4);
        assert_eq!(findings.len(), 1, "{findings:?}");
        assert_eq!((findings[0].index, findings[0].identical_to), (2, Some(1)));
    }

    #[test]
    fn a_frame_in_several_samples_is_one_picture() {
        // Six degrees apart, each frame in five samples.
        let records: Vec<FrameRecord> = (0..300)
            .map(|n| {
                let light = 100.0 + 40.0 * (f64::from(n / 5) * 0.2).sin();
                let mut record = record(n, light);
                record.sharpness = light * light;
                record.source_frame = u64::from(n / 5);
                record.duplicate = n % 5 != 2;
                record
            })
            .collect();
        let digest = |record: &FrameRecord| Digest::hash(&record.source_frame.to_le_bytes());
        let samples: Vec<_> = records.iter().map(|r| (r, digest(r))).collect();
        assert_eq!(findings(&samples, 300), []);
    }
}
