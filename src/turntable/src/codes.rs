//! The meanings of alarm and error numbers. Grbl's own are the same everywhere; above them each
//! firmware of the family counts in its own way.

use std::fmt;

use super::family::Family;

/// What locked the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub struct Alarm {
    /// The alarm's number, or none if none was reported: a controller can start locked, and a message
    /// can be lost.
    pub code: Option<u8>,
    /// Whose number it is.
    pub family: Family,
    /// Whether the emergency stop was seen pressed since the table was locked.
    pub emergency_stop: bool,
}

impl Alarm {
    /// A locked table whose controller does not say why.
    pub(super) fn unknown(family: Family) -> Alarm {
        Alarm {
            code: None,
            family,
            emergency_stop: false,
        }
    }

    /// Whether the emergency stop locked it. It stays locked until that is released and the controller
    /// reset.
    pub fn is_emergency_stop(self) -> bool {
        let numbered = self.family.emergency_stop_alarm();
        self.emergency_stop || (self.code.is_some() && self.code == numbered)
    }

    /// Whether the counted position may be wrong after this alarm.
    pub fn loses_position(self) -> bool {
        match self.code {
            _ if self.emergency_stop => true,
            None | Some(2 | 4 | 5) => false,
            Some(20) => self.family != Family::Rig,
            Some(_) => true,
        }
    }

    fn meaning(self, code: u8) -> &'static str {
        match (code, self.family) {
            (1, _) => {
                "a limit switch stopped it, its position is lost: free it, unlock and home it"
            }
            (2, _) => {
                "a target was beyond the soft limit, the position is kept: unlock it and go the other way"
            }
            (3, _) => "it was reset in motion, its position is lost: unlock and home it",
            (4 | 5, _) => "a probe failed, which a table does not have: unlock it",
            (6, _) => "it was reset while it looked for the index: home it again",
            (7, _) => "a door opened while it looked for the index: close it and home again",
            (8, _) => "the index sensor stayed active after it was left: check sensor and $27",
            (9, _) => "no index was found within a turn: check the sensor, its wiring and $5",
            (10, Family::Rig | Family::Grbl | Family::GrblHal) => EMERGENCY,
            (20, Family::Rig) => {
                "the host was silent longer than its lease, the position is kept: unlock it"
            }
            _ => "an alarm of its firmware, its position counts as lost: see the firmware's manual",
        }
    }
}

const EMERGENCY: &str = "the emergency stop was pressed, its position is lost: once it is released, reset and home the table";

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.code {
            Some(code) => write!(f, "ALARM:{code}, {}", self.meaning(code))?,
            None if self.emergency_stop => return f.write_str(EMERGENCY),
            None => f.write_str("the controller is locked: unlock or home it")?,
        }
        if self.emergency_stop && self.code != self.family.emergency_stop_alarm() {
            f.write_str("; the emergency stop was pressed: release it, then reset the table")
        } else {
            Ok(())
        }
    }
}

/// What an `error:` number means, of those that the lines of this program can get.
pub(super) fn describe_error(code: u8) -> &'static str {
    match code {
        3 | 20 => "a command it does not know",
        5 => "homing is switched off ($22)",
        7 => "its stored settings were damaged and are the defaults again",
        8 => "that needs an idle table",
        9 => "the table is locked: unlock or home it",
        10 => "soft limits need homing",
        12 => "that speed needs more steps a second than it can make",
        13 => "a door is open",
        15 => "the jog goes beyond the soft limit",
        50 => "its emergency stop is pressed",
        70 => "the line came damaged",
        71 => "the line's number is out of order",
        72 => "no checked session is open",
        79 => "it has to be reset first, once its emergency stop is released",
        _ => "see the firmware's manual",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAMILIES: [Family; 5] = [
        Family::Rig,
        Family::Grbl,
        Family::GrblHal,
        Family::FluidNc,
        Family::GrblEsp32,
    ];

    fn alarm(code: u8, family: Family) -> Alarm {
        Alarm {
            code: Some(code),
            ..Alarm::unknown(family)
        }
    }

    #[test]
    fn only_alarms_at_rest_or_with_a_ramp_keep_the_position() {
        for family in FAMILIES {
            for code in 1..=u8::MAX {
                let lease = code == 20 && family == Family::Rig;
                let kept = matches!(code, 2 | 4 | 5) || lease;
                assert_eq!(
                    alarm(code, family).loses_position(),
                    !kept,
                    "{code} {family}"
                );
            }
            assert!(!Alarm::unknown(family).loses_position());
        }
    }

    #[test]
    fn an_alarm_says_its_number_and_the_way_out() {
        for (code, family) in [(10, Family::Rig), (11, Family::GrblHal)] {
            let text = alarm(code, family).to_string();
            let meaning = text.strip_prefix(&format!("ALARM:{code}")).unwrap();
            assert!(meaning.len() > 10, "{text}");
        }
    }

    #[test]
    fn a_number_above_grbls_own_means_what_its_firmware_means_by_it() {
        for family in [Family::Rig, Family::Grbl, Family::GrblHal] {
            assert!(alarm(10, family).is_emergency_stop(), "{family}");
        }
        for family in [Family::FluidNc, Family::GrblEsp32] {
            let spindle = alarm(10, family);
            assert!(!spindle.is_emergency_stop(), "{family}");
            let meaning = spindle.to_string();
            let pressed = Alarm {
                emergency_stop: true,
                ..spindle
            };
            assert!(pressed.is_emergency_stop());
            // It says so besides what the alarm means.
            let text = pressed.to_string();
            assert!(text.starts_with(&meaning) && text != meaning, "{text}");
        }
        let lease = alarm(20, Family::Rig).to_string();
        assert_ne!(lease, alarm(20, Family::GrblHal).to_string());
    }
}
