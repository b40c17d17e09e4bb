//! The lines that a controller sends.

use std::fmt;

use super::number::{decimal, shown, whole};
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
    /// The host sent the reset command.
    Host,
}

impl RestartCause {
    const NAMES: [(RestartCause, &'static str); 5] = [
        (RestartCause::PowerOn, "power-on"),
        (RestartCause::External, "external"),
        (RestartCause::BrownOut, "brown-out"),
        (RestartCause::Watchdog, "watchdog"),
        (RestartCause::Host, "host"),
    ];

    fn parse(text: &str) -> Option<RestartCause> {
        let mut names = Self::NAMES.iter();
        names
            .find(|(_, name)| *name == text)
            .map(|(cause, _)| *cause)
    }
}

impl fmt::Display for RestartCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut names = Self::NAMES.iter();
        let found = names.find(|(cause, _)| cause == self);
        f.write_str(found.map_or("", |(_, name)| name))
    }
}

/// The line with which a controller starts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Banner {
    /// Grbl's version, such as `1.1h`.
    pub version: String,
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
        /// Version and date, such as `1.1h.20190830`.
        version: String,
        /// The note.
        note: String,
    },
    /// `[OPT:..]`: how the firmware was built.
    Build {
        /// One letter per option.
        letters: String,
        /// Size of the planner buffer, blocks.
        blocks: u32,
        /// Size of the receive buffer, bytes.
        buffer: u32,
    },
    /// `[MSG:..]`: a text for the user.
    Note(String),
    /// Any other line in brackets, such as `[GC:G0 G54 ..]`.
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
    /// `>G21:ok`: a start-up line the controller ran by itself, with its answer.
    Startup(String),
}

/// Parses one line without its line end; `None` if it is no line of a Grbl 1.1 controller.
#[must_use]
pub fn parse(line: &str) -> Option<Message> {
    match line.as_bytes().first()? {
        b'<' => StatusReport::parse(line).map(Message::Status),
        b'[' => bracket(line.strip_prefix('[')?.strip_suffix(']')?),
        b'$' => setting(line.strip_prefix('$')?),
        b'>' => Some(Message::Startup(line.strip_prefix('>')?.to_owned())),
        b'G' => banner(line),
        _ => answer(line),
    }
}

fn answer(line: &str) -> Option<Message> {
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

fn banner(line: &str) -> Option<Message> {
    let (version, rest) = line.strip_prefix("Grbl ")?.split_once(' ')?;
    let rest = rest.strip_prefix("['$' for help]")?;
    let usable = |b: u8| b.is_ascii_alphanumeric() || b == b'.';
    if version.is_empty() || !version.bytes().all(usable) {
        return None;
    }
    let cause = match rest {
        "" => None,
        _ => {
            let words = rest.strip_prefix(" [reset: ")?.strip_suffix(']')?;
            Some(RestartCause::parse(words)?)
        }
    };
    let version = version.to_owned();
    Some(Message::Banner(Banner { version, cause }))
}

fn bracket(inside: &str) -> Option<Message> {
    let (tag, text) = inside.split_once(':')?;
    if tag.is_empty() || !tag.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'.') {
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
            let mut parts = text.split(',');
            let letters = parts.next()?.to_owned();
            Message::Build {
                letters,
                blocks: whole(parts.next()?)?,
                buffer: whole(parts.next()?)?,
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
    let (number, value) = inside.split_once('=')?;
    let number = u16::try_from(whole(number)?).ok()?;
    let value = decimal(value)?;
    Some(Message::Setting { number, value })
}

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Message::Ok { seq } => write!(f, "ok{}", numbered(*seq)),
            Message::Error { code, seq } => write!(f, "error:{code}{}", numbered(*seq)),
            Message::Alarm(code) => write!(f, "ALARM:{code}"),
            Message::Status(report) => report.fmt(f),
            Message::Banner(Banner { version, cause }) => {
                write!(f, "Grbl {version} ['$' for help]")?;
                cause.map_or(Ok(()), |cause| write!(f, " [reset: {cause}]"))
            }
            Message::Version { version, note } => write!(f, "[VER:{version}:{note}]"),
            Message::Build {
                letters,
                blocks,
                buffer,
            } => write!(f, "[OPT:{letters},{blocks},{buffer}]"),
            Message::Note(text) => write!(f, "[MSG:{text}]"),
            Message::Info { tag, text } => write!(f, "[{tag}:{text}]"),
            Message::Setting { number, value } => write!(f, "${number}={}", shown(*value, 3)),
            Message::Startup(text) => write!(f, ">{text}"),
        }
    }
}

fn numbered(seq: Option<u32>) -> String {
    seq.map_or_else(String::new, |seq| format!(" N{seq}"))
}
