//! What is true of a turn, beside its shard.

use std::fs;
use std::path::{Path, PathBuf};
use std::process;

use relit_data::durable::publish;
use serde::{Deserialize, Serialize};

use super::{Frame, Turn};
use crate::SynthError;
use crate::png::{Sixteen, encode_sixteen};
use crate::sample::Whites;

/// The folder of the truth of all turns.
const TRUTH: &str = "truth";

/// What is true of one frame, a line of `frames.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameTruth {
    /// The sample's index.
    pub index: u32,
    /// The table's angle, degrees.
    pub angle_deg: f64,
    /// What 65535 stands for in the frame's `shading` and `highlight`.
    pub white: Whites,
    /// All light but what bounces, as nine coefficients in the viewer's frame, with the camera's gain.
    pub coefficients: [[f64; 3]; 9],
}

/// Where the truth of a session lies in a data set.
pub(super) fn place(out: &Path, session: &str) -> PathBuf {
    out.join(TRUTH).join(session)
}

/// The truth of a turn, written under another name until it is whole.
pub(super) struct TruthFolder {
    partial: PathBuf,
    place: PathBuf,
}

impl TruthFolder {
    pub(super) fn create(out: &Path, session: &str) -> Result<Self, SynthError> {
        let place = place(out, session);
        let partial = place.with_file_name(format!(".{session}.{}.partial", process::id()));
        // What a killed process of this number left.
        let _ = fs::remove_dir_all(&partial);
        for folder in ["shading", "highlight"] {
            let path = partial.join(folder);
            fs::create_dir_all(&path).map_err(SynthError::write(&path))?;
        }
        Ok(Self { partial, place })
    }

    pub(super) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), SynthError> {
        let path = self.partial.join(name);
        fs::write(&path, bytes).map_err(SynthError::write(&path))
    }

    /// What all frames share.
    pub(super) fn write_object(&self, turn: &Turn<'_>) -> Result<(), SynthError> {
        let (buffer, material) = (turn.scene.buffer(), &turn.material);
        self.write("turn.json", &turn.json())?;
        let albedo = encode_sixteen(buffer, &Sixteen::up_to(&material.albedo, 1.0))?;
        self.write("albedo.png", &albedo)?;
        let normals = encode_sixteen(buffer, &Sixteen::normals(&material.normals))?;
        self.write("normal.png", &normals)
    }

    pub(super) fn write_frame(&self, frame: &Frame) -> Result<(), SynthError> {
        let index = frame.truth.index;
        self.write(&format!("shading/{index:04}.png"), &frame.shading)?;
        self.write(&format!("highlight/{index:04}.png"), &frame.highlight)
    }

    /// Gives the truth its name, in place of an older one.
    pub(super) fn publish(&self) -> Result<(), SynthError> {
        match fs::remove_dir_all(&self.place) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(SynthError::write(&self.place)(error));
            }
            _ => {}
        }
        publish(&self.partial, &self.place).map_err(SynthError::write(&self.place))
    }
}

impl Drop for TruthFolder {
    fn drop(&mut self) {
        // After publishing there is nothing under this name.
        let _ = fs::remove_dir_all(&self.partial);
    }
}
