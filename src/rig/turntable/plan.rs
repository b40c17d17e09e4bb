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

/// Which way a turn goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TurnDirection {
    /// Angles grow.
    Positive,
    /// Angles shrink.
    Negative,
}

impl TurnDirection {
    pub(super) fn sign(self) -> f64 {
        match self {
            TurnDirection::Positive => 1.0,
            TurnDirection::Negative => -1.0,
        }
    }
}

/// The request for a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnRequest {
    /// Speed, degrees a second, above 0.
    pub degrees_per_second: f64,
    /// How far the table turns at constant speed, without margins, degrees, above 0.
    pub turn_deg: f64,
    /// Added to it at either end, degrees, 0 or more.
    pub margin_deg: f64,
    /// The only direction allowed; with `None`, positive if it fits, else negative.
    pub direction: Option<TurnDirection>,
    /// Whether the table turns back to its start afterwards, so that the cable does not wind up.
    pub unwind: bool,
}

impl Default for TurnRequest {
    /// One turn in 50 s with two degrees more at either end, unwound afterwards.
    fn default() -> Self {
        Self {
            degrees_per_second: 7.2,
            turn_deg: 360.0,
            margin_deg: 2.0,
            direction: None,
            unwind: true,
        }
    }
}

/// A turn that stays inside the limits.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct TurnPlan {
    /// Speed, degrees a second.
    pub degrees_per_second: f64,
    /// How far the table turns at constant speed, margins included, degrees.
    pub constant_deg: f64,
    margin_deg: f64,
    ramp_deg: f64,
    /// Its direction.
    pub direction: TurnDirection,
    /// Whether it turns back afterwards.
    pub unwind: bool,
    /// The angle from which it was planned.
    pub start_deg: f64,
}

impl TurnPlan {
    /// Plans a turn from where the table stands.
    ///
    /// # Errors
    /// [`TurntableError::NoRoom`], or [`TurntableError::OutOfRange`] for a speed or angle that the
    /// table cannot follow.
    pub fn new(
        identity: &Identity,
        status: &TableStatus,
        request: &TurnRequest,
    ) -> Result<TurnPlan, TurntableError> {
        check(identity, request)?;
        let speed = request.degrees_per_second;
        let plan = |direction| TurnPlan {
            degrees_per_second: speed,
            constant_deg: request.turn_deg + 2.0 * request.margin_deg,
            margin_deg: request.margin_deg,
            ramp_deg: speed * speed / (2.0 * identity.acceleration) + RAMP_SLACK_DEG,
            direction,
            unwind: request.unwind,
            start_deg: status.angle_deg,
        };
        let (low, high) = identity.limits_from(status);
        let directions = match request.direction {
            Some(direction) => vec![direction],
            None => vec![TurnDirection::Positive, TurnDirection::Negative],
        };
        let mut plans = directions.into_iter().map(plan);
        let first = plans.next();
        let fits = |plan: &TurnPlan| plan.fits(low, high);
        let chosen = first.clone().filter(fits).or_else(|| plans.find(fits));
        chosen.ok_or_else(|| no_room(first.as_ref(), status, (low, high), request))
    }

    fn fits(&self, low: f64, high: f64) -> bool {
        let (a, b) = (self.back_deg(), self.end_deg());
        a.min(b) >= low + PRINTED_DEG && a.max(b) <= high - PRINTED_DEG
    }

    /// Where it moves first: back by ramp and margin.
    #[must_use]
    pub fn back_deg(&self) -> f64 {
        self.start_deg - self.direction.sign() * (self.ramp_deg + self.margin_deg)
    }

    /// Where its speed becomes constant.
    #[must_use]
    pub fn constant_from_deg(&self) -> f64 {
        self.start_deg - self.direction.sign() * self.margin_deg
    }

    /// Where it starts to decelerate.
    #[must_use]
    pub fn constant_to_deg(&self) -> f64 {
        self.constant_from_deg() + self.direction.sign() * self.constant_deg
    }

