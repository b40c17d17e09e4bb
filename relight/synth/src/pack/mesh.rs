//! A mesh as bytes: CBOR, with the names of its pictures.

use std::collections::BTreeMap;
use std::mem;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use relit_data::shard::Digest;
use serde::{Deserialize, Serialize};

use crate::mesh::{MeshMaterial, MeshMaterials, RawMesh};
use crate::texture::{PictureKind, TextureImage};

/// Longest side of the pictures.
pub(super) const MAX_PICTURE_SIDE: usize = 256;
/// Steps along each side of a box.
const STEPS: f64 = 65535.0;

/// A mesh, whose materials have pictures by their names.
#[derive(Serialize, Deserialize)]
pub(super) struct PackedMesh {
    positions: Vec<Vec3>,
    /// The vertices of all triangles, each as its difference from the one before, which is mostly small.
    corners: Vec<i32>,
    texture: Vec<[Vec2; 3]>,
    colours: Vec<[Vec3; 3]>,
    materials: Vec<MeshMaterial<String>>,
    of_triangle: Vec<u32>,
}

/// Pictures as JPEG, by names that are made of their bytes.
pub(super) type Pictures = BTreeMap<String, Vec<u8>>;

/// A mesh as bytes, with the pictures of its materials.
///
/// # Errors
/// If a picture cannot be encoded.
pub(super) fn encode(mut raw: RawMesh) -> Result<(Vec<u8>, Pictures), String> {
    sort_by_material(&mut raw);
    if !raw
        .texture
        .as_flattened()
        .iter()
        .any(|place| place.is_finite())
    {
        raw.texture.clear();
    }
    snap(&mut raw.positions);
    snap(raw.texture.as_flattened_mut());
    let mut pictures = Pictures::new();
    let mut named = |image: &Arc<TextureImage>, kind| {
        let bytes = image.packed(kind, MAX_PICTURE_SIDE);
        let bytes = bytes.map_err(|fault| format!("a picture of it: {fault}"))?;
        let name = Digest::hash(&bytes).to_string();
        pictures.insert(name.clone(), bytes);
        Ok(name)
    };
    let materials = raw.materials.all.iter();
    let materials = materials.map(|material| material.with_pictures(&mut named));
    let materials = materials.collect::<Result<_, String>>()?;
    let mut before = 0;
    let corners = raw.triangles.as_flattened().iter();
    let packed = PackedMesh {
        positions: raw.positions,
        corners: corners
            .map(|&vertex| vertex.wrapping_sub(mem::replace(&mut before, vertex)) as i32)
            .collect(),
        texture: raw.texture,
        colours: raw.colours,
        materials,
        of_triangle: raw.materials.of_triangle,
    };
    let mut bytes = Vec::new();
    ciborium::into_writer(&packed, &mut bytes).map_err(|fault| fault.to_string())?;
    Ok((bytes, pictures))
}

impl PackedMesh {
    /// The mesh in bytes.
    ///
    /// # Errors
    /// If they hold none.
    pub(super) fn decode(bytes: &[u8]) -> Result<Self, String> {
        ciborium::from_reader(bytes).map_err(|fault| fault.to_string())
    }

    /// The names of its pictures, and what their values are.
    pub(super) fn pictures(&self) -> impl Iterator<Item = (String, PictureKind)> {
        self.materials.iter().flat_map(|material| {
            let (colours, numbers) = (&material.picture, &material.factors);
            let kinds = [
                (colours, PictureKind::Colours),
                (numbers, PictureKind::Numbers),
            ];
            kinds
                .into_iter()
                .filter_map(|(picture, kind)| Some((picture.as_ref()?.image.clone(), kind)))
        })
    }

    /// The mesh with its pictures.
    ///
    /// # Errors
    /// If one is missing.
    pub(super) fn unpacked(
        self,
        pictures: &BTreeMap<(String, PictureKind), Arc<TextureImage>>,
    ) -> Result<RawMesh, String> {
        let mut vertex = 0_u32;
        let corners = self.corners.iter().map(|&step| {
            vertex = vertex.wrapping_add_signed(step);
            vertex
        });
        let corners: Vec<u32> = corners.collect();
        let picture = |name: &String, kind| {
            let found = pictures.get(&(name.clone(), kind)).cloned();
            found.ok_or_else(|| format!("picture {name} is missing"))
        };
        let materials = self.materials.iter();
        let all = materials.map(|material| material.with_pictures(picture));
        Ok(RawMesh {
            positions: self.positions,
            triangles: corners.as_chunks::<3>().0.to_vec(),
            texture: self.texture,
            colours: self.colours,
            materials: MeshMaterials {
                all: all.collect::<Result<_, _>>()?,
                of_triangle: self.of_triangle,
            },
            left_out: Vec::new(),
        })
    }
}

/// Puts the triangles of each material together, and drops materials that none has.
fn sort_by_material(raw: &mut RawMesh) {
    let RawMesh { materials, .. } = raw;
    let mut used: Vec<usize> = materials.used().into_iter().collect();
    used.retain(|&number| number < materials.all.len());
    for number in &mut materials.of_triangle {
        let place = used.binary_search(&(*number as usize));
        *number = place.map_or(u32::MAX, |place| place as u32);
    }
    materials.all = used
        .iter()
        .map(|&number| materials.all[number].clone())
        .collect();
    if !raw.colours.is_empty() {
        raw.colours.resize(raw.triangles.len(), [Vec3::ONE; 3]);
    }
    let mut order: Vec<usize> = (0..raw.triangles.len()).collect();
    order.sort_by_key(|&triangle| materials.of_triangle.get(triangle));
    materials.of_triangle = ordered(&materials.of_triangle, &order);
    raw.triangles = ordered(&raw.triangles, &order);
    raw.texture = ordered(&raw.texture, &order);
    raw.colours = ordered(&raw.colours, &order);
}

fn ordered<T: Copy>(items: &[T], order: &[usize]) -> Vec<T> {
    let items = order.iter().map(|&place| items.get(place).copied());
    items.flatten().collect()
}

/// Moves places to the nearest of 65536 along each side of their box. What is not finite stays.
pub(super) fn snap<const N: usize, P: AsMut<[f32; N]>>(places: &mut [P]) {
    for axis in 0..N {
        let values = places.iter_mut().map(|place| &mut place.as_mut()[axis]);
        let values: Vec<&mut f32> = values.filter(|value| value.is_finite()).collect();
        let low = values
            .iter()
            .fold(f64::INFINITY, |low, value| low.min(f64::from(**value)));
        let high = values.iter().fold(f64::NEG_INFINITY, |high, value| {
            high.max(f64::from(**value))
        });
        for value in values {
            // A box without a width gives NaN, which is 0.
            let part = ((f64::from(*value) - low) / (high - low)).max(0.0);
            *value = (low + (high - low) * (part * STEPS).round() / STEPS) as f32;
        }
    }
}
