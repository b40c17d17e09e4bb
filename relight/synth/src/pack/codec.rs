//! Meshes and panoramas as bytes. What is counted stands in the catalogue, and is held against the bytes before anything is
//! made of it.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::Arc;

use glam::{Affine2, Vec2, Vec3};
use relight_core::image::{ColourSpace, Extent, Linear, Planes, Rgb, Srgb};
use relight_core::light::Panorama;
use serde::{Deserialize, Serialize};

use crate::mesh::{MeshMaterial, MeshMaterials, NO_TEXTURE, PlacedPicture, RawMesh};
use crate::texture::{PictureKind, TextureImage};

/// Largest number of steps along each side of a box.
const STEPS: f64 = 65535.0;
/// Largest number of pixels along a side of a panorama.
const MAX_PANORAMA: usize = 4096;
/// Bytes of a corner's colours and of a triangle's.
const TRIANGLE_COLOURS: usize = 9;
/// The exponent of RGBE is stored with this added, and its mantissa has 8 bits.
const EXPONENT_BIAS: i32 = 136;

/// What stands in the catalogue of a mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct PackedMesh {
    vertices: usize,
    /// Texture coordinates that differ.
    places: usize,
    pub(super) triangles: usize,
    /// The corners of its box.
    low: [f32; 3],
    high: [f32; 3],
    /// Those of the box of its texture coordinates.
    texture_low: [f32; 2],
    texture_high: [f32; 2],
    /// Whether its corners have colours.
    has_colours: bool,
    pub(super) materials: Vec<PackedMaterial>,
    /// In their order: the number of a material, and of how many triangles.
    runs: Vec<(Option<usize>, usize)>,
}

/// A material of a mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct PackedMaterial {
    colour: [f32; 3],
    roughness: f32,
    metallic: f32,
    pub(super) picture: Option<PackedPicture>,
    pub(super) factors: Option<PackedPicture>,
}

/// A picture of a material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct PackedPicture {
    /// Its number among those of the library; while a mesh is prepared, among its own.
    pub(super) number: usize,
    placed: Option<[f32; 6]>,
}

/// What stands in the catalogue of a panorama.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct PackedPanorama {
    width: usize,
    height: usize,
}

/// Moves positions to the nearest of 65536 places along each side of their box.
pub(super) fn snap(positions: &mut [Vec3]) {
    let grid = Grid::from_values(positions.iter().map(Vec3::to_array));
    for position in positions {
        *position = grid.value(grid.number(position.to_array())).into();
    }
}

/// 65536 places along each side of a box.
#[derive(Clone, Copy)]
struct Grid<const N: usize> {
    low: [f32; N],
    high: [f32; N],
}

impl<const N: usize> Grid<N> {
    fn from_values(values: impl Iterator<Item = [f32; N]>) -> Self {
        let mut grid: Option<Self> = None;
        for value in values {
            let (low, high) = grid.map_or((value, value), |grid| (grid.low, grid.high));
            grid = Some(Self {
                low: std::array::from_fn(|k| low[k].min(value[k])),
                high: std::array::from_fn(|k| high[k].max(value[k])),
            });
        }
        grid.unwrap_or(Self {
            low: [0.0; N],
            high: [0.0; N],
        })
    }

    fn number(&self, value: [f32; N]) -> [u16; N] {
        std::array::from_fn(|k| {
            let [low, high, value] = [self.low[k], self.high[k], value[k]].map(f64::from);
            // A box without a width gives NaN, which is 0.
            (((value - low) / (high - low)).clamp(0.0, 1.0) * STEPS).round() as u16
        })
    }

    fn value(&self, number: [u16; N]) -> [f32; N] {
        std::array::from_fn(|k| {
            let [low, high] = [self.low[k], self.high[k]].map(f64::from);
            (low + (high - low) * f64::from(number[k]) / STEPS) as f32
        })
    }
}

/// Pictures of a mesh's materials.
pub(super) type Pictures = Vec<(Arc<TextureImage>, PictureKind)>;

/// Things by number in the order of their first use.
struct Numbered<T> {
    numbers: HashMap<T, u32>,
    all: Vec<T>,
}

impl<T: Copy + Eq + Hash> Numbered<T> {
    fn new() -> Self {
        Self {
            numbers: HashMap::new(),
            all: Vec::new(),
        }
    }

    fn number(&mut self, thing: T) -> u32 {
        *self.numbers.entry(thing).or_insert_with(|| {
            self.all.push(thing);
            self.all.len() as u32 - 1
        })
    }
}