    /// Where it comes to rest.
    #[must_use]
    pub fn end_deg(&self) -> f64 {
        self.constant_to_deg() + self.direction.sign() * self.ramp_deg
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

fn check(identity: &Identity, request: &TurnRequest) -> Result<(), TurntableError> {
    identity.check_speed(request.degrees_per_second)?;
    let angle = |what, value: f64, usable: bool| {
        if usable && value.is_finite() {
            return Ok(());
        }
        let range = "it has to be an angle above 0 (a margin may be 0)".to_owned();
        Err(TurntableError::OutOfRange { what, value, range })
    };
    angle(
        "the turn in degrees",
        request.turn_deg,
        request.turn_deg > 0.0,
    )?;
    angle(
        "the margin in degrees",
        request.margin_deg,
        request.margin_deg >= 0.0,
    )
}

fn no_room(
    plan: Option<&TurnPlan>,
    status: &TableStatus,
    (low_deg, high_deg): (f64, f64),
    request: &TurnRequest,
) -> TurntableError {
    let back_deg = plan.map_or(0.0, |plan| plan.ramp_deg + plan.margin_deg);
    let forward_deg = back_deg + request.turn_deg;
    let sign = plan.map_or(1.0, |plan| plan.direction.sign());
    let (from, to) = match sign > 0.0 {
        true => (low_deg + back_deg, high_deg - forward_deg),
        false => (low_deg + forward_deg, high_deg - back_deg),
    };
    let way_out = if from <= to {
        format!("jog to a place between {from:.3} and {to:.3} first")
    } else {
        "no place has room for it: turn less far, or raise the limit ($130) if the cable allows it"
            .to_owned()
    };
    TurntableError::NoRoom {
        from_deg: status.angle_deg,
        forward_deg,
        back_deg,
        low_deg,
        high_deg,
        way_out,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::turntable::family::Family;
    use crate::turntable::identity::Extras;
    use crate::turntable::wire::ControllerState;

    fn identity(low_deg: f64, high_deg: f64) -> Identity {
        Identity {
            family: Family::Rig,
            firmware: String::new(),
            extras: Extras::default(),
            steps_per_degree: 88.889,
            max_degrees_per_second: 36.0,
            acceleration: 36.0,
            limits: (low_deg, high_deg),
            homing: false,
            lease_s: None,
            degrees_per_unit: 1.0,
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
        let request = TurnRequest::default();
        TurnPlan::new(
            &identity(-400.0, 400.0),
            &status(angle_deg, angle_deg),
            &request,
        )
    }

    #[test]
    fn a_turn_from_zero_has_its_ramps_outside_the_constant_part() {
        let plan = plan(0.0).unwrap();
        assert_eq!(plan.direction, TurnDirection::Positive);
        // 7.2^2 / (2 * 36) = 0.72 degrees of ramp.
        assert!((plan.back_deg() + 2.0 + 0.72 + RAMP_SLACK_DEG).abs() < 1e-9);
        assert_eq!(plan.constant_from_deg(), -2.0);
        assert_eq!(plan.constant_to_deg(), 362.0);
        assert!((plan.end_deg() - 362.0 - 0.72 - RAMP_SLACK_DEG).abs() < 1e-9);
    }

    #[test]
    fn a_table_that_is_wound_up_turns_the_other_way() {
        let plan = plan(200.0).unwrap();
        assert_eq!(plan.direction, TurnDirection::Negative);
        assert!(plan.end_deg() > -163.0 && plan.back_deg() > 200.0);
    }

    #[test]
    fn a_turn_without_room_is_refused_with_the_numbers_and_a_way_out() {
        let request = TurnRequest {
            direction: Some(TurnDirection::Positive),
            ..TurnRequest::default()
        };
        let here = status(100.0, 100.0);
        let error = TurnPlan::new(&identity(-400.0, 400.0), &here, &request).unwrap_err();
        let text = error.to_string();
        assert!(
            text.contains("from 100.000") && text.contains("400.000"),
            "{text}"
        );
        assert!(text.contains("between -397.180 and 37.180"), "{text}");
        let small = identity(-100.0, 100.0);
        let error = TurnPlan::new(&small, &here, &request).unwrap_err();
        assert!(error.to_string().contains("no place has room"), "{error}");
    }

    #[test]
    fn speeds_and_angles_that_no_table_can_follow_are_refused() {
        let refused = |request: TurnRequest| {
            let planned = TurnPlan::new(&identity(-400.0, 400.0), &status(0.0, 0.0), &request);
            assert!(
                matches!(planned, Err(TurntableError::OutOfRange { .. })),
                "{planned:?}"
            );
        };
        let usual = TurnRequest::default();
        for degrees_per_second in [0.0, -1.0, 36.1, f64::NAN] {
            refused(TurnRequest {
                degrees_per_second,
                ..usual
            });
        }
        for turn_deg in [0.0, f64::INFINITY, f64::NAN] {
            refused(TurnRequest { turn_deg, ..usual });
        }
        refused(TurnRequest {
            margin_deg: -0.1,
            ..usual
        });
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
            margin_deg in 0.0..20.0f64,
        ) {
            let identity = identity(low, high);
            let status = status(at - zero, at);
            let request = TurnRequest { degrees_per_second: speed, turn_deg, margin_deg, ..TurnRequest::default() };
            let ramp = speed * speed / 72.0 + RAMP_SLACK_DEG;
            let reach = high.max(-low);
            let inside = |machine: f64| (low..=high).contains(&machine) && (machine - zero).abs() <= reach;
            match TurnPlan::new(&identity, &status, &request) {
                Ok(plan) => for angle in [plan.back_deg(), plan.end_deg()] {
                    prop_assert!(inside(angle + zero));
                    prop_assert!((plan.constant_to_deg() - plan.constant_from_deg()).abs() >= turn_deg);
                },
                Err(_) => for sign in [1.0, -1.0] {
                    let (back, end) = (at - sign * (ramp + margin_deg), at + sign * (turn_deg + margin_deg + ramp));
                    let room = |machine: f64| inside(machine - 0.002) && inside(machine + 0.002);
                    prop_assert!(!(room(back) && room(end)));
                },
            }
        }
    }
}
