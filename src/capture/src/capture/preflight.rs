//! What is checked before anything turns.
//!
//! A check that is passed leaves a line for the person at the rig; one that is not ends the capture
//! with a [`CaptureError::Refused`] before the table moves for it. Only an unknown zero of the table is put right
//! here: the table is homed.

use std::path::Path;

use jiff::Timestamp;

use super::error::CaptureError;
use super::settings::Settings;
use crate::state::{Check, Obstacle};
use relit_data::naming::is_session_name;
use relit_turntable::{
    Alarm, HomingResult, MARGIN_DEG, Table, TableStatus, TurnPlan, TurntableError,
};

/// What is added to the expected size of a take, as a fraction of it.
const RESERVE: f64 = 0.2;
/// Longest object name, bytes: a session's name has date and time before it.
const MAX_OBJECT_LENGTH: usize = 80;
/// What a person has to do with a table that has no index sensor, before zero is known.
pub(crate) const ZERO_NOT_SET: &str = "zero is not set, and the cable may be wound: turn the table until the cable hangs free, then press “Set zero here”";
/// What a person has to check where such a table took its zero without being asked.
pub(crate) const ZERO_TAKEN: &str = "zero is now where the table stands, as it has no index sensor: if the cable is wound, turn the table until it hangs free, then press “Set zero here”";
/// 2025-01-01, seconds since 1970.
const EARLIEST: i64 = 1_735_689_600;

/// Checks that the disk has space for a take, and a fifth more.
pub(super) fn check_disk(root: &Path, expected: u64) -> Result<Check, CaptureError> {
    let free = free_bytes(root)?;
    let needed = (expected as f64 * (1.0 + RESERVE)).ceil() as u64;
    if free < needed {
        return Err(CaptureError::Refused(format!(
            "{} has {} MB free, but the take needs {} MB, including a reserve of 20 %: free some space, or give another --root",
            root.display(),
            free / 1_000_000,
            needed.div_ceil(1_000_000)
        )));
    }
    let (free, needed) = (free / 1_000_000, needed.div_ceil(1_000_000));
    let words = format!("{free} MB free, {needed} MB needed");
    Ok(Check::passed("disk", words))
}

/// Bytes that this user may still write in a folder.
pub(crate) fn free_bytes(root: &Path) -> Result<u64, CaptureError> {
    let failed = CaptureError::system(root.display().to_string(), "asked for its free space");
    let space = rustix::fs::statvfs(root).map_err(|errno| failed(errno.into()))?;
    Ok(space.f_bavail.saturating_mul(space.f_frsize))
}

/// Checks that the time of day is one in which this program can run.
pub(super) fn check_clock(now: Timestamp) -> Result<Check, CaptureError> {
    if now.as_second() < EARLIEST {
        Err(CaptureError::Refused(format!(
            "the system's clock says {now}, before this program was written: set it, or the session's name would be wrong"
        )))
    } else {
        Ok(Check::passed("clock", format!("{now:.0}")))
    }
}

/// Checks that an object's name can be part of a session's.
///
/// # Errors
/// What a name can have, in a sentence.
pub fn check_object(name: &str) -> Result<(), String> {
    if is_session_name(name) && name.len() <= MAX_OBJECT_LENGTH {
        Ok(())
    } else {
        Err(format!(
            "{name:?} cannot be an object's name: use letters, digits, '-', '_' and '.', at most {MAX_OBJECT_LENGTH} bytes"
        ))
    }
}

/// Checks that the table turns as fast as it is to.
pub(super) fn check_speed(table: &Table, set: f64) -> Result<(), CaptureError> {
    let highest = table.identity().max_degrees_per_second;
    match Obstacle::from_speed(set, highest) {
        Some(obstacle) => Err(CaptureError::Refused(obstacle.to_string())),
        None => Ok(()),
    }
}

/// Makes sure that the table can turn: it answers, and knows its zero or is homed now.
pub(super) fn ready_table(table: &Table) -> Result<Vec<Check>, CaptureError> {
    let status = table.status()?;
    if status.emergency_stop {
        return Err(TurntableError::EmergencyStop.into());
    }
    // After an emergency stop a person decides when the table may move again.
    if status.alarm.is_some_and(Alarm::is_emergency_stop) {
        let (state, alarm) = (status.state, status.alarm);
        return Err(TurntableError::NotReady { state, alarm }.into());
    }
    let mut checks = Vec::new();
    let firmware = &table.identity().firmware;
    checks.push(Check::passed("table", format!("Grbl {firmware} answers")));
    // Without an index, the place where it stands would become the zero of a cable that may be wound.
    if status.restarted && !table.identity().homing {
        return Err(CaptureError::Refused(ZERO_NOT_SET.to_owned()));
    }
    checks.push(if status.homed {
        Check::passed("table's zero", "known")
    } else {
        match table.home()? {
            HomingResult::Index => Check::passed("table's zero", "found at its index"),
            HomingResult::WhereItStands => Check::noted(
                "table's zero",
                "taken where the table stood: it has no index",
            ),
        }
    });
    Ok(checks)
}

/// Why the turn of a take has no room from where the table stands, where its zero is known.
pub(crate) fn no_room(
    table: &Table,
    status: &TableStatus,
    degrees_per_second: f64,
) -> Option<String> {
    if !status.homed {
        return None;
    }
    match TurnPlan::new(table.identity(), status, degrees_per_second, 360.0) {
        Err(error @ TurntableError::NoRoom { .. }) => Some(error.to_string()),
        _ => None,
    }
}

/// Plans the turn of a take from where the table stands.
pub(super) fn plan_turn(
    table: &Table,
    settings: &Settings,
) -> Result<(TurnPlan, Check), CaptureError> {
    let speed = settings.degrees_per_second;
    let plan = TurnPlan::new(table.identity(), &table.status()?, speed, 360.0)?;
    let (from, to) = (plan.back_deg(), plan.end_deg());
    let words = format!("room for the turn from {from:.1} to {to:.1} degrees");
    Ok((plan, Check::passed("cable", words)))
}

/// Time at constant speed before the turn's first frame, microseconds.
pub(super) fn margin_us(plan: &TurnPlan) -> i64 {
    (MARGIN_DEG / plan.degrees_per_second * 1e6).round() as i64
}

#[cfg(test)]
mod tests {
    use relit_data::causes::with_causes;

    use super::*;

    #[test]
    fn a_full_disk_is_refused_with_both_numbers() {
        let root = tempfile::tempdir().unwrap();
        let error = check_disk(root.path(), 1 << 60).unwrap_err();
        assert!(matches!(error, CaptureError::Refused(_)));
        let error = with_causes(&error);
        assert!(error.contains("1383505805529 MB"), "{error}");
    }
}
