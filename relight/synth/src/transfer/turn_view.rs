//! A view of an object on the table: the data for a device to light it over a whole turn without a ray.

use std::ops::Range;

use half::f16;
use relight_core::light::Order;

use super::cast::{cast_pixels, table_frame};
use super::photo_view::{ViewGeometry, write};
use super::{BOUNCE_COEFFICIENTS, COEFFICIENTS, TRANSFER_ORDER, ViewRecipe};
use crate::library::Library;
use crate::random::{Random, stream};
use crate::samples::finish::Finish;
use crate::samples::recipe::Recipe;
use crate::sequence::{TablePose, standing_object};

/// The camera over the plate, degrees.
const ELEVATIONS: Range<f32> = 5.0..40.0;
/// Part of the objects that are meshes, if there are any.
const MESHES: f32 = 0.6;

/// A view, cast once. All planes are `size x size`, row by row, and 0 outside the object. Vectors are in the viewer's frame,
/// harmonics in the table's.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnView {
    /// The camera over the plate, radians.
    pub elevation: f32,
    /// [`Self::BASE`] planes.
    pub base: Vec<f16>,
    /// [`Self::FINISHES`] materials, each three planes of unit normals and three of linear albedo.
    pub finishes: Vec<f16>,
}

impl TurnView {
    /// The order of light from all around: lamps are blurred by it, and gloss as smooth as varnish.
    pub const ORDER: Order = TRANSFER_ORDER;
    /// Materials of a view.
    pub const FINISHES: usize = 3;
    /// Planes of a material.
    pub const FINISH_PLANES: usize = 6;

    /// The plane that is 1 on the object.
    pub const MASK: usize = 0;
    /// Unit vectors to the eye, 3 planes.
    pub const TOWARDS_EYE: usize = 1;
    /// 1 where what a pixel mirrors is not blocked.
    pub const MIRRORS: usize = 4;
    /// The blocked part of the cosine, a plane for each harmonic.
    pub const BLOCKED: usize = 5;
    /// The irradiance that an object of the albedo 1 throws back onto a pixel, a plane for each of 9 harmonics.
    pub const BOUNCED: usize = Self::BLOCKED + COEFFICIENTS;
    /// The number of planes.
    pub const BASE: usize = Self::BOUNCED + BOUNCE_COEFFICIENTS;

    /// The matrix that takes vectors of the viewer's frame into the table's, row by row; the elevation is in radians.
    pub fn to_table(elevation: f32) -> [[f32; 3]; 3] {
        table_frame(elevation).transpose().to_cols_array_2d()
    }
}

impl TurnView {
    /// Casts the view of a number.
    pub fn cast(view: &ViewRecipe, library: &Library, number: u64) -> Self {
        let mut random = Random::new(stream(stream(view.seed, 31), number));
        let recipe = Recipe {
            seed: random.seed(),
            size: view.size,
            ..Recipe::default()
        };
        let (_, mesh) = standing_object(&recipe, library, MESHES, &mut random);
        let stand = TablePose::draw(&mut random, ELEVATIONS);
        let seen = ViewGeometry::on_table(&mesh, &stand, view.size);
        let base = base(&seen, stand.elevation(), (view.rays, random.seed()));
        let finishes = (0..TurnView::FINISHES).flat_map(|_| {
            let finish = Finish::draw(&mut random, seen.buffer(), library, 0.0, false);
            seen.finish_planes(&finish, library)
        });
        Self {
            elevation: stand.elevation(),
            finishes: finishes.collect(),
            base,
        }
    }
}

/// The planes that do not depend on the material.
pub(super) fn base(seen: &ViewGeometry, elevation: f32, (rays, seed): (u32, u64)) -> Vec<f16> {
    let to_table = table_frame(elevation);
    let cast = cast_pixels(seen.buffer(), seen.occluder(), to_table, rays, seed);
    seen.dense(TurnView::BASE, |k, values| {
        let found = &cast[k];
        values[TurnView::MASK] = 1.0;
        let eye = seen.buffer().towards_eye[k].to_array();
        write(values, TurnView::TOWARDS_EYE, &eye);
        values[TurnView::MIRRORS] = f32::from(u8::from(found.mirrors));
        write(values, TurnView::BLOCKED, &found.blocked);
        write(values, TurnView::BOUNCED, &found.bounced);
    })
}
