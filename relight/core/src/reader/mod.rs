//! Data sets as streams of plain `f32` arrays, for training and for evaluation. Knows files and
//! nothing of networks and frameworks.
//!
//! | what | type |
//! | --- | --- |
//! | whole turns: shards of `relit-extract`, and folders in the layout of the paper's released data set | [`Turns`] |
//! | images with their ground truth, in folders: of `relight synth` (the warm-up set), MIT Intrinsic Images, Janner et al. | [`TruthSet`] |
//! | the order in which samples are drawn: batches of neighbours, shuffled, restartable | [`DrawPlan`] |
//! | batches decoded by threads ahead of their consumer | [`Stream`] |
//!
//! A sample that is damaged is never left out in silence: [`DamagedBatch`]. [`Stream`] has an example.

mod draw_plan;
mod error;
mod listing;
mod stream;
mod truth;
mod turns;

pub use draw_plan::{Cursor, Draw, DrawPlan, Rank, SampleId};
pub use error::{DamagedBatch, DamagedSample, ReadError};
pub use stream::{Source, Stream, StreamedBatch, Streaming};
pub use truth::{TruthLayout, TruthSample, TruthSet};
pub use turns::{Encoding, TurnBatch, TurnFrame, Turns};
