//! Why a line was refused: the numbers of `error:N`.
//!
//! Numbers up to 36 are Grbl's own; 70 and up belong to checked lines.

/// Why a line was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Error {
    /// A word does not begin with a letter.
    ExpectedLetter = 1,
    /// A number is missing, malformed or out of range.
    BadNumber = 2,
    /// No such `$` command.
    InvalidStatement = 3,
    /// The value must not be negative.
    Negative = 4,
    /// Homing is off (`$22`).
    HomingDisabled = 5,
    /// A step pulse shorter than 3 us.
    StepPulse = 6,
    /// Settings in the EEPROM were damaged.
    Eeprom = 7,
    /// Allowed at rest only.
    NotIdle = 8,
    /// Locked by an alarm or a jog.
    Locked = 9,
    /// More characters than the line buffer holds.
    LineTooLong = 11,
    /// More than 10 000 steps/s.
    StepRate = 12,
    /// The jog would pass the soft limit.
    JogTravel = 15,
    /// `$J` without `=`, or with a word that a jog has no use for.
    InvalidJog = 16,
    /// A word or command that the table does not know.
    Unsupported = 20,
    /// Two commands of one modal group.
    ModalGroup = 21,
    /// No feed was ever given.
    UndefinedFeed = 22,
    /// A command number with a fraction.
    NotInteger = 23,
    /// A word stands twice.
    RepeatedWord = 25,
    /// The command needs an axis word.
    NoAxisWords = 26,
    /// A line number beyond 9999999.
    LineNumber = 27,
    /// The command needs a `P` word.
    ValueMissing = 28,
    /// `G53` without a motion.
    MachineMotion = 30,
    /// No command uses the axis word.
    UnusedAxisWords = 31,
    /// A target that cannot be reached in numbers.
    InvalidTarget = 33,
    /// No command uses a word.
    UnusedWords = 36,
    /// Damaged on the way: checksum wrong or missing, or bytes lost.
    Damaged = 70,
    /// Not the line that is due.
    OutOfOrder = 71,
    /// A checked line while no checked session is open.
    NoSession = 72,
}

impl Error {
    /// The number that goes over the wire.
    pub(crate) fn code(self) -> u8 {
        self as u8
    }
}
