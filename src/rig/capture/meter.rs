//! The exposure meter's mind: which exposure comes next, by what was seen of the turn so far.
//!
//! The table turns slowly while the meter begins at the brightest exposure. Every frame in which
//! more of the middle saturates than is allowed makes the exposure darker at once. A degree of the
//! turn counts as seen when a frame of it stayed within what is allowed; what is seen at one
//! exposure need not be looked at again at a darker one, since less light saturates less.
//! The meter is done when all 360 degrees have been seen, which takes one turn, and those parts
//! of a second one that went by while it was changing the exposure.
//!
//! What it guarantees: of every degree of the turn there was a frame that did not saturate more
//! than allowed, at the exposure found or a brighter one. The exposure is at most a step (a sixth
//! of a stop where little was too bright, a stop where much was) darker than it had to be, and never brighter than
//! where it began. Pure: no camera, no table, no clock.

use super::failure::MeterFault;

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
pub struct Exposures {
    /// The darkest, at least 1.
    pub darkest: i64,
    /// The brightest that a frame's time allows.
    pub brightest: i64,
    /// The distance between two.
    pub step: i64,
}

impl Exposures {
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

/// What is to be done after a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Advice {
    /// Look at more.
    GoOn,
    /// Set this exposure, and pass over frames taken before it has effect.
    Set(i64),
    /// This exposure it is.
    Done(i64),
}

/// Finds the exposure over a turn.
#[derive(Debug, Clone)]
pub struct Meter {
    exposures: Exposures,
    now: i64,
    allowed: f64,
    seen: [bool; DEGREES],
    left: usize,
}

impl Meter {
    /// Begins at the brightest exposure. `allowed`: the part of the pixels that may saturate, 0 to 1.
    #[must_use]
    pub fn new(exposures: Exposures, allowed: f64) -> Self {
        Self {
            exposures,
            now: exposures.brightest.max(exposures.darkest),
            allowed,
            seen: [false; DEGREES],
            left: DEGREES,
        }
    }

    /// The exposure to begin with, and the present one later.
    #[must_use]
    pub fn exposure(&self) -> i64 {
        self.now
    }

    /// Degrees of the turn that are still to be seen.
    #[must_use]
    pub fn left(&self) -> usize {
        self.left
    }

    /// Takes a frame that was exposed with the present exposure at `angle_deg`.
    ///
    /// # Errors
    /// [`MeterFault::TooBright`] where it clips at the darkest exposure.
    pub fn look(&mut self, angle_deg: f64, clipped: f64) -> Result<Advice, MeterFault> {
        let degree = (angle_deg.rem_euclid(360.0) as usize).min(DEGREES - 1);
        if clipped <= self.allowed {
            if !std::mem::replace(&mut self.seen[degree], true) {
                self.left -= 1;
            }
            return Ok(match self.left {
                0 => Advice::Done(self.now),
                _ => Advice::GoOn,
            });
        }
        // Seen within the limit a moment ago, and beyond it now: it has to be looked at again.
        if std::mem::replace(&mut self.seen[degree], false) {
            self.left += 1;
        }
        let much = clipped > MUCH * self.allowed;
        let factor = if much { COARSE } else { FINE };
        match self.exposures.darker(self.now, factor) {
            Some(next) => {
                self.now = next;
                Ok(Advice::Set(next))
            }
            None => Err(MeterFault::TooBright {
                exposure: self.now,
                clipped,
                allowed: self.allowed,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const WEBCAM: Exposures = Exposures {
        darkest: 3,
        brightest: 333,
        step: 1,
    };

    /// A turn on which the highlight at `angle` is `light(angle)` bright: what saturates grows
    /// with exposure times light beyond 1.
    fn clipped(light: f64, exposure: i64) -> f64 {
        (light * exposure as f64 - 1.0).clamp(0.0, 1.0)
    }

    /// Turns up to two turns with a frame every `pace` degrees; `late` frames have no say after
    /// a change.
    fn meter(light: impl Fn(f64) -> f64, pace: f64, late: u32) -> Result<(i64, f64), MeterFault> {
        let mut meter = Meter::new(WEBCAM, 0.005);
        let (mut angle, mut passed_over) = (0.0, 0);
        while angle < 720.0 {
            let clip = clipped(light(angle % 360.0), meter.exposure());
            if passed_over > 0 {
                passed_over -= 1;
            } else {
                match meter.look(angle, clip)? {
                    Advice::GoOn => {}
                    Advice::Set(_) => passed_over = late,
                    Advice::Done(exposure) => return Ok((exposure, angle)),
                }
            }
            angle += pace;
        }
        Err(MeterFault::Unseen {
            degrees: meter.left(),
        })
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
    fn light_that_clips_at_the_darkest_exposure_is_told() {
        let error = meter(|_| 1.0, 0.48, 6).unwrap_err();
        assert!(matches!(error, MeterFault::TooBright { exposure: 3, .. }));
    }

    #[test]
    fn a_camera_with_few_frames_does_not_see_every_degree_and_is_told_so() {
        assert!(matches!(
            meter(|_| 0.001, 7.0, 0),
            Err(MeterFault::Unseen { degrees: 1.. })
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
            let exposures = Exposures { darkest, brightest: darkest + steps * step, step };
            let mut meter = Meter::new(exposures, 0.005);
            loop {
                let now = meter.exposure();
                prop_assert_eq!((now - darkest) % step, 0);
                match meter.look(0.0, 1.0) {
                    Ok(Advice::Set(next)) => prop_assert!(next < now),
                    Ok(other) => prop_assert!(false, "{:?}", other),
                    Err(_) => break,
                }
            }
            prop_assert_eq!(meter.exposure(), darkest);
        }
    }
}
