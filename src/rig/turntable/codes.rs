//! The meanings of Grbl's alarm and error numbers. Alarms from 20 and errors from 70 on are those of
//! the rig's own firmware.

use std::fmt;

/// What locked the table: Grbl's alarm number, or none if no alarm was reported: a controller can
/// start locked, and a message can be lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub struct Alarm(pub Option<u8>);

impl Alarm {
    /// The emergency stop was pressed. It stays locked until it is released and the controller reset.
    pub const EMERGENCY_STOP: Self = Self(Some(10));

    /// Whether the counted position may be wrong after this alarm.
    #[must_use]
    pub fn loses_position(self) -> bool {
        !matches!(self.0, None | Some(2 | 4 | 5 | 20))
    }
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(code) = self.0 else {
            return f.write_str("the controller is locked: unlock or home it");
        };
        write!(f, "ALARM:{code}, ")?;
        f.write_str(match code {
            1 => "a limit switch stopped it, its position is lost: free it, unlock and home it",
            2 => "a target was beyond the soft limit, the position is kept: unlock it and go the other way",
            3 => "it was reset in motion, its position is lost: unlock and home it",
            4 | 5 => "a probe failed, which tables have none of: unlock it",
            6 => "it was reset while it looked for the index: home it again",
            7 => "a door opened while it looked for the index: close it and home again",
            8 => "the index sensor stayed active after it was left: check sensor and $27",
            9 => "no index was found within a turn: check the sensor, its wiring and $5",
            10 => "the emergency stop was pressed, its position is lost: once it is released, reset and home the table",
            20 => "the host was silent longer than its lease, the position is kept: unlock it",
            _ => "an alarm this program does not know: see the firmware's manual",
        })
    }
}

/// What an `error:` number means.
pub(super) fn meaning_of_error(code: u8) -> &'static str {
    match code {
        1 => "a word has no letter",
        2 => "a number is malformed",
        3 => "an unknown `$` command",
        4 => "a value is negative that may not be",
        5 => "homing is switched off ($22)",
        6 => "the step pulse is too short",
        7 => "its stored settings were damaged and are the defaults again",
        8 => "that needs an idle table",
        9 => "the table is locked: unlock or home it",
        10 => "soft limits need homing",
        11 | 14 => "the line is too long",
        12 => "that speed needs more steps a second than it can make",
        13 => "a door is open",
        15 => "the jog goes beyond the soft limit",
        16 => "the jog is malformed",
        20 => "a command it does not know",
        21 | 24 => "two commands of one line exclude each other",
        22 => "a feed rate is missing",
        23 => "a number has to be whole",
        25 => "a word is repeated",
        26 | 28 => "a value is missing",
        27 => "a line number is out of range",
        29 => "a coordinate system it does not have",
        30 => "G53 needs G0 or G1",
        31 | 36 => "words are left over",
        32 | 34 | 35 => "an arc, which tables cannot drive",
        33 => "the target is invalid",
        37 => "a tool offset, which tables have none of",
        38 => "a tool number too large",
        70 => "the line came damaged",
        71 => "the line's number is out of order",
        72 => "no checked session is open",
        _ => "a number this program does not know: see the firmware's manual",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_alarms_at_rest_or_with_a_ramp_keep_the_position() {
        for code in 1..=u8::MAX {
            let kept = matches!(code, 2 | 4 | 5 | 20);
            assert_eq!(Alarm(Some(code)).loses_position(), !kept, "{code}");
        }
        assert!(!Alarm(None).loses_position());
    }

    #[test]
    fn an_alarm_says_its_number_and_the_way_out() {
        let text = Alarm(Some(10)).to_string();
        assert!(
            text.contains("ALARM:10") && text.contains("release"),
            "{text}"
        );
    }
}
