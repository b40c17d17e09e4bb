//! Wavefront files and their materials, as programs write them.
//!
//! Read here and not by a library: none of those that are maintained reads concave polygons, text that is not UTF-8, lines that
//! go on and colours of vertices alike, and says the line in which a file is damaged.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{Vec2, Vec3};
use relight_core::image::{ColourSpace, Srgb};

use super::material::{MeshMaterial, PlacedPicture};
use super::mtl::{self, MtlMaterial, MtlPicture};
use super::polygon::Triangulator;
use super::raw::{RawMesh, RawTriangle};
use super::sidecar_files::by_name;
use super::text::{decoded, keyword, readings, statements, without_comment};
use crate::texture::{PictureKind, TextureImage};

/// Names that programs give to a missing material.
const NO_MATERIAL: [&str; 3] = ["", "none", "(null)"];

/// All parts of the file as one surface, with the materials of the `.mtl` files that it names.
pub(super) fn parsed(path: &Path, bytes: &[u8]) -> Result<RawMesh, String> {
    let file = ObjFile::parsed(&decoded(bytes))?;
    let mut left_out = Vec::new();
    if file.has_free_form {
        left_out.push("its free-form surfaces are not read, only its polygons".to_owned());
    }
    let materials = Materials::read(path, &file, &mut left_out)?;
    let mut raw = file.triangles(&materials)?;
    raw.materials.all = materials.all;
    raw.left_out = left_out;
    Ok(raw)
}

/// What stands in a file.
#[derive(Default)]
struct ObjFile {
    positions: Vec<Vec3>,
    /// For each position up to the last that has one.
    colours: Vec<Vec3>,
    texture: Vec<Vec2>,
    corners: Vec<Corner>,
    faces: Vec<Face>,
    /// Names of materials in their order, and the number of each.
    materials: Vec<String>,
    numbers: HashMap<String, u32>,
    /// What is named as files of materials.
    libraries: Vec<String>,
    has_free_form: bool,
}

/// A corner of a face.
#[derive(Clone, Copy)]
struct Corner {
    position: u32,
    texture: Option<u32>,
}

struct Face {
    /// In the file, from 1.
    line: usize,
    /// Number of its first corner.
    first: usize,
    /// By number of its name.
    material: Option<u32>,
}

impl ObjFile {
    fn parsed(text: &str) -> Result<Self, String> {
        let mut file = Self::default();
        let mut material = None;
        for (line, statement) in statements(text) {
            let (key, rest) = keyword(&statement);
            let read = match key {
                "v" => file.position(rest),
                "vt" => file.coordinates(rest),
                "f" | "fo" => file.face(line, material, rest),
                "usemtl" => {
                    material = file.material(rest);
                    Ok(())
                }
                "mtllib" => {
                    file.libraries.push(rest.to_owned());
                    Ok(())
                }
                "surf" | "bsp" | "bzp" | "cdp" => {
                    file.has_free_form = true;
                    Ok(())
                }
                _ => Ok(()),
            };
            read.map_err(|what| format!("line {line}: {what}"))?;
        }
        file.make_colours_linear();
        Ok(file)
    }

    /// Colours of vertices are sRGB, from 0 to 1, or in some programs to 255.
    fn make_colours_linear(&mut self) {
        let largest = self.colours.iter().map(|colour| colour.max_element());
        let scale = if largest.fold(0.0, f32::max) > 1.0 {
            1.0 / 255.0
        } else {
            1.0
        };
        for colour in &mut self.colours {
            *colour = colour.map(|level| Srgb::to_linear((scale * level).max(0.0).clamp(0.0, 1.0)));
        }
    }

    /// Three coordinates, and a colour behind them.
    fn position(&mut self, text: &str) -> Result<(), String> {
        let numbers = numbers(text)?;
        let Some(&[x, y, z]) = numbers.first_chunk() else {
            let count = numbers.len();
            return Err(format!("a vertex has {count} coordinates instead of 3"));
        };
        // One number more is a weight, which only curves use; one behind a colour is its opacity.
        if let [_, _, _, red, green, blue] | [_, _, _, red, green, blue, _] = *numbers {
            self.colours.resize(self.positions.len(), Vec3::ONE);
            self.colours.push(Vec3::new(red, green, blue));
        }
        self.positions.push(Vec3::new(x, y, z));
        Ok(())
    }

    fn coordinates(&mut self, text: &str) -> Result<(), String> {
        let numbers = numbers(text)?;
        let u = *numbers.first().ok_or("texture coordinates are missing")?;
        let v = numbers.get(1).copied().unwrap_or(0.0);
        self.texture.push(Vec2::new(u, v));
        Ok(())
    }

    fn face(&mut self, line: usize, material: Option<u32>, text: &str) -> Result<(), String> {
        let first = self.corners.len();
        for word in without_comment(text).split_whitespace() {
            let mut parts = word.split('/');
            let position = parts.next().unwrap_or_default();
            let texture = parts.next().filter(|part| !part.is_empty());
            self.corners.push(Corner {
                position: index(position, self.positions.len())?,
                texture: match texture {
                    Some(part) => Some(index(part, self.texture.len())?),
                    None => None,
                },
            });
        }
        if self.corners.len() == first {
            return Err("a face has no corners".to_owned());
        }
        self.faces.push(Face {
            line,
            first,
            material,
        });
        Ok(())
    }

