//! The ground truth of a turn, beside its shard.

use std::fs;
use std::path::{Path, PathBuf};
use std::process;

use relit_data::durable::publish;

use super::simulated::{RenderedFrame, SimulatedSequence};
use crate::SynthError;
use crate::samples::png::{Rgb16, encode_sixteen};

/// The folder of the ground truth of all turns.
const TRUTH: &str = "truth";

/// The path of a session's ground truth in a data set.
pub(super) fn ground_truth_of(out: &Path, session: &str) -> PathBuf {
    out.join(TRUTH).join(session)
}

/// The ground truth of a turn, written under another name until it is whole.
pub(super) struct GroundTruthFolder {
    partial: PathBuf,
    place: PathBuf,
}

impl GroundTruthFolder {
    pub(super) fn create(out: &Path, session: &str) -> Result<Self, SynthError> {
        let place = ground_truth_of(out, session);
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

    /// Writes what all frames share.
    pub(super) fn write_object(&self, turn: &SimulatedSequence<'_>) -> Result<(), SynthError> {
        let (buffer, material) = (turn.scene.buffer(), &turn.material);
        self.write("turn.json", &turn.json())?;
        self.write("light.txt", turn.first_light().to_string().as_bytes())?;
        let albedo = encode_sixteen(buffer, &Rgb16::up_to(&material.albedo, 1.0))?;
        self.write("albedo.png", &albedo)?;
        let normals = encode_sixteen(buffer, &Rgb16::normals(&material.normals))?;
        self.write("normal.png", &normals)
    }

    pub(super) fn write_frame(&self, frame: &RenderedFrame) -> Result<(), SynthError> {
        let index = frame.truth.index;
        self.write(&format!("shading/{index:04}.png"), &frame.shading)?;
        self.write(&format!("highlight/{index:04}.png"), &frame.highlight)
    }

    /// Gives the ground truth its name, in place of an older one.
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

impl Drop for GroundTruthFolder {
    fn drop(&mut self) {
        // After publishing there is nothing under this name.
        let _ = fs::remove_dir_all(&self.partial);
    }
}
