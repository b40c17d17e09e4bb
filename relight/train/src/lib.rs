//! Training, on libtorch: the one crate of relight that knows it.
//!
//! | module | concern |
//! | --- | --- |
//! | `model` | a [`relight_photo::nets::Graph`] on tensors: what is trained is what the ONNX file holds |
//! | `adam`, `learner` | how a network learns; all of it can be saved |
//! | `losses`, `low_rank`, `terms` | what is descended |
//! | `photographs` | photographs lit on the device while a network learns from them |
//! | `sample` | their arrays |
//! | `decompose`, `decompose_task` | the decomposing network: maps, losses, run |
//! | `held_out` | turns and samples that networks are judged by while they train |
//! | `task`, `run`, `checkpoint`, `journal`, `guard` | a run: what is trained, its steps, what is saved, what is logged, what ends it |
//! | `cuda`, `memory` | GPUs; memory between steps |
//! | `launch`, `process_group`, `agreement`, `all_reduced` | several processes: their ranks, sums over them, whether they agree, all-reduced losses |
//! | `paper_layers`, `paper_phases`, `paper_networks`, `paper_task` | the paper's phases: layers on tensors, losses, networks, runs |
//! | `turn_samples`, `turn_task` | the network of whole turns: views in rooms, its run |
//! | `turn_reader` | turns |
//! | [`RunSettings`] and others, `settings/` | TOML |

#![cfg(feature = "libtorch")]

mod adam;
mod agreement;
mod all_reduced;
mod checkpoint;
mod cuda;
mod darkness;
mod decompose;
mod decompose_task;
mod error;
mod guard;
mod held_out;
mod journal;
mod launch;
mod learner;
mod losses;
mod low_rank;
mod memory;
mod model;
mod paper_layers;
mod paper_networks;
mod paper_phases;
mod paper_task;
mod photographs;
mod process_group;
mod run;
mod sample;
mod settings;
mod sheet;
mod symmetry;
mod task;
mod terms;
mod turn_reader;
mod turn_samples;
mod turn_task;

pub use adam::Adam;
pub use checkpoint::{CHECKPOINT, Checkpoint};
pub use cuda::cuda_device;
pub use decompose::{AnsweredTensors, DecomposeLossCoefficients};
pub use decompose_task::DecomposeTask;
pub use error::TrainError;
pub use journal::{Journal, TABLE};
pub use launch::Launch;
pub use learner::Learner;
pub use memory::keep_memory;
pub use model::{ComputePrecision, Model};
pub use paper_networks::PaperInputs;
pub use paper_phases::PaperPhase;
pub use paper_task::PaperTask;
pub use photographs::Photographs;
pub use process_group::ProcessGroup;
pub use run::{Run, RunOutcome, TrainObserver};
pub use sample::TruthBatch;
pub use settings::{
    DataSettings, DecomposeSettings, PaperLossCoefficients, PaperSettings, RunSettings,
    TransferSettings, TurnNetworkSettings, TurnSettings, read_settings,
};
pub use task::{Resources, StepLosses, TrainingTask, Validation};
pub use terms::LossTerms;
pub use turn_task::TurnNetworkTask;

/// The examples of the README, so that they are built.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