    fn material(&mut self, name: &str) -> Option<u32> {
        if NO_MATERIAL.contains(&name.to_ascii_lowercase().as_str()) {
            return None;
        }
        if let Some(&number) = self.numbers.get(name) {
            return Some(number);
        }
        let number = u32::try_from(self.materials.len()).ok()?;
        self.materials.push(name.to_owned());
        self.numbers.insert(name.to_owned(), number);
        Some(number)
    }

    /// The faces as triangles.
    fn triangles(&self, materials: &Materials) -> Result<RawMesh, String> {
        let mut raw = RawMesh {
            positions: self.positions.clone(),
            ..RawMesh::default()
        };
        let mut triangulator = Triangulator::new();
        let ends = self.faces.iter().skip(1).map(|face| face.first);
        let ends = ends.chain([self.corners.len()]);
        for (face, end) in self.faces.iter().zip(ends) {
            let corners = &self.corners[face.first..end];
            let told = |what| format!("line {}: {what}", face.line);
            let places = self.places(corners).map_err(told)?;
            let material = face.material.map(|number| number as usize);
            for triangle in triangulator.triangles(&places) {
                let corners = triangle.map(|at| corners[at]);
                let colours =
                    (!self.colours.is_empty()).then(|| corners.map(|one| self.colour(one)));
                raw.push(RawTriangle {
                    corners: corners.map(|one| one.position),
                    texture: self.texture_of(corners),
                    colours: colours.filter(|_| !materials.has_picture(material)),
                    material: material.and_then(|number| materials.of(number, colours.is_some())),
                });
            }
        }
        Ok(raw)
    }

    /// Where the corners of a face lie.
    fn places(&self, corners: &[Corner]) -> Result<Vec<Vec3>, String> {
        let place = |corner: &Corner| {
            let (number, count) = (corner.position as usize, self.positions.len());
            let texture = corner.texture.map_or(0, |number| number as usize + 1);
            // Some programs number coordinates that they do not write.
            if !self.texture.is_empty() && texture > self.texture.len() {
                let count = self.texture.len();
                return Err(format!(
                    "a face names texture coordinates {texture}; there are {count}"
                ));
            }
            let found = self.positions.get(number).copied();
            found.ok_or_else(|| format!("a face names vertex {}; there are {count}", number + 1))
        };
        corners.iter().map(place).collect()
    }

    fn colour(&self, corner: Corner) -> Vec3 {
        let colour = self.colours.get(corner.position as usize);
        colour.copied().unwrap_or(Vec3::ONE)
    }

    fn texture_of(&self, corners: [Corner; 3]) -> Option<[Vec2; 3]> {
        let at = |corner: Corner| self.texture.get(corner.texture? as usize).copied();
        match corners.map(at) {
            [Some(a), Some(b), Some(c)] => Some([a, b, c]),
            _ => None,
        }
    }
}

fn numbers(text: &str) -> Result<Vec<f32>, String> {
    let words = without_comment(text).split_whitespace();
    let number = |word: &str| {
        word.parse()
            .map_err(|_| format!("{word:?} is not a number"))
    };
    words.map(number).collect()
}

/// The place, from 0, of what a face names: from 1, or backwards from the last of `count`.
fn index(text: &str, count: usize) -> Result<u32, String> {
    let number: i64 = text
        .parse()
        .map_err(|_| format!("{text:?} is not the number of a corner"))?;
    let place = match number {
        1.. => Some(number - 1),
        0 => None,
        _ => i64::try_from(count)
            .ok()
            .map(|count| count.saturating_add(number)),
    };
    let place = place.and_then(|place| u32::try_from(place).ok());
    place.ok_or_else(|| format!("a face names corner {number}; there are {count}"))
}

/// The materials that faces name, by the number of the name.
struct Materials {
    /// Those of the names, then the same without a colour, for faces whose vertices have colours.
    all: Vec<MeshMaterial>,
    /// Whether a file has a material of the name.
    is_known: Vec<bool>,
}

impl Materials {
    fn read(path: &Path, file: &ObjFile, left_out: &mut Vec<String>) -> Result<Self, String> {
        let mut used: Vec<bool> = vec![false; file.materials.len()];
        for face in &file.faces {
            if let Some(number) = face.material {
                used[number as usize] = true;
            }
        }
        let (known, missing) = libraries(path, file)?;
        let known: Vec<Option<&MtlMaterial>> = file
            .materials
            .iter()
            .map(|name| readings(name).find_map(|name| known.get(name)))
            .collect();
        let names = file.materials.iter().zip(&known).zip(&used);
        let unknown = names.filter(|((_, known), used)| known.is_none() && **used);
        let unknown: Vec<String> = unknown.map(|((name, _), _)| format!("{name:?}")).collect();
        // Without a file that is named, the names are the program's own: nothing is lost.
        if !unknown.is_empty() && !file.libraries.is_empty() {
            left_out.extend(
                missing
                    .iter()
                    .map(|name| format!("its materials {name:?} are missing")),
            );
            if missing.is_empty() {
                let names = unknown.join(", ");
                left_out.push(format!("none of its .mtl files has the material {names}"));
            }
        }
        let mut pictures = Pictures::new(path);
        let mut all = Vec::with_capacity(2 * known.len());
        for (known, used) in known.iter().zip(&used) {
            all.push(match known.filter(|_| *used) {
                Some(material) => pictures.material(material, left_out),
                None => MeshMaterial::default(),
            });
        }
        let plain = all.iter().cloned().map(|one| MeshMaterial {
            colour: Vec3::ONE,
            ..one
        });
        let plain: Vec<MeshMaterial> = plain.collect();
        all.extend(plain);
        Ok(Self {
            all,
            is_known: known.iter().map(Option::is_some).collect(),
        })
    }

