//! The G-code subset, as pure functions: text to a typed block.
//!
//! Which error a line gets follows Grbl 1.1. Distances leave here as thousandths of a degree, one
//! millimetre of G-code being one degree. Knows nothing of positions, limits or states.

mod words;

pub(crate) use self::words::Motion;
use self::words::{OneShot, Words};
use crate::error::Error;

/// What one line leaves for the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Modal {
    /// `G0` or `G1`.
    pub motion: Motion,
    /// `G91` instead of `G90`.
    pub relative: bool,
    /// `F`, thousandths of a degree/min; 0: none given yet.
    pub feed: u32,
}

impl Modal {
    /// As after a reset.
    pub(crate) const fn new() -> Modal {
        Modal {
            motion: Motion::Rapid,
            relative: false,
            feed: 0,
        }
    }
}

/// A place to go to, thousandths of a degree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Target {
    /// From zero.
    Absolute(i32),
    /// From where the moves before end.
    Relative(i32),
}

/// What a line asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Action {
    /// Nothing beyond the modal state.
    Nothing,
    /// `G0`, `G1`: go there.
    Move(Target),
    /// `G4`: wait so many microseconds at rest.
    Dwell(u32),
}

/// A line of G-code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Block {
    /// The modal state from this line on.
    pub modal: Modal,
    /// What to do under it.
    pub action: Action,
}

/// A jog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Jog {
    /// Where to.
    pub target: Target,
    /// Thousandths of a degree/min.
    pub feed: u32,
}

impl Words {
    /// The modal state under this line.
    fn modal(&self, before: &Modal) -> Result<Modal, Error> {
        let feed = match self.f {
            Some(feed) => feed
                .thousandths()
                .ok_or(Error::InvalidTarget)?
                .unsigned_abs(),
            None => before.feed,
        };
        Ok(Modal {
            motion: self.motion.unwrap_or(before.motion),
            relative: self.relative.unwrap_or(before.relative),
            feed,
        })
    }

    /// Where the axis word points to.
    fn target(&self, modal: &Modal) -> Result<Option<Target>, Error> {
        let Some(x) = self.x else {
            return Ok(None);
        };
        let x = x.thousandths().ok_or(Error::InvalidTarget)?;
        let relative = modal.relative && self.one_shot != Some(OneShot::Machine);
        Ok(Some(if relative {
            Target::Relative(x)
        } else {
            Target::Absolute(x)
        }))
    }

    fn dwell(&self) -> Result<Action, Error> {
        if self.x.is_some() {
            return Err(Error::UnusedAxisWords);
        }
        let micros = self.p.ok_or(Error::ValueMissing)?.micros();
        micros.map(Action::Dwell).ok_or(Error::BadNumber)
    }

    fn go(&self, modal: &Modal) -> Result<Action, Error> {
        // Only `G4` uses it.
        if self.p.is_some() {
            return Err(Error::UnusedWords);
        }
        let Some(target) = self.target(modal)? else {
            return match self.one_shot {
                Some(OneShot::Machine) => Err(Error::MachineMotion),
                _ => Ok(Action::Nothing),
            };
        };
        if modal.motion == Motion::Feed && modal.feed == 0 {
            return Err(Error::UndefinedFeed);
        }
        Ok(Action::Move(target))
    }
}

/// Reads a line of G-code under the modal state before it.
///
/// # Errors
/// Grbl's number for what is wrong first.
pub(crate) fn parse(text: &[u8], before: &Modal) -> Result<Block, Error> {
    let mut words = Words::default();
    words.read(text)?;
    let modal = words.modal(before)?;
    let action = match words.one_shot {
        Some(OneShot::Dwell) => words.dwell()?,
        Some(OneShot::Machine) | None => words.go(&modal)?,
    };
    Ok(Block { modal, action })
}

