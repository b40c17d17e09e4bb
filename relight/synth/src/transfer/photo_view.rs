//! A view for photographs: the data for a device to light it in any way without rays.
//!
//! Light from all around goes by the harmonics of the viewer's frame, as in a turn's view. They have no sharp shadows: those
//! come from a few lamps whose visibility is cast with the view.

use glam::{Mat3, Vec3};
use half::f16;
use relight_core::light::Order;

use super::cast::cast_pixels;
use super::{BOUNCE_COEFFICIENTS, ViewRecipe};
use crate::geometry::{GBuffer, Occluder};
use crate::library::Library;
use crate::lighting::SyntheticLamp;
use crate::mesh::Mesh;
use crate::random::{Random, stream};
use crate::samples::finish::Finish;
use crate::samples::object::ObjectSource;
use crate::samples::recipe::Recipe;
use crate::sequence::TablePose;

/// Part of the closed objects that stand on a black table.
const ON_TABLE: f32 = 0.4;
/// Part of the objects that are meshes, if there are any.
const MESHES: f32 = 0.6;
/// The camera over that table, degrees.
const ELEVATIONS: std::ops::Range<f32> = 0.0..50.0;
/// A lamp far away is this far: all rays from it are parallel.
const FAR: f32 = 1e3;

/// A lamp whose visibility is cast with a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewLamp {
    /// Its middle, in the viewer's frame.
    pub centre: [f32; 3],
    /// Half of the angle under which the object's middle sees it, radians.
    pub half_angle: f32,
}

/// A view, cast once. All planes are `size x size`, row by row, in the viewer's frame, and 0 outside the object.
#[derive(Debug, Clone, PartialEq)]
pub struct PhotoView {
    /// Width and height, pixels.
    pub size: u32,
    /// [`Self::BASE`] planes.
    pub base: Vec<f16>,
    /// [`Self::FINISHES`] materials, each three planes of unit normals and three of linear albedo.
    pub finishes: Vec<f16>,
    /// Of each lamp, the part of it that each pixel sees, 0..=1.
    pub visibility: Vec<f16>,
    /// The lamps, [`Self::LAMPS`] of them.
    pub lamps: Vec<ViewLamp>,
}

impl PhotoView {
    /// The order of light from all around.
    pub const ORDER: Order = Order::GLOSS;
    /// Materials of a view.
    pub const FINISHES: usize = 3;
    /// Planes of a material.
    pub const FINISH_PLANES: usize = 6;
    /// Lamps of a view.
    pub const LAMPS: usize = 6;

    /// The plane that is 1 on the object.
    pub const MASK: usize = 0;
    /// Where the surface is, 3 planes.
    pub const POINTS: usize = 1;
    /// Unit vectors to the eye, 3 planes.
    pub const TOWARDS_EYE: usize = 4;
    /// 1 where what a pixel mirrors is not blocked.
    pub const MIRRORS: usize = 7;
    /// Where the surface is in the mesh's own frame, within the unit sphere, 3 planes.
    pub const OBJECT_POINTS: usize = 8;
    /// The blocked part of the cosine, a plane for each harmonic.
    pub const BLOCKED: usize = 11;
    /// The irradiance that an object of the albedo 1 throws back onto a pixel, a plane for each of 9 harmonics.
    pub const BOUNCED: usize = Self::BLOCKED + Self::ORDER.coefficients();
    /// The number of planes.
    pub const BASE: usize = Self::BOUNCED + BOUNCE_COEFFICIENTS;
}

impl PhotoView {
    /// Casts the view of a number.
    pub fn cast(view: &ViewRecipe, library: &Library, number: u64) -> Self {
        let mut random = Random::new(stream(stream(view.seed, 33), number));
        let recipe = Recipe {
            seed: view.seed,
            size: view.size,
            ..Recipe::default()
        };
        let (object, mesh) = recipe.object_with(library, number, MESHES);
        let seen = ViewGeometry::draw(&recipe, &object, &mesh, &mut random);
        let lamps: Vec<SyntheticLamp> = (0..PhotoView::LAMPS)
            .map(|_| seen.lamp(&mut random))
            .collect();
        let finishes: Vec<Finish> = (0..PhotoView::FINISHES)
            .map(|_| Finish::draw(&mut random, &seen.buffer, library, 0.0, false))
            .collect();
        Self {
            size: view.size,
            base: seen.base(view.rays, random.seed()),
            finishes: finishes
                .iter()
                .flat_map(|finish| seen.finish_planes(finish, library))
                .collect(),
            visibility: lamps
                .iter()
                .flat_map(|lamp| seen.visibility(lamp, random.seed()))
                .collect(),
            lamps: lamps.iter().map(view_lamp).collect(),
        }
    }
}

