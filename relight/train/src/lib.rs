//! Training, on libtorch: the one crate of relight that knows it.
//!
//! | module | concern |
//! | --- | --- |
//! | `engine` | any run: a [`relight_photo::nets::Graph`] on tensors, the optimiser, checkpoints, the log, what ends a run |
//! | `tasks` | what is trained: `decompose_task` (photographs), `turn_task` (turns), `paper_task` (the paper's phases); their losses, `low_rank`, `validation` |
//! | `data` | `photographs` and `turns` lit on the device |
//! | `distributed` | several processes: their ranks, sums over them |
//! | `settings` | [`RunSettings`] and others, in TOML |
//!
//! ```no_run
//! use std::path::Path;
//! use std::sync::Arc;
//!
//! use relight_train::{DecomposeSettings, DecomposeTask, Resources, Run, TrainError, read_settings};
//! use tch::Device;
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let settings = read_settings::<DecomposeSettings>(Path::new("settings.toml"))?;
//!     let table = toml::Table::try_from(&settings)?;
//!     let resources = Resources { device: Device::Cpu, workers: 2, stop: Arc::default() };
//!     let stop = Arc::clone(&resources.stop);
//!     let mut task = DecomposeTask::new(settings, resources, None)?;
//!     let outcome = Run::open(&mut task, &table, Path::new("run"), true, None)?.finish(&stop, &mut |_, _| {})?;
//!     println!("{} steps: {:?}", outcome.steps, outcome.weights);
//!     Ok(())
//! }
//! ```

#![cfg(feature = "libtorch")]

mod data;
mod distributed;
mod engine;
mod error;
mod settings;
mod tasks;

pub use data::photographs::Photographs;
pub use data::sample::TruthBatch;
pub use distributed::launch::Launch;
pub use distributed::process_group::ProcessGroup;
pub use engine::adam::Adam;
pub use engine::checkpoint::{CHECKPOINT, Checkpoint};
pub use engine::cuda::cuda_device;
pub use engine::memory::keep_memory;
pub use engine::metrics_log::{MetricsLog, TABLE};
pub use engine::model::Model;
pub use engine::run::{Run, RunOutcome, TrainEvent, TrainObserver};
pub use engine::task::{Resources, StepLosses, TrainingTask, Validation};
pub use engine::terms::LossTerms;
pub use engine::trainable::Trainable;
pub use error::TrainError;
pub use settings::{
    ComputePrecision, DataSettings, DecomposeSettings, PaperLossCoefficients, PaperPhase,
    PaperSettings, RunSettings, TurnNetworkSettings, TurnSettings, read_settings,
};
pub use tasks::decompose::PredictedTensors;
pub use tasks::decompose_task::DecomposeTask;
pub use tasks::paper_networks::PaperInputs;
pub use tasks::paper_task::PaperTask;
pub use tasks::turn_task::TurnNetworkTask;
