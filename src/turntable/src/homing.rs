//! Where the angle 0 is: at the index, or where the table stands.

use super::codes::Alarm;
use super::error::TurntableError;
use super::grbl_client::{Table, refused, require_released};
use super::supervisor::{MotionFault, MotionGoal};

use super::protocol::{ControllerState, LineOutcome, ReplyTimeout};

/// Time limit of the search for the index.
const HOMING: ReplyTimeout = ReplyTimeout::Within(120_000_000);
/// Grbl's error for `$H` if homing is switched off.
const HOMING_OFF: u8 = 5;

/// The result of homing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HomingResult {
    /// The index was found; the angle 0 is there.
    Index,
    /// Without an index sensor: the angle 0 is where the table stood.
    WhereItStands,
}

impl Table {
    /// Searches for the index. Without an index sensor, the table's present position becomes the
    /// angle 0.
    ///
    /// # Errors
    /// [`TurntableError::Motion`] if no index was found, [`TurntableError::EmergencyStop`] while it is
    /// pressed, or the fault that has ended the search.
    pub fn home(&self) -> Result<HomingResult, TurntableError> {
        self.clear_emergency_stop()?;
        if !self.identity().homing {
            return self.home_where_it_stands();
        }
        self.begin(MotionGoal::Homing)?;
        let searched = self.search_index();
        self.connection().supervisor().end_motion();
        searched
    }

    fn search_index(&self) -> Result<HomingResult, TurntableError> {
        match self.outcome("$H", HOMING)? {
            LineOutcome::Refused(HOMING_OFF) => return self.home_where_it_stands(),
            LineOutcome::Refused(code) => return Err(refused("$H", code)),
            LineOutcome::Failed(fault) => return Err(self.lost("$H", fault)),
            LineOutcome::Done(_) => {}
        }
        if let Some(fault) = self.end_by_fault()? {
            return Err(fault);
        }
        // A controller that has not found its index accepts `$H` all the same.
        let status = self.status()?;
        if status.state != ControllerState::Idle {
            let unknown = Alarm::unknown(self.identity().family);
            return Err(MotionFault::Alarm(status.alarm.unwrap_or(unknown)).into());
        }
        self.connection().supervisor().set_zero_deg(0.0);
        Ok(HomingResult::Index)
    }

    fn home_where_it_stands(&self) -> Result<HomingResult, TurntableError> {
        let status = self.ready()?;
        self.connection()
            .supervisor()
            .set_zero_deg(status.machine_deg);
        Ok(HomingResult::WhereItStands)
    }

    /// Brings the table back after an alarm of any kind: resets the controller, unlocks and homes it.
    ///
    /// # Errors
    /// [`TurntableError::EmergencyStop`] while the emergency stop is pressed, and the errors of
    /// [`Table::stop`] and [`Table::home`].
    pub fn reset(&self) -> Result<HomingResult, TurntableError> {
        require_released(&self.status()?)?;
        self.connection().reset()?;
        self.unlock()?;
        self.home()
    }
}