fn view_lamp(lamp: &SyntheticLamp) -> ViewLamp {
    ViewLamp {
        centre: lamp.emitter.middle(FAR).to_array(),
        half_angle: lamp.emitter.half_angle(),
    }
}

/// What a camera sees of an object, and what blocks light.
pub(super) struct ViewGeometry {
    buffer: GBuffer,
    occluder: Occluder,
    /// The table's upward axis in the viewer's frame, if it stands on one.
    table: Option<Vec3>,
}

impl ViewGeometry {
    #[cfg(test)]
    pub(super) fn new(buffer: GBuffer, occluder: Occluder, table: Option<Vec3>) -> Self {
        Self {
            buffer,
            occluder,
            table,
        }
    }

    #[cfg(test)]
    pub(super) fn into_occluder(self) -> Occluder {
        self.occluder
    }

    /// An object on the plate of the table.
    pub(super) fn on_table(mesh: &Mesh, stand: &TablePose, size: u32) -> Self {
        let placement = stand.placement(mesh);
        Self {
            buffer: GBuffer::render(mesh, placement, stand.projection, size),
            occluder: Occluder::with_disc(mesh, placement, &stand.plate(mesh)),
            table: Some(stand.axis()),
        }
    }

    pub(super) fn buffer(&self) -> &GBuffer {
        &self.buffer
    }

    pub(super) fn occluder(&self) -> &Occluder {
        &self.occluder
    }

    fn draw(recipe: &Recipe, object: &ObjectSource, mesh: &Mesh, random: &mut Random) -> Self {
        let can_stand = match object {
            ObjectSource::Mesh { .. } => true,
            ObjectSource::Shape { kind, .. } => !kind.is_open(),
        };
        if can_stand && random.chance(ON_TABLE) {
            let stand = TablePose::draw(random, ELEVATIONS);
            return Self::on_table(mesh, &stand, recipe.size);
        }
        let (pose, projection, buffer) = recipe.framed(object, mesh, random);
        Self {
            buffer,
            occluder: Occluder::new(mesh, pose.place(mesh, projection)),
            table: None,
        }
    }

    pub(super) fn lamp(&self, random: &mut Random) -> SyntheticLamp {
        let lamp = SyntheticLamp::draw(random, &self.buffer, 1.0);
        match self.table {
            Some(axis) => SyntheticLamp {
                emitter: lamp.emitter.above(axis),
                ..lamp
            },
            None => lamp,
        }
    }

    pub(super) fn base(&self, rays: u32, seed: u64) -> Vec<f16> {
        let cast = cast_pixels(&self.buffer, &self.occluder, Mat3::IDENTITY, rays, seed);
        self.dense(PhotoView::BASE, |k, values| {
            let buffer = &self.buffer;
            let found = &cast[k];
            values[PhotoView::MASK] = 1.0;
            write(values, PhotoView::POINTS, &buffer.points[k].to_array());
            let eye = buffer.towards_eye[k].to_array();
            write(values, PhotoView::TOWARDS_EYE, &eye);
            values[PhotoView::MIRRORS] = f32::from(u8::from(found.mirrors));
            let own = buffer.object_points[k].to_array();
            write(values, PhotoView::OBJECT_POINTS, &own);
            let blocked = &found.blocked[..PhotoView::ORDER.coefficients()];
            write(values, PhotoView::BLOCKED, blocked);
            write(values, PhotoView::BOUNCED, &found.bounced);
        })
    }

    pub(super) fn finish_planes(&self, finish: &Finish, library: &Library) -> Vec<f16> {
        let material = finish.apply(&self.buffer, library);
        self.dense(PhotoView::FINISH_PLANES, |k, values| {
            write(values, 0, &material.normals[k].to_array());
            write(values, 3, &material.albedo[k].to_array());
        })
    }

    pub(super) fn visibility(&self, lamp: &SyntheticLamp, seed: u64) -> Vec<f16> {
        let shadows = lamp.shadows(&self.buffer, &self.occluder, seed);
        self.dense(1, |k, values| values[0] = shadows.visible_part(k, lamp))
    }

    /// Planes with the values that `of` writes for each covered pixel, 0 elsewhere.
    pub(super) fn dense(&self, planes: usize, of: impl Fn(usize, &mut [f32])) -> Vec<f16> {
        let area = (self.buffer.size * self.buffer.size) as usize;
        let mut dense = vec![f16::ZERO; planes * area];
        let mut values = vec![0.0; planes];
        for (k, &pixel) in self.buffer.pixels.iter().enumerate() {
            of(k, &mut values);
            for (plane, &value) in values.iter().enumerate() {
                dense[plane * area + pixel as usize] = f16::from_f32(value);
            }
        }
        dense
    }
}

pub(super) fn write(values: &mut [f32], at: usize, part: &[f32]) {
    values[at..at + part.len()].copy_from_slice(part);
}
