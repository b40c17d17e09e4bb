//! Triangles as files and generators give them.

use glam::{Vec2, Vec3};

use super::material::MeshMaterials;

/// Texture coordinates of a triangle that has none.
pub(crate) const NO_TEXTURE: [Vec2; 3] = [Vec2::NAN; 3];

/// What a file or a generator gives: positions, triangles by index, and texture coordinates for
/// each corner and materials where there are any.
#[derive(Debug, Default)]
pub(crate) struct RawMesh {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// For each triangle, [`NO_TEXTURE`] where it has none; empty of shapes that know none.
    pub(crate) texture: Vec<[Vec2; 3]>,
    pub(crate) materials: MeshMaterials,
}
