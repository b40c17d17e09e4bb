//! The exposure search: which exposure to try next, by what was seen of the turn so far.
//!
//! The table turns slowly while the search begins at the brightest exposure. Every frame in which
//! more of the middle saturates than is allowed makes the exposure darker at once. A degree of the
//! turn counts as seen when a frame of it stayed within what is allowed. It need not be seen again
//! at a darker exposure, since less light saturates less. The search is done when all 360 degrees
//! have been seen: after one turn, and those parts of a second one that went by while the exposure
//! was changed.
//!
//! What it guarantees: of every degree of the turn there was a frame that did not saturate more
//! than allowed, at the exposure found or a brighter one. The exposure is at most one step darker
//! than it had to be (a sixth of a stop where little was too bright, a stop where much was), and
//! never brighter than where it began. Pure: no camera, no table, no clock.

use crate::capture::error::MeterFault;

/// Degrees of a turn, each seen or not.
const DEGREES: usize = 360;
/// How much darker a step is where little more saturates than is allowed: a sixth of a stop.
const FINE: f64 = 0.89;
/// The same where much saturates: a stop.
const COARSE: f64 = 0.5;
/// Many times the allowed part from which on a step is coarse.
const MUCH: f64 = 10.0;

/// The exposures that a camera can be set to, in the control's own units.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ExposureRange {
    /// The darkest, at least 1.
    pub(super) darkest: i64,
    /// The brightest that a frame's time allows.
    pub(super) brightest: i64,
    /// The distance between two.
    pub(super) step: i64,
}

impl ExposureRange {
    /// The exposure next to `factor` times `now`, at least a step darker.
    fn darker(&self, now: i64, factor: f64) -> Option<i64> {
        let step = self.step.max(1);
        let aimed = (now as f64 * factor) as i64;
        let steps = aimed.saturating_sub(self.darkest).max(0) / step;
        let on_step = self.darkest.saturating_add(steps.saturating_mul(step));
        let next = on_step.min(now.saturating_sub(step)).max(self.darkest);
        (next < now).then_some(next)
    }
}

/// What to do after a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Advice {
    /// More frames are needed.
    Continue,
    /// Set the search's exposure, and skip frames taken before it has effect.
    Set,
    /// The exposure is found.
    Done,
}

/// A search for the exposure over a turn.
#[derive(Debug, Clone)]
pub(super) struct ExposureSearch {
    range: ExposureRange,
    exposure: i64,
    allowed: f64,
    seen: [bool; DEGREES],
}

impl ExposureSearch {
    /// Begins at the brightest exposure. `allowed`: the part of the pixels that may saturate, 0 to
    /// 1.
    pub(super) fn new(range: ExposureRange, allowed: f64) -> Self {
        Self {
            range,
            exposure: range.brightest.max(range.darkest),
            allowed,
            seen: [false; DEGREES],
        }
    }

    /// The exposure to begin with, the present one later, and the one found at the end.
    pub(super) fn exposure(&self) -> i64 {
        self.exposure
    }

    /// Degrees of the turn that were not seen yet.
    pub(super) fn unseen(&self) -> usize {
        self.seen.iter().filter(|seen| !**seen).count()
    }

