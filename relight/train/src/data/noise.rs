//! Noise that is the same for the same seeds, on any device.

use tch::{Device, Kind, Tensor};

use crate::engine::tensors::indices;
use relight_synth::{normal_of, stream};

/// Tiles of noise: each sample has one of them.
const TILES: usize = 32;

/// Noise of standard deviation 1 to draw from.
#[derive(Debug)]
pub(crate) struct NoiseTiles(Tensor);

impl NoiseTiles {
    pub(crate) fn new((planes, side): (i64, i64), seed: u64, device: Device) -> Self {
        let count = TILES * (planes * side * side) as usize;
        let values: Vec<half::f16> = (0..count as u64)
            .map(|at| half::f16::from_f32(normal_of(stream(seed, at))))
            .collect();
        let tiles = Tensor::from_slice(&values)
            .reshape([TILES as i64, planes, side, side])
            .to_device(device);
        Self(tiles)
    }

    /// One tile for each seed.
    pub(crate) fn of(&self, seeds: &[u64], kind: Kind) -> Tensor {
        let device = self.0.device();
        let chosen = indices(seeds.iter().map(|seed| *seed as usize % TILES), device);
        self.0.index_select(0, &chosen).to_kind(kind)
    }
}
