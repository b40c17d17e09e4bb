//! One object of a library: repaired, judged by its catalogue and its shape, and made small.

use std::collections::HashSet;
use std::fmt;

use glam::{Vec2, Vec3};
use relit_data::shard::Digest;

use super::candidates::Candidate;
use super::mesh::{Pictures, encode, snap};
use crate::mesh::RawMesh;

/// Most triangles of an object: more are details that small pictures do not show.
const MAX_TRIANGLES: usize = 30_000;
/// Thinner than this part of its size, an object is flat.
const FLAT: f32 = 0.02;
/// A picture with a larger see-through part is cut out, as those of leaves,
const CUT_OUT: f32 = 0.1;
/// and an object is left out where such pictures cover more of its surface than this.
const MAX_CUT_OUT: f32 = 0.05;
/// Directions in which an object's thickness is measured: the normals of its largest triangles.
const DIRECTIONS: usize = 48;

/// Words at the end of a title of objects that belong to a building.
const OF_ROOMS: [&str; 10] = [
    "wall", "walls", "window", "windows", "door", "doors", "floor", "ceiling", "roof", "plane",
];

/// Why an object or a panorama is not part of a library.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Reason {
    /// What all for the same reason have in common.
    pub(super) kind: &'static str,
    /// A sentence; of what is there twice the name of the one that stays, of what cannot be read why.
    pub(super) detail: String,
}

pub(super) const REPEATED: &str = "the same as another one";
pub(super) const EXCLUDED: &str = "excluded by origin.toml";
pub(super) const UNREADABLE: &str = "cannot be read";

impl Reason {
    pub(super) fn new(kind: &'static str, detail: impl Into<String>) -> Self {
        let detail = detail.into();
        Self { kind, detail }
    }

    pub(super) fn unreadable(why: impl Into<String>) -> Self {
        Self::new(UNREADABLE, why)
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kind {
            REPEATED => write!(f, "it is the same as {}", self.detail),
            UNREADABLE => write!(f, "it cannot be read: {}", self.detail),
            _ => f.write_str(&self.detail),
        }
    }
}

/// An object that is part of a library.
pub(super) struct PreparedObject {
    pub(super) triangles: usize,
    pub(super) mesh: Vec<u8>,
    pub(super) pictures: Pictures,
    /// Of its shape.
    pub(super) digest: Digest,
    /// What its file names and is not used.
    pub(super) missing: Vec<String>,
}

impl PreparedObject {
    /// Reads an object and makes it ready.
    ///
    /// # Errors
    /// Why it is left out.
    pub(super) fn read(candidate: &Candidate) -> Result<Self, Reason> {
        if let Some(why) = &candidate.leave_out {
            return Err(Reason::new(EXCLUDED, why));
        }
        if is_part_of_room(candidate) {
            let why = "it is a wall, a window or a door";
            return Err(Reason::new("walls, windows and doors", why));
        }
        let bytes = std::fs::read(&candidate.path);
        let bytes = bytes.map_err(|fault| Reason::unreadable(fault.to_string()))?;
        let raw = RawMesh::parsed(&candidate.path, &bytes);
        let mut raw = raw.map_err(Reason::unreadable)?;
        for position in &mut raw.positions {
            *position = candidate.rotation * *position;
        }
        let raw = repaired(raw).map_err(Reason::unreadable)?;
        Self::judged(raw)
    }

    fn judged(mut raw: RawMesh) -> Result<Self, Reason> {
        if raw.triangles.len() > MAX_TRIANGLES {
            let count = raw.triangles.len();
            let why = format!("it has {count} triangles, more than {MAX_TRIANGLES}");
            return Err(Reason::new("too many triangles", why));
        }
        if is_flat(&raw) {
            return Err(Reason::new("flat", "it is flat"));
        }
        if is_cut_out(&raw) {
            let why = "its pictures are cut out, which is not drawn";
            return Err(Reason::new("pictures that are cut out, as of leaves", why));
        }
        raw.orient().map_err(Reason::unreadable)?;
        let missing = std::mem::take(&mut raw.left_out);
        let positions = raw.positions.iter().flat_map(Vec3::to_array);
        let shape: Vec<u8> = positions.flat_map(f32::to_le_bytes).collect();
        let triangles = raw.triangles.len();
        let (mesh, pictures) = encode(raw).map_err(Reason::unreadable)?;
        Ok(Self {
            triangles,
            mesh,
            pictures,
            digest: Digest::hash(&shape),
            missing,
        })
    }
}

fn is_part_of_room(candidate: &Candidate) -> bool {
    let category = candidate.entry.category.to_lowercase();
    let title = candidate.entry.title.to_lowercase();
    let last = title.split_whitespace().next_back().unwrap_or_default();
    candidate.is_door_or_window
        || category.contains("door")
        || category.contains("window")
        || OF_ROOMS.contains(&last)
}

/// The mesh with vertices joined, without triangles of no area and duplicates.
fn repaired(mut raw: RawMesh) -> Result<RawMesh, String> {
    let is_finite = |place: &Vec3| place.is_finite();
    if raw.positions.iter().all(is_finite) {
        snap(&mut raw.positions);
    }
    let mut raw = raw.welded()?;
    let mut seen = HashSet::new();
    let marks: Vec<bool> = raw
        .triangles
        .iter()
        .map(|&corners| {
            let [a, b, c] = corners.map(|vertex| raw.positions[vertex as usize]);
            let mut sorted = corners;
            sorted.sort_unstable();
            (b - a).cross(c - a) != Vec3::ZERO && seen.insert(sorted)
        })
        .collect();
    raw.keep(&marks);
    // Texture coordinates that are numbers of another kind than places: none.
    for corners in &mut raw.texture {
        if !corners.iter().all(|place| place.is_finite()) {
            *corners = [Vec2::NAN; 3];
        }
    }
    raw.welded()
}

fn normal(raw: &RawMesh, triangle: &[u32; 3]) -> Vec3 {
    let [a, b, c] = triangle.map(|vertex| raw.positions[vertex as usize]);
    (b - a).cross(c - a)
}

/// Whether an object is a plane, or nearly: thin along the normal of one of its largest triangles.
fn is_flat(raw: &RawMesh) -> bool {
    let mut normals: Vec<Vec3> = raw.triangles.iter().map(|t| normal(raw, t)).collect();
    normals.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
    normals.truncate(DIRECTIONS);
    normals.extend(Vec3::AXES);
    let extent = |along: Vec3| {
        let heights = raw.positions.iter().map(|place| place.dot(along));
        let (low, high) = heights.fold((f32::MAX, f32::MIN), |(low, high), height| {
            (low.min(height), high.max(height))
        });
        high - low
    };
    let largest = Vec3::AXES.map(extent).into_iter().fold(0.0, f32::max);
    let directions = normals.iter().filter_map(|normal| normal.try_normalize());
    directions
        .map(extent)
        .any(|thickness| thickness < FLAT * largest)
}

/// Whether much of the surface is covered by see-through pictures.
fn is_cut_out(raw: &RawMesh) -> bool {
    let is_cut_out = |number: &u32| {
        let material = raw.materials.all.get(*number as usize);
        let picture = material.and_then(|material| material.picture.as_ref());
        picture.is_some_and(|picture| picture.image.transparent_fraction() > CUT_OUT)
    };
    let (mut all, mut cut_out) = (0.0, 0.0);
    for (triangle, number) in raw.triangles.iter().zip(&raw.materials.of_triangle) {
        let area = normal(raw, triangle).length();
        all += area;
        if is_cut_out(number) {
            cut_out += area;
        }
    }
    cut_out > MAX_CUT_OUT * all
}
