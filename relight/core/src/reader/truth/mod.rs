//! Images with their ground truth.

mod entry;
mod layout;
mod npy;
mod read;
mod sample;
mod scenes;

use std::path::Path;

use super::{DamagedSample, OpenError, SampleId, Source};
use entry::Entry;

pub use layout::TruthLayout;
pub use sample::TruthSample;

/// A folder of images with their ground truth.
pub struct TruthSet {
    layout: TruthLayout,
    entries: Vec<Entry>,
}

impl TruthSet {
    /// Finds the samples in the folder `root`, in the order of their names.
    ///
    /// # Errors
    /// [`OpenError::Read`], or [`OpenError::Content`] where there are none.
    pub fn open(root: &Path, layout: TruthLayout) -> Result<Self, OpenError> {
        let entries = layout.entries(root)?;
        if entries.is_empty() {
            return Err(OpenError::empty(root, layout.expected()));
        }
        Ok(Self { layout, entries })
    }

    /// The names of all samples.
    pub fn names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.entries.iter().map(|entry| entry.name.as_str())
    }

    /// Keeps `count` samples, spread evenly over the set; all where there are no more.
    #[must_use]
    pub fn spread(mut self, count: usize) -> Self {
        let all = self.entries.len();
        let count = count.min(all);
        let mut index = 0;
        self.entries.retain(|_| {
            let kept = index * count / all != (index + 1) * count / all;
            index += 1;
            kept
        });
        self
    }

    /// Reads the sample at `index`, 0-based.
    ///
    /// # Errors
    /// [`DamagedSample`], which names the sample.
    pub fn load(&self, index: usize) -> Result<TruthSample, DamagedSample> {
        let Some(entry) = self.entries.get(index) else {
            let why = format!("there are {} samples", self.entries.len());
            return Err(DamagedSample {
                sample: format!("sample {index}"),
                fault: super::SampleFault::Part(why),
            });
        };
        read::sample(entry, self.layout).map_err(|fault| DamagedSample {
            sample: entry.name.clone(),
            fault,
        })
    }
}

/// All samples are of one turn, to be drawn as [`Draw::Mixed`](super::Draw::Mixed).
impl Source for TruthSet {
    type Batch = Vec<TruthSample>;

    fn turns(&self) -> Vec<u32> {
        vec![u32::try_from(self.entries.len()).unwrap_or(u32::MAX)]
    }

    fn batch(
        &self,
        samples: &[SampleId],
        spare: Option<Self::Batch>,
    ) -> (Self::Batch, Vec<DamagedSample>) {
        let mut batch = spare.unwrap_or_default();
        batch.clear();
        let mut damage = Vec::new();
        for id in samples {
            match self.load(id.position as usize) {
                Ok(sample) => batch.push(sample),
                Err(damaged) => damage.push(damaged),
            }
        }
        (batch, damage)
    }
}
