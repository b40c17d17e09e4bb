//! The plan of a turn: where it starts, where its speed is constant, where it ends.
//!
//! ```text
//!        back            start                                        end
//!         |--ramp--|margin|------------ turn_deg ------------|margin|--ramp--|
//!                  |------------- constant speed -------------------|
//! ```
//!
//! A ramp from rest to the speed v at the acceleration a is v^2 / 2a long. The plan chooses the
//! direction in which all of it lies inside the limits.

use super::error::TurntableError;
use super::identity::Identity;
use super::table::Status;

/// Degrees added to a ramp for the rounding of its steps.
const RAMP_SLACK_DEG: f64 = 0.1;
/// What a target can gain when it is printed.
const PRINTED_DEG: f64 = 0.001;

/// Which way a turn goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Angles grow.
    Positive,
    /// Angles shrink.
    Negative,
}

impl Direction {
    pub(super) fn sign(self) -> f64 {
        match self {
            Direction::Positive => 1.0,
            Direction::Negative => -1.0,
        }
    }
}

/// What is asked of a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnRequest {
    /// Speed, degrees a second, above 0.
    pub degrees_per_second: f64,
    /// How far the table turns at constant speed, without margins, degrees, above 0.
    pub turn_deg: f64,
    /// What is added to it at either end, degrees, 0 or more.
    pub margin_deg: f64,
    /// The only direction allowed; `None` takes the one that has room, angles growing first.
    pub direction: Option<Direction>,
    /// Whether the table turns back to where it started afterwards, so that no cable winds up.
    pub unwind: bool,
}

impl Default for TurnRequest {
    /// One turn in 50 s, two degrees more at either end, unwound afterwards.
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
pub struct TurnPlan {
    degrees_per_second: f64,
    constant_deg: f64,
    margin_deg: f64,
    ramp_deg: f64,
    direction: Direction,
    unwind: bool,
    start_deg: f64,
}

impl TurnPlan {
    /// Plans a turn from where the table stands.
    ///
    /// # Errors
    /// [`TurntableError::NoRoom`], or [`TurntableError::Figure`] for a speed or angle that no
    /// table can follow.
    pub fn new(
        identity: &Identity,
        status: &Status,
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
            None => vec![Direction::Positive, Direction::Negative],
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

    /// Speed, degrees a second.
    #[must_use]
    pub fn degrees_per_second(&self) -> f64 {
        self.degrees_per_second
    }

    /// How far the table turns at constant speed, margins included, degrees.
    #[must_use]
    pub fn constant_deg(&self) -> f64 {
        self.constant_deg
    }

    /// Which way it turns.
    #[must_use]
    pub fn direction(&self) -> Direction {
        self.direction
    }

    /// Whether it turns back afterwards.
    #[must_use]
    pub fn unwind(&self) -> bool {
        self.unwind
    }

    /// The angle it was planned from.
    #[must_use]
    pub fn start_deg(&self) -> f64 {
        self.start_deg
    }

    /// Where it moves back to first.
    #[must_use]
    pub fn back_deg(&self) -> f64 {
        self.start_deg - self.direction.sign() * (self.ramp_deg + self.margin_deg)
    }

    /// Where its speed becomes constant.
    #[must_use]
    pub fn constant_from_deg(&self) -> f64 {
        self.start_deg - self.direction.sign() * self.margin_deg
    }

    /// Where it starts to slow down.
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
    /// The limits as angles of a table whose angle and machine position are known: those of the
    /// controller, and as far again either way from the angle 0, where the cable hangs free.
    pub(super) fn limits_from(&self, status: &Status) -> (f64, f64) {
        let zero = status.machine_deg - status.angle_deg;
        let reach = self.limits.high_deg.max(-self.limits.low_deg);
        let low = (self.limits.low_deg - zero).max(-reach);
        let high = (self.limits.high_deg - zero).min(reach);
        (low, high)
    }

    /// A speed that the table can follow.
    pub(super) fn check_speed(&self, degrees_per_second: f64) -> Result<(), TurntableError> {
        let fastest = self.max_degrees_per_second;
        if degrees_per_second > 0.0 && degrees_per_second <= fastest * (1.0 + 1e-9) {
            return Ok(());
        }
        Err(TurntableError::Figure {
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
        Err(TurntableError::Figure { what, value, range })
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
    status: &Status,
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
