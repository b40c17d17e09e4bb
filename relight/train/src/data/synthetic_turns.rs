//! Training data of the network of turns: views of objects on the table, each in a random environment light, as tensors.

use std::path::Path;

use rayon::prelude::*;
use tch::{Device, Kind, Tensor};

use crate::error::TrainError;
use crate::settings::TransferSettings;
use relight_core::light::Panorama;
use relight_photo::nets::TURN_INPUTS;
use relight_synth::{
    EnvironmentLights, Folders, Library, SkippedFile, TransferCache, TransferRecipe, TurnSample,
    stream,
};
use relight_turn::{NetworkTurn, PhaseHypothesis, network_input};

/// Views that are drawn for training, for validation.
const TRAINING: u64 = 41;
const VALIDATION: u64 = 42;
/// One of so many drawn turns has the phase of its second harmonic, in one of two directions.
const BY_SECOND: u64 = 3;

/// Views and rooms to draw from.
#[derive(Debug)]
pub(crate) struct TurnViews {
    library: Library,
    cache: TransferCache,
    rooms: EnvironmentLights,
}

/// A batch of turns for the network.
#[derive(Debug)]
pub(crate) struct TurnBatch {
    /// `batch x channels x height x width`.
    pub(crate) input: Tensor,
    /// Unit normals, 3 channels.
    pub(crate) normals: Tensor,
    /// The logarithm of the albedo, 3 channels.
    pub(crate) log_albedo: Tensor,
    /// 1 where the object is, 1 channel.
    pub(crate) mask: Tensor,
}

impl TurnViews {
    /// For training: with the meshes, in the panoramas of the settings.
    pub(crate) fn for_training(
        settings: &TransferSettings,
        folder: &Path,
        seed: u64,
    ) -> Result<Self, TrainError> {
        let library = Library::read(&Folders {
            meshes: settings.meshes.clone(),
            textures: None,
            panoramas: settings.panoramas.clone(),
        })?
        .training()?;
        Self::new(settings, folder, library, stream(seed, TRAINING))
    }

    /// For validation: procedural shapes and panoramas of their own, the same for all seeds.
    pub(crate) fn for_validation(
        settings: &TransferSettings,
        folder: &Path,
    ) -> Result<Self, TrainError> {
        let library = Library::read(&Folders {
            panoramas: settings.validation_panoramas.clone(),
            ..Folders::default()
        })?
        .validation()?;
        Self::new(settings, folder, library, VALIDATION)
    }

    /// Unused files of the folders.
    pub(crate) fn left_out(&self) -> &[SkippedFile] {
        &self.library.left_out
    }

    fn new(
        settings: &TransferSettings,
        folder: &Path,
        library: Library,
        seed: u64,
    ) -> Result<Self, TrainError> {
        let recipe = TransferRecipe {
            seed,
            size: settings.size,
            rays: settings.rays,
        };
        let cache = TransferCache::open(folder, recipe, &library)?;
        let panoramas: Vec<&Panorama> = (0..library.panoramas.len())
            .filter_map(|number| library.panoramas.get(number))
            .collect();
        let rooms = EnvironmentLights::new(&panoramas, settings.variants, seed);
        Ok(Self {
            library,
            cache,
            rooms,
        })
    }

    /// A batch of turns, each by its view's number and a seed; at half the width where `is_coarse`.
    pub(crate) fn batch(
        &self,
        turns: &[(u64, u64)],
        is_coarse: bool,
        (kind, device): (Kind, Device),
    ) -> Result<TurnBatch, TrainError> {
        let drawn: Result<Vec<Planes>, TrainError> = turns
            .par_iter()
            .map(|&(view, seed)| {
                let drawn = self.cache.turn(&self.library, view, &self.rooms, seed)?;
                let drawn = if is_coarse { drawn.halved() } else { drawn };
                Ok(Planes::new(&drawn, phase_of(stream(seed, 1))))
            })
            .collect();
        TurnBatch::new(&drawn?, kind, device)
    }
}

/// The least albedo whose logarithm is learned.
const MIN_ALBEDO: f32 = 0.002;

/// Mostly the phase by which turns are looked at first.
fn phase_of(seed: u64) -> PhaseHypothesis {
    match seed % (2 * BY_SECOND) {
        0 => PhaseHypothesis::Second,
        1 => PhaseHypothesis::SecondOpposite,
        _ => PhaseHypothesis::First,
    }
}

/// A turn as planes.
struct Planes {
    side: usize,
    input: Vec<f32>,
    normals: Vec<f32>,
    log_albedo: Vec<f32>,
    mask: Vec<f32>,
}

impl Planes {
    fn new(drawn: &TurnSample, phase: PhaseHypothesis) -> Self {
        let side = drawn.size as usize;
        let turn = NetworkTurn {
            side,
            pixels: &drawn.pixels,
            curves: &drawn.curves,
            elevation: drawn.elevation,
        };
        let area = side * side;
        let (mut normals, mut mask) = (vec![0.0; 3 * area], vec![0.0; area]);
        let mut log_albedo = vec![0.0; 3 * area];
        for (k, &pixel) in drawn.pixels.iter().enumerate() {
            let at = pixel as usize;
            mask[at] = 1.0;
            for (axis, value) in drawn.normals[k].to_array().into_iter().enumerate() {
                normals[axis * area + at] = value;
            }
            for (channel, value) in drawn.albedo[k].to_array().into_iter().enumerate() {
                log_albedo[channel * area + at] = value.max(MIN_ALBEDO).ln();
            }
        }
        Self {
            side,
            input: network_input(&turn, phase),
            normals,
            log_albedo,
            mask,
        }
    }
}

impl TurnBatch {
    fn new(turns: &[Planes], kind: Kind, device: Device) -> Result<Self, TrainError> {
        let side = turns.first().map_or(0, |turn| turn.side) as i64;
        let stacked = |channels: usize, of: fn(&Planes) -> &[f32]| {
            let values: Vec<f32> = turns.iter().flat_map(|turn| of(turn).to_vec()).collect();
            Tensor::f_from_slice(&values)?
                .f_reshape([turns.len() as i64, channels as i64, side, side])?
                .f_to_kind(kind)?
                .f_to_device(device)
        };
        Ok(Self {
            input: stacked(TURN_INPUTS, |turn| &turn.input)?,
            normals: stacked(3, |turn| &turn.normals)?,
            log_albedo: stacked(3, |turn| &turn.log_albedo)?,
            mask: stacked(1, |turn| &turn.mask)?,
        })
    }
}
