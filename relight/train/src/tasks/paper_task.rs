//! The runs of the paper's phases.

use std::path::PathBuf;

use tch::{Kind, Tensor};

use super::paper_networks::{PaperInputs, PhaseNetworks, missing_option, trained_graph};
use super::validation::{ValidationSamples, ValidationTurns};
use crate::data::photographs::Photographs;
use crate::data::turn_reader::{TurnGroup, TurnReader};
use crate::distributed::agreement::fingerprint;
use crate::distributed::process_group::{ProcessGroup, indivisible};
use crate::engine::losses::Mean;
use crate::engine::task::{Resources, StepLosses, TrainingTask, Validation};
use crate::engine::trainable::Trainable;
use crate::error::TrainError;
use crate::settings::{PaperPhase, PaperSettings};
use relight_core::reader::Rank;
use relight_synth::{SkippedFile, stream};

/// Training of one of the paper's networks.
#[derive(Debug)]
pub struct PaperTask {
    networks: PhaseNetworks,
    settings: PaperSettings,
    resources: Resources,
    trainable: Trainable,
    photographs: Photographs,
    turns: Option<TurnReader>,
    rank: Rank,
    validation_samples: ValidationSamples,
    validation_turns: Option<ValidationTurns>,
}

impl PaperTask {
    /// Reads the data of photographs, opens the turns, and makes the networks.
    ///
    /// # Errors
    /// Settings out of range, files that cannot be read, weights that do not fit, [`TrainError::Refused`] if the phase
    /// needs what is not given.
    pub fn new(
        phase: PaperPhase,
        settings: PaperSettings,
        resources: Resources,
        inputs: &PaperInputs,
    ) -> Result<Self, TrainError> {
        settings.check()?;
        if phase.needs_turns() && inputs.turns.is_none() {
            return Err(missing_option(phase, "--turns"));
        }
        if inputs.turns.is_some() && !phase.uses_turns() {
            return Err(TrainError::Refused(format!(
                "relight train {} learns from synthetic photographs, not from turns: omit --turns",
                phase.name()
            )));
        }
        if inputs.validation_turns.is_some() && !phase.validates_on_turns() {
            return Err(TrainError::Refused(format!(
                "relight train {} does not validate on turns: omit --validation-turns",
                phase.name()
            )));
        }
        let graph = trained_graph(phase);
        let weights = inputs.weights.as_ref();
        let kind = settings.run.precision.kind();
        let seed = stream(settings.run.seed, 31);
        let open = |path: &PathBuf| TurnReader::open(path, seed);
        let validation_turns = |path: &PathBuf| ValidationTurns::read(path, kind, resources.device);
        let photographs = Photographs::new(&settings.data, &settings.run, resources.clone())?;
        // On them, nothing is known of the paper's smoothness.
        let samples = match phase {
            PaperPhase::Specular => 0,
            _ => settings.data.validation,
        };
        Ok(Self {
            validation_samples: ValidationSamples::new(
                photographs.library(),
                settings.data.size,
                samples,
            ),
            validation_turns: inputs
                .validation_turns
                .as_ref()
                .map(validation_turns)
                .transpose()?,
            networks: PhaseNetworks::new(phase, &settings, resources.device, inputs)?,
            trainable: Trainable::new(graph, weights, &settings.run, resources.device)?,
            photographs,
            turns: inputs.turns.as_ref().map(open).transpose()?,
            rank: Rank::ONLY,
            settings,
            resources,
        })
    }

    /// The type of what goes into the network.
    fn kind(&self) -> Kind {
        self.settings.run.precision.kind()
    }