/// A mesh as bytes. Pictures are numbered in their order in the second list, each with what its values are.
///
/// # Errors
/// If a number is not finite.
pub(super) fn encode_mesh(raw: &RawMesh) -> Result<(PackedMesh, Vec<u8>, Pictures), String> {
    let EncodedMaterials {
        materials,
        pictures,
        numbers,
    } = encode_materials(&raw.materials)?;
    let own = |triangle: &usize| {
        let number = raw.materials.of_triangle.get(*triangle);
        number.and_then(|number| numbers.get(number).copied())
    };
    let mut order: Vec<usize> = (0..raw.triangles.len()).collect();
    order.sort_by_key(|triangle| own(triangle).unwrap_or(usize::MAX));
    let grid = Grid::from_values(raw.positions.iter().map(Vec3::to_array));
    let finite = |place: &&Vec2| place.is_finite();
    let places = raw.texture.iter().flatten().filter(finite);
    let texture = Grid::from_values(places.map(Vec2::to_array));

    let (mut vertices, mut coordinates) = (Numbered::new(), Numbered::new());
    let (mut corners, mut placed) = (Vec::new(), Vec::new());
    let mut runs: Vec<(Option<usize>, usize)> = Vec::new();
    for &triangle in &order {
        match runs.last_mut().filter(|(of, _)| *of == own(&triangle)) {
            Some((_, count)) => *count += 1,
            None => runs.push((own(&triangle), 1)),
        }
        corners.extend(raw.triangles[triangle].map(|vertex| vertices.number(vertex)));
        let lies = raw.texture.get(triangle).copied().unwrap_or(NO_TEXTURE);
        // 0 is no place at all.
        placed.extend(lies.map(|place| {
            if place.is_finite() {
                1 + coordinates.number(texture.number(place.to_array()))
            } else {
                0
            }
        }));
    }
    let mut bytes = Vec::new();
    let numbers = vertices.all.iter();
    let positions: Vec<[u16; 3]> = numbers
        .map(|&vertex| grid.number(raw.positions[vertex as usize].to_array()))
        .collect();
    push_columns(&mut bytes, &positions);
    push_columns(&mut bytes, &coordinates.all);
    push_indices(&mut bytes, &corners, 0);
    if !coordinates.all.is_empty() {
        push_indices(&mut bytes, &placed, 1);
    }
    let has_colours = !raw.colours.is_empty();
    if has_colours {
        for triangle in &order {
            let own = raw.colours.get(*triangle).copied();
            let colours = own
                .unwrap_or([Vec3::ONE; 3])
                .map(|colour| colour.to_array());
            let level = |light: &f32| (Srgb::from_linear(*light).clamp(0.0, 1.0) * 255.0).round();
            bytes.extend(
                colours
                    .as_flattened()
                    .iter()
                    .map(|light| level(light) as u8),
            );
        }
    }
    let packed = PackedMesh {
        vertices: vertices.all.len(),
        places: coordinates.all.len(),
        triangles: order.len(),
        low: grid.low,
        high: grid.high,
        texture_low: texture.low,
        texture_high: texture.high,
        has_colours,
        materials,
        runs,
    };
    Ok((packed, bytes, pictures))
}

/// The materials that are used, their pictures, and the numbers of theirs by those of all.
struct EncodedMaterials {
    materials: Vec<PackedMaterial>,
    pictures: Pictures,
    numbers: HashMap<u32, usize>,
}

fn encode_materials(of: &MeshMaterials) -> Result<EncodedMaterials, String> {
    let mut pictures: Pictures = Vec::new();
    let mut packed = Vec::new();
    let mut numbers = HashMap::new();
    for number in of.used() {
        let Some(material) = of.all.get(number) else {
            continue;
        };
        let finite = [material.roughness, material.metallic];
        if !material.colour.is_finite() || !finite.into_iter().all(f32::is_finite) {
            return Err("a material has numbers that are not finite".to_owned());
        }
        let mut picture = |of: &Option<PlacedPicture>, kind: PictureKind| {
            let of = of.as_ref()?;
            let is_it = |one: &(Arc<TextureImage>, PictureKind)| {
                Arc::ptr_eq(&one.0, &of.image) && one.1 == kind
            };
            let number = pictures.iter().position(is_it).unwrap_or_else(|| {
                pictures.push((Arc::clone(&of.image), kind));
                pictures.len() - 1
            });
            let placed = of.placed.map(|placed| placed.to_cols_array());
            Some(PackedPicture { number, placed })
        };
        numbers.insert(number as u32, packed.len());
        packed.push(PackedMaterial {
            colour: material.colour.to_array(),
            roughness: material.roughness,
            metallic: material.metallic,
            picture: picture(&material.picture, PictureKind::Colours),
            factors: picture(&material.factors, PictureKind::Numbers),
        });
    }
    Ok(EncodedMaterials {
        materials: packed,
        pictures,
        numbers,
    })
}

