//! The order in which samples are drawn. Knows their number and not their content.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};

/// The position of one sample in a turn, or in another ordered set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SampleId {
    /// Which turn, from 0.
    pub turn: u32,
    /// Which position of it, from 0.
    pub position: u32,
}

/// Which samples make a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Draw {
    /// Neighbours of one turn: in a shard of `relit-extract` any 12 cover the whole turn. The start
    /// of a run is drawn again for each epoch; the last run of a turn goes on at the turn's start. It
    /// is shorter if the turn is not a multiple of the batch.
    Neighbours,
    /// Samples from anywhere.
    Mixed,
}

/// How samples are drawn. The same plan over the same data always draws the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DrawPlan {
    /// Samples of a batch, at least 1.
    pub batch: u32,
    /// Which of them go together.
    pub draw: Draw,
    /// The seed of the shuffle; `None` draws in stored order.
    pub seed: Option<u64>,
    /// Which process draws: each draws its own batches.
    pub rank: Rank,
}

/// The rank of a process and the world size, where several processes draw from one data set: of each `world_size`
/// batches that follow each other, a process takes the one at its rank. Epochs go on into each other: whenever the last
/// process has had a batch, all of them have had as many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rank {
    index: u32,
    world_size: u32,
}

impl Rank {
    /// The only process: it draws everything.
    pub const ONLY: Self = Self {
        index: 0,
        world_size: 1,
    };

    /// The process `index` of `world_size`; `None` if `index` is out of range.
    pub const fn new(index: u32, world_size: u32) -> Option<Self> {
        if index < world_size {
            Some(Self { index, world_size })
        } else {
            None
        }
    }

    /// Which process this is, from 0.
    pub const fn index(self) -> u32 {
        self.index
    }

    /// How many processes there are, at least 1.
    pub const fn world_size(self) -> u32 {
        self.world_size
    }
}

/// A position between two samples of a plan, to resume from. It is the same for all processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Cursor {
    /// Which time all samples are drawn, from 0.
    pub epoch: u64,
    /// How many samples were drawn in this epoch by all processes together, damaged ones included.
    pub sample: u64,
}

/// The samples of a batch, and the cursor after it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Job {
    pub(super) samples: Vec<SampleId>,
    pub(super) next: Cursor,
}

impl DrawPlan {
    /// Batches of 12 neighbours in shuffled order, as the paper draws them.
    pub const fn from_turns(seed: u64) -> Self {
        Self {
            batch: 12,
            draw: Draw::Neighbours,
            seed: Some(seed),
            rank: Rank::ONLY,
        }
    }

    /// The batches of this rank from a cursor on, up to the end of the epoch before `end`. `turns` are the numbers
    /// of samples. The cursor after a batch is also after the batches that the other ranks take with it.
    pub(super) fn jobs(
        self,
        turns: &[u32],
        from: Cursor,
        end: u64,
    ) -> impl Iterator<Item = Job> + use<> {
        let turns = turns.to_vec();
        // Epochs of nothing would go by for ever.
        let is_empty = turns.iter().all(|&samples| samples == 0);
        let end = if is_empty { from.epoch } else { end };
        let mut all = (from.epoch..end).flat_map(move |epoch| {
            let skip = if epoch == from.epoch { from.sample } else { 0 };
            self.epoch(&turns, epoch, skip)
        });
        let Rank { index, world_size } = self.rank;
        std::iter::from_fn(move || {
            let round: Vec<Job> = all.by_ref().take(world_size as usize).collect();
            let next = round.last()?.next;
            let samples = round.into_iter().nth(index as usize)?.samples;
            Some(Job { samples, next })
        })
    }

    /// The batches of an epoch, of all ranks, without its first `skip` samples.
    fn epoch(self, turns: &[u32], epoch: u64, skip: u64) -> impl Iterator<Item = Job> + use<> {
        let mut random = self.seed.map(|seed| {
            // An odd factor keeps the seeds of different epochs apart.
            let seed = seed.wrapping_add(epoch.wrapping_mul(0x9e37_79b9_7f4a_7c15));
            Pcg64::seed_from_u64(seed)
        });
        let batch = self.batch.max(1);
        let batches = match self.draw {
            Draw::Neighbours => neighbours(turns, batch, random.as_mut()),
            Draw::Mixed => mixed(turns, batch, random.as_mut()),
        };
        let mut drawn = 0;
        batches.into_iter().filter_map(move |mut samples| {
            let start = drawn;
            drawn += samples.len() as u64;
            let over = skip.saturating_sub(start).min(samples.len() as u64);
            samples.drain(..usize::try_from(over).unwrap_or(usize::MAX));
            let next = Cursor {
                epoch,
                sample: drawn,
            };
            (!samples.is_empty()).then_some(Job { samples, next })
        })
    }
}

