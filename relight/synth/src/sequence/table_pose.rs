//! How an object stands on the turntable.

use std::borrow::Cow;
use std::ops::Range;

use glam::{Affine3A, Vec3};

use crate::geometry::Disc;
use crate::library::Library;
use crate::mesh::Mesh;
use crate::random::Random;
use crate::samples::object::ObjectSource;
use crate::samples::recipe::Recipe;
use crate::view::{Pose, Projection};

/// The plate's radius, in halves of the picture's width.
const PLATE: f32 = 2.5;

/// How an object stands on the table.
pub(crate) struct TablePose {
    pub(crate) pose: Pose,
    pub(crate) projection: Projection,
    /// Of the camera over the plate, radians.
    elevation: f32,
}

impl TablePose {
    /// A camera at an elevation within this range, degrees.
    pub(crate) fn draw(random: &mut Random, elevations: Range<f32>) -> Self {
        let elevation = random.uniform(elevations).to_radians();
        let azimuth = random.uniform(0.0..std::f32::consts::TAU);
        Self {
            pose: Pose::upright(elevation, azimuth, random.uniform(0.85..0.95)),
            projection: Projection::Perspective {
                distance: random.uniform(4.0..8.0),
            },
            elevation,
        }
    }

    /// Of the camera over the plate, radians.
    pub(crate) fn elevation(&self) -> f32 {
        self.elevation
    }

    /// Of the table in the viewer's frame, upwards.
    pub(crate) fn axis(&self) -> Vec3 {
        Vec3::new(0.0, self.elevation.cos(), self.elevation.sin())
    }

    /// The map from the mesh's own frame into the viewer's.
    pub(crate) fn placement(&self, mesh: &Mesh) -> Affine3A {
        self.pose.place(mesh, self.projection)
    }

    /// The plate on which the object stands.
    pub(crate) fn plate(&self, mesh: &Mesh) -> Disc {
        let placement = self.placement(mesh);
        let points = mesh
            .positions
            .iter()
            .map(|&p| placement.transform_point3(p));
        let lowest = points
            .map(|p| p.dot(self.axis()))
            .fold(f32::INFINITY, f32::min);
        let middle = placement.transform_point3(Vec3::ZERO);
        let down = middle.dot(self.axis()) - lowest;
        Disc {
            centre: middle - self.axis() * (down + 2e-3),
            normal: self.axis(),
            radius: PLATE,
        }
    }
}

/// An object that can stand: sheets do not. This part of them are meshes, if there are any.
pub(crate) fn standing_object<'a>(
    recipe: &Recipe,
    library: &'a Library,
    meshes: f32,
    random: &mut Random,
) -> (ObjectSource, Cow<'a, Mesh>) {
    loop {
        let (object, mesh) = recipe.object_with(library, random.seed(), meshes);
        match object {
            ObjectSource::Shape { kind, .. } if kind.is_open() => {}
            _ => return (object, mesh),
        }
    }
}