    /// Adds a frame at `angle_deg` that was exposed with the present exposure; `clipped`: the part
    /// of its pixels that saturates, 0 to 1.
    ///
    /// # Errors
    /// [`MeterFault::TooBright`] where it clips at the darkest exposure.
    pub(super) fn add(&mut self, angle_deg: f64, clipped: f64) -> Result<Advice, MeterFault> {
        let degree = (angle_deg.rem_euclid(360.0) as usize).min(DEGREES - 1);
        // Where it is above the limit, the degree has to be seen again.
        self.seen[degree] = clipped <= self.allowed;
        if self.seen[degree] {
            return Ok(match self.unseen() {
                0 => Advice::Done,
                _ => Advice::Continue,
            });
        }
        let much = clipped > MUCH * self.allowed;
        let factor = if much { COARSE } else { FINE };
        let darker = self.range.darker(self.exposure, factor);
        self.exposure = darker.ok_or(MeterFault::TooBright {
            exposure: self.exposure,
            clipped,
            allowed: self.allowed,
        })?;
        Ok(Advice::Set)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const WEBCAM: ExposureRange = ExposureRange {
        darkest: 3,
        brightest: 333,
        step: 1,
    };

    /// A turn on which the highlight at `angle` is `light(angle)` bright: what saturates grows
    /// with exposure times light beyond 1.
    fn clipped(light: f64, exposure: i64) -> f64 {
        (light * exposure as f64 - 1.0).clamp(0.0, 1.0)
    }

    /// Turns up to two turns with a frame every `pace` degrees; `late` frames are skipped after a
    /// change.
    fn meter(light: impl Fn(f64) -> f64, pace: f64, late: u32) -> Result<(i64, f64), MeterFault> {
        let mut search = ExposureSearch::new(WEBCAM, 0.005);
        let (mut angle, mut passed_over) = (0.0, 0);
        while angle < 720.0 {
            let clip = clipped(light(angle % 360.0), search.exposure());
            if passed_over > 0 {
                passed_over -= 1;
            } else {
                match search.add(angle, clip)? {
                    Advice::Continue => {}
                    Advice::Set => passed_over = late,
                    Advice::Done => return Ok((search.exposure(), angle)),
                }
            }
            angle += pace;
        }
        Err(MeterFault::Unseen(search.unseen()))
    }

    #[test]
    fn a_dark_turn_keeps_the_brightest_exposure_and_takes_one_turn() {
        let (exposure, angle) = meter(|_| 0.001, 0.48, 6).unwrap();
        assert_eq!(exposure, 333);
        assert!(angle < 361.0);
    }

    #[test]
    fn a_highlight_late_in_the_turn_darkens_it_and_only_its_part_is_seen_again() {
        let light = |angle: f64| {
            if (300.0..310.0).contains(&angle) {
                0.01
            } else {
                0.001
            }
        };
        let (exposure, angle) = meter(light, 0.48, 6).unwrap();
        assert!((50..=100).contains(&exposure), "{exposure}");
        assert!(angle < 672.0, "{angle}");
    }

    #[test]
    fn light_that_clips_at_the_darkest_exposure_is_reported() {
        let error = meter(|_| 1.0, 0.48, 6).unwrap_err();
        assert!(matches!(error, MeterFault::TooBright { exposure: 3, .. }));
    }

    #[test]
    fn a_camera_with_few_frames_does_not_see_every_degree_and_is_reported() {
        assert!(matches!(
            meter(|_| 0.001, 7.0, 0),
            Err(MeterFault::Unseen(1..))
        ));
    }

    proptest! {
        #[test]
        fn no_degree_saturates_more_than_allowed_at_the_exposure_found(
            highlights in proptest::collection::vec((0.0..360.0f64, 1.0..20.0f64, 0.001..0.2f64), 0..5),
            late in 0u32..8,
        ) {
            let light = |angle: f64| {
                let lit = highlights.iter().filter(|(at, wide, _)| (angle - at).abs() < *wide);
                lit.map(|&(_, _, light)| light).fold(0.001, f64::max)
            };
            if let Ok((exposure, _)) = meter(light, 0.48, late) {
                // The meter sees where its frames were: a degree may hold two kinds of light.
                for degree in 0..360 {
                    let places = [0.02, 0.25, 0.5, 0.75, 0.98].map(|part| f64::from(degree) + part);
                    let best = places.map(light).into_iter().fold(f64::INFINITY, f64::min);
                    prop_assert!(clipped(best, exposure) <= 0.005);
                }
                let brightest = (0..3600).map(|tenth| light(f64::from(tenth) / 10.0));
                let most = brightest.fold(0.0, f64::max);
                let needed = (1.0 / most).min(333.0);
                prop_assert!(exposure as f64 >= (needed * COARSE).floor() - 1.0);
            }
        }

        #[test]
        fn exposures_stay_on_the_cameras_steps(darkest in 1i64..50, steps in 0i64..400, step in 1i64..20) {
            let exposures = ExposureRange { darkest, brightest: darkest + steps * step, step };
            let mut search = ExposureSearch::new(exposures, 0.005);
            loop {
                let now = search.exposure();
                prop_assert_eq!((now - darkest) % step, 0);
                match search.add(0.0, 1.0) {
                    Ok(Advice::Set) => prop_assert!(search.exposure() < now),
                    Ok(other) => prop_assert!(false, "{:?}", other),
                    Err(_) => break,
                }
            }
            prop_assert_eq!(search.exposure(), darkest);
        }
    }
}