/// Numbers column by column, each as its difference from the previous one, low bytes first.
fn push_columns<const N: usize>(bytes: &mut Vec<u8>, rows: &[[u16; N]]) {
    for column in 0..N {
        let values = || rows.iter().map(move |row| row[column]);
        let before = || std::iter::once(0).chain(values());
        let steps = || {
            values()
                .zip(before())
                .map(|(own, before)| own.wrapping_sub(before))
        };
        bytes.extend(steps().map(|step| step as u8));
        bytes.extend(steps().map(|step| (step >> 8) as u8));
    }
}

/// Each number as its distance below the next one that was never used, which is mostly short.
fn push_indices(bytes: &mut Vec<u8>, indices: &[u32], first: u32) {
    let mut next = first;
    for &index in indices {
        let mut code = next - index;
        if code == 0 {
            next += 1;
        }
        while code >= 0x80 {
            bytes.push(code as u8 | 0x80);
            code >>= 7;
        }
        bytes.push(code as u8);
    }
}

/// Bytes that are not read yet.
struct Rest<'a>(&'a [u8]);

const CUT_OFF: &str = "it is cut off";

impl<'a> Rest<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or(CUT_OFF)?;
        self.0 = rest;
        Ok(taken)
    }

    fn columns<const N: usize>(&mut self, count: usize) -> Result<Vec<[u16; N]>, String> {
        let bytes = count.checked_mul(2 * N).ok_or(CUT_OFF)?;
        let bytes = self.take(bytes)?;
        let mut rows = vec![[0; N]; count];
        for (column, bytes) in bytes.chunks_exact((2 * count).max(1)).enumerate() {
            let (low, high) = bytes.split_at(count);
            let mut value = 0_u16;
            for (row, (&low, &high)) in rows.iter_mut().zip(low.iter().zip(high)) {
                value = value.wrapping_add(u16::from_le_bytes([low, high]));
                row[column] = value;
            }
        }
        Ok(rows)
    }

    fn indices(&mut self, triangles: usize, first: u32) -> Result<Vec<[u32; 3]>, String> {
        // Each has a byte at least, so that what is made is no larger than a few times what is there.
        if triangles
            .checked_mul(3)
            .is_none_or(|count| count > self.0.len())
        {
            return Err(CUT_OFF.to_owned());
        }
        let mut next = first;
        let mut index = || {
            let index = next.checked_sub(self.number()?);
            let index = index.ok_or("a number of a vertex is negative")?;
            if index == next {
                next = next.checked_add(1).ok_or("it has too many vertices")?;
            }
            Ok::<u32, String>(index)
        };
        (0..triangles)
            .map(|_| Ok([index()?, index()?, index()?]))
            .collect()
    }

    fn number(&mut self) -> Result<u32, String> {
        let mut number = 0;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.take(1)?[0];
            number |= u32::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(number);
            }
        }
        Err("a number is too long".to_owned())
    }
}

