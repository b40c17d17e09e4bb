//! How recordings are extracted.

use std::path::PathBuf;
use std::thread::available_parallelism;

use relit_data::image_stats::SATURATION_LEVEL;
use relit_data::shard::{Align, ArrayTask, ExtractionSettings, ImageSize, Layout};
use relit_data::spec_net_gate::SPEC_NET_GATE;

use super::scale;

/// Largest side of a scaled image, pixels.
pub const MAX_SIDE: u32 = 8192;
/// Largest margin, as a fraction of the object's longer side.
pub const MAX_MARGIN: f64 = 4.0;
/// Largest `align_tolerance` and `max_shift`, source pixels.
pub const MAX_SHIFT: f64 = 64.0;

/// How to extract. The default is that of the program `relit-extract`.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtractOptions {
    /// Samples per session, at least 1; 1500 is each frame of the rig's turn once.
    pub frames: u32,
    /// Size of images and masks: a square of 1..=[`MAX_SIDE`] pixels, or the source's pixels.
    pub size: ImageSize,
    /// Margin around the object on each side, as a fraction of its longer side,
    /// 0..=[`MAX_MARGIN`].
    pub margin: f64,
    /// The 8-bit value from which a channel is saturated.
    pub saturation_level: u8,
    /// The saturated fraction above which `spec_net` is set, 0..=1: [`SPEC_NET_GATE`] by default.
    pub gate: f64,
    /// How samples are stored.
    pub layout: Layout,
    /// How shifts of the object against its mask are handled.
    pub align: Align,
    /// Shifts up to this are not corrected, source pixels, 0..=[`MAX_SHIFT`].
    pub align_tolerance: f64,
    /// A turn in which the object moves further fails, source pixels, 1..=[`MAX_SHIFT`]. Without effect
    /// where shifts are not measured.
    pub max_shift: f64,
    /// The mask for all recordings, or a folder of masks with the names of clips or sessions; `None` uses the
    /// `mask.png` in each session folder.
    pub mask: Option<PathBuf>,
    /// Extract recordings of a part of a turn too; otherwise they are left out.
    pub partial: bool,
    /// Skip sessions that the data set already holds, intact and made from the same input.
    pub resume: bool,
    /// Replace sessions of the same name that were made from another video.
    pub replace: bool,
    /// The task whose part of the recordings is extracted; `None` extracts all of them.
    pub task: Option<ArrayTask>,
    /// Number of worker threads, at least 1.
    pub threads: usize,
}

impl Default for ExtractOptions {
    fn default() -> Self {
        Self {
            frames: 1500,
            size: ImageSize::Pixels(256),
            margin: 0.05,
            saturation_level: SATURATION_LEVEL,
            gate: SPEC_NET_GATE,
            layout: Layout::Webdataset,
            align: Align::Correct,
            align_tolerance: 0.1,
            max_shift: 8.0,
            mask: None,
            partial: false,
            resume: false,
            replace: false,
            task: None,
            threads: available_parallelism().map_or(1, std::num::NonZero::get),
        }
    }
}

impl ExtractOptions {
    /// The settings as the data set records them.
    pub(super) fn settings(&self) -> ExtractionSettings {
        ExtractionSettings {
            frames: self.frames,
            size: self.size,
            margin: self.margin,
            saturation_level: self.saturation_level,
            gate: self.gate,
            align: self.align,
            align_tolerance: (self.align == Align::Correct).then_some(self.align_tolerance),
            layout: self.layout,
            scaling: match self.size {
                ImageSize::Pixels(_) => scale::METHOD,
                ImageSize::Native(_) => scale::NO_METHOD,
            }
            .to_owned(),
        }
    }
}
