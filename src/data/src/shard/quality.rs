//! The quality figures of a session summed, and what they mean for whoever uses it. Knows records only.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::record::FrameRecord;
use crate::counts::count_of;
use crate::statistics::upper_median;

/// Degrees of a whole turn.
const TURN_DEG: f64 = 360.0;
/// Up to this share of pictures that the camera repeated, or of blurred ones, a session is usable.
const USABLE_SHARE: f64 = 0.05;
/// Up to so many flawed samples, a session is usable, however few it has.
const FEW: f64 = 2.0;
/// Up to this share of samples at which the exposure steps, a session is usable.
const USABLE_STEPS: f64 = 0.01;
/// A session of fewer source frames is broken: batches of twelve neighbours show the light of a turn.
const MIN_SOURCE_FRAMES: u32 = 12;
/// An object whose mean is nowhere above this 8-bit value is black.
const BLACK: f64 = 4.0;
/// A frame with more than this part of the object saturated is overexposed.
const OVEREXPOSED: f64 = 0.5;

/// What a session is good for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum QualityVerdict {
    /// Nothing was found.
    Good,
    /// Something is missing or flagged, in few samples or without harm to the others.
    Usable,
    /// The recording is at fault in so many samples that it should be made again, or the mask is another object's.
    Broken,
}

impl QualityVerdict {
    /// All verdicts, from the best to the worst.
    pub const ALL: [Self; 3] = [Self::Good, Self::Usable, Self::Broken];

    /// The word in `dataset.json`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Usable => "usable",
            Self::Broken => "broken",
        }
    }
}

impl fmt::Display for QualityVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// How much a mask does not fit its recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MaskMisfit {
    /// A part of it is background, or a part of the object is not in it.
    InPart,
    /// It is that of another object or recording.
    AsAWhole,
}

/// The quality figures of a session, summed over its samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionQuality {
    /// What the session is good for.
    pub verdict: QualityVerdict,
    /// Why it is not good, one phrase each; none if it is.
    pub reasons: Vec<String>,
    /// Mean of `saturated_fraction`, 0..=1.
    pub saturated_mean: f64,
    /// Median of `sharpness`.
    pub sharpness_median: f64,
    /// Root of the mean square of the shifts, source pixels; `None` if none was measured.
    pub shift_rms_px: Option<f64>,
    /// Largest shift, source pixels; `None` if none was measured.
    pub shift_max_px: Option<f64>,
    /// Samples with `shift_applied`.
    pub moved: u32,
    /// Samples whose frame could not be registered.
    pub unregistered: u32,
    /// Samples whose shift comes from the frames around.
    #[serde(default, skip_serializing_if = "is_none")]
    pub interpolated: u32,
    /// How much the mask does not fit the recording, by a look at a few frames; `None` if it fits or nothing is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mask_misfit: Option<MaskMisfit>,
    /// Samples with an `exposure_step`.
    pub exposure_steps: u32,
    /// Samples with `identical_to`: the camera delivered the picture twice.
    pub identical: u32,
    /// Samples with `blur`.
    pub blurred: u32,
}

impl SessionQuality {
    /// The figures of a session with these records. `lossy`: something was lost. It may cover
    /// only a part of the turn (`covered_deg`).
    pub fn from_records(records: &[FrameRecord], lossy: bool, covered_deg: Option<f64>) -> Self {
        let shifts = || {
            let measured = records.iter().filter_map(|record| record.shift_px);
            measured.map(|[dx, dy]| dx.hypot(dy))
        };
        let squares = mean(shifts().map(|shift| shift * shift));
        let mut quality = Self {
            verdict: QualityVerdict::Good,
            reasons: Vec::new(),
            saturated_mean: rounded(
                mean(records.iter().map(|r| r.saturated_fraction)).unwrap_or_default(),
                1e6,
            ),
            sharpness_median: rounded(
                upper_median(records.iter().map(|r| r.sharpness)).unwrap_or_default(),
                1e3,
            ),
            shift_rms_px: squares.map(|square| rounded(square.sqrt(), 1e3)),
            shift_max_px: shifts().reduce(f64::max).map(|most| rounded(most, 1e3)),
            moved: count(records, |r| r.shift_applied),
            unregistered: count(records, |r| {
                r.align_confidence.is_some() && r.shift_px.is_none()
            }),
            interpolated: count(records, |r| r.shift_interpolated_sd_px.is_some()),
            mask_misfit: None,
            exposure_steps: count(records, |r| r.exposure_step.is_some()),
            identical: count(records, |r| r.identical_to.is_some()),
            blurred: count(records, |r| r.blur.is_some()),
        };
        quality.judge(records, lossy, covered_deg);
        quality
    }

