//! The plan of a turn: where it starts, where its speed is constant, where it ends.
//!
//! ```text
//!        back            start                                        end
//!         |--ramp--|margin|------------ turn_deg ------------|margin|--ramp--|
//!                  |------------- constant speed -------------------|
//! ```
//!
//! A ramp from rest to the speed v at the acceleration a has the length v^2 / 2a. The plan chooses
//! a direction in which the whole turn lies inside the limits.

use super::error::TurntableError;
use super::identity::Identity;
use super::status::TableStatus;

/// Degrees added to a ramp for the rounding of its steps.
const RAMP_SLACK_DEG: f64 = 0.1;
/// Rounding error of a printed target, degrees.
const PRINTED_DEG: f64 = 0.001;

/// Degrees at constant speed on either side of a turn.
pub const MARGIN_DEG: f64 = 2.0;

/// A turn that stays inside the limits, after which the table turns back, so that the cable does not wind up.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnPlan {
    /// Speed, degrees a second.
    pub degrees_per_second: f64,
    /// How far the table turns at constant speed, margins included, degrees.
    pub(super) constant_deg: f64,
    ramp_deg: f64,
    /// 1 if angles grow, -1 if they shrink.
    pub(super) sign: f64,
    /// The angle from which it was planned.
    pub(super) start_deg: f64,
}

impl TurnPlan {
    /// Plans a turn of `turn_deg` degrees at constant speed from where the table stands: onwards if that fits, else
    /// back.
    ///
    /// # Errors
    /// [`TurntableError::NoRoom`], or [`TurntableError::OutOfRange`] for a speed or angle that the
    /// table cannot follow.
    pub fn new(
        identity: &Identity,
        status: &TableStatus,
        degrees_per_second: f64,
        turn_deg: f64,
    ) -> Result<TurnPlan, TurntableError> {
        identity.check_speed(degrees_per_second)?;
        if !(turn_deg.is_finite() && turn_deg > 0.0) {
            return Err(TurntableError::OutOfRange {
                what: "the turn in degrees",
                value: turn_deg,
                range: "it has to be above 0".to_owned(),
            });
        }
        let plan = |sign| TurnPlan {
            degrees_per_second,
            constant_deg: turn_deg + 2.0 * MARGIN_DEG,
            ramp_deg: degrees_per_second * degrees_per_second / (2.0 * identity.acceleration)
                + RAMP_SLACK_DEG,
            sign,
            start_deg: status.angle_deg,
        };
        let limits = identity.limits_from(status);
        let plans = [plan(1.0), plan(-1.0)];
        let chosen = plans.iter().find(|plan| plan.fits(limits)).cloned();
        chosen.ok_or_else(|| plans[0].no_room(limits))
    }

    fn fits(&self, (low, high): (f64, f64)) -> bool {
        let (a, b) = (self.back_deg(), self.end_deg());
        a.min(b) >= low + PRINTED_DEG && a.max(b) <= high - PRINTED_DEG
    }

    /// Why this turn in the positive direction has no room, and where there is some.
    fn no_room(&self, (low_deg, high_deg): (f64, f64)) -> TurntableError {
        let back_deg = self.start_deg - self.back_deg();
        let forward_deg = self.end_deg() - self.start_deg;
        let (from, to) = (low_deg + back_deg, high_deg - forward_deg);
        let way_out = if from <= to {
            format!("jog to a place between {from:.3} and {to:.3} first")
        } else {
            "no place has room for it: raise the limit ($130) if the cable allows it".to_owned()
        };
        TurntableError::NoRoom {
            from_deg: self.start_deg,
            forward_deg,
            back_deg,
            low_deg,
            high_deg,
            way_out,
        }
    }

    /// Where it moves first: back by ramp and margin.
    pub fn back_deg(&self) -> f64 {
        self.start_deg - self.sign * (self.ramp_deg + MARGIN_DEG)
    }

    /// Where its speed becomes constant.
    pub fn constant_from_deg(&self) -> f64 {
        self.start_deg - self.sign * MARGIN_DEG
    }

    /// Where it starts to decelerate.
    pub fn constant_to_deg(&self) -> f64 {
        self.constant_from_deg() + self.sign * self.constant_deg
    }

    /// Where it comes to rest.
    pub fn end_deg(&self) -> f64 {
        self.constant_to_deg() + self.sign * self.ramp_deg
    }
}

impl Identity {
    /// The limits as angles, for a table whose angle and machine position are known: those of the
    /// controller, and the same distance in either direction from the angle 0, where the cable hangs
    /// free.
    pub(super) fn limits_from(&self, status: &TableStatus) -> (f64, f64) {
        let zero = status.machine_deg - status.angle_deg;
        let (low, high) = self.limits;
        let reach = high.max(-low);
        let low = (low - zero).max(-reach);
        let high = (high - zero).min(reach);
        (low, high)
    }

