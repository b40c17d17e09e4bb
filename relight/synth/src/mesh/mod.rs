//! Triangle meshes with a normal for each corner. Knows nothing of cameras or light; `obj` and
//! `gltf` read files, `material` is their surface, and `mtl` reads it for `obj`.

mod gltf;
mod material;
mod mtl;
mod obj;
mod polygon;
mod raw;
mod sidecar_files;
mod text;

use std::collections::HashMap;
use std::path::Path;

use glam::{Vec2, Vec3};

use super::SynthError;
pub(crate) use material::{MeshMaterial, MeshMaterials, SurfaceSample};
pub(crate) use raw::RawMesh;

/// Most triangles that a mesh may have.
const MAX_TRIANGLES: usize = 20_000_000;

/// Faces that meet at a larger angle than this, radians, have an edge between them: 50 degrees.
pub(super) const CREASE: f32 = 50.0 * std::f32::consts::PI / 180.0;

/// A surface of triangles, with a normal for each corner.
#[derive(Debug, Clone)]
pub struct Mesh {
    /// The vertices; the farthest is at distance 1 from the origin.
    pub positions: Vec<Vec3>,
    /// By their vertices.
    pub(super) triangles: Vec<[u32; 3]>,
    /// One for each corner of each triangle, unit length.
    pub(super) normals: Vec<[Vec3; 3]>,
    /// As in [`RawMesh::texture`].
    texture: Vec<[Vec2; 3]>,
    /// Whether all of them have some.
    is_textured: bool,
    /// As in [`RawMesh::colours`].
    colours: Vec<[Vec3; 3]>,
    materials: Option<MeshMaterials>,
    /// Parts of the mesh's file that are not used, such as missing pictures: each in words.
    pub left_out: Vec<String>,
}

/// The fault of a file in an unknown format.
pub(super) const NOT_READ: &str =
    "is not a mesh of a kind that can be read: give .obj, .gltf or .glb";
/// The fault of triangles without an area.
const EMPTY: &str = "it has no triangle with an area";

impl Mesh {
    /// Reads a mesh: Wavefront (`.obj`) or glTF 2.0 (`.gltf`, `.glb`). All its parts become one
    /// surface; its own normals are not used, those of faces within 50 degrees are blended. Materials with pictures or of several
    /// colours are read, from the files that it names, and colours of vertices; one colour for all is not used as
    /// the object's. What of that cannot be used is left out: see [`Self::left_out`].
    ///
    /// # Errors
    /// [`SynthError::Unusable`] if the file is damaged, holds no surface or is of another kind, [`SynthError::Io`] if it
    /// cannot be read.
    pub fn read(path: &Path) -> Result<Self, SynthError> {
        let bytes = std::fs::read(path).map_err(SynthError::read(path))?;
        let raw = RawMesh::parsed(path, &bytes);
        raw.and_then(|raw| Self::new(raw, CREASE))
            .map_err(SynthError::mesh(path))
    }

    /// A mesh of these triangles, moved and scaled into the unit sphere; normals are blended
    /// between faces that meet at less than `crease` radians. Triangles without an area are left
    /// out, vertices at one place are joined.
    pub(super) fn new(raw: RawMesh, crease: f32) -> Result<Self, String> {
        let mut raw = raw.welded()?;
        into_unit_sphere(&mut raw.positions);
        drop_flat(&mut raw);
        if raw.triangles.is_empty() {
            return Err(EMPTY.to_owned());
        }
        let normals = corner_normals(&raw.positions, &raw.triangles, crease);
        let has_own_surface = raw.has_own_surface();
        Ok(Self {
            positions: raw.positions,
            triangles: raw.triangles,
            normals,
            is_textured: !raw.texture.is_empty()
                && raw.texture.iter().flatten().all(|place| place.is_finite()),
            texture: raw.texture,
            colours: raw.colours,
            materials: has_own_surface.then_some(raw.materials),
            left_out: raw.left_out,
        })
    }

    /// Whether the mesh's file has materials.
    pub fn has_own_surface(&self) -> bool {
        self.materials.is_some()
    }

    /// The look of a triangle at weights of its corners, if the mesh's file has one.
    pub(super) fn own_surface(&self, triangle: usize, weights: [f32; 3]) -> Option<SurfaceSample> {
        let materials = self.materials.as_ref()?;
        let corners = self.texture.get(triangle);
        let place = corners.map(|&corners| blended(corners, weights));
        let place = place.filter(|place| place.is_finite());
        let paint = match self.colours.get(triangle) {
            Some(&[a, b, c]) => a * weights[0] + b * weights[1] + c * weights[2],
            None => Vec3::ONE,
        };
        Some(materials.at(triangle, place, paint))
    }

    /// Texture coordinates for each corner of each triangle, where all of them have some.
    pub(super) fn texture(&self) -> Option<&[[Vec2; 3]]> {
        self.is_textured.then_some(&self.texture)
    }
}