    /// The losses on this process's groups of a step.
    fn turn_loss(&mut self, losses: &mut StepLosses) -> Result<(), TrainError> {
        let kind = self.kind();
        let Some(reader) = &mut self.turns else {
            return Ok(());
        };
        let (mut values, mut damage) = (Vec::new(), Vec::new());
        for _ in 0..self.settings.turns.groups / u64::from(self.rank.world_size()) {
            let TurnGroup {
                frames,
                damage: found,
            } = reader.next_group(kind, self.resources.device)?;
            damage.extend(found);
            if let Some(turns) = frames {
                let own = &self.trainable.model;
                values.extend(self.networks.turn_loss(own, &turns)?);
            }
        }
        losses.add_damage(&damage);
        let coefficient = self.settings.loss.low_rank;
        if values.is_empty() {
            losses.terms.add_nothing("turns", coefficient);
        } else {
            let over = Tensor::from_slice(&[values.len() as i64]);
            let value = Tensor::stack(&values, 0).mean(None);
            losses
                .terms
                .add_mean("turns", coefficient, Mean { value, over });
        }
        Ok(())
    }

    /// The coefficient of the supervised term on synthetic samples: 1 without turns.
    fn supervised(&self) -> f64 {
        match (self.networks.phase, &self.turns) {
            (PaperPhase::Specular, _) => 0.0,
            (_, None) => 1.0,
            (_, Some(_)) => self.settings.loss.supervised,
        }
    }
}

impl TrainingTask for PaperTask {
    fn name(&self) -> &'static str {
        self.networks.phase.name()
    }

    fn left_out(&self) -> &[SkippedFile] {
        self.photographs.left_out()
    }

    fn trainable(&mut self) -> &mut Trainable {
        &mut self.trainable
    }

    fn inputs(&self) -> Result<String, TrainError> {
        let mut inputs = self.photographs.library().identity();
        inputs += &self
            .turns
            .as_ref()
            .map_or(String::new(), TurnReader::identity);
        for model in self.networks.frozen_models() {
            inputs += &fingerprint(model.parameters())?;
        }
        Ok(inputs)
    }

    fn join(&mut self, group: &ProcessGroup) -> Result<(), TrainError> {
        let (rank, groups) = (group.rank(), self.settings.turns.groups);
        if self.supervised() > 0.0 {
            self.photographs.set_rank(rank)?;
        }
        if let Some(reader) = &mut self.turns {
            if !groups.is_multiple_of(u64::from(rank.world_size())) {
                let missing_option = format!("a multiple of {}", rank.world_size());
                return Err(indivisible("turns.groups", groups, rank, &missing_option));
            }
            reader.set_rank(rank)?;
        }
        self.rank = rank;
        Ok(())
    }

    fn step(&mut self, step: u64) -> Result<StepLosses, TrainError> {
        let mut losses = StepLosses::default();
        let supervised = self.supervised();
        if supervised > 0.0 {
            let batch = self.photographs.batch(step)?;
            if let Some(loss) = self
                .networks
                .supervised_loss(&self.trainable.model, &batch)?
            {
                losses.terms.add_mean("supervised", supervised, loss);
            }
        }
        self.turn_loss(&mut losses)?;
        Ok(losses)
    }

    fn validate(&mut self) -> Result<Validation, TrainError> {
        let own = self.trainable.average();
        let device = self.resources.device;
        let mut figures = self
            .validation_samples
            .figures(self.kind(), device, |batch| {
                self.networks.sample_figures(own, batch)
            })?;
        let mut damage = None;
        if let Some(turns) = &mut self.validation_turns {
            damage = turns.take_damage();
            figures.extend(turns.figures(|turns| self.networks.turn_figures(own, turns))?);
        }
        Ok(Validation { figures, damage })
    }

    fn cursor(&self) -> String {
        let cursor = self.turns.as_ref().map(TurnReader::cursor);
        // Two numbers: they can be written.
        serde_json::to_string(&cursor).unwrap_or_default()
    }

    fn go_to(&mut self, cursor: &str) -> Result<(), String> {
        let cursor: Option<relight_core::reader::Cursor> =
            serde_json::from_str(cursor).map_err(|error| error.to_string())?;
        match (&mut self.turns, cursor) {
            (Some(reader), Some(cursor)) => reader.go_to(cursor).map_err(|error| error.to_string()),
            (None, None) => Ok(()),
            _ => Err("one of the two runs has turns, the other has not".to_owned()),
        }
    }
}
