//! Words of a line: which commands and values it names, each at most once.

use crate::error::Error;
use crate::number::{self, Decimal};

/// At which speed to move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Motion {
    /// `G0`: as fast as the table goes.
    Rapid,
    /// `G1`: at the feed.
    Feed,
}

/// The commands that count for their line only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OneShot {
    Dwell,
    Machine,
}

/// The words of a line.
#[derive(Debug, Default)]
pub(super) struct Words {
    pub(super) motion: Option<Motion>,
    pub(super) one_shot: Option<OneShot>,
    pub(super) relative: Option<bool>,
    pub(super) f: Option<Decimal>,
    pub(super) n: Option<Decimal>,
    pub(super) p: Option<Decimal>,
    pub(super) x: Option<Decimal>,
}

const MAX_LINE_NUMBER: u32 = 9_999_999;

impl Words {
    /// Reads all words of a line.
    pub(super) fn read(&mut self, text: &[u8]) -> Result<(), Error> {
        let mut rest = text;
        while let Some((&letter, after)) = rest.split_first() {
            if !letter.is_ascii_uppercase() {
                return Err(Error::ExpectedLetter);
            }
            let (value, after) = number::parse(after).ok_or(Error::BadNumber)?;
            self.take(letter, value)?;
            rest = after;
        }
        Ok(())
    }

    fn take(&mut self, letter: u8, value: Decimal) -> Result<(), Error> {
        let place = match letter {
            b'G' => return self.command(value),
            b'F' => &mut self.f,
            b'N' => &mut self.n,
            b'P' => &mut self.p,
            b'X' => &mut self.x,
            _ => return Err(Error::Unsupported),
        };
        if place.replace(value).is_some() {
            return Err(Error::RepeatedWord);
        }
        if value.is_negative() && letter != b'X' {
            return Err(Error::Negative);
        }
        if letter == b'N' && value.whole() > MAX_LINE_NUMBER {
            return Err(Error::LineNumber);
        }
        Ok(())
    }

    fn command(&mut self, value: Decimal) -> Result<(), Error> {
        if value.is_negative() && value.whole() > 0 {
            return Err(Error::Unsupported);
        }
        let group_taken = match value.whole() {
            0 => self.motion.replace(Motion::Rapid).is_some(),
            1 => self.motion.replace(Motion::Feed).is_some(),
            4 => self.one_shot.replace(OneShot::Dwell).is_some(),
            53 => self.one_shot.replace(OneShot::Machine).is_some(),
            // Millimetres are all there is.
            21 => false,
            90 => self.relative.replace(false).is_some(),
            91 => self.relative.replace(true).is_some(),
            _ => return Err(Error::Unsupported),
        };
        if !value.is_whole() {
            return Err(Error::NotInteger);
        }
        if group_taken {
            return Err(Error::ModalGroup);
        }
        Ok(())
    }
}