/// The mesh in bytes. `picture` gives the library's pictures by number.
///
/// # Errors
/// If the bytes are not what the catalogue says.
pub(super) fn decode_mesh(
    packed: &PackedMesh,
    bytes: &[u8],
    picture: impl Fn(usize, PictureKind) -> Result<Arc<TextureImage>, String>,
) -> Result<RawMesh, String> {
    let mut rest = Rest(bytes);
    let numbers = rest.columns::<3>(packed.vertices)?;
    let places = rest.columns::<2>(packed.places)?;
    let triangles = rest.indices(packed.triangles, 0)?;
    let grid = Grid {
        low: packed.low,
        high: packed.high,
    };
    let mut raw = RawMesh {
        positions: numbers.into_iter().map(|n| grid.value(n).into()).collect(),
        triangles,
        ..RawMesh::default()
    };
    if !places.is_empty() {
        let grid = Grid {
            low: packed.texture_low,
            high: packed.texture_high,
        };
        let place = |number: u32| match number.checked_sub(1) {
            None => Ok(Vec2::NAN),
            Some(number) => {
                let place = places.get(number as usize);
                let place = place.ok_or("it names texture coordinates that are missing")?;
                Ok::<Vec2, String>(grid.value(*place).into())
            }
        };
        let placed = rest.indices(packed.triangles, 1)?.into_iter();
        let placed = placed.map(|[a, b, c]| Ok([place(a)?, place(b)?, place(c)?]));
        raw.texture = placed.collect::<Result<_, String>>()?;
    }
    if packed.has_colours {
        let count = packed.triangles.checked_mul(TRIANGLE_COLOURS);
        let bytes = rest.take(count.ok_or(CUT_OFF)?)?;
        let colours = bytes.as_chunks::<3>().0.iter();
        let colours = colours.map(|levels| {
            Vec3::from_array(levels.map(|level| Srgb::to_linear(f32::from(level) / 255.0)))
        });
        let colours: Vec<Vec3> = colours.collect();
        raw.colours = colours.as_chunks::<3>().0.to_vec();
    }
    if !rest.0.is_empty() {
        return Err("it is longer than its catalogue states".to_owned());
    }
    decode_materials(packed, &mut raw, picture)?;
    Ok(raw)
}

fn decode_materials(
    packed: &PackedMesh,
    raw: &mut RawMesh,
    picture: impl Fn(usize, PictureKind) -> Result<Arc<TextureImage>, String>,
) -> Result<(), String> {
    for &(material, count) in &packed.runs {
        if material.is_some_and(|number| number >= packed.materials.len()) {
            return Err("it names a material that is missing".to_owned());
        }
        if count > packed.triangles - raw.materials.of_triangle.len() {
            return Err("its materials have too many triangles".to_owned());
        }
        (0..count).for_each(|_| raw.materials.push(material));
    }
    if raw.materials.of_triangle.len() != packed.triangles {
        return Err("triangles have no material".to_owned());
    }
    let placed = |of: &Option<PackedPicture>, kind: PictureKind| {
        let of = of.as_ref();
        of.map(|of| {
            Ok::<_, String>(PlacedPicture {
                image: picture(of.number, kind)?,
                placed: of.placed.map(|numbers| Affine2::from_cols_array(&numbers)),
            })
        })
        .transpose()
    };
    let material = |of: &PackedMaterial| {
        Ok(MeshMaterial {
            colour: of.colour.into(),
            picture: placed(&of.picture, PictureKind::Colours)?,
            roughness: of.roughness,
            metallic: of.metallic,
            factors: placed(&of.factors, PictureKind::Numbers)?,
        })
    };
    raw.materials.all = packed
        .materials
        .iter()
        .map(material)
        .collect::<Result<_, String>>()?;
    Ok(())
}

/// A panorama as bytes: red, green, blue and exponent, each plane by the differences of neighbours.
pub(super) fn encode_panorama(panorama: &Panorama) -> (PackedPanorama, Vec<u8>) {
    let Extent { width, height } = panorama.extent();
    let planes = panorama.image().planes();
    let mut channels: [Vec<u8>; 4] = std::array::from_fn(|_| Vec::with_capacity(width * height));
    for y in 0..height {
        for x in 0..width {
            for (channel, value) in channels.iter_mut().zip(rgbe(planes.pixel(x, y))) {
                channel.push(value);
            }
        }
    }
    let mut bytes = channels.concat();
    for row in bytes.chunks_exact_mut(width) {
        for x in (1..row.len()).rev() {
            row[x] = row[x].wrapping_sub(row[x - 1]);
        }
    }
    (PackedPanorama { width, height }, bytes)
}

/// The panorama that bytes hold.
///
/// # Errors
/// If the bytes are not what the catalogue says.
pub(super) fn decode_panorama(packed: PackedPanorama, bytes: &[u8]) -> Result<Panorama, String> {
    let PackedPanorama { width, height } = packed;
    if !(8..=MAX_PANORAMA).contains(&width) || width != 2 * height {
        return Err(format!("it has {width} x {height} pixels"));
    }
    let count = width * height;
    if bytes.len() != 4 * count {
        return Err(CUT_OFF.to_owned());
    }
    let mut bytes = bytes.to_vec();
    for row in bytes.chunks_exact_mut(width) {
        for x in 1..row.len() {
            row[x] = row[x].wrapping_add(row[x - 1]);
        }
    }
    let planes = [0, 1, 2].map(|channel| {
        let mantissas = &bytes[channel * count..(channel + 1) * count];
        let exponents = &bytes[3 * count..];
        let values = mantissas.iter().zip(exponents);
        values.map(|(&m, &e)| f32::from(m) * scale_of(e)).collect()
    });
    let planes = Planes::from_planes(Extent::new(width, height), planes);
    let image: Rgb<Linear> = Rgb::new(planes.map_err(|fault| fault.to_string())?);
    Panorama::new(image).map_err(|fault| fault.to_string())
}

