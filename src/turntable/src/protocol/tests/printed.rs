//! Messages as a controller prints them.

use std::fmt;

use crate::protocol::number::MAX_LENGTH;
use crate::protocol::{Message, StatusReport};

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Message::Ok { seq } => write!(f, "ok{}", numbered(*seq)),
            Message::Error { code, seq } => write!(f, "error:{code}{}", numbered(*seq)),
            Message::Alarm(code) => write!(f, "ALARM:{code}"),
            Message::Status(report) => report.fmt(f),
            Message::Banner(None) => f.write_str("Grbl 1.1h ['$' for help]"),
            Message::Banner(Some(cause)) => write!(f, "Grbl 1.1h ['$' for help] [reset: {cause}]"),
            Message::Version { version, note } => write!(f, "[VER:{version}:{note}]"),
            Message::Build { letters } => write!(f, "[OPT:{letters},8,128]"),
            Message::Info { tag, text } => write!(f, "[{tag}:{text}]"),
            Message::Setting { number, value } => write!(f, "${number}={}", shown(*value, 3)),
            Message::Other => f.write_str(">G21:ok"),
        }
    }
}

fn numbered(seq: Option<u32>) -> String {
    seq.map_or_else(String::new, |seq| format!(" N{seq}"))
}

impl fmt::Display for StatusReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "<{}", self.state)?;
        if let Some(code) = self.alarm {
            write!(f, ":{code}")?;
        }
        write!(f, "|MPos:{},0.000,0.000", shown(self.machine_deg, 3))?;
        if let Some(feed) = self.feed {
            write!(f, "|FS:{feed},0")?;
        }
        if let Some(us) = self.chip_us {
            write!(f, "|T:{us}")?;
        }
        if let Some(volts) = self.battery_v {
            write!(f, "|Bat:{}", shown(volts, 2))?;
        }
        match (self.pins.index, self.pins.emergency_stop) {
            (false, false) => {}
            (true, false) => f.write_str("|Pn:X")?,
            (false, true) => f.write_str("|Pn:R")?,
            (true, true) => f.write_str("|Pn:XR")?,
        }
        if let Some(homed) = self.homed {
            write!(f, "|H:{}", u8::from(homed))?;
        }
        f.write_str(">")
    }
}

/// A value as Grbl writes it, with so many digits behind the point; as it is where others wrote more, or where that would be too
/// long.
fn shown(value: f64, digits: usize) -> String {
    let usual = format!("{value:.digits$}");
    if usual.len() <= MAX_LENGTH && usual.parse() == Ok(value) {
        usual
    } else {
        value.to_string()
    }
}
