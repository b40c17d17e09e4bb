//! Grbl and its relatives.

use std::fmt;

use super::protocol::Message;

/// Which firmware of the Grbl family a controller runs, as it says itself.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// The rig's own firmware.
    Rig,
    /// Grbl 1.1, or one that says no more of itself.
    #[default]
    Grbl,
    /// grblHAL.
    GrblHal,
    /// FluidNC.
    FluidNc,
    /// Grbl_ESP32, FluidNC's predecessor.
    GrblEsp32,
}

impl Family {
    /// Reads the answer to `$I`.
    pub(super) fn from_messages(about: &[Message]) -> Family {
        let families = about.iter().rev().find_map(Self::from_message);
        families.unwrap_or_default()
    }

    /// The number of its alarm for the emergency stop.
    pub(super) fn emergency_stop_alarm(self) -> Option<u8> {
        match self {
            Family::Rig | Family::Grbl | Family::GrblHal => Some(10),
            Family::FluidNc | Family::GrblEsp32 => None,
        }
    }

    fn from_message(message: &Message) -> Option<Family> {
        match message {
            Message::Version { note, .. } if note == "relit" => Some(Family::Rig),
            Message::Version { version, .. } if version.contains("FluidNC") => {
                Some(Family::FluidNc)
            }
            // Grbl has not gone beyond 1.1.
            Message::Version { version, .. }
                if version.starts_with("1.2") || version.starts_with("1.3") =>
            {
                Some(Family::GrblEsp32)
            }
            Message::Info { tag, text } if tag == "FIRMWARE" && text == "grblHAL" => {
                Some(Family::GrblHal)
            }
            _ => None,
        }
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Family::Rig => "the rig's firmware",
            Family::Grbl => "Grbl",
            Family::GrblHal => "grblHAL",
            Family::FluidNc => "FluidNC",
            Family::GrblEsp32 => "Grbl_ESP32",
        })
    }
}