/// Three mantissas and the exponent that they share; radiance below 0 is 0.
fn rgbe(pixel: [f32; 3]) -> [u8; 4] {
    let largest = pixel.into_iter().fold(0.0, f32::max);
    // The largest has a mantissa of 128 to 255.
    let exponent = (largest.log2().floor() as i32).saturating_add(1 + EXPONENT_BIAS - 8);
    if largest <= 0.0 || exponent < 1 {
        return [0; 4];
    }
    let exponent = exponent.min(255) as u8;
    let [red, green, blue] = pixel.map(|value| {
        let mantissa = (value / scale_of(exponent)).round();
        mantissa.clamp(0.0, 255.0) as u8
    });
    [red, green, blue, exponent]
}

fn scale_of(exponent: u8) -> f32 {
    2.0_f32.powi(i32::from(exponent) - EXPONENT_BIAS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn bright_and_dark_radiance_keeps_its_ratio() {
        let extent = Extent::new(16, 8);
        let planes = Planes::from_fn(extent, |x, y| {
            let level = 10.0_f32.powi(x as i32 - 6);
            [level, 0.5 * level, y as f32 * 0.1 * level]
        });
        let panorama = Panorama::new(Rgb::new(planes)).unwrap();
        let (packed, bytes) = encode_panorama(&panorama);
        let again = decode_panorama(packed, &bytes).unwrap();
        for y in 0..8 {
            for x in 0..16 {
                let [own, read] = [&panorama, &again].map(|p| p.image().planes().pixel(x, y));
                let step = own[0] / 128.0;
                let apart = [0, 1, 2].map(|k| (own[k] - read[k]).abs());
                assert!(
                    apart.into_iter().all(|apart| apart <= step),
                    "{own:?} {read:?}"
                );
            }
        }
        assert_eq!(rgbe([0.0, -1.0, 0.0]), [0; 4]);
        assert_eq!(rgbe([f32::MAX, 0.0, 0.0])[3], 255);
    }

    proptest! {
        #[test]
        fn columns_and_indices_are_read_as_they_were_written(
            rows in prop::collection::vec(prop::array::uniform3(any::<u16>()), 0..40),
            indices in prop::collection::vec(0_usize..30, 0..60),
        ) {
            let mut numbers = Numbered::new();
            let mut indices: Vec<u32> = indices.into_iter().map(|k| numbers.number(k)).collect();
            indices.truncate(indices.len() / 3 * 3);
            let mut bytes = Vec::new();
            push_columns(&mut bytes, &rows);
            push_indices(&mut bytes, &indices, 0);
            let mut rest = Rest(&bytes);
            prop_assert_eq!(rest.columns::<3>(rows.len()).unwrap(), rows);
            let triangles = rest.indices(indices.len() / 3, 0).unwrap();
            prop_assert_eq!(triangles.as_flattened(), indices);
            prop_assert!(rest.0.is_empty());
        }

        #[test]
        fn no_bytes_end_the_program(
            bytes in prop::collection::vec(any::<u8>(), 0..300),
            (vertices, places, triangles) in (0_usize..40, 0_usize..20, 0_usize..40),
            count in 0_usize..50,
            has_colours in any::<bool>(),
        ) {
            let packed = PackedMesh {
                vertices,
                places,
                triangles,
                low: [0.0; 3],
                high: [1.0; 3],
                texture_low: [0.0; 2],
                texture_high: [1.0; 2],
                has_colours,
                materials: Vec::new(),
                runs: vec![(None, count)],
            };
            let none = |_, _| Err("none".to_owned());
            let _ = decode_mesh(&packed, &bytes, none);
            let huge = PackedMesh { vertices: usize::MAX, triangles: usize::MAX, ..packed };
            prop_assert!(decode_mesh(&huge, &bytes, none).is_err());
            let size = PackedPanorama { width: 2 * count, height: count };
            let _ = decode_panorama(size, &bytes);
        }
    }
}
