//! The ground truth of a turn, beside its shard.

use std::fs;
use std::path::{Path, PathBuf};

use super::simulated::{RenderedFrame, SimulatedSequence};
use crate::SynthError;
use crate::samples::folder::write_file;
use crate::samples::png::{Rgb16, encode_sixteen};

/// The path of a session's ground truth in a data set.
pub(super) fn ground_truth_of(out: &Path, session: &str) -> PathBuf {
    out.join("truth").join(session)
}

/// Writes what all frames share, and makes the folders of the frames.
pub(super) fn write_object(folder: &Path, turn: &SimulatedSequence<'_>) -> Result<(), SynthError> {
    for name in ["shading", "highlight"] {
        let path = folder.join(name);
        fs::create_dir(&path).map_err(SynthError::write(&path))?;
    }
    let (buffer, material) = (turn.scene.buffer(), &turn.material);
    write_file(folder, "turn.json", &turn.json())?;
    write_file(
        folder,
        "light.txt",
        turn.first_light().to_string().as_bytes(),
    )?;
    let albedo = encode_sixteen(buffer, &Rgb16::up_to(&material.albedo, 1.0))?;
    write_file(folder, "albedo.png", &albedo)?;
    let normals = encode_sixteen(buffer, &Rgb16::normals(&material.normals))?;
    write_file(folder, "normal.png", &normals)
}

pub(super) fn write_frame(folder: &Path, frame: &RenderedFrame) -> Result<(), SynthError> {
    let index = frame.truth.index;
    write_file(folder, &format!("shading/{index:04}.png"), &frame.shading)?;
    write_file(
        folder,
        &format!("highlight/{index:04}.png"),
        &frame.highlight,
    )
}
