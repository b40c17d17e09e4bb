//! What a mask's record says of the network that found the object.

use relit_data::geometry::Rect;
use serde::{Deserialize, Serialize};

/// The network whose marks are the recorded seeds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedNetwork {
    /// Its files, and those in which they keep weights.
    pub files: Vec<NetworkFile>,
    /// The rectangle within which it was asked; outside, the marks are background.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rect: Option<Rect>,
}

/// A file of a network.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkFile {
    /// Its name, without folders.
    pub name: String,
    /// BLAKE3 of its content, in hexadecimal.
    pub blake3: String,
}