/// The batches of [`Draw::Neighbours`].
fn neighbours(turns: &[u32], batch: u32, mut random: Option<&mut Pcg64>) -> Vec<Vec<SampleId>> {
    let mut batches = Vec::new();
    for (turn, &length) in (0..).zip(turns) {
        let offset = random
            .as_deref_mut()
            .map_or(0, |random| below(random, u64::from(length)));
        let sample = |step: u32| {
            let position = (u64::from(step) + offset) % u64::from(length);
            SampleId {
                turn,
                position: position as u32,
            }
        };
        for begin in (0..length).step_by(batch as usize) {
            let end = length.min(begin.saturating_add(batch));
            batches.push((begin..end).map(sample).collect());
        }
    }
    if let Some(random) = random {
        shuffle(&mut batches, random);
    }
    batches
}

/// The batches of [`Draw::Mixed`].
fn mixed(turns: &[u32], batch: u32, random: Option<&mut Pcg64>) -> Vec<Vec<SampleId>> {
    let all = (0..).zip(turns);
    let mut samples: Vec<SampleId> = all
        .flat_map(|(turn, &length)| (0..length).map(move |position| SampleId { turn, position }))
        .collect();
    if let Some(random) = random {
        shuffle(&mut samples, random);
    }
    samples.chunks(batch as usize).map(<[_]>::to_vec).collect()
}

/// Fisher and Yates.
fn shuffle<T>(items: &mut [T], random: &mut Pcg64) {
    for last in (1..items.len()).rev() {
        let other = below(random, last as u64 + 1) as usize;
        items.swap(last, other);
    }
}