    /// With what is known of the mask, which lowers the verdict.
    #[must_use]
    pub fn with_mask(mut self, misfit: Option<MaskMisfit>) -> Self {
        self.mask_misfit = misfit;
        match misfit {
            None => {}
            Some(MaskMisfit::InPart) => {
                self.add(QualityVerdict::Usable, "the mask does not fit everywhere");
            }
            Some(MaskMisfit::AsAWhole) => {
                self.add(QualityVerdict::Broken, "the mask is not that of the object");
            }
        }
        self
    }

    fn judge(&mut self, records: &[FrameRecord], lossy: bool, covered_deg: Option<f64>) {
        if records
            .iter()
            .all(|r| r.mean_rgb.iter().all(|&value| value <= BLACK))
        {
            self.add(QualityVerdict::Broken, "the object is black in every frame");
        }
        let over = count(records, |r| r.saturated_fraction > OVEREXPOSED);
        if 2 * over as usize > records.len() {
            let samples = count_of(u64::from(over), "sample");
            let reason = format!("more than half of the object is saturated in {samples}");
            self.add(QualityVerdict::Broken, &reason);
        }
        let repeated = count(records, |r| r.duplicate);
        let own = records.len() as u32 - repeated;
        if repeated > 0 && own < MIN_SOURCE_FRAMES {
            let reason = format!("it has only {}", count_of(u64::from(own), "source frame"));
            self.add(QualityVerdict::Broken, &reason);
        }
        let share = |limit: f64| limit * records.len() as f64;
        let flaws = [
            (
                self.exposure_steps,
                share(USABLE_STEPS),
                "the exposure steps",
            ),
            (
                self.identical,
                share(USABLE_SHARE),
                "the camera repeated a picture",
            ),
            (self.blurred, share(USABLE_SHARE), "the picture is blurred"),
            (
                self.unregistered,
                f64::INFINITY,
                "the shift could not be measured",
            ),
            (
                self.interpolated,
                f64::INFINITY,
                "the shift comes from the frames around",
            ),
            (repeated, f64::INFINITY, "a source frame is used again"),
        ];
        for (samples, most, what) in flaws {
            if samples > 0 {
                let few = f64::from(samples) <= most.max(FEW);
                let verdict = if few {
                    QualityVerdict::Usable
                } else {
                    QualityVerdict::Broken
                };
                let samples = count_of(u64::from(samples), "sample");
                self.add(verdict, &format!("{what} in {samples}"));
            }
        }
        match covered_deg {
            Some(degrees) => {
                let part = format!("it covers {degrees:.1} of {TURN_DEG} degrees");
                self.add(QualityVerdict::Usable, &part);
            }
            None if lossy => self.add(QualityVerdict::Usable, "something of the recording is lost"),
            None => {}
        }
    }

    fn add(&mut self, verdict: QualityVerdict, reason: &str) {
        self.verdict = self.verdict.max(verdict);
        self.reasons.push(reason.to_owned());
    }
}

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde passes a reference"
)]
fn is_none(samples: &u32) -> bool {
    *samples == 0
}

fn count(records: &[FrameRecord], is: impl Fn(&FrameRecord) -> bool) -> u32 {
    records.iter().filter(|record| is(record)).count() as u32
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, number) = values.fold((0.0, 0_u32), |(sum, n), value| (sum + value, n + 1));
    (number > 0).then(|| sum / f64::from(number))
}

