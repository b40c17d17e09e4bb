//! Images with their ground truth.

mod layout;
mod read;

use std::path::Path;

use super::{DamagedSample, ReadError};
use crate::image::{Extent, Linear, Planes, Rgb};
use crate::light::{Normals, ShLight};
use layout::Entry;

pub use layout::TruthLayout;

/// An image and its ground truth. A data set has some of these parts and lacks others;
/// all maps have the size of the mask.
#[derive(Debug, Clone, PartialEq)]
pub struct TruthSample {
    /// Its name within the set; parts of it are separated by `/`.
    pub name: String,
    /// 1 where the object is, 0 elsewhere.
    pub mask: Planes<1>,
    /// What a camera sees.
    pub image: Option<Rgb<Linear>>,
    /// The same without highlights: albedo times shading.
    pub diffuse: Option<Rgb<Linear>>,
    /// Normals, where they are known.
    pub normals: Option<Normals>,
    /// The diffuse reflectance, up to a scale.
    pub albedo: Option<Rgb<Linear>>,
    /// The light that falls on the surface, up to a scale.
    pub shading: Option<Rgb<Linear>>,
    /// The highlights, in the image's units.
    pub highlight: Option<Rgb<Linear>>,
    /// The light of the scene.
    pub light: Option<ShLight>,
}

impl TruthSample {
    /// Width and height.
    pub const fn extent(&self) -> Extent {
        self.mask.extent()
    }
}

/// A folder of images with their ground truth.
pub struct TruthSet {
    layout: TruthLayout,
    entries: Vec<Entry>,
}

impl TruthSet {
    /// Finds the samples in the folder `root`, in the order of their names.
    ///
    /// # Errors
    /// If it cannot be read, or contains no samples.
    pub fn open(root: &Path, layout: TruthLayout) -> Result<Self, ReadError> {
        let entries = layout.entries(root)?;
        if entries.is_empty() {
            return Err(ReadError::empty(root, layout.expected()));
        }
        Ok(Self { layout, entries })
    }

    /// The names of all samples.
    pub fn names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.entries.iter().map(|entry| entry.name.as_str())
    }

    /// Keeps `count` samples, spread evenly over the set; all if the set has fewer.
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
                fault: super::ReadError::Other(why),
            });
        };
        read::sample(entry, self.layout).map_err(|fault| DamagedSample {
            sample: entry.name.clone(),
            fault,
        })
    }
}