/// Uniform in `0..count`; 0 where `count` is 0.
fn below(random: &mut Pcg64, count: u64) -> u64 {
    ((u128::from(random.next_u64()) * u128::from(count)) >> 64) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashSet;

    fn plan(batch: u32, draw: Draw, seed: Option<u64>) -> DrawPlan {
        DrawPlan {
            batch,
            draw,
            seed,
            rank: Rank::ONLY,
        }
    }

    fn drawn(plan: DrawPlan, turns: &[u32], from: Cursor, end: u64) -> Vec<SampleId> {
        plan.jobs(turns, from, end)
            .flat_map(|job| job.samples)
            .collect()
    }

    fn draws() -> impl Strategy<Value = Draw> {
        prop_oneof![Just(Draw::Neighbours), Just(Draw::Mixed)]
    }

    proptest! {
        #[test]
        fn each_epoch_draws_each_sample_once(
            turns in prop::collection::vec(0_u32..40, 0..6),
            batch in 1_u32..15,
            draw in draws(),
            seed in prop::option::of(any::<u64>()),
        ) {
            let all = drawn(plan(batch, draw, seed), &turns, Cursor::default(), 1);
            let different: HashSet<SampleId> = all.iter().copied().collect();
            prop_assert_eq!(all.len(), turns.iter().sum::<u32>() as usize);
            prop_assert_eq!(different.len(), all.len());
            prop_assert!(all.iter().all(|id| id.position < turns[id.turn as usize]));
        }

        #[test]
        fn from_any_cursor_on_the_rest_is_drawn(
            turns in prop::collection::vec(0_u32..30, 1..5),
            draw in draws(),
            cut in any::<prop::sample::Index>(),
            seed in prop::option::of(any::<u64>()),
        ) {
            let plan = plan(12, draw, seed);
            let both = drawn(plan, &turns, Cursor::default(), 2);
            let epoch = both.len() / 2;
            let cut = cut.index(epoch + 1);
            let rest = drawn(plan, &turns, Cursor { epoch: 0, sample: cut as u64 }, 2);
            prop_assert_eq!(&both[cut..], rest);
        }

        #[test]
        fn ranks_draw_everything_between_them(
            turns in prop::collection::vec(0_u32..60, 1..5),
            of in 1_u32..5,
            draw in draws(),
        ) {
            let whole = plan(12, draw, Some(7));
            let mut all: Vec<SampleId> = (0..of)
                .flat_map(|index| {
                    let rank = Rank::new(index, of).unwrap();
                    drawn(DrawPlan { rank, ..whole }, &turns, Cursor::default(), 1)
                })
                .collect();
            let mut expected = drawn(whole, &turns, Cursor::default(), 1);
            all.sort_unstable();
            expected.sort_unstable();
            prop_assert_eq!(all, expected);
        }
    }

    #[test]
    fn a_batch_of_neighbours_is_a_run_of_one_turn_around_its_end() {
        let turns = [1500, 30];
        for job in DrawPlan::from_turns(3).jobs(&turns, Cursor::default(), 1) {
            let turn = job.samples[0].turn;
            assert!(job.samples.len() == 12 || turn == 1 && job.samples.len() == 6);
            for pair in job.samples.windows(2) {
                let next = (pair[0].position + 1) % turns[turn as usize];
                assert_eq!((pair[1].turn, pair[1].position), (turn, next));
            }
        }
    }

    #[test]
    fn batches_are_shuffled_over_turns_and_otherwise_in_each_epoch() {
        let epoch = |epoch| {
            drawn(
                DrawPlan::from_turns(3),
                &[120; 8],
                Cursor { epoch, sample: 0 },
                epoch + 1,
            )
        };
        let turns: HashSet<u32> = epoch(0)[..96].iter().map(|id| id.turn).collect();
        assert!(turns.len() > 3, "{turns:?}");
        assert_ne!(epoch(0), epoch(1));
        assert_eq!(epoch(1), epoch(1));
    }

    #[test]
    fn without_a_seed_samples_come_as_they_stand() {
        let all = drawn(
            plan(4, Draw::Neighbours, None),
            &[5, 3],
            Cursor::default(),
            1,
        );
        let mut sorted = all.clone();
        sorted.sort_unstable();
        assert_eq!(all, sorted);
    }

    #[test]
    fn epochs_without_a_batch_end_at_once() {
        let endless = |rank, turns: &[u32]| {
            let plan = DrawPlan {
                rank,
                ..DrawPlan::from_turns(1)
            };
            plan.jobs(turns, Cursor::default(), u64::MAX).next()
        };
        assert_eq!(endless(Rank::ONLY, &[0, 0]), None);
        assert!(endless(Rank::new(2, 3).unwrap(), &[24]).is_some());
        assert_eq!(Rank::new(3, 3), None);
    }

    #[test]
    fn ranks_go_on_together_over_epochs_and_from_each_others_cursors() {
        let whole = DrawPlan::from_turns(5);
        // Five batches an epoch: three processes do not come out even.
        let turns = [30, 24];
        let jobs = |rank, from| {
            let plan = DrawPlan { rank, ..whole };
            plan.jobs(&turns, from, 7).collect::<Vec<Job>>()
        };
        let alone = jobs(Rank::ONLY, Cursor::default());
        let rank = |index| Rank::new(index, 3).unwrap();
        let begun = jobs(rank(0), Cursor::default());
        for (round, job) in begun.iter().take(10).enumerate() {
            assert_eq!(job.samples, alone[3 * round].samples);
            assert_eq!(job.next, alone[3 * round + 2].next);
            let resumed = &jobs(rank(2), job.next)[0];
            assert_eq!(resumed.samples, alone[3 * round + 5].samples);
        }
    }

    #[test]
    fn the_cursor_behind_a_batch_counts_the_samples_before_it() {
        let plan = plan(12, Draw::Neighbours, Some(1));
        let places: Vec<u64> = plan
            .jobs(&[30], Cursor::default(), 1)
            .map(|job| job.next.sample)
            .collect();
        assert_eq!(places.last(), Some(&30));
        let first = plan
            .jobs(
                &[30],
                Cursor {
                    epoch: 0,
                    sample: 5,
                },
                1,
            )
            .next();
        assert_eq!(first.unwrap().next.sample, places[0]);
    }
}
