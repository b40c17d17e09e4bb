//! Training, on libtorch (feature `train`). The one module that knows it.
//!
//! | module | concern |
//! | --- | --- |
//! | `model` | a [`relight_nets::Graph`] on tensors: what is trained is what the ONNX file holds |
//! | `adam`, `average`, `learner` | how a network learns; all of it can be saved |
//! | [`losses`], [`low_rank`], `terms` | what is descended |
//! | `sample`, `composer`, `composed`, `window` | samples composed while training |
//! | `decompose`, `decompose_task` | the decomposing network: maps, losses, run |
//! | `held_out` | turns and samples that networks are judged by while they train |
//! | `run`, `checkpoint`, `journal`, `guard` | a run: steps, what is saved, what is logged, what ends it |
//! | `launch`, `process_group`, `agreement`, `joint` | several processes: who they are, sums over them, whether they agree, joint losses |
//! | `paper_layers`, `paper_phases`, `paper_task`, `turn_reader` | the paper's phases: layers on tensors, losses, runs; turns |
//! | `settings` | TOML |

mod adam;
mod agreement;
mod average;
mod checkpoint;
mod composed;
mod composer;
mod decompose;
mod decompose_task;
mod error;
mod guard;
mod held_out;
mod joint;
mod journal;
mod labelled;
mod launch;
mod learner;
pub mod losses;
pub mod low_rank;
mod model;
pub mod paper_layers;
pub mod paper_phases;
mod paper_task;
mod process_group;
mod run;
mod sample;
mod settings;
mod sheet;
mod terms;
mod turn_reader;
mod window;

pub use adam::{Adam, AdamSettings};
pub use average::Average;
pub use checkpoint::{CHECKPOINT, Checkpoint};
pub use composer::{Composer, Composition};
pub use decompose::{AnsweredTensors, DecomposeWeights, decompose_losses, head_spreads};
pub use decompose_task::{DecomposeTask, Resources};
pub use error::TrainError;
pub use guard::Guard;
pub use journal::{Journal, TABLE};
pub use launch::Launch;
pub use learner::{Learner, LearnerSettings};
pub use model::{ComputePrecision, Model};
pub use paper_phases::PaperPhase;
pub use paper_task::{PaperInputs, PaperTask};
pub use process_group::ProcessGroup;
pub use run::{Run, RunOutcome, StepLosses, Task, TrainObserver, Validation};
pub use sample::{DrawnSample, Linearisation, TruthArrays, TruthBatch};
pub use settings::{
    DataSettings, DecomposeSettings, PaperLosses, PaperSettings, PrecisionChoice, RunSettings,
    TurnSettings, read_settings,
};
pub use terms::Terms;
pub use turn_reader::{TurnGroup, TurnReader, TurnTensors};
pub use window::{SampleWindow, SampleWindowSettings};
