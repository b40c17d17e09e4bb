//! glTF 2.0 files: JSON with its buffers in files or inside, or one binary file. Positions, texture coordinates and colours
//! of triangles are read, placed by the scene's nodes, and their materials with pictures.
//!
//! Read here and not by a library: the one that is maintained refuses valid files for what is not needed of them, and ends the
//! program at some that are not.

mod accessor;
mod document;
mod file;
mod materials;
mod nodes;
#[cfg(test)]
mod tests;

use std::path::Path;

use glam::{Mat4, Vec2, Vec3};

use self::document::{Node, Primitive};
use self::file::{File, not_read};
use super::raw::{RawMesh, RawTriangle};
use super::{MAX_TRIANGLES, too_large};

/// Kinds of primitives.
const TRIANGLES: u32 = 4;
const TRIANGLE_STRIP: u32 = 5;
const TRIANGLE_FAN: u32 = 6;
/// A compression that libraries alone can take back.
const DRACO: &str = "KHR_draco_mesh_compression";

/// All triangles of the default scene as one surface.
pub(super) fn parsed(path: &Path, bytes: &[u8]) -> Result<RawMesh, String> {
    let file = File::parsed(path, bytes)?;
    let mut reader = Reader {
        file: &file,
        raw: RawMesh::default(),
    };
    for (node, placed) in nodes::placed(&file.document)? {
        reader.node(node, placed)?;
    }
    let mut raw = reader.raw;
    raw.materials.all = materials::read(&file, &raw.materials.used(), &mut raw.left_out);
    Ok(raw)
}

struct Reader<'a> {
    file: &'a File<'a>,
    raw: RawMesh,
}

impl Reader<'_> {
    fn node(&mut self, node: &Node, placed: Mat4) -> Result<(), String> {
        let Some(number) = node.mesh else {
            return Ok(());
        };
        let meshes = &self.file.document.meshes;
        let mesh = meshes
            .get(number)
            .ok_or_else(|| format!("it names mesh {number}, and has {}", meshes.len()))?;
        let bound = "its skeletons are not read: skinned parts stay in the modelled pose";
        if node.skin.is_some() && !self.raw.left_out.iter().any(|what| what == bound) {
            self.raw.left_out.push(bound.to_owned());
        }
        for primitive in &mesh.primitives {
            self.primitive(primitive, placed)?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, placed: Mat4) -> Result<(), String> {
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        if !matches!(mode, TRIANGLES | TRIANGLE_STRIP | TRIANGLE_FAN) {
            return Ok(());
        }
        let accessor = primitive.attributes.get("POSITION");
        let accessor = *accessor.ok_or("a part of it has no positions")?;
        if primitive.extensions.contains_key(DRACO) && !self.file.has_items(accessor) {
            return Err(not_read(DRACO));
        }
        let positions = self.file.vectors(accessor)?.into_iter();
        let positions: Vec<Vec3> = positions
            .map(|position| placed.transform_point3(position.into()))
            .collect();
        let count = positions.len();
        let order = match primitive.indices {
            Some(accessor) => self.file.indices(accessor)?,
            None => (0..count as u32).collect(),
        };
        if let Some(&vertex) = order.iter().find(|&&vertex| vertex as usize >= count) {
            return Err(format!(
                "a triangle names vertex {vertex}; there are {count}"
            ));
        }
        let first = self.raw.positions.len() as u32;
        self.raw.positions.extend(positions);
        let mut triangles = triangles(mode, &order);
        if placed.determinant() < 0.0 {
            triangles
                .iter_mut()
                .for_each(|[_, b, c]| std::mem::swap(b, c));
        }
        self.push(primitive, first, &triangles)
    }

    /// Adds triangles of vertices from `first` on, with the part's attributes of their corners.
    fn push(&mut self, part: &Primitive, first: u32, triangles: &[[u32; 3]]) -> Result<(), String> {
        let count = self.raw.triangles.len() + triangles.len();
        if count > MAX_TRIANGLES {
            return Err(too_large(count));
        }
        let material = part
            .material
            .and_then(|number| self.file.document.materials.get(number));
        let set = material.map_or(0, document::Material::coordinates);
        let texture = match part.attributes.get(&format!("TEXCOORD_{set}")) {
            Some(&accessor) => self.file.pairs(accessor)?,
            None => Vec::new(),
        };
        let colours = match part.attributes.get("COLOR_0") {
            Some(&accessor) => self.file.colours(accessor)?,
            None => Vec::new(),
        };
        // In glTF, v runs downwards.
        let place = |vertex: u32| {
            let &[u, v] = texture.get(vertex as usize)?;
            Some(Vec2::new(u, 1.0 - v))
        };
        let colour = |vertex: u32| {
            let colour = Vec3::from(*colours.get(vertex as usize)?);
            Some(colour.map(|level| level.max(0.0).clamp(0.0, 1.0)))
        };
        for &corners in triangles {
            self.raw.push(RawTriangle {
                corners: corners.map(|vertex| vertex.saturating_add(first)),
                texture: all(corners.map(place)),
                colours: all(corners.map(colour)),
                material: part.material,
            });
        }
        Ok(())
    }
}

/// All three, or none.
fn all<T>(of: [Option<T>; 3]) -> Option<[T; 3]> {
    match of {
        [Some(a), Some(b), Some(c)] => Some([a, b, c]),
        _ => None,
    }
}

fn triangles(mode: u32, order: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        TRIANGLE_STRIP => (0..)
            .zip(order.windows(3))
            .map(|(k, w)| {
                if k % 2 == 0 {
                    [w[0], w[1], w[2]]
                } else {
                    [w[1], w[0], w[2]]
                }
            })
            .collect(),
        TRIANGLE_FAN => order
            .get(1..)
            .unwrap_or_default()
            .windows(2)
            .map(|w| [order[0], w[0], w[1]])
            .collect(),
        _ => order.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}
