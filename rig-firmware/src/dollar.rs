//! The `$` commands, as a pure function: text to a typed command.
//!
//! Knows nothing of states: whether a command is allowed now is the controller's.

use crate::error::Error;
use crate::gcode::{self, Jog, Modal};
use crate::number;
use crate::settings::Key;

/// A `$` command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dollar {
    /// `$`: name the commands.
    Help,
    /// `$$`: tell the settings.
    Settings,
    /// `$n=v`: change a setting; the value in millionths.
    Set(Key, i64),
    /// `$I`: tell version and options.
    Version,
    /// `$H`: look for the index.
    Home,
    /// `$X`: unlock after an alarm.
    Unlock,
    /// `$C`: check lines without moving, or end that.
    Check,
    /// `$G`: tell the modal state.
    Modal,
    /// `$#`: tell the offsets.
    Offsets,
    /// `$J=`: jog.
    Jog(Jog),
    /// `$RST=`: back to the defaults.
    Restore {
        /// The settings.
        settings: bool,
        /// The work offsets.
        offsets: bool,
    },
}

/// Reads what stands behind the `$`.
///
/// # Errors
/// [`Error::InvalidStatement`] for what is no command of this table, [`Error::InvalidJog`] for `$J`
/// without `=`, [`Error::BadNumber`] for a value that is none, and what a jog gives.
pub fn parse(text: &[u8], modal: &Modal) -> Result<Dollar, Error> {
    let restore = |settings, offsets| Ok(Dollar::Restore { settings, offsets });
    match text {
        b"" => Ok(Dollar::Help),
        b"$" => Ok(Dollar::Settings),
        b"I" => Ok(Dollar::Version),
        b"H" => Ok(Dollar::Home),
        b"X" => Ok(Dollar::Unlock),
        b"C" => Ok(Dollar::Check),
        b"G" => Ok(Dollar::Modal),
        b"#" => Ok(Dollar::Offsets),
        b"RST=$" => restore(true, false),
        b"RST=#" => restore(false, true),
        b"RST=*" => restore(true, true),
        [b'J', b'=', jog @ ..] => gcode::parse_jog(jog, modal).map(Dollar::Jog),
        [b'J', ..] => Err(Error::InvalidJog),
        _ => set(text),
    }
}

fn set(text: &[u8]) -> Result<Dollar, Error> {
    let count = text.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let (number, assignment) = text
        .split_at_checked(count)
        .filter(|_| (1..=3).contains(&count))
        .ok_or(Error::InvalidStatement)?;
    let number = number
        .iter()
        .fold(0, |value, digit| value * 10 + u32::from(digit - b'0'));
    let value = assignment
        .strip_prefix(b"=")
        .ok_or(Error::InvalidStatement)?;
    let key = Key::of(number).ok_or(Error::InvalidStatement)?;
    match number::parse(value) {
        Some((value, [])) => Ok(Dollar::Set(key, value)),
        _ => Err(Error::BadNumber),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Dollar, u8> {
        parse(text.as_bytes(), &Modal::new()).map_err(Error::code)
    }

    #[test]
    fn commands_are_told_apart() {
        assert_eq!(read(""), Ok(Dollar::Help));
        assert_eq!(read("$"), Ok(Dollar::Settings));
        assert_eq!(
            read("110=2000.5"),
            Ok(Dollar::Set(Key::MaxFeed, 2_000_500_000))
        );
        assert_eq!(read("0=-1"), Ok(Dollar::Set(Key::StepPulse, -1_000_000)));
        let all = Dollar::Restore {
            settings: true,
            offsets: true,
        };
        assert_eq!(read("RST=*"), Ok(all));
    }

    #[test]
    fn what_is_no_command_gets_its_number() {
        let cases = [
            ("SLP", 3),
            ("Q", 3),
            ("6=1", 3),
            ("0", 3),
            ("0100=5", 3),
            ("=5", 3),
            ("N0=G1", 3),
            ("RST=1", 3),
            ("HX", 3),
            ("0=", 2),
            ("0=1X", 2),
            ("0=1.2.3", 2),
            ("J", 16),
            ("JX1F1", 16),
            ("J=", 26),
        ];
        for (text, code) in cases {
            assert_eq!(read(text), Err(code), "{text}");
        }
    }
}
