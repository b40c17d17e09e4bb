//! The `$` commands, as a pure function: text to a typed command.
//!
//! Knows nothing of states: whether a command is allowed now is the controller's.

use crate::error::Error;
use crate::gcode::{self, Jog, Modal};
use crate::number::{self, Decimal};
use crate::settings::Key;

/// A `$` command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Dollar {
    /// `$$`: print the settings.
    Settings,
    /// `$n=v`: change a setting.
    Set(Key, Decimal),
    /// `$I`: print version and options.
    Version,
    /// `$H`: look for the index.
    Home,
    /// `$X`: unlock after an alarm.
    Unlock,
    /// `$G`: print the modal state.
    Modal,
    /// `$J=`: jog.
    Jog(Jog),
}

/// Reads what stands behind the `$`.
///
/// # Errors
/// [`Error::InvalidStatement`] for an unknown command, [`Error::InvalidJog`] for `$J`
/// without `=`, [`Error::BadNumber`] for a value that is not a number, and the errors of a jog.
pub(crate) fn parse(text: &[u8], modal: &Modal) -> Result<Dollar, Error> {
    match text {
        [b'J'] => Err(Error::InvalidJog),
        [letter] => simple(*letter).ok_or(Error::InvalidStatement),
        [b'J', b'=', jog @ ..] => gcode::parse_jog(jog, modal).map(Dollar::Jog),
        [b'J', ..] => Err(Error::InvalidJog),
        _ => set(text),
    }
}

fn simple(letter: u8) -> Option<Dollar> {
    Some(match letter {
        b'$' => Dollar::Settings,
        b'I' => Dollar::Version,
        b'H' => Dollar::Home,
        b'X' => Dollar::Unlock,
        b'G' => Dollar::Modal,
        _ => return None,
    })
}

fn set(text: &[u8]) -> Result<Dollar, Error> {
    let Some((number, [b'=', value @ ..])) = number::digits(text, 3) else {
        return Err(Error::InvalidStatement);
    };
    let key = Key::from_number(number).ok_or(Error::InvalidStatement)?;
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
        assert_eq!(read("$"), Ok(Dollar::Settings));
        let number = |text: &str| number::parse(text.as_bytes()).unwrap().0;
        assert_eq!(
            read("110=2000.5"),
            Ok(Dollar::Set(Key::MaxFeed, number("2000.5")))
        );
        assert_eq!(read("0=-1"), Ok(Dollar::Set(Key::StepPulse, number("-1"))));
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
            ("", 3),
            ("C", 3),
            ("RST=$", 3),
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
