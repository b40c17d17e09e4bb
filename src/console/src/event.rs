//! The JSON lines of the toolkit's programs, each an object with the name of its event. The same type is
//! printed by the programs and read by the rig, which runs some of them; `docs/reference/json-lines.md` has an example
//! of each line.

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A line for a machine. Values that only their program knows the type of are left as JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
#[allow(
    missing_docs,
    reason = "docs/reference/json-lines.md explains the fields"
)]
pub enum Event {
    // Every program. `session` is missing where an event concerns none.
    Warning {
        #[serde(skip_serializing_if = "Option::is_none")]
        session: Option<String>,
        message: String,
    },
    Error {
        #[serde(skip_serializing_if = "Option::is_none")]
        session: Option<String>,
        message: String,
        /// The input that it concerns, of several.
        input: Option<String>,
    },
    Progress {
        #[serde(skip_serializing_if = "Option::is_none")]
        session: Option<String>,
        what: String,
        done: u64,
        /// 0: not counted yet.
        of: u64,
    },
    Check(Check),
    Done(Done),
    // relit-capture
    Camera {
        address: String,
        name: String,
        driver: String,
        bus: String,
        modes: Vec<String>,
        controls: Vec<Value>,
        problems: Vec<String>,
    },
    Turntable {
        addresses: Vec<String>,
    },
    Phase {
        phase: Value,
    },
    Serving {
        url: String,
        address: String,
    },
    Ready {
        port: String,
        speed: f64,
    },
    Ended,
    Calibrated {
        rotation: Option<String>,
        camera_elevation_deg: Option<f64>,
    },
    Status(Value),
    Homed(Value),
    Jogged(Value),
    Stopped(Value),
    Unlocked(Value),
    // relit-mask
    Mask {
        session: String,
        input: String,
        mask: String,
        record: String,
        preview: String,
        source: Value,
        result: Value,
        warnings: Vec<String>,
    },
    /// A mask that was made by hand, and that nobody asked to replace.
    Kept {
        session: String,
        input: String,
        mask: String,
    },
    Editor {
        address: String,
        url: String,
    },
    // relit-extract
    Task {
        task: String,
    },
    Extracted {
        session: String,
        input: String,
        /// That of `dataset.json`.
        entry: Value,
    },
    Skipped {
        session: String,
        input: String,
        lossy: bool,
        misfit: bool,
        broken: bool,
    },
    LeftOut {
        #[serde(skip_serializing_if = "Option::is_none")]
        session: Option<String>,
        input: String,
        message: String,
    },
    /// How far all sessions together have come.
    Total {
        done: u64,
        of: u64,
        /// Until all are done, about; not known before one was worked on.
        seconds_left: Option<u64>,
    },
    Problem {
        #[serde(skip_serializing_if = "Option::is_none")]
        session: Option<String>,
        file: String,
        sample: Option<String>,
        message: String,
    },
    Verified {
        out: String,
        sessions: u64,
        shards: u64,
        samples: u64,
        problems: u64,
    },
    Merged {
        out: String,
        sessions: u64,
        samples: u64,
        tasks: u64,
        datasets: u64,
        /// Sessions with losses, with a mask that does not fit, or broken.
        flawed: Vec<String>,
    },
    Converted {
        out: String,
        layout: String,
        sessions: u64,
        samples: u64,
        /// As above.
        flawed: Vec<String>,
    },
    Removed {
        out: String,
        sessions: Vec<String>,
        samples: u64,
    },
    Session(Value),
    Stats(Value),
}

/// Something was checked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
#[allow(
    missing_docs,
    reason = "docs/reference/json-lines.md explains the fields"
)]
pub enum Check {
    /// A mask, by `relit-mask check`.
    Mask {
        session: String,
        input: String,
        page: String,
        report: Value,
    },
    /// The rig before a turn, by `relit-capture record`.
    Rig {
        what: String,
        good: bool,
        found: String,
    },
}

/// A program has ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
#[allow(
    missing_docs,
    reason = "docs/reference/json-lines.md explains the fields"
)]
pub enum Done {
    /// `relit-capture record`.
    Capture { session: String, take: Value },
    /// `relit-extract`.
    Extraction {
        out: String,
        extracted: u64,
        lossy: u64,
        misfits: u64,
        broken: u64,
        skipped: u64,
        left_out: u64,
        failed: u64,
        summary: String,
    },
    /// `relit-mask` of several recordings.
    Masks {
        made: u64,
        kept: u64,
        left_out: u64,
        failed: u64,
        summary: String,
    },
    /// `relit-mask check` of several recordings.
    Checks {
        fitting: u64,
        unfit: u64,
        failed: u64,
        summary: String,
    },
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

    use super::*;
    use crate::json_of;

    #[test]
    fn the_manuals_lines_are_read_and_printed_as_they_stand_there() {
        let manual = include_str!("../../../docs/reference/json-lines.md");
        let lines = manual.lines().filter_map(|line| line.strip_prefix("    {"));
        let mut count = 0;
        for line in lines.map(|rest| format!("{{{rest}")) {
            let event: Event = serde_json::from_str(&line).unwrap();
            assert_eq!(json_of(&event), line);
            count += 1;
        }
        assert_eq!(count, 37);
    }
}