    /// Checks that the table can follow a speed.
    pub(super) fn check_speed(&self, degrees_per_second: f64) -> Result<(), TurntableError> {
        let fastest = self.max_degrees_per_second;
        if degrees_per_second > 0.0 && degrees_per_second <= fastest * (1.0 + 1e-9) {
            return Ok(());
        }
        Err(TurntableError::OutOfRange {
            what: "the speed in degrees/s",
            value: degrees_per_second,
            range: format!("it has to be above 0 and at most {fastest:.3} (setting $110)"),
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use relit_test_support::is_named;

    use super::super::protocol::ControllerState;
    use super::*;
    use crate::family::Family;

    fn identity(low_deg: f64, high_deg: f64) -> Identity {
        Identity {
            family: Family::Rig,
            firmware: String::new(),
            extras: false,
            steps_per_degree: 88.889,
            max_degrees_per_second: 36.0,
            acceleration: 36.0,
            limits: (low_deg, high_deg),
            homing: false,
            lease_s: None,
        }
    }

    fn status(angle_deg: f64, machine_deg: f64) -> TableStatus {
        TableStatus {
            restarted: false,
            state: ControllerState::Idle,
            angle_deg,
            machine_deg,
            degrees_per_second: 0.0,
            battery_v: None,
            index: false,
            emergency_stop: false,
            homed: true,
            alarm: None,
        }
    }

    fn plan(angle_deg: f64) -> Result<TurnPlan, TurntableError> {
        let here = status(angle_deg, angle_deg);
        TurnPlan::new(&identity(-400.0, 400.0), &here, 7.2, 360.0)
    }

    #[test]
    fn a_turn_from_zero_has_its_ramps_outside_the_constant_part() {
        let plan = plan(0.0).unwrap();
        // 7.2^2 / (2 * 36) = 0.72 degrees of ramp.
        assert!((plan.back_deg() + 2.0 + 0.72 + RAMP_SLACK_DEG).abs() < 1e-9);
        assert_eq!(plan.constant_from_deg(), -2.0);
        assert_eq!(plan.constant_to_deg(), 362.0);
        assert!((plan.end_deg() - 362.0 - 0.72 - RAMP_SLACK_DEG).abs() < 1e-9);
    }

    #[test]
    fn a_table_that_is_wound_up_turns_the_other_way() {
        let plan = plan(200.0).unwrap();
        assert!(plan.end_deg() > -163.0 && plan.end_deg() < plan.back_deg());
        assert!(plan.back_deg() > 200.0);
    }

    #[test]
    fn a_turn_without_room_is_refused_with_the_numbers_and_a_way_out() {
        let here = status(100.0, 100.0);
        let error = TurnPlan::new(&identity(-262.0, 400.0), &here, 7.2, 360.0).unwrap_err();
        let TurntableError::NoRoom {
            from_deg,
            high_deg,
            ref way_out,
            ..
        } = error
        else {
            panic!("{error}");
        };
        assert_eq!((from_deg, high_deg), (100.0, 400.0));
        assert!(is_named(way_out, &["-259.180", "37.180"]), "{way_out}");
        assert!(is_named(
            &error.to_string(),
            &["100.000", "400.000", way_out]
        ));
        let error = TurnPlan::new(&identity(-100.0, 100.0), &here, 7.2, 360.0).unwrap_err();
        let TurntableError::NoRoom { way_out, .. } = error else {
            panic!("{error}");
        };
        // There is none to go to.
        assert!(!way_out.contains(".180"), "{way_out}");
    }

    #[test]
    fn speeds_and_angles_that_no_table_can_follow_are_refused() {
        let refused = |degrees_per_second, turn_deg| {
            let identity = identity(-400.0, 400.0);
            let planned = TurnPlan::new(&identity, &status(0.0, 0.0), degrees_per_second, turn_deg);
            assert!(
                matches!(planned, Err(TurntableError::OutOfRange { .. })),
                "{planned:?}"
            );
        };
        for degrees_per_second in [0.0, -1.0, 36.1, f64::NAN] {
            refused(degrees_per_second, 360.0);
        }
        for turn_deg in [0.0, f64::INFINITY, f64::NAN] {
            refused(7.2, turn_deg);
        }
    }

    proptest! {
        #[test]
        fn a_plan_never_passes_a_limit_and_none_is_refused_that_has_room(
            low in -800.0..0.0f64,
            high in 0.0..800.0f64,
            at in -800.0..800.0f64,
            zero in -300.0..300.0f64,
            speed in 0.1..36.0f64,
            turn_deg in 1.0..800.0f64,
        ) {
            let identity = identity(low, high);
            let status = status(at - zero, at);
            let ramp = speed * speed / 72.0 + RAMP_SLACK_DEG;
            let reach = high.max(-low);
            let inside = |machine: f64| (low..=high).contains(&machine) && (machine - zero).abs() <= reach;
            match TurnPlan::new(&identity, &status, speed, turn_deg) {
                Ok(plan) => for angle in [plan.back_deg(), plan.end_deg()] {
                    prop_assert!(inside(angle + zero));
                    prop_assert!((plan.constant_to_deg() - plan.constant_from_deg()).abs() >= turn_deg);
                },
                Err(_) => for sign in [1.0, -1.0] {
                    let (back, end) = (at - sign * (ramp + MARGIN_DEG), at + sign * (turn_deg + MARGIN_DEG + ramp));
                    let room = |machine: f64| inside(machine - 0.002) && inside(machine + 0.002);
                    prop_assert!(!(room(back) && room(end)));
                },
            }
        }
    }
}
