//! The lines that a controller sends.

use std::fmt;

use super::error_texts;
use super::number::{decimal, whole};
use super::status::StatusReport;

/// Why the controller started.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RestartCause {
    /// Its power came on.
    PowerOn,
    /// Its reset pin, which an Uno's USB side pulls when the port is opened.
    External,
    /// Its supply voltage dropped.
    BrownOut,
    /// It hung, and its watchdog restarted it.
    Watchdog,
    /// Its own program: after a crash, an update, or on request (ESP32).
    Software,
    /// The host sent the reset command.
    Host,
}

impl RestartCause {
    const NAMES: [(RestartCause, &'static str); 6] = [
        (RestartCause::PowerOn, "power-on"),
        (RestartCause::External, "external"),
        (RestartCause::BrownOut, "brown-out"),
        (RestartCause::Watchdog, "watchdog"),
        (RestartCause::Software, "software"),
        (RestartCause::Host, "host"),
    ];

    fn parse(text: &str) -> Option<RestartCause> {
        let mut names = Self::NAMES.iter();
        names
            .find(|(_, name)| *name == text)
            .map(|(cause, _)| *cause)
    }

    /// Reads the name that an ESP32's boot loader gives, such as `POWERON_RESET`.
    fn from_boot_loader(name: &str) -> RestartCause {
        let is = |part: &str| name.contains(part);
        match () {
            () if is("POWERON") => RestartCause::PowerOn,
            () if is("BROWN") => RestartCause::BrownOut,
            () if is("WDT") => RestartCause::Watchdog,
            () if is("EXT") => RestartCause::External,
            () => RestartCause::Software,
        }
    }
}

impl fmt::Display for RestartCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut names = Self::NAMES.iter();
        let found = names.find(|(cause, _)| cause == self);
        f.write_str(found.map_or("", |(_, name)| name))
    }
}

/// A line with which a controller starts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Banner {
    /// The line.
    pub text: String,
    /// Why it started, if it reports that.
    pub cause: Option<RestartCause>,
}

/// A line from the controller.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// A line was accepted.
    Ok {
        /// The checked line's number.
        seq: Option<u32>,
    },
    /// A line was refused.
    Error {
        /// Grbl's error number.
        code: u8,
        /// The checked line's number.
        seq: Option<u32>,
    },
    /// An alarm, with Grbl's number.
    Alarm(u8),
    /// A status report.
    Status(StatusReport),
    /// The controller has started.
    Banner(Banner),
    /// `[VER:..]`: the firmware's version and the note its owner gave it.
    Version {
        /// Version and date, such as `1.1h.20190830`, or `3.9 FluidNC v3.9.1`.
        version: String,
        /// The note.
        note: String,
    },
    /// `[OPT:..]`: how the firmware was built.
    Build {
        /// One letter per option.
        letters: String,
        /// Sizes of its buffers, and what grblHAL adds to them; empty with FluidNC and Grbl_ESP32.
        sizes: String,
    },
    /// `[MSG:..]`: a text for the user.
    Note(String),
    /// Any other line in brackets, such as `[GC:G0 G54 ..]` or `[FIRMWARE:grblHAL]`.
    Info {
        /// The text before the colon.
        tag: String,
        /// The text after it.
        text: String,
    },
    /// `$100=88.889`: a setting.
    Setting {
        /// Its number.
        number: u16,
        /// Its value.
        value: f64,
    },
    /// `$300=grblHAL`: a setting whose value is not a number.
    TextSetting {
        /// Its number.
        number: u16,
        /// Its value.
        text: String,
    },
    /// `>G21:ok`: a start-up line the controller ran by itself, with its answer.
    Startup(String),
}

/// Parses one line without its line end; `None` if no controller of the Grbl family sends it.
#[must_use]
pub fn parse(line: &str) -> Option<Message> {
    match line.as_bytes().first()? {
        b'<' => StatusReport::parse(line).map(Message::Status),
        b'[' => bracket(line.strip_prefix('[')?.strip_suffix(']')?),
        b'$' => setting(line.strip_prefix('$')?),
        b'>' => Some(Message::Startup(line.strip_prefix('>')?.to_owned())),
        _ => banner(line).map(Message::Banner).or_else(|| answer(line)),
    }
}

fn answer(line: &str) -> Option<Message> {
    if let Some(text) = line.strip_prefix("error:")
        && text.starts_with(|letter: char| letter.is_ascii_alphabetic())
    {
        let code = error_texts::code(text);
        return Some(Message::Error { code, seq: None });
    }
    let (word, seq) = match line.split_once(' ') {
        Some((word, number)) => (word, Some(whole(number.strip_prefix('N')?)?)),
        None => (line, None),
    };
    if word == "ok" {
        return Some(Message::Ok { seq });
    }
    let (kind, code) = word.split_once(':')?;
    let code = u8::try_from(whole(code)?).ok()?;
    match kind {
        "error" => Some(Message::Error { code, seq }),
        "ALARM" if seq.is_none() => Some(Message::Alarm(code)),
        _ => None,
    }
}

/// A controller's first line, in whichever words: `Grbl 1.1h ['$' for help]`, `GrblHAL 1.1f ['$' or
/// '$HELP' for help]`, `Grbl 3.9 [FluidNC v3.9.1 (wifi) '$' for help]`. A restart that is missed costs
/// the position, so that a part of such a line counts too, and so does what an ESP32's boot loader
/// prints before it.
fn banner(line: &str) -> Option<Banner> {
    let boot = line
        .strip_prefix("rst:")
        .map(RestartCause::from_boot_loader);
    let named = line
        .rsplit_once(" [reset: ")
        .and_then(|(_, cause)| RestartCause::parse(cause.strip_suffix(']')?));
    let is_banner = boot.is_some() || line.contains("for help]") || names_grbl(line);
    is_banner.then(|| Banner {
        text: line.to_owned(),
        cause: boot.or(named),
    })
}

/// Whether a line begins with Grbl's name or a relative's, and a version.
fn names_grbl(line: &str) -> bool {
    let Some((name, rest)) = line.split_once(' ') else {
        return false;
    };
    let named = name
        .get(..4)
        .is_some_and(|start| start.eq_ignore_ascii_case("grbl"));
    named && rest.starts_with(|first: char| first.is_ascii_digit() || first == 'v')
}

fn bracket(inside: &str) -> Option<Message> {
    let (tag, text) = inside.split_once(':').unwrap_or((inside, ""));
    if tag.is_empty() {
        return None;
    }
    Some(match tag {
        "VER" => {
            let (version, note) = text.split_once(':').unwrap_or((text, ""));
            Message::Version {
                version: version.to_owned(),
                note: note.to_owned(),
            }
        }
        "OPT" => {
            let (letters, sizes) = text.split_once(',').unwrap_or((text, ""));
            Message::Build {
                letters: letters.to_owned(),
                sizes: sizes.to_owned(),
            }
        }
        "MSG" => Message::Note(text.to_owned()),
        _ => Message::Info {
            tag: tag.to_owned(),
            text: text.to_owned(),
        },
    })
}

fn setting(inside: &str) -> Option<Message> {
    let (number, text) = inside.split_once('=')?;
    let number = u16::try_from(whole(number)?).ok()?;
    Some(match decimal(text) {
        Some(value) => Message::Setting { number, value },
        None => Message::TextSetting {
            number,
            text: text.to_owned(),
        },
    })
}
