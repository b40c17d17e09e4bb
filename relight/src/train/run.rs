//! A run: steps, one after the other, with what is logged, validated and saved on the way. Knows nothing of
//! what is trained.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use tch::Tensor;

use super::checkpoint::Checkpoint;
use super::error::TrainError;
use super::guard::Guard;
use super::journal::Journal;
use super::learner::Learner;
use super::model::to_weights;
use super::settings::RunSettings;
use super::terms::Terms;
use crate::nets::{WeightPrecision, Weights};

/// What is trained.
pub trait Task {
    /// Its name, as on the command line.
    fn name(&self) -> &'static str;

    /// The settings that make the run what it is, as TOML.
    fn settings(&self) -> String;

    /// The networks that learn.
    fn learners(&mut self) -> Vec<&mut Learner>;

    /// The losses of a step, from 0. Steps are asked for one after the other.
    ///
    /// # Errors
    /// Whatever keeps the step from being computed.
    fn step(&mut self, step: u64) -> Result<StepLosses, TrainError>;

    /// Figures of the averaged networks on what they are not trained on.
    ///
    /// # Errors
    /// Whatever keeps them from being computed.
    fn validate(&mut self) -> Result<Validation, TrainError>;

    /// Where it stands in data that are read one after the other, to go on from; empty where there are none.
    fn place(&self) -> String {
        String::new()
    }

    /// Goes on from such a place.
    ///
    /// # Errors
    /// A sentence that says why it cannot.
    fn go_to(&mut self, _place: &str) -> Result<(), String> {
        Ok(())
    }
}

/// What a step gives.
#[derive(Debug, Default)]
pub struct StepLosses {
    /// The losses.
    pub terms: Terms,
    /// How much each head's answers vary, in parts of the truth's variation.
    pub spreads: BTreeMap<&'static str, f64>,
    /// The batch, to be saved where something is wrong with it. They share their numbers.
    pub batch: BTreeMap<String, Tensor>,
    /// What was damaged in the data, and is not in the batch.
    pub damage: Option<String>,
}

/// What a validation gives.
#[derive(Debug, Default)]
pub struct Validation {
    /// Figures by name.
    pub figures: BTreeMap<String, f64>,
    /// A sheet of answers beside the truth, a PNG file, with its size.
    pub sheet: Option<(Vec<u8>, (usize, usize))>,
}

/// What a run says while it goes on.
pub trait TrainObserver {
    /// A step was made. `losses` have their weights.
    fn step(&mut self, step: u64, losses: &BTreeMap<String, f64>);
    /// Something in the data of a step is damaged, and was left out.
    fn damaged(&mut self, step: u64, what: &str);
    /// The networks were validated.
    fn validated(&mut self, step: u64, figures: &BTreeMap<String, f64>);
    /// The run was saved.
    fn saved(&mut self, step: u64, path: &Path);
}

/// How a run came out.
#[derive(Debug, Clone, PartialEq)]
pub struct RunOutcome {
    /// Steps made in all.
    pub steps: u64,
    /// Whether it was asked to stop before its last step.
    pub stopped: bool,
    /// Figures of the last validation.
    pub figures: BTreeMap<String, f64>,
    /// The files of weights.
    pub weights: Vec<PathBuf>,
}

/// A run in its folder.
pub struct Run<'a> {
    task: &'a mut dyn Task,
    settings: &'a RunSettings,
    folder: &'a Path,
    journal: Journal,
    guard: Guard,
    step: u64,
}

impl<'a> Run<'a> {
    /// Begins a run in a folder, or goes on with the one that is there (`resume`).
    ///
    /// # Errors
    /// [`TrainError::Occupied`], [`TrainError::Checkpoint`] where it is another run's, [`TrainError::Io`].
    pub fn open(
        task: &'a mut dyn Task,
        settings: &'a RunSettings,
        folder: &'a Path,
        resume: bool,
    ) -> Result<Self, TrainError> {
        settings.check()?;
        fs::create_dir_all(folder).map_err(|source| TrainError::Io {
            path: folder.to_owned(),
            doing: "made",
            source,
        })?;
        let step = match Checkpoint::read(folder)? {
            None => 0,
            Some(_) if !resume => {
                return Err(TrainError::Occupied {
                    path: folder.to_owned(),
                });
            }
            Some(checkpoint) => recall(task, &checkpoint, folder)?,
        };
        Ok(Self {
            task,
            settings,
            folder,
            journal: Journal::open(folder, step)?,
            guard: Guard::default(),
            step,
        })
    }

    /// Steps made so far.
    #[must_use]
    pub fn steps_made(&self) -> u64 {
        self.step
    }

