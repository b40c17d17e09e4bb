//! Between the reports of a turn and the journal in its session.

use crate::turntable::{ExpectedTurn, TimedReport, Track};
use relit_data::session::{JournaledReport, JournaledTurn, TurnJournal};

/// The turn as the journal keeps it.
pub(super) fn journaled_turn(turn: &ExpectedTurn) -> JournaledTurn {
    JournaledTurn {
        from_deg: turn.from_deg,
        to_deg: turn.to_deg,
        degrees_per_second: turn.degrees_per_second,
        zero_deg: turn.zero_deg,
        step_deg: turn.step_deg,
    }
}

/// A report as the journal keeps it.
pub(super) fn journaled_report(report: &TimedReport) -> JournaledReport {
    JournaledReport {
        asked_us: report.asked_us,
        came_us: report.came_us,
        chip_us: report.chip_us,
        machine_deg: report.machine_deg,
    }
}

/// The angles of a turn that was interrupted, up to its last report; `None` where the reports do not
/// determine them.
pub(super) fn track_of(journal: &TurnJournal) -> Option<Track> {
    let turn = &journal.turn;
    let expected = ExpectedTurn {
        from_deg: turn.from_deg,
        to_deg: turn.to_deg,
        degrees_per_second: turn.degrees_per_second,
        zero_deg: turn.zero_deg,
        step_deg: turn.step_deg,
    };
    let report = |report: &JournaledReport| TimedReport {
        asked_us: report.asked_us,
        came_us: report.came_us,
        chip_us: report.chip_us,
        machine_deg: report.machine_deg,
    };
    let reports: Vec<_> = journal.reports.iter().map(report).collect();
    Track::of_part(&reports, &expected).ok()
}
