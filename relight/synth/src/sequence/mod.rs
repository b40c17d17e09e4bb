//! Whole simulated turns, as `relit-extract` would leave them: camera and object ride on a table, so in the
//! pictures the object stands still and the light turns about the table's axis.
//!
//! | file | concern |
//! | --- | --- |
//! | `description` | how turns are made, and what stands in files of them |
//! | `stand` | how an object stands on the table |
//! | `simulated` | a turn and its frames, rendered |
//! | `ground_truth` | the ground truth of a turn, beside its shard |

mod description;
mod ground_truth;
mod simulated;
mod table_pose;
#[cfg(test)]
mod tests;

use std::path::Path;

use rayon::prelude::*;
use relit_data::geometry::Rect;
use relit_data::image_stats::{MaskSpans, SATURATION_LEVEL};
use relit_data::mask::bounding_box;
use relit_data::shard::{
    self, Align, Dataset, Digest, ExtractionSettings, ImageSize, Layout, MaskInfo, OutputFolder,
    SamplingBasis, SessionEntry, SessionQuality, ShardEntry, ShardWriter,
};
use relit_data::spec_net_gate::SPEC_NET_GATE;

use super::SynthError;
use super::library::Library;
use super::samples::folder::{SynthSummary, holds_samples, write_file, write_folder};
use super::samples::sample::mask;
use ground_truth::{ground_truth_of, write_frame, write_object};
use simulated::{RenderedFrame, SimulatedSequence};
pub(crate) use table_pose::{TablePose, standing_object};

pub use description::{FrameTruth, SequenceDescription, SequenceRecipe};

/// Frames that are made in parallel before they are written.
const BATCH: u32 = 32;

/// Writes the turns 0 to `count - 1` into the data set in the folder `out`: shards in the format of
/// `relit-extract`, and next to them `truth/<session>/`. Frames are made in parallel on rayon's threads.
/// Turns that the data set already describes are kept. `progress` is called for each finished frame.
///
/// # Errors
/// If a setting is out of range, `out` holds another data set, or a file cannot be written: turns
/// that are whole stay.
pub fn write_sequences(
    turns: &SequenceRecipe,
    library: &Library,
    count: u64,
    out: &Path,
    progress: &(dyn Fn() + Sync),
) -> Result<SynthSummary, SynthError> {
    turns.recipe.check()?;
    if !(1..=shard::MAX_SAMPLES).contains(&turns.frames) {
        let fault = format!(
            "the number of frames is {}: give 1 to 1000000",
            turns.frames
        );
        return Err(SynthError::Refused(fault));
    }
    let folder = OutputFolder::lock(out)?;
    let mut dataset = open_dataset(out, &settings(turns))?;
    let mut written = SynthSummary::default();
    for number in 0..count {
        let turn = SimulatedSequence::draw(turns, library, number);
        if is_whole(&turn, &dataset, out)? {
            written.kept += 1;
            (0..turns.frames).for_each(|_| progress());
            continue;
        }
        let (entry, shards) = write_turn(&turn, &folder, progress)?;
        dataset.replace(entry, shards);
        dataset.write(out)?;
        written.new += 1;
    }
    Ok(written)
}

fn settings(turns: &SequenceRecipe) -> ExtractionSettings {
    ExtractionSettings {
        frames: turns.frames,
        size: ImageSize::NATIVE,
        margin: 0.0,
        saturation_level: SATURATION_LEVEL,
        gate: SPEC_NET_GATE,
        align: Align::Off,
        align_tolerance: None,
        layout: Layout::Webdataset,
        scaling: "none".to_owned(),
    }
}

fn open_dataset(out: &Path, settings: &ExtractionSettings) -> Result<Dataset, SynthError> {
    if holds_samples(out) {
        return Err(SynthError::other_settings(out));
    }
    match Dataset::read(out) {
        Ok(there) if there.settings == *settings => Ok(there),
        Ok(_) => Err(SynthError::other_settings(out)),
        Err(shard::ShardError::NoDataset { .. }) => Ok(Dataset::new(settings.clone())),
        Err(error) => Err(error.into()),
    }
}

/// Whether the data set holds this very turn, whole.
fn is_whole(
    turn: &SimulatedSequence<'_>,
    dataset: &Dataset,
    out: &Path,
) -> Result<bool, SynthError> {
    let Some(entry) = dataset.session(&turn.session) else {
        return Ok(false);
    };
    if entry.input != turn.input() {
        return Err(SynthError::other_settings(out));
    }
    let truth = ground_truth_of(out, &turn.session);
    // The last file that came to be part of it.
    Ok(truth.join("light.txt").is_file() && dataset.check_integrity(out, &turn.session).is_ok())
}

/// Writes shard, table and ground truth.
fn write_turn(
    turn: &SimulatedSequence<'_>,
    folder: &OutputFolder,
    progress: &(dyn Fn() + Sync),
) -> Result<(SessionEntry, Vec<ShardEntry>), SynthError> {
    let mask = mask(turn.scene.buffer());
    let spans = MaskSpans::from_mask(&mask);
    let frames = turn.description.frames;
    let layout = Layout::Webdataset;
    let mut writer = ShardWriter::create(folder.path(), layout, &turn.session, frames, &mask)?;
    let mut records = Vec::new();
    let place = ground_truth_of(folder.path(), &turn.session);
    let files = write_folder(&place, |truth| {
        write_object(truth, turn)?;
        let mut lines = Vec::new();
        for first in (0..frames).step_by(BATCH as usize) {
            let batch: Result<Vec<RenderedFrame>, SynthError> = (first..frames.min(first + BATCH))
                .into_par_iter()
                .map(|index| {
                    let frame = turn.frame(index, &spans);
                    progress();
                    frame
                })
                .collect();
            for frame in batch? {
                write_frame(truth, &frame)?;
                lines.extend(serde_json::to_vec(&frame.truth).unwrap_or_default());
                lines.push(b'\n');
                records.push(frame.sample.record.clone());
                writer.push(frame.sample)?;
            }
        }
        write_file(truth, "frames.jsonl", &lines)?;
        Ok::<_, SynthError>(writer.finish()?)
    })?;
    let spec_net = records.iter().filter(|record| record.spec_net).count();
    let entry = SessionEntry {
        id: turn.session.clone(),
        object: turn.object.clone(),
        input: turn.input(),
        mask: MaskInfo {
            blake3: Digest::hash(&shard::encode_mask(&mask)?),
            px: spans.pixels(),
            bounding_box: bounding_box(&mask).unwrap_or(Rect::new(0, 0, 0, 0)),
        },
        selection: SamplingBasis::Angle,
        samples: frames,
        covered_deg: None,
        rig: None,
        duplicates: 0,
        spec_net: spec_net as u32,
        lossy: false,
        quality: SessionQuality::from_records(&records, false, None),
        warnings: Vec::new(),
        table: files.table,
        report: None,
    };
    Ok((entry, files.shards))
}
