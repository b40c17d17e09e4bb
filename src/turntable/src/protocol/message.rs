//! The lines that a controller sends.

use super::error_texts;
use super::number::{decimal, whole};
use super::status::StatusReport;

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
    /// The controller has started; why, if it says so.
    Banner(Option<String>),
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
    },
    /// Any other line in brackets, such as `[MSG:..]` or `[FIRMWARE:grblHAL]`.
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
    /// A setting whose value is not a number (`$300=grblHAL`), or a start-up line that the controller ran by
    /// itself, with its answer (`>G21:ok`).
    Other,
}

/// Parses one line without its line end; `None` if no controller of the Grbl family sends it.
pub fn parse(line: &str) -> Option<Message> {
    match line.as_bytes().first()? {
        b'<' => StatusReport::parse(line).map(Message::Status),
        b'[' => bracket(line.strip_prefix('[')?.strip_suffix(']')?),
        b'$' => setting(line.strip_prefix('$')?),
        b'>' => Some(Message::Other),
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
fn banner(line: &str) -> Option<Option<String>> {
    let boot = line.strip_prefix("rst:").map(|reset| {
        let cause = reset.split(['(', ')']).nth(1);
        cause.unwrap_or(reset).to_ascii_lowercase()
    });
    let named = line
        .rsplit_once(" [reset: ")
        .and_then(|(_, cause)| Some(cause.strip_suffix(']')?.to_owned()));
    let is_banner = boot.is_some() || line.contains("for help]") || names_grbl(line);
    is_banner.then(|| boot.or(named))
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
            let letters = text.split(',').next().unwrap_or_default();
            Message::Build {
                letters: letters.to_owned(),
            }
        }
        _ => Message::Info {
            tag: tag.to_owned(),
            text: text.to_owned(),
        },
    })
}

fn setting(inside: &str) -> Option<Message> {
    let (number, text) = inside.split_once('=')?;
    let number = u16::try_from(whole(number)?).ok()?;
    Some(decimal(text).map_or(Message::Other, |value| Message::Setting { number, value }))
}