/// Texture coordinates at weights of a triangle's corners.
pub(super) fn blended([a, b, c]: [Vec2; 3], weights: [f32; 3]) -> Vec2 {
    a * weights[0] + b * weights[1] + c * weights[2]
}

fn check(raw: &RawMesh) -> Result<(), String> {
    let (count, triangles) = (raw.positions.len(), raw.triangles.len());
    if triangles > MAX_TRIANGLES {
        return Err(too_large(triangles));
    }
    for (triangle, corners) in raw.triangles.iter().enumerate() {
        for &vertex in corners {
            match raw.positions.get(vertex as usize) {
                Some(position) if position.is_finite() => {}
                Some(_) => {
                    return Err(format!(
                        "vertex {vertex} has a coordinate that is not finite"
                    ));
                }
                None => {
                    return Err(format!(
                        "triangle {triangle} names vertex {vertex}; there are {count}"
                    ));
                }
            }
        }
    }
    if raw.triangles.is_empty() {
        return Err(EMPTY.to_owned());
    }
    Ok(())
}

fn too_large(triangles: usize) -> String {
    format!("it has {triangles} triangles, more than {MAX_TRIANGLES}")
}

impl RawMesh {
    /// The content of a file's bytes, by its extension.
    ///
    /// # Errors
    /// The fault, in words.
    pub(crate) fn parsed(path: &Path, bytes: &[u8]) -> Result<Self, String> {
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        match extension.to_str() {
            Some("obj") => obj::parsed(path, bytes),
            Some("gltf" | "glb") => gltf::parsed(path, bytes),
            _ => Err(NOT_READ.to_owned()),
        }
    }

    /// The mesh with vertices at one place joined, so that faces know their neighbours, and without those that no
    /// triangle uses.
    ///
    /// # Errors
    /// If it has no triangles, or their vertices are not there.
    pub(crate) fn welded(self) -> Result<Self, String> {
        check(&self)?;
        let mut places: HashMap<[u32; 3], u32> = HashMap::with_capacity(self.positions.len());
        let mut positions = Vec::with_capacity(self.positions.len());
        let mut joined = |vertex: u32| {
            // Adding 0 makes -0 and 0 one place.
            let position = self.positions[vertex as usize] + Vec3::ZERO;
            let key = position.to_array().map(f32::to_bits);
            *places.entry(key).or_insert_with(|| {
                positions.push(position);
                positions.len() as u32 - 1
            })
        };
        let triangles = self
            .triangles
            .iter()
            .map(|corners| corners.map(&mut joined))
            .collect();
        Ok(Self {
            positions,
            triangles,
            ..self
        })
    }

    /// Keeps the triangles that are marked.
    pub(crate) fn keep(&mut self, marks: &[bool]) {
        keep(&mut self.triangles, marks);
        keep(&mut self.texture, marks);
        keep(&mut self.colours, marks);
        keep(&mut self.materials.of_triangle, marks);
    }
}

/// Moves the middle of the bounding box to the origin and the farthest vertex to distance 1.
fn into_unit_sphere(positions: &mut [Vec3]) {
    let low = positions.iter().copied().reduce(Vec3::min);
    let high = positions.iter().copied().reduce(Vec3::max);
    let middle = low.zip(high).map_or(Vec3::ZERO, |(l, h)| l * 0.5 + h * 0.5);
    let largest = positions
        .iter()
        .map(|&p| (p - middle).abs().max_element())
        .fold(0.0, f32::max);
    if largest == 0.0 {
        return;
    }
    // In two steps: squares of huge or tiny coordinates are not numbers.
    let mut farthest = 0.0_f32;
    for position in positions.iter_mut() {
        *position = (*position - middle) / largest;
        farthest = farthest.max(position.length());
    }
    for position in positions {
        *position /= farthest;
    }
}

fn drop_flat(raw: &mut RawMesh) {
    let has_area: Vec<bool> = raw
        .triangles
        .iter()
        .map(|corners| {
            let [a, b, c] = corners.map(|v| raw.positions[v as usize]);
            (b - a).cross(c - a).length_squared() > 1e-20
        })
        .collect();
    raw.keep(&has_area);
}

/// Keeps the items that are marked, and those beyond the marks.
fn keep<T>(items: &mut Vec<T>, marks: &[bool]) {
    let mut marks = marks.iter();
    items.retain(|_| marks.next().copied().unwrap_or(true));
}

/// For each corner, the mean normal of the faces around its vertex, each weighted by its angle there,
/// of those that meet the corner's own face at less than `crease` radians.
fn corner_normals(positions: &[Vec3], triangles: &[[u32; 3]], crease: f32) -> Vec<[Vec3; 3]> {
    let faces: Vec<Face> = triangles
        .iter()
        .map(|corners| Face::new(corners.map(|v| positions[v as usize])))
        .collect();
    let around = CornersAround::new(positions.len(), triangles);
    let least_cosine = crease.cos();
    triangles
        .iter()
        .zip(&faces)
        .map(|(corners, own)| {
            corners.map(|vertex| {
                let near = around
                    .vertex(vertex)
                    .map(|(face, corner)| (&faces[face], corner));
                let blended: Vec3 = near
                    .filter(|(other, _)| own.normal.dot(other.normal) > least_cosine)
                    .map(|(other, corner)| other.normal * other.angles[corner])
                    .sum();
                blended.try_normalize().unwrap_or(own.normal)
            })
        })
        .collect()
}