/// Reads what stands behind `$J=`. A jog uses units and distance mode of the modal state, but
/// changes nothing in it, and always names its own feed.
///
/// # Errors
/// [`Error::InvalidJog`] for commands and words that a jog has no use for, [`Error::NoAxisWords`],
/// [`Error::UndefinedFeed`], and what reading words gives.
pub(crate) fn parse_jog(text: &[u8], modal: &Modal) -> Result<Jog, Error> {
    let mut words = Words::default();
    words.read(text)?;
    let allowed = matches!(words.one_shot, None | Some(OneShot::Machine));
    if !allowed || words.motion.is_some() || words.p.is_some() {
        return Err(Error::InvalidJog);
    }
    let modal = words.modal(&Modal { feed: 0, ..*modal })?;
    let target = words.target(&modal)?.ok_or(Error::NoAxisWords)?;
    if modal.feed == 0 {
        return Err(Error::UndefinedFeed);
    }
    Ok(Jog {
        target,
        feed: modal.feed,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn action(text: &str) -> Result<Action, Error> {
        let before = Modal {
            feed: 1000,
            ..Modal::new()
        };
        parse(text.as_bytes(), &before).map(|block| block.action)
    }

    #[test]
    fn lines_become_actions() {
        let cases = [
            ("", Action::Nothing),
            ("G1", Action::Nothing),
            ("N7F100", Action::Nothing),
            ("G0X1.5", Action::Move(Target::Absolute(1500))),
            ("G21X-2", Action::Move(Target::Absolute(-2000))),
            ("G91G1X3", Action::Move(Target::Relative(3000))),
            ("G91G53X3", Action::Move(Target::Absolute(3000))),
            ("G4P0.5", Action::Dwell(500_000)),
            ("G00001X1", Action::Move(Target::Absolute(1000))),
        ];
        for (text, expected) in cases {
            assert_eq!(action(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn wrong_lines_get_grbls_numbers() {
        let cases = [
            ("5", 1),
            ("-X1", 1),
            ("G", 2),
            ("X1.2.3", 1),
            ("X", 2),
            ("X1000000000", 2),
            ("F-1", 4),
            ("G4P-1", 4),
            ("G4P5000", 2),
            ("G2X1", 20),
            ("M5", 20),
            ("Y1", 20),
            ("G20", 20),
            ("G92X1", 20),
            ("G10L2P1X1", 20),
            ("G28", 20),
            ("G54", 20),
            ("G-5", 20),
            ("G0G1X1", 21),
            ("G90G91", 21),
            ("G4P1G53", 21),
            ("G1.5X1", 23),
            ("G90.1", 23),
            ("X1X2", 25),
            ("F1F2", 25),
            ("N10000000", 27),
            ("G4", 28),
            ("G53", 30),
            ("G4P1X1", 31),
            ("X3000000", 33),
            ("F3000000", 33),
            ("G1X1P1", 36),
            ("G1X1L1", 20),
            ("P1", 36),
        ];
        for (text, code) in cases {
            let got = action(text).map_err(Error::code);
            assert_eq!(got, Err(code), "{text}");
        }
        let unfed = parse(b"G1X1", &Modal::new());
        assert_eq!(unfed, Err(Error::UndefinedFeed));
    }

    #[test]
    fn the_modal_state_goes_from_line_to_line() {
        let block = parse(b"G91G1F10", &Modal::new()).unwrap();
        let expected = Modal {
            motion: Motion::Feed,
            relative: true,
            feed: 10_000,
        };
        assert_eq!(block.modal, expected);
        let next = parse(b"X1", &block.modal).unwrap();
        assert_eq!(next.action, Action::Move(Target::Relative(1000)));
        assert_eq!(next.modal, expected);
    }

    #[test]
    fn a_jog_names_its_feed_and_only_what_a_jog_needs() {
        let modal = Modal {
            feed: 1000,
            ..Modal::new()
        };
        let jog = |text: &str| parse_jog(text.as_bytes(), &modal).map_err(Error::code);
        let expected = Jog {
            target: Target::Relative(5000),
            feed: 100_000,
        };
        assert_eq!(jog("G91X5F100"), Ok(expected));
        assert_eq!(
            jog("G53X5F1").map(|jog| jog.target),
            Ok(Target::Absolute(5000))
        );
        assert_eq!(jog("N5X1F1").map(|jog| jog.feed), Ok(1000));
        let wrong = [
            ("X5", 22),
            ("F5", 26),
            ("G1X5F1", 16),
            ("X5F1P1", 16),
            ("G4X5F1", 16),
            ("X5FF", 2),
        ];
        for (text, code) in wrong {
            assert_eq!(jog(text), Err(code), "{text}");
        }
    }
}
