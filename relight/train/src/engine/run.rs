//! A run: steps, one after the other, with what is logged, validated and saved on the way. Knows nothing of
//! what is trained.
//!
//! Several processes make a run together as one would: each computes its part of every batch, the gradients are
//! summed, and all make the same step. Process 0 validates, and writes the run's files.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use relit_data::causes::with_causes;

use super::all_reduced::AllReducedLosses;
use super::checkpoint::Checkpoint;
use super::divergence_guard::DivergenceGuard;
use super::guard::guarded;
use super::learning_rate::learning_rate;
use super::metrics_log::MetricsLog;
use super::task::{StepLosses, TrainingTask, Validation};
use crate::distributed::agreement::{Fact, agree, fingerprint};
use crate::distributed::process_group::ProcessGroup;
use crate::error::TrainError;
use crate::settings::{RunSettings, first_difference};
use relight_photo::nets::WeightPrecision;

/// How long a process waits for process 0 to write its checkpoint and end, where the run ends early. No longer, as process 0 can
/// itself be waiting for this one: only the neighbours of a lost process notice at once. Launchers kill after 30 seconds.
const SUCCESSION: Duration = Duration::from_secs(3);

/// An event of a run, after so many steps.
#[derive(Debug, Clone, Copy)]
pub enum TrainEvent<'a> {
    /// A step was made: its losses, with their coefficients.
    Step(&'a BTreeMap<String, f64>),
    /// Something in the data is damaged, and was left out.
    Damaged(&'a str),
    /// The networks were validated: the figures.
    Validated(&'a BTreeMap<String, f64>),
    /// The run was saved.
    Saved(&'a Path),
}

/// Is told of each event, and the number of its step.
pub type TrainObserver<'a> = &'a mut dyn FnMut(u64, TrainEvent<'_>);

/// How a run came out.
#[derive(Debug, Clone, PartialEq)]
pub struct RunOutcome {
    /// Steps made in total.
    pub steps: u64,
    /// Whether it was asked to stop before its last step.
    pub stopped: bool,
    /// Whether something in the data was damaged, and left out.
    pub damaged: bool,
    /// Figures of the last validation; none in other processes than the first.
    pub figures: BTreeMap<String, f64>,
    /// The file of weights, which the first process writes.
    pub weights: Option<PathBuf>,
}

/// A run in its folder.
pub struct Run<'a> {
    task: &'a mut dyn TrainingTask,
    settings: RunSettings,
    /// All settings that determine the run, as TOML.
    table: String,
    folder: &'a Path,
    group: Option<ProcessGroup>,
    /// Of the first process.
    metrics_log: Option<MetricsLog>,
    guard: DivergenceGuard,
    step: u64,
    /// What the task was given beside its settings.
    inputs: String,
    /// The cursor in the data after that step.
    cursor: String,
    /// Whether something in the data was left out.
    damaged: bool,
}

impl<'a> Run<'a> {
    /// Begins a run in a folder, or resumes the existing one (`resume`); among the processes of a group, all of
    /// which open it with the same arguments. `settings` are those that determine the run; `run` has the [`RunSettings`].
    ///
    /// # Errors
    /// [`TrainError::Refused`] if there is one without `resume`, or another one; [`TrainError::Io`],
    /// [`TrainError::ProcessLost`].
    pub fn open(
        task: &'a mut dyn TrainingTask,
        settings: &toml::Table,
        folder: &'a Path,
        resume: bool,
        group: Option<ProcessGroup>,
    ) -> Result<Self, TrainError> {
        let run = settings.get("run").cloned();
        let run = run.unwrap_or_else(|| toml::Table::new().into());
        let run: RunSettings = run.try_into().map_err(|fault: toml::de::Error| {
            TrainError::Refused(format!("[run] is not right: {}", fault.message()))
        })?;
        run.check()?;
        fs::create_dir_all(folder).map_err(TrainError::io(folder, "made"))?;
        let inputs = task.inputs()?;
        let step = match Checkpoint::read(folder)? {
            None => 0,
            Some(_) if !resume => {
                return Err(TrainError::Refused(format!(
                    "{} already holds a run: continue it with --resume, or give another folder",
                    folder.display()
                )));
            }
            Some(checkpoint) => load_state(task, (settings, &inputs), &checkpoint, folder)?,
        };
        let table = settings.to_string();
        if let Some(group) = &group {
            agree(group, &facts(task, (&table, &inputs), step)?)?;
            task.join(group)?;
        }
        let is_first = group.as_ref().is_none_or(ProcessGroup::is_first);
        Ok(Self {
            inputs,
            cursor: task.cursor(),
            task,
            settings: run,
            table,
            folder,
            group,
            metrics_log: is_first
                .then(|| MetricsLog::open(folder, step))
                .transpose()?,
            guard: DivergenceGuard::default(),
            step,
            damaged: false,
        })
    }

    /// Steps of the whole run.
    pub fn steps(&self) -> u64 {
        self.settings.steps
    }

    /// Steps made so far.
    pub fn steps_made(&self) -> u64 {
        self.step
    }

    /// Makes all steps that are left, or those until `stop` is set in one of the processes; saves the run and the averaged
    /// weights at the end.
    ///
    /// # Errors
    /// Whatever a step fails with: the last checkpoint stays. [`TrainError::Refused`] if another process is lost:
    /// the run is
    /// saved.
    pub fn finish(
        mut self,
        stop: &AtomicBool,
        observer: TrainObserver<'_>,
    ) -> Result<RunOutcome, TrainError> {
        let figures = match self.make_steps(stop, observer) {
            Ok(figures) => figures,
            Err(lost @ TrainError::ProcessLost(_)) => {
                return Err(self.end_early(lost, observer));
            }
            Err(fault) => return Err(fault),
        };
        let mut weights = None;
        if self.metrics_log.is_some() {
            self.save(observer)?;
            weights = Some(self.write_weights()?);
        }
        // Only now: launchers end all processes as soon as one has ended with another code than 0.
        if let Some(group) = self.group.take() {
            group.leave();
        }
        Ok(RunOutcome {
            steps: self.step,
            stopped: self.step < self.settings.steps,
            damaged: self.damaged,
            figures,
            weights,
        })
    }

    /// Figures of the last validation.
    fn make_steps(
        &mut self,
        stop: &AtomicBool,
        observer: TrainObserver<'_>,
    ) -> Result<BTreeMap<String, f64>, TrainError> {
        if self.metrics_log.is_some() {
            for left_out in self.task.left_out() {
                self.damaged = true;
                observer(self.step, TrainEvent::Damaged(&left_out.to_string()));
            }
        }
        let between = Duration::from_secs_f64(60.0 * self.settings.checkpoint_minutes);
        let mut saved = Instant::now();
        // Where training begins, so that it shows what it has changed.
        let mut figures = if self.step == 0 {
            self.validate(observer)?
        } else {
            BTreeMap::new()
        };
        let mut stopped = false;
        while self.step < self.settings.steps && !stopped {
            let asked = stop.load(Ordering::Relaxed);
            if asked && self.group.is_none() {
                break;
            }
            // Processes of a group stop after the same step, the one in which the first of them is asked to.
            stopped = match self.make_step(asked, observer) {
                Err(TrainError::Stopped) => break,
                made => made?,
            };
            if self.metrics_log.is_none() {
                continue;
            }
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
        Ok(figures)
    }

    /// Makes a step; whether one of the processes was asked to stop.
    fn make_step(&mut self, stop: bool, observer: TrainObserver<'_>) -> Result<bool, TrainError> {
        let learning_rate = learning_rate(&self.settings, self.step);
        let losses = guarded(|| self.task.step(self.step))?;
        if let Some(damage) = &losses.damage {
            self.damaged = true;
            observer(self.step, TrainEvent::Damaged(damage));
        }
        let reduced = AllReducedLosses::new(&losses, stop, self.group.as_ref())?;
        // Of some batches nothing can be learned, as of those for which the gate of saturation is closed.
        if !reduced.values.is_empty() {
            self.guard.check(self.step, &reduced.values)?;
            let norm = self.descend(&losses, &reduced, learning_rate)?;
            self.log(&reduced, (learning_rate, norm), observer)?;
        }
        self.step += 1;
        self.cursor = self.task.cursor();
        Ok(reduced.stop)
    }

    /// Goes down the all-reduced loss; the norm of its gradient.
    fn descend(
        &mut self,
        losses: &StepLosses,
        reduced: &AllReducedLosses,
        learning_rate: f64,
    ) -> Result<f64, TrainError> {
        let trainable = self.task.trainable();
        match reduced.part(losses) {
            Some(part) => part.f_backward()?,
            None => trainable.model.add_zero_gradients()?,
        }
        if let Some(group) = &self.group {
            group.sum_gradients(trainable.model.parameters())?;
        }
        trainable.step(learning_rate)
    }

    fn log(
        &mut self,
        reduced: &AllReducedLosses,
        (learning_rate, gradient_norm): (f64, f64),
        observer: TrainObserver<'_>,
    ) -> Result<(), TrainError> {
        let step = self.step + 1;
        observer(step, TrainEvent::Step(&reduced.values));
        let Some(metrics_log) = &mut self.metrics_log else {
            return Ok(());
        };
        if !step.is_multiple_of(self.settings.log_every) {
            return Ok(());
        }
        let mut values = reduced.values.clone();
        values.insert("learning_rate".to_owned(), learning_rate);
        values.insert("gradient_norm".to_owned(), gradient_norm);
        metrics_log.scalars(step, &values)
    }

    /// Ends the run after another process was lost: the first of the remaining processes saves it.
    fn end_early(&mut self, lost: TrainError, observer: TrainObserver<'_>) -> TrainError {
        let path = Checkpoint::path(self.folder);
        let path = path.display();
        let saved = match self.save_as_successor(observer) {
            Ok(()) => format!("its checkpoint is {path}: start all processes again with --resume"),
            Err(fault) => format!("it could not be saved: {}", with_causes(&fault)),
        };
        let step = self.step;
        TrainError::Refused(format!(
            "{lost}; the run ends after {step} steps, and {saved}"
        ))
    }

    /// Saves the run in process 0, and in others where that has ended and has not.
    fn save_as_successor(&mut self, observer: TrainObserver<'_>) -> Result<(), TrainError> {
        if self.metrics_log.is_none() {
            let begun = Instant::now();
            while MetricsLog::is_open(self.folder)
                && !self.is_saved()
                && begun.elapsed() < SUCCESSION
            {
                std::thread::sleep(Duration::from_millis(500));
            }
            if self.is_saved() {
                return Ok(());
            }
        }
        self.save(observer)
    }

    /// Whether a checkpoint has this process's steps. One that cannot be read does not.
    fn is_saved(&self) -> bool {
        let found = Checkpoint::read(self.folder).ok().flatten();
        found.is_some_and(|checkpoint| checkpoint.step >= self.step)
    }

    fn validate(
        &mut self,
        observer: TrainObserver<'_>,
    ) -> Result<BTreeMap<String, f64>, TrainError> {
        let Some(metrics_log) = &mut self.metrics_log else {
            return Ok(BTreeMap::new());
        };
        let Validation { figures, damage } = match guarded(|| self.task.validate()) {
            // The next step sees that, too, and all processes stop after it.
            Err(TrainError::Stopped) => return Ok(BTreeMap::new()),
            made => made?,
        };
        if let Some(damage) = damage {
            self.damaged = true;
            observer(self.step, TrainEvent::Damaged(&damage));
        }
        let named: BTreeMap<String, f64> = figures
            .iter()
            .map(|(name, value)| (format!("validation/{name}"), *value))
            .collect();
        metrics_log.scalars(self.step, &named)?;
        observer(self.step, TrainEvent::Validated(&figures));
        Ok(figures)
    }

    fn save(&mut self, observer: TrainObserver<'_>) -> Result<(), TrainError> {
        let state = self.task.trainable().state()?;
        Checkpoint {
            task: self.task.name().to_owned(),
            step: self.step,
            settings: self.table.clone(),
            inputs: self.inputs.clone(),
            cursor: self.cursor.clone(),
            state,
        }
        .write(self.folder)?;
        observer(self.step, TrainEvent::Saved(&Checkpoint::path(self.folder)));
        Ok(())
    }

    /// The averaged weights, half precision.
    fn write_weights(&mut self) -> Result<PathBuf, TrainError> {
        let trainable = self.task.trainable();
        let path = self
            .folder
            .join(format!("{}.safetensors", trainable.name()));
        let weights = trainable.average().weights()?;
        weights.write(&path, WeightPrecision::Half)?;
        Ok(path)
    }
}

/// Facts that have to be equal in all processes.
fn facts(
    task: &mut dyn TrainingTask,
    (settings, inputs): (&str, &str),
    step: u64,
) -> Result<Vec<Fact>, TrainError> {
    let version = format!("{} {}", env!("CARGO_PKG_VERSION"), task.name());
    let weights = fingerprint(task.trainable().model.parameters())?;
    Ok(vec![
        ("version and task", version),
        ("the settings", settings.to_owned()),
        (
            "the turns and the networks that are given",
            inputs.to_owned(),
        ),
        ("the steps made before", step.to_string()),
        ("the weights", weights),
    ])
}

/// Brings a task to a checkpoint; its step.
fn load_state(
    task: &mut dyn TrainingTask,
    (settings, inputs): (&toml::Table, &str),
    checkpoint: &Checkpoint,
    folder: &Path,
) -> Result<u64, TrainError> {
    let other = |fault: String| TrainError::checkpoint(&Checkpoint::path(folder), &fault);
    if checkpoint.task != task.name() {
        return Err(other(format!(
            "it trains {}, not {}",
            checkpoint.task,
            task.name()
        )));
    }
    if let Some(setting) = first_difference(settings, &checkpoint.settings) {
        return Err(other(format!("its settings differ: {setting}")));
    }
    if checkpoint.inputs != inputs {
        let fault = "it was trained on other turns, or with other fixed networks";
        return Err(other(fault.to_owned()));
    }
    task.go_to(&checkpoint.cursor).map_err(other)?;
    task.trainable().load_state(&checkpoint.state)?;
    Ok(checkpoint.step)
}