struct Face {
    normal: Vec3,
    /// At each corner, radians.
    angles: [f32; 3],
}

impl Face {
    fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners;
        let angles = [0, 1, 2].map(|k| {
            let [here, next, last] = [k, (k + 1) % 3, (k + 2) % 3].map(|i| corners[i]);
            (next - here).angle_between(last - here)
        });
        Self {
            normal: (b - a).cross(c - a).normalize_or_zero(),
            angles,
        }
    }
}

/// The corners of faces that meet at each vertex.
struct CornersAround {
    starts: Vec<u32>,
    /// Three times the face, plus the corner.
    corners: Vec<u32>,
}

impl CornersAround {
    fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let mut starts = vec![0_u32; vertices + 1];
        for vertex in triangles.iter().flatten() {
            starts[*vertex as usize + 1] += 1;
        }
        for vertex in 0..vertices {
            starts[vertex + 1] += starts[vertex];
        }
        let mut next = starts.clone();
        let mut corners = vec![0; triangles.len() * 3];
        for (corner, vertex) in (0_u32..).zip(triangles.iter().flatten()) {
            let place = &mut next[*vertex as usize];
            corners[*place as usize] = corner;
            *place += 1;
        }
        Self { starts, corners }
    }

    /// Face and corner.
    fn vertex(&self, vertex: u32) -> impl Iterator<Item = (usize, usize)> {
        let [start, end] = [vertex, vertex + 1].map(|v| self.starts[v as usize] as usize);
        let corners = self.corners[start..end].iter();
        corners.map(|&corner| (corner as usize / 3, corner as usize % 3))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of two triangles a side, each with its own vertices.
    fn cube() -> RawMesh {
        let mut raw = RawMesh::default();
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let corner = |u: f32, v: f32| {
                    let mut p = [0.0; 3];
                    p[axis] = sign;
                    p[(axis + 1) % 3] = u * sign;
                    p[(axis + 2) % 3] = v;
                    Vec3::from_array(p) * 3.0 + Vec3::new(5.0, 0.0, -2.0)
                };
                let first = raw.positions.len() as u32;
                let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
                raw.positions.extend(corners.map(|(u, v)| corner(u, v)));
                raw.triangles.push([first, first + 1, first + 2]);
                raw.triangles.push([first, first + 2, first + 3]);
            }
        }
        raw
    }

    #[test]
    fn a_mesh_is_moved_into_the_unit_sphere_and_its_vertices_joined() {
        let mesh = Mesh::new(cube(), CREASE).unwrap();
        assert_eq!(mesh.positions.len(), 8);
        for position in mesh.positions {
            assert!((position.length() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn edges_stay_sharp_below_the_crease_angle_and_are_blended_above_it() {
        let sharp = Mesh::new(cube(), CREASE).unwrap();
        for normal in sharp.normals.iter().flatten() {
            assert!((normal.abs().max_element() - 1.0).abs() < 1e-6, "{normal}");
        }
        let smooth = Mesh::new(cube(), 2.0).unwrap();
        for (normals, corners) in smooth.normals.iter().zip(&smooth.triangles) {
            for (normal, &vertex) in normals.iter().zip(corners) {
                assert!(normal.dot(smooth.positions[vertex as usize]) > 0.9);
            }
        }
    }

    #[test]
    fn numbers_that_are_no_mesh_are_refused_and_named() {
        let mut raw = cube();
        raw.positions[3].y = f32::NAN;
        let fault = Mesh::new(raw, CREASE).unwrap_err();
        assert!(fault.contains("vertex 3 "), "{fault}");
        let mut raw = cube();
        raw.triangles[2][1] = 99;
        let fault = Mesh::new(raw, CREASE).unwrap_err();
        for named in ["triangle 2", "99", "24"] {
            assert!(fault.contains(named), "{named}: {fault}");
        }
        let mut raw = cube();
        for position in &mut raw.positions {
            position.x = 0.0;
            position.y = 1.0;
        }
        assert_eq!(Mesh::new(raw, CREASE).unwrap_err(), EMPTY);
        let empty = Mesh::new(RawMesh::default(), CREASE);
        assert_eq!(empty.unwrap_err(), EMPTY);
    }

    #[test]
    fn huge_and_tiny_meshes_are_scaled_without_losing_them() {
        for scale in [1e30, 1e-30] {
            let mut raw = cube();
            for position in &mut raw.positions {
                *position *= scale;
            }
            let mesh = Mesh::new(raw, CREASE).unwrap();
            assert_eq!(mesh.triangles.len(), 12);
        }
    }
}
