//! Which objects and poses are drawn, and how many rays each pixel has.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::cast::{RadianceTransfer, TransferFinish};
use crate::geometry::{GBuffer, Occluder};
use crate::library::Library;
use crate::random::{Random, stream};
use crate::samples::finish::Finish;
use crate::samples::recipe::Recipe;
use crate::sequence::{TablePose, standing_object};

/// The camera over the plate, degrees.
const ELEVATIONS: Range<f32> = 5.0..40.0;
/// Materials of a view.
const FINISHES: u64 = 3;

/// How views are drawn and cast. The same recipe and library give the same views.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TransferRecipe {
    /// The seed of all draws.
    pub seed: u64,
    /// Width and height, pixels.
    pub size: u32,
    /// Rays a pixel, all around; half of them leave the surface.
    pub rays: u32,
}

impl TransferRecipe {
    /// Casts the view of a number.
    pub(super) fn cast(&self, library: &Library, number: u64) -> RadianceTransfer {
        let mut random = Random::new(stream(stream(self.seed, 31), number));
        let recipe = Recipe {
            seed: random.seed(),
            size: self.size,
            ..Recipe::default()
        };
        let (_, mesh) = standing_object(&recipe, library, &mut random);
        let stand = TablePose::draw(&mut random, ELEVATIONS);
        let placement = stand.placement(&mesh);
        let buffer = GBuffer::render(&mesh, placement, stand.projection, self.size);
        let occluder = Occluder::with_disc(&mesh, placement, &stand.plate(&mesh));
        let elevation = stand.elevation();
        let mut transfer =
            RadianceTransfer::cast(&buffer, &occluder, elevation, self.rays, random.seed());
        transfer.finishes = (0..FINISHES)
            .map(|_| {
                let finish = Finish::painted(&mut random, &buffer, library, 0.0);
                let material = finish.apply(&buffer, library);
                TransferFinish {
                    normals: material.normals,
                    albedo: material.albedo,
                }
            })
            .collect();
        transfer
    }
}