    /// The place of a name's material among all, where a file has it.
    fn of(&self, number: usize, is_coloured: bool) -> Option<usize> {
        let is_known = self.is_known.get(number).copied().unwrap_or_default();
        let of = if is_coloured && !self.has_picture(Some(number)) {
            number + self.is_known.len()
        } else {
            number
        };
        is_known.then_some(of)
    }

    fn has_picture(&self, number: Option<usize>) -> bool {
        let material = number.and_then(|number| self.all.get(number));
        material.is_some_and(|material| material.picture.is_some())
    }
}

/// The materials of all files that a mesh names, by their names, and the files that are not there. Of materials with one name
/// the first file's counts.
fn libraries(
    path: &Path,
    file: &ObjFile,
) -> Result<(BTreeMap<String, MtlMaterial>, Vec<String>), String> {
    let (mut known, mut missing) = (BTreeMap::new(), Vec::new());
    for named in &file.libraries {
        for library in split(path, named) {
            let found = match library {
                Ok(found) => found,
                Err(name) => {
                    if !missing.contains(&name) {
                        missing.push(name);
                    }
                    continue;
                }
            };
            let bytes = std::fs::read(&found).map_err(|fault| {
                format!("its materials {} cannot be read: {fault}", found.display())
            })?;
            let materials = mtl::materials(&decoded(&bytes));
            let mut own: BTreeMap<String, MtlMaterial> = BTreeMap::new();
            own.extend(materials.into_iter().map(|one| (one.name.clone(), one)));
            for (name, material) in own {
                known.entry(name).or_insert(material);
            }
        }
    }
    Ok((known, missing))
}

/// The files that a statement names: one, whose name may hold spaces, or several. In place of a file that is not there, its
/// name.
fn split(mesh: &Path, named: &str) -> Vec<Result<PathBuf, String>> {
    let found = |name: &str| by_name(mesh, name.trim_matches('"'));
    if let Some(whole) = readings(named).find_map(found) {
        return vec![Ok(whole)];
    }
    let words = without_comment(named).split_whitespace();
    let all: Vec<Result<PathBuf, String>> = words
        .map(|name| found(name).ok_or_else(|| name.to_owned()))
        .collect();
    if all.len() > 1 && all.iter().all(Result::is_err) {
        return vec![Err(named.to_owned())];
    }
    all
}

/// The pictures of a file's materials, each read once.
struct Pictures<'a> {
    path: &'a Path,
    /// By name; `None` for those that cannot be used.
    read: HashMap<String, Option<Arc<TextureImage>>>,
}

impl<'a> Pictures<'a> {
    fn new(path: &'a Path) -> Self {
        Self {
            path,
            read: HashMap::new(),
        }
    }

    fn material(&mut self, of: &MtlMaterial, left_out: &mut Vec<String>) -> MeshMaterial {
        let named = of.picture.as_ref();
        let picture = named.and_then(|named| self.picture(named, left_out));
        // Beside a picture, programs write a colour that they do not multiply by.
        let colour = of.colour.filter(|_| picture.is_none());
        MeshMaterial {
            colour: colour.unwrap_or(Vec3::ONE),
            picture,
            roughness: of.roughness(),
            ..MeshMaterial::default()
        }
    }

    fn picture(&mut self, named: &MtlPicture, left_out: &mut Vec<String>) -> Option<PlacedPicture> {
        let name = &named.name;
        if !self.read.contains_key(name) {
            let read = picture(self.path, name);
            let read = read.map_err(|why| left_out.push(format!("its picture {name:?} {why}")));
            self.read.insert(name.clone(), read.ok().map(Arc::new));
        }
        let image = self.read.get(name)?.as_ref()?;
        Some(PlacedPicture {
            image: Arc::clone(image),
            placed: named.placed,
        })
    }
}

fn picture(path: &Path, name: &str) -> Result<TextureImage, String> {
    let file = readings(name).find_map(|name| by_name(path, name));
    let file = file.ok_or_else(|| "is missing".to_owned())?;
    let bytes = std::fs::read(file).map_err(|fault| format!("cannot be read: {fault}"))?;
    TextureImage::decoded(&bytes, PictureKind::Colours)
        .map_err(|fault| format!("cannot be used: {fault}"))
}

#[cfg(test)]
mod tests;
