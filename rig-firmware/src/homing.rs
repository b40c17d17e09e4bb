//! Homing: the way to the index, as a state machine without a table.
//!
//! ```text
//! not on the index:  seek it fast ----------\
//! on the index:      move off it, backwards -+-> back off from it -> approach it slowly -> zero
//! ```
//!
//! Always approached from the same side and at the same speed, the index gives the same step
//! every time. Zero is the first step at which the index was active and then stayed so. The table
//! runs a little past it while it ramps down, and then returns to zero: it rests on the index's
//! edge, for an index stops nothing and needs no pull-off.
//!
//! Knows degrees and directions; nothing of steps, lines or pins.

use crate::settings::{GrblSettings, Key};

/// The way on which the index has to show up, thousandths of a degree: a turn and a bit.
const SEEK: i32 = 375_000;
/// The way on which the index has to end when homing starts on it.
const MOVE_OFF: i32 = 45_000;

/// Where homing is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HomingPhase {
    /// Leaving the index that was active at the start.
    MoveOff,
    /// Looking for the index, fast.
    Seek,
    /// Going to where the approach begins.
    BackOff,
    /// Going to the index, slowly.
    Approach,
    /// Going back to zero.
    Return,
}

/// What the table has to do next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Leg {
    /// The phase this is.
    pub phase: HomingPhase,
    /// From which step the way counts: from where the index changed, or from where the table
    /// stands.
    pub from: Option<i32>,
    /// The way, thousandths of a degree.
    pub way: i32,
    /// Thousandths of a degree/min.
    pub feed: u32,
    /// The level of the index that ends it.
    pub until: Option<bool>,
}

/// How a leg ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HomingOutcome {
    /// Another leg follows.
    Go(Leg),
    /// This step is zero; another leg follows, counted from the new zero.
    Zero(i32, Leg),
    /// The table is home.
    Home,
    /// The index did not end: alarm 8.
    StillActive,
    /// The index did not show up: alarm 9.
    NotFound,
}

/// The first leg; `active`: the table stands on the index.
pub(crate) fn start(settings: &GrblSettings, active: bool) -> Leg {
    let feed = settings.amount(Key::HomingSeek);
    let (phase, way) = if active {
        (HomingPhase::MoveOff, -MOVE_OFF)
    } else {
        (HomingPhase::Seek, SEEK)
    };
    Leg {
        phase,
        from: None,
        way: directed(settings, way),
        feed,
        until: Some(!active),
    }
}

/// What follows a leg. `found`: the step at which the index changed as the leg asked; `active`: the
/// table now stands on the index.
pub(crate) fn next(
    settings: &GrblSettings,
    phase: HomingPhase,
    found: Option<i32>,
    active: bool,
) -> HomingOutcome {
    let pull_off = settings.get(Key::HomingPullOff);
    match (phase, found) {
        (HomingPhase::MoveOff, None) => HomingOutcome::StillActive,
        (HomingPhase::Seek | HomingPhase::Approach, None) => HomingOutcome::NotFound,
        (HomingPhase::MoveOff | HomingPhase::Seek, Some(_)) => HomingOutcome::Go(Leg {
            phase: HomingPhase::BackOff,
            from: found,
            way: directed(settings, -pull_off),
            feed: settings.amount(Key::HomingSeek),
            until: None,
        }),
        (HomingPhase::BackOff, _) if active => HomingOutcome::StillActive,
        (HomingPhase::BackOff, _) => HomingOutcome::Go(Leg {
            phase: HomingPhase::Approach,
            from: None,
            // Twice the pull-off and a degree for an index that comes later than it went.
            way: directed(settings, 2 * pull_off + 1000),
            feed: settings.amount(Key::HomingFeed),
            until: Some(true),
        }),
        (HomingPhase::Approach, Some(step)) => HomingOutcome::Zero(
            step,
            Leg {
                phase: HomingPhase::Return,
                from: Some(0),
                way: 0,
                feed: settings.amount(Key::HomingFeed),
                until: None,
            },
        ),
        (HomingPhase::Return, _) => HomingOutcome::Home,
    }
}

fn directed(settings: &GrblSettings, way: i32) -> i32 {
    if settings.flag(Key::HomingInverted) {
        -way
    } else {
        way
    }
}