    /// Makes all steps that are left, or those until `stop` is set; saves the run and the averaged weights at the end.
    ///
    /// # Errors
    /// Whatever a step fails with: the last checkpoint stays.
    pub fn finish(
        mut self,
        stop: &AtomicBool,
        observer: &mut dyn TrainObserver,
    ) -> Result<RunOutcome, TrainError> {
        let between = Duration::from_secs_f64(60.0 * self.settings.checkpoint_minutes);
        let mut saved = Instant::now();
        // Where training begins, so that it shows what it has changed.
        let mut figures = if self.step == 0 {
            self.validate(observer)?
        } else {
            BTreeMap::new()
        };
        while self.step < self.settings.steps && !stop.load(Ordering::Relaxed) {
            self.make_step(observer)?;
            if self.step.is_multiple_of(self.settings.validate_every)
                || self.step == self.settings.steps
            {
                figures = self.validate(observer)?;
            }
            if saved.elapsed() >= between {
                self.save(observer)?;
                saved = Instant::now();
            }
        }
        self.save(observer)?;
        Ok(RunOutcome {
            steps: self.step,
            stopped: self.step < self.settings.steps,
            figures,
            weights: self.write_weights()?,
        })
    }

    fn make_step(&mut self, observer: &mut dyn TrainObserver) -> Result<(), TrainError> {
        let rate = self.settings.rate_at(self.step);
        let losses = self.task.step(self.step)?;
        if let Some(damage) = &losses.damage {
            observer.damaged(self.step, damage);
        }
        if losses.terms.is_empty() {
            // A batch on which nothing can be learned, as one for which the gate of saturation is closed.
            self.step += 1;
            return Ok(());
        }
        let total = losses.terms.total()?;
        let mut values: BTreeMap<String, f64> = BTreeMap::new();
        for (name, value) in losses.terms.values()? {
            values.insert(format!("loss/{name}"), value);
        }
        values.insert("loss".to_owned(), f64::try_from(&total)?);
        let folder = self.folder;
        self.guard.check(self.step, &values, &losses.spreads, || {
            let path = folder.join(format!("bad-batch-{}.safetensors", self.step));
            to_weights(&losses.batch)?.write(&path, WeightPrecision::Single)?;
            Ok(path)
        })?;
        total.f_backward()?;
        let mut length = 0.0_f64;
        for learner in self.task.learners() {
            length = length.hypot(learner.learn(rate, self.settings.longest_gradient)?);
        }
        self.step += 1;
        observer.step(self.step, &values);
        if self.step.is_multiple_of(self.settings.log_every) {
            values.insert("rate".to_owned(), rate);
            values.insert("gradient".to_owned(), length);
            for (head, spread) in &losses.spreads {
                values.insert(format!("spread/{head}"), *spread);
            }
            self.journal.scalars(self.step, &values)?;
        }
        Ok(())
    }

    fn validate(
        &mut self,
        observer: &mut dyn TrainObserver,
    ) -> Result<BTreeMap<String, f64>, TrainError> {
        let Validation { figures, sheet } = self.task.validate()?;
        let named: BTreeMap<String, f64> = figures
            .iter()
            .map(|(name, value)| (format!("validation/{name}"), *value))
            .collect();
        self.journal.scalars(self.step, &named)?;
        if let Some((png, size)) = sheet {
            let path = self.folder.join("validation.png");
            relit_data::durable::write_whole(&path, &png).map_err(|source| TrainError::Io {
                path,
                doing: "written",
                source,
            })?;
            self.journal.picture(self.step, "validation", size, png)?;
        }
        observer.validated(self.step, &figures);
        Ok(figures)
    }

    fn save(&mut self, observer: &mut dyn TrainObserver) -> Result<(), TrainError> {
        let mut state = Weights::default();
        for learner in self.task.learners() {
            state.extend(learner.state()?);
        }
        Checkpoint {
            task: self.task.name().to_owned(),
            step: self.step,
            settings: self.task.settings(),
            place: self.task.place(),
            state,
        }
        .write(self.folder)?;
        observer.saved(self.step, &Checkpoint::path(self.folder));
        Ok(())
    }

    /// The averaged weights, half precision, a file a network.
    fn write_weights(&mut self) -> Result<Vec<PathBuf>, TrainError> {
        let folder = self.folder;
        self.task
            .learners()
            .into_iter()
            .map(|learner| {
                let path = folder.join(format!("{}.safetensors", learner.name()));
                learner.averaged()?.write(&path, WeightPrecision::Half)?;
                Ok(path)
            })
            .collect()
    }
}

/// Brings a task to a checkpoint; its step.
fn recall(task: &mut dyn Task, checkpoint: &Checkpoint, folder: &Path) -> Result<u64, TrainError> {
    let other = |fault: String| TrainError::Checkpoint {
        path: Checkpoint::path(folder),
        fault,
    };
    if checkpoint.task != task.name() {
        return Err(other(format!(
            "it trains {}, not {}",
            checkpoint.task,
            task.name()
        )));
    }
    if checkpoint.settings != task.settings() {
        return Err(other("its settings are others".to_owned()));
    }
    task.go_to(&checkpoint.place).map_err(other)?;
    for learner in task.learners() {
        learner.recall(&checkpoint.state, checkpoint.step)?;
    }
    Ok(checkpoint.step)
}