/// To a `steps`th.
fn rounded(value: f64, steps: f64) -> f64 {
    (value * steps).round() / steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shard::record::record;

    fn turn(samples: u32) -> Vec<FrameRecord> {
        (0..samples).map(record).collect()
    }

    #[test]
    fn a_turn_of_which_nothing_is_to_say_is_good() {
        let mut records = turn(100);
        records[7].shift_px = Some([0.3, -0.4]);
        let quality = SessionQuality::from_records(&records, false, None);
        assert_eq!(quality.verdict, QualityVerdict::Good);
        assert!(quality.reasons.is_empty());
        assert_eq!(quality.shift_max_px, Some(0.5));
        assert_eq!(quality.shift_rms_px, Some(0.5));
    }

    #[test]
    fn a_mask_that_does_not_fit_lowers_the_verdict() {
        let of = |misfit| SessionQuality::from_records(&turn(100), false, None).with_mask(misfit);
        assert_eq!(of(None).verdict, QualityVerdict::Good);
        let partly = of(Some(MaskMisfit::InPart));
        assert_eq!(partly.verdict, QualityVerdict::Usable);
        let other = of(Some(MaskMisfit::AsAWhole));
        assert_eq!(other.verdict, QualityVerdict::Broken);
        assert_eq!(
            (other.reasons.len(), other.mask_misfit),
            (1, Some(MaskMisfit::AsAWhole))
        );
    }

    #[test]
    fn interpolated_shifts_are_counted_and_leave_a_session_usable() {
        let mut records = turn(100);
        records[3].shift_px = Some([0.1, 0.2]);
        records[3].shift_interpolated_sd_px = Some(0.3);
        let quality = SessionQuality::from_records(&records, false, None);
        assert_eq!(
            (quality.verdict, quality.interpolated),
            (QualityVerdict::Usable, 1)
        );
        let json =
            serde_json::to_string(&SessionQuality::from_records(&turn(3), false, None)).unwrap();
        assert!(
            !json.contains("interpolated") && !json.contains("misfit"),
            "{json}"
        );
    }

    #[test]
    fn few_flaws_leave_a_session_usable_and_many_break_it() {
        let set: [fn(&mut FrameRecord); 3] = [
            |r| r.exposure_step = Some(0.5),
            |r| r.identical_to = Some(0),
            |r| r.blur = Some(1.0),
        ];
        for (set, most) in set.into_iter().zip([3, 15, 15]) {
            for (samples, verdict) in [
                (most, QualityVerdict::Usable),
                (most + 1, QualityVerdict::Broken),
            ] {
                let mut records = turn(300);
                records.iter_mut().take(samples).for_each(set);
                let quality = SessionQuality::from_records(&records, false, None);
                assert_eq!(quality.verdict, verdict, "{:?}", quality.reasons);
                assert_eq!(quality.reasons.len(), 1);
            }
        }
    }

    #[test]
    fn two_flaws_break_no_session_however_short() {
        let mut records = turn(3);
        records[0].exposure_step = Some(0.5);
        records[1].blur = Some(1.0);
        let quality = SessionQuality::from_records(&records, false, None);
        assert_eq!(quality.verdict, QualityVerdict::Usable);
    }

    #[test]
    fn repeated_frames_losses_and_part_of_a_turn_leave_a_session_usable() {
        let mut records = turn(30);
        let repeat = |r: &mut FrameRecord| r.duplicate = true;
        records.iter_mut().take(10).for_each(repeat);
        for (lossy, covered, count, named) in [
            (false, None, 1, "10 samples"),
            (true, None, 2, "10 samples"),
            (true, Some(120.5), 2, "120.5"),
        ] {
            let quality = SessionQuality::from_records(&records, lossy, covered);
            assert_eq!(quality.verdict, QualityVerdict::Usable);
            assert_eq!(quality.reasons.len(), count, "{:?}", quality.reasons);
            assert!(quality.reasons.iter().any(|reason| reason.contains(named)));
        }
    }

    #[test]
    fn a_turn_of_a_few_source_frames_is_broken() {
        for (own, verdict) in [(12, QualityVerdict::Usable), (11, QualityVerdict::Broken)] {
            let mut records = turn(100);
            records
                .iter_mut()
                .skip(own)
                .for_each(|r| r.duplicate = true);
            let quality = SessionQuality::from_records(&records, false, None);
            assert_eq!(quality.verdict, verdict, "{:?}", quality.reasons);
        }
        let short = SessionQuality::from_records(&turn(8), false, None);
        assert_eq!(short.verdict, QualityVerdict::Good);
    }

    #[test]
    fn a_black_object_and_an_overexposed_one_are_broken() {
        for (mean, saturated) in [(3.0, 0.0), (250.0, 0.6)] {
            let mut records = turn(10);
            for record in &mut records {
                record.mean_rgb = [mean; 3];
                record.saturated_fraction = saturated;
            }
            let quality = SessionQuality::from_records(&records, false, None);
            assert_eq!(quality.verdict, QualityVerdict::Broken);
        }
    }
}
