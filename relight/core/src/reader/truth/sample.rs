//! One image with its ground truth.

use crate::image::{Extent, Linear, Planes, Rgb};
use crate::light::{Normals, ShLight, YUp};

/// An image and its ground truth. A data set has some of these parts and lacks others;
/// all that are there have the size of the mask.
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
    pub normals: Option<Normals<YUp>>,
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
    #[must_use]
    pub const fn extent(&self) -> Extent {
        self.mask.extent()
    }
}
