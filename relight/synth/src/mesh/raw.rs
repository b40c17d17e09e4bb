//! Triangles as files and generators give them.

use glam::{Vec2, Vec3};

use super::material::MeshMaterials;

/// Texture coordinates of a triangle that has none.
pub(crate) const NO_TEXTURE: [Vec2; 3] = [Vec2::NAN; 3];

/// Colours of a triangle that has none.
const WHITE: [Vec3; 3] = [Vec3::ONE; 3];

/// The result of a file or a generator: positions, triangles by index, and texture coordinates and colours for
/// each corner and materials, if there are any.
#[derive(Debug, Default)]
pub(crate) struct RawMesh {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// For each triangle, [`NO_TEXTURE`] where it has none; empty of shapes that know none.
    pub(crate) texture: Vec<[Vec2; 3]>,
    /// For each triangle up to the last that has some: linear colours by which its material's is multiplied.
    pub(crate) colours: Vec<[Vec3; 3]>,
    pub(crate) materials: MeshMaterials,
    /// Unused parts of the file, in words.
    pub(crate) left_out: Vec<String>,
}

/// A triangle of a file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RawTriangle {
    /// By index of the positions.
    pub(crate) corners: [u32; 3],
    pub(crate) texture: Option<[Vec2; 3]>,
    pub(crate) colours: Option<[Vec3; 3]>,
    pub(crate) material: Option<usize>,
}

impl RawMesh {
    /// Adds a triangle.
    pub(crate) fn push(&mut self, triangle: RawTriangle) {
        if let Some(colours) = triangle.colours {
            self.colours.resize(self.triangles.len(), WHITE);
            self.colours.push(colours);
        }
        self.triangles.push(triangle.corners);
        self.texture.push(triangle.texture.unwrap_or(NO_TEXTURE));
        self.materials.push(triangle.material);
    }

    /// Whether the file has more than one colour for all, which programs write for an object without colours.
    pub(crate) fn has_own_surface(&self) -> bool {
        let mut colours = self.colours.iter().flatten();
        let first = colours.next().copied().unwrap_or(Vec3::ONE);
        let is_partly_white = self.colours.len() < self.triangles.len() && first != Vec3::ONE;
        self.materials.have_variation()
            || (!self.colours.is_empty() && is_partly_white)
            || colours.any(|&colour| colour != first)
    }
}
