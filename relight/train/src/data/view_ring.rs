//! Views on the device: a ring in which new ones replace the oldest.

use tch::{Device, Kind, Tensor};

use crate::engine::tensors::indices;
use relight_core::reader::Rank;
use relight_synth::stream;

/// Planes of views, in half precision.
#[derive(Debug)]
pub(super) struct ViewPlanes {
    /// `(views x each) x planes x side x side`.
    planes: Tensor,
    /// Parts of a view.
    each: usize,
    /// The type of what is computed of them.
    kind: Kind,
}

impl ViewPlanes {
    /// Room for so many views of `each` parts, each of `[planes, side]`; what is computed of them is of a kind.
    pub(super) fn new(
        (views, each): (usize, usize),
        [planes, side]: [usize; 2],
        (kind, device): (Kind, Device),
    ) -> Self {
        let shape = [views * each, planes, side, side].map(|size| size as i64);
        Self {
            planes: Tensor::zeros(shape, (Kind::Half, device)),
            each,
            kind,
        }
    }

    /// Puts a view at a place.
    pub(super) fn put(&self, place: usize, values: &[half::f16]) {
        let each = self.each as i64;
        let mut to = self.planes.narrow(0, place as i64 * each, each);
        to.copy_(&Tensor::from_slice(values).reshape(to.size()));
    }

    /// Parts, each by its view's place and its number: `parts x planes x side x side`.
    pub(super) fn of(&self, chosen: impl Iterator<Item = (usize, usize)>) -> Tensor {
        let at = chosen.map(|(place, part)| place * self.each + part);
        let at = indices(at, self.planes.device());
        self.planes.index_select(0, &at).to_kind(self.kind)
    }
}

/// The views that a step draws from, by their numbers. Sample i of a batch is of a view whose number is i modulo the batch: where
/// several processes share the batches, each casts the views of its samples only.
#[derive(Debug, Clone, Copy)]
pub(super) struct ViewWindow {
    /// The oldest of them.
    pub(super) oldest: u64,
    /// The first that is not one of them.
    pub(super) end: u64,
    /// Samples of a batch, at most as many as views.
    pub(super) batch: u64,
    /// Which process this is.
    pub(super) rank: Rank,
}

impl ViewWindow {
    /// How many views of a process a ring needs room for, of so many of all processes.
    pub(super) fn ring(views: u64, rank: Rank) -> usize {
        views.div_ceil(u64::from(rank.world_size())) as usize + 1
    }

    /// Of each sample of this process its seed, and where its view lies in a ring of so many.
    pub(super) fn draw(self, seed: u64, ring: usize) -> (Vec<u64>, Vec<usize>) {
        let one = |sample: u64| {
            let seed = stream(seed, sample);
            let view = self.view_of(sample, stream(seed, 0));
            (seed, self.place(view, ring))
        };
        self.samples().map(one).unzip()
    }

    /// The samples of this process.
    fn samples(self) -> impl Iterator<Item = u64> {
        let rank = self.rank;
        let is_own =
            move |sample: &u64| sample % u64::from(rank.world_size()) == u64::from(rank.index());
        (0..self.batch).filter(is_own)
    }

    /// The view of a sample, drawn by a seed.
    fn view_of(self, sample: u64, seed: u64) -> u64 {
        let batch = self.batch;
        let first = self.oldest + (sample + batch - self.oldest % batch) % batch;
        debug_assert!(self.end - self.oldest >= batch);
        let count = (self.end - first).div_ceil(batch);
        first + batch * (seed % count)
    }

    /// Where a view of this process lies in a ring of so many.
    pub(super) fn place(self, view: u64, ring: usize) -> usize {
        (view / u64::from(self.rank.world_size())) as usize % ring
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn samples_are_of_views_that_are_there_of_their_own_process_and_each_has_its_place() {
        for (views, batch, processes, new_views) in [
            (8_u64, 4_u64, 1_u32, 1_u64),
            (13, 4, 2, 3),
            (12, 12, 3, 40),
            (31, 8, 4, 0),
        ] {
            for step in 0..20 {
                let end = batch + new_views * step;
                for index in 0..processes {
                    let window = ViewWindow {
                        oldest: end.saturating_sub(views),
                        end,
                        batch,
                        rank: Rank::new(index, processes).unwrap(),
                    };
                    let ring = ViewWindow::ring(views, window.rank);
                    let own = |view: &u64| view % u64::from(processes) == u64::from(index);
                    let kept: Vec<u64> = (window.oldest..end).filter(own).collect();
                    let places: BTreeSet<usize> =
                        kept.iter().map(|&view| window.place(view, ring)).collect();
                    assert_eq!(places.len(), kept.len());
                    for sample in window.samples() {
                        for seed in 0..9 {
                            assert!(kept.contains(&window.view_of(sample, seed)));
                        }
                    }
                }
            }
        }
    }
}
