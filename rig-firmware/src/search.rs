//! Looking for the index while the table turns: to one exact step, past contacts that bounce.
//!
//! Knows positions and ticks; nothing of moves.

/// What is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Search {
    /// Nothing.
    Off,
    /// The level is not there yet.
    For(bool),
    /// The level came at this position, and has been there for so many ticks.
    Seen {
        /// The level.
        level: bool,
        /// Where it came.
        position: i32,
        /// For how long it has been there.
        ticks: u32,
    },
    /// The level came at this position and stayed.
    Found(i32),
}

impl Search {
    /// Takes in the level at a position, `ticks` after the look before. A level counts from where
    /// it first came, if it stays for `debounce` ticks. True: found just now.
    pub(crate) fn look(&mut self, active: bool, here: i32, ticks: u32, debounce: u32) -> bool {
        let (level, position, stayed) = match *self {
            Search::Off | Search::Found(_) => return false,
            Search::For(level) => (level, here, 0),
            Search::Seen {
                level,
                position,
                ticks: before,
            } => (level, position, before.saturating_add(ticks)),
        };
        *self = if active != level {
            Search::For(level)
        } else if stayed < debounce {
            Search::Seen {
                level,
                position,
                ticks: stayed,
            }
        } else {
            Search::Found(position)
        };
        matches!(self, Search::Found(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_position_is_the_first_of_those_that_stayed() {
        let mut search = Search::For(false);
        for (here, active) in [(5, true), (6, false), (7, true), (8, false), (9, false)] {
            assert!(!search.look(active, here, 10, 20));
        }
        assert!(search.look(false, 10, 10, 20));
        assert_eq!(search, Search::Found(8));
        assert!(!search.look(false, 11, 10, 20), "found only once");
    }
}
