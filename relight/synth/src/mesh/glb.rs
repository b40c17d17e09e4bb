//! glTF 2.0 files: JSON with its buffers beside it or inside, or one binary file. Positions and texture
//! coordinates of triangles are read, placed as the scene's nodes say, and their materials with pictures.

use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{Mat4, Vec2, Vec3};
use gltf::accessor::{DataType, Dimensions};
use gltf::json::Index;
use gltf::json::validation::Checked::Valid;
use gltf::mesh::Mode;
use gltf::{Accessor, Document, Gltf, Node, Primitive, Semantic};

use super::beside::file_beside;
use super::material::MeshMaterial;
use super::raw::{NO_TEXTURE, RawMesh};
use crate::SynthError;
use crate::texture::TextureImage;

/// Deepest nesting of nodes that is followed.
const DEEPEST: usize = 64;
/// Bytes of the header of a binary file.
const GLB_HEADER: u32 = 12;
/// Most nodes that are visited; more are a circle.
const MOST_NODES: usize = 100_000;

/// All triangles of the default scene as one surface.
pub(super) fn read(path: &Path) -> Result<RawMesh, SynthError> {
    let bytes = std::fs::read(path).map_err(SynthError::read(path))?;
    let damaged = |reason: String| SynthError::Mesh {
        path: path.to_owned(),
        reason,
    };
    let file = parsed(&bytes).map_err(damaged)?;
    let buffers = buffers(path, &file)?;
    let mut reader = Reader {
        buffers: &buffers,
        raw: RawMesh::default(),
        visited: 0,
    };
    let scene = file.default_scene().or_else(|| file.scenes().next());
    for node in scene.iter().flat_map(gltf::Scene::nodes) {
        reader.node(&node, Mat4::IDENTITY, 0).map_err(damaged)?;
    }
    let mut raw = reader.raw;
    raw.materials.all = materials(path, &file, &buffers, &raw.materials.used())?;
    Ok(raw)
}

/// The file, validated.
fn parsed(bytes: &[u8]) -> Result<Gltf, String> {
    let told = |fault: gltf::Error| fault.to_string();
    // `gltf` takes the header off the length that a binary file says it has, whatever that is.
    if let [b'g', b'l', b'T', b'F', _, _, _, _, length @ ..] = bytes
        && let Some(length) = length
            .first_chunk()
            .map(|&length| u32::from_le_bytes(length))
        && length < GLB_HEADER
    {
        return Err(format!("it says that it is {length} bytes long"));
    }
    let Gltf { document, blob } = Gltf::from_slice_without_validation(bytes).map_err(told)?;
    let root = document.into_json();
    // `gltf` ends the program where it validates positions that are not there.
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let positions = primitives.filter_map(|one| one.attributes.get(&Valid(Semantic::Positions)));
    let count = root.accessors.len();
    if let Some(missing) = positions.map(Index::value).find(|&number| number >= count) {
        return Err(format!("its positions are accessor {missing} of {count}"));
    }
    let document = Document::from_json(root).map_err(told)?;
    Ok(Gltf { document, blob })
}

/// The materials that are used, and plain ones in place of the others, so that numbers stay as they are.
fn materials(
    path: &Path,
    file: &Gltf,
    buffers: &[Cow<'_, [u8]>],
    used: &BTreeSet<usize>,
) -> Result<Vec<MeshMaterial>, SynthError> {
    let mut pictures = Pictures {
        path,
        file,
        buffers,
        read: HashMap::new(),
    };
    let numbered = file.materials().enumerate();
    numbered
        .map(|(number, one)| {
            if used.contains(&number) {
                pictures.material(&one)
            } else {
                Ok(MeshMaterial::default())
            }
        })
        .collect()
}

/// The bytes of each buffer.
fn buffers<'a>(path: &Path, file: &'a Gltf) -> Result<Vec<Cow<'a, [u8]>>, SynthError> {
    let damaged = |reason: String| SynthError::Mesh {
        path: path.to_owned(),
        reason,
    };
    let one = |buffer: gltf::Buffer<'a>| {
        let bytes = match buffer.source() {
            gltf::buffer::Source::Bin => {
                let blob = file.blob.as_deref();
                Cow::Borrowed(blob.ok_or_else(|| damaged("it has no binary part".to_owned()))?)
            }
            gltf::buffer::Source::Uri(uri) => Cow::Owned(linked(path, uri)?),
        };
        if bytes.len() < buffer.length() {
            let (number, length) = (buffer.index(), buffer.length());
            let found = bytes.len();
            return Err(damaged(format!(
                "buffer {number} has {found} bytes of {length}"
            )));
        }
        Ok(bytes)
    };
    file.buffers().map(one).collect()
}

/// What an address stands for: data within it, or a file in the folder of the mesh.
fn linked(path: &Path, uri: &str) -> Result<Vec<u8>, SynthError> {
    let damaged = |reason: String| SynthError::Mesh {
        path: path.to_owned(),
        reason,
    };
    if let Some(data) = uri.strip_prefix("data:") {
        let (_, text) = data
            .split_once(";base64,")
            .ok_or_else(|| damaged("data within it is not in base64".to_owned()))?;
        return STANDARD
            .decode(text)
            .map_err(|fault| damaged(format!("data within it is damaged: {fault}")));
    }
    let beside = file_beside(path, uri).ok_or_else(|| {
        damaged(format!(
            "its file {uri:?} does not lie in the folder of the mesh"
        ))
    })?;
    std::fs::read(&beside).map_err(SynthError::read(&beside))
}

/// The pictures of a file's materials, each read once.
struct Pictures<'a> {
    path: &'a Path,
    file: &'a Gltf,
    buffers: &'a [Cow<'a, [u8]>],
    /// By the picture's number and what its values are.
    read: HashMap<(usize, PictureKind), Arc<TextureImage>>,
}

/// What the values of a picture are.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum PictureKind {
    Colours,
    Numbers,
}

impl Pictures<'_> {
    fn material(&mut self, of: &gltf::Material<'_>) -> Result<MeshMaterial, SynthError> {
        if let Some(surface) = of.pbr_specular_glossiness() {
            let colour = surface.diffuse_factor();
            return Ok(MeshMaterial {
                colour: Vec3::from_slice(&colour),
                picture: self.picture(surface.diffuse_texture(), PictureKind::Colours)?,
                roughness: 1.0 - surface.glossiness_factor(),
                ..MeshMaterial::default()
            });
        }
        let surface = of.pbr_metallic_roughness();
        let plain = MeshMaterial {
            colour: Vec3::from_slice(&surface.base_color_factor()),
            picture: self.picture(surface.base_color_texture(), PictureKind::Colours)?,
            ..MeshMaterial::default()
        };
        // Its colours are those of a photograph, as scans have them.
        if of.unlit() {
            return Ok(plain);
        }
        let factors = surface.metallic_roughness_texture();
        Ok(MeshMaterial {
            roughness: surface.roughness_factor(),
            metallic: surface.metallic_factor(),
            factors: self.picture(factors, PictureKind::Numbers)?,
            ..plain
        })
    }

    fn picture(
        &mut self,
        texture: Option<gltf::texture::Info<'_>>,
        kind: PictureKind,
    ) -> Result<Option<Arc<TextureImage>>, SynthError> {
        let Some(texture) = texture else {
            return Ok(None);
        };
        let number = texture.texture().source().index();
        let unusable = |why: String| SynthError::Mesh {
            path: self.path.to_owned(),
            reason: format!("its picture {number}, counted from 0, {why}"),
        };
        if texture.tex_coord() != 0 {
            let why = "lies on other texture coordinates than the first, and only those are read";
            return Err(unusable(why.to_owned()));
        }
        if let Some(picture) = self.read.get(&(number, kind)) {
            return Ok(Some(Arc::clone(picture)));
        }
        let bytes = self.bytes(number, &unusable)?;
        let picture = match kind {
            PictureKind::Colours => TextureImage::of_colours(&bytes),
            PictureKind::Numbers => TextureImage::of_numbers(&bytes),
        };
        let picture = picture.map_err(|fault| unusable(format!("cannot be used: {fault}")))?;
        let picture = Arc::new(picture);
        self.read.insert((number, kind), Arc::clone(&picture));
        Ok(Some(picture))
    }

    /// The bytes of a picture's file. Looked up in the JSON: `gltf` ends the program at a picture without a type or a place.
    fn bytes(
        &self,
        number: usize,
        unusable: &dyn Fn(String) -> SynthError,
    ) -> Result<Cow<'_, [u8]>, SynthError> {
        let image = self.file.as_json().images.get(number);
        let image = image.ok_or_else(|| unusable("is not there".to_owned()))?;
        if let Some(view) = &image.buffer_view {
            let view = self.file.views().nth(view.value());
            let bytes = view.and_then(|view| {
                let buffer = self.buffers.get(view.buffer().index())?;
                buffer.get(view.offset()..view.offset().checked_add(view.length())?)
            });
            let bytes = bytes.ok_or_else(|| unusable("reaches beyond its buffer".to_owned()))?;
            return Ok(Cow::Borrowed(bytes));
        }
        match &image.uri {
            Some(uri) => Ok(Cow::Owned(linked(self.path, uri)?)),
            None => Err(unusable("has neither bytes nor a file".to_owned())),
        }
    }
}

struct Reader<'a> {
    buffers: &'a [Cow<'a, [u8]>],
    raw: RawMesh,
    visited: usize,
}

impl Reader<'_> {
    fn node(&mut self, node: &Node<'_>, parent: Mat4, depth: usize) -> Result<(), String> {
        self.visited += 1;
        if depth > DEEPEST || self.visited > MOST_NODES {
            return Err("its nodes go in a circle, or there are too many".to_owned());
        }
        let placed = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
        if let Some(mesh) = node.mesh() {
            for primitive in mesh.primitives() {
                self.primitive(&primitive, placed)?;
            }
        }
        node.children()
            .try_for_each(|child| self.node(&child, placed, depth + 1))
    }

    fn primitive(&mut self, primitive: &Primitive<'_>, placed: Mat4) -> Result<(), String> {
        if !matches!(
            primitive.mode(),
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
        ) {
            return Ok(());
        }
        let positions = primitive
            .get(&Semantic::Positions)
            .ok_or("a part of it has no positions")?;
        let positions = self.floats::<3>(&positions, Dimensions::Vec3)?;
        let count = positions.len();
        let order = match primitive.indices() {
            Some(accessor) => self.indices(&accessor)?,
            None => (0..count as u32).collect(),
        };
        let triangles = triangles(primitive.mode(), &order);
        if let Some(&vertex) = order.iter().find(|&&vertex| vertex as usize >= count) {
            return Err(format!("a triangle names vertex {vertex} of {count}"));
        }
        let first = self.raw.positions.len() as u32;
        let moved = positions
            .iter()
            .map(|&p| placed.transform_point3(Vec3::from(p)));
        self.raw.positions.extend(moved);
        self.texture(primitive, &triangles)?;
        let shifted = |corners: [u32; 3]| corners.map(|vertex| vertex.saturating_add(first));
        self.raw
            .triangles
            .extend(triangles.into_iter().map(shifted));
        Ok(())
    }

    /// Adds the material of these triangles and their texture coordinates, where the part has them.
    fn texture(&mut self, part: &Primitive<'_>, triangles: &[[u32; 3]]) -> Result<(), String> {
        let pairs = match part.get(&Semantic::TexCoords(0)) {
            Some(accessor) => self.pairs(&accessor)?,
            None => Vec::new(),
        };
        // In glTF, v runs downwards.
        let at = |vertex: u32| {
            let &[u, v] = pairs.get(vertex as usize)?;
            Some(Vec2::new(u, 1.0 - v))
        };
        let material = part.material().index();
        for corners in triangles {
            let found = match corners.map(at) {
                [Some(a), Some(b), Some(c)] => [a, b, c],
                _ => NO_TEXTURE,
            };
            self.raw.texture.push(found);
            self.raw.materials.push(material);
        }
        Ok(())
    }

    /// Texture coordinates: numbers, or parts of 255 or 65535.
    fn pairs(&self, accessor: &Accessor<'_>) -> Result<Vec<[f32; 2]>, String> {
        let bytes = match accessor.data_type() {
            DataType::U8 => 1,
            DataType::U16 => 2,
            _ => return self.floats::<2>(accessor, Dimensions::Vec2),
        };
        if accessor.dimensions() != Dimensions::Vec2 {
            let number = accessor.index();
            return Err(format!("accessor {number} holds numbers of another kind"));
        }
        let value = |item: &[u8]| match *item {
            [byte] => f32::from(byte) / 255.0,
            [low, high] => f32::from(u16::from_le_bytes([low, high])) / 65535.0,
            _ => f32::NAN,
        };
        let items = self.items(accessor, 2 * bytes)?;
        Ok(items
            .map(|item| [value(&item[..bytes]), value(&item[bytes..])])
            .collect())
    }

    fn floats<const N: usize>(
        &self,
        accessor: &Accessor<'_>,
        dimensions: Dimensions,
    ) -> Result<Vec<[f32; N]>, String> {
        if (accessor.data_type(), accessor.dimensions()) != (DataType::F32, dimensions) {
            let number = accessor.index();
            return Err(format!("accessor {number} holds numbers of another kind"));
        }
        let items = self.items(accessor, 4 * N)?;
        Ok(items
            .map(|item| {
                std::array::from_fn(|k| {
                    f32::from_le_bytes([
                        item[4 * k],
                        item[4 * k + 1],
                        item[4 * k + 2],
                        item[4 * k + 3],
                    ])
                })
            })
            .collect())
    }

    fn indices(&self, accessor: &Accessor<'_>) -> Result<Vec<u32>, String> {
        let bytes = match (accessor.data_type(), accessor.dimensions()) {
            (DataType::U8, Dimensions::Scalar) => 1,
            (DataType::U16, Dimensions::Scalar) => 2,
            (DataType::U32, Dimensions::Scalar) => 4,
            _ => {
                let number = accessor.index();
                return Err(format!("accessor {number} holds no indices"));
            }
        };
        let items = self.items(accessor, bytes)?;
        let value = |item: &[u8]| {
            item.iter()
                .rev()
                .fold(0, |sum, &byte| (sum << 8) | u32::from(byte))
        };
        Ok(items.map(value).collect())
    }

    /// The items of an accessor, each of `size` bytes; all of them lie within their buffer.
    fn items<'b>(
        &'b self,
        accessor: &Accessor<'_>,
        size: usize,
    ) -> Result<impl Iterator<Item = &'b [u8]> + use<'b>, String> {
        let number = accessor.index();
        if accessor.sparse().is_some() {
            return Err(format!("accessor {number} is sparse, which is not read"));
        }
        let beyond = || format!("accessor {number} reaches beyond its buffer");
        let view = accessor.view().ok_or_else(beyond)?;
        let stride = view.stride().unwrap_or(size).max(size);
        let count = accessor.count();
        // The last item need not be followed by its padding.
        let length = stride.checked_mul(count.saturating_sub(1));
        let length = length.and_then(|length| length.checked_add(size.min(size * count)));
        let bytes = length.and_then(|length| {
            let buffer = self.buffers.get(view.buffer().index())?;
            let end = view.offset().checked_add(view.length())?;
            let within = buffer.get(view.offset()..end)?;
            let start = accessor.offset();
            within.get(start..start.checked_add(length)?)
        });
        let bytes = bytes.ok_or_else(beyond)?;
        Ok(bytes
            .chunks(stride)
            .filter_map(move |item| item.get(..size)))
    }
}

fn triangles(mode: Mode, order: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => (0..)
            .zip(order.windows(3))
            .map(|(k, w)| {
                if k % 2 == 0 {
                    [w[0], w[1], w[2]]
                } else {
                    [w[1], w[0], w[2]]
                }
            })
            .collect(),
        Mode::TriangleFan => order
            .get(1..)
            .unwrap_or_default()
            .windows(2)
            .map(|w| [order[0], w[0], w[1]])
            .collect(),
        _ => order.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;
    use serde_json::{Value, json};

    /// A square of two triangles in the plane z = 0, in a node that stretches it by 2 along x.
    fn square() -> (Value, Vec<u8>) {
        let positions = [
            [0.0_f32, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        let mut bytes: Vec<u8> = positions
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        bytes.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|v| v.to_le_bytes()));
        let document = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "scale": [2.0, 1.0, 1.0]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "buffers": [{"byteLength": bytes.len()}],
            "bufferViews": [
                {"buffer": 0, "byteOffset": 0, "byteLength": 48},
                {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
                 "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 0.0]},
                {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}],
        });
        (document, bytes)
    }

    fn read(document: &Value, binary: &[u8]) -> Result<Mesh, SynthError> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.bin"), binary).unwrap();
        let path = folder.path().join("a.gltf");
        std::fs::write(&path, document.to_string()).unwrap();
        Mesh::read(&path)
    }

    #[test]
    fn a_buffer_may_lie_in_a_file_in_the_text_or_in_the_binary_part() {
        let (mut document, bytes) = square();
        let mut shapes = Vec::new();
        document["buffers"][0]["uri"] = json!("a.bin");
        shapes.push(read(&document, &bytes).unwrap());
        let data = format!(
            "data:application/octet-stream;base64,{}",
            STANDARD.encode(&bytes)
        );
        document["buffers"][0]["uri"] = json!(data);
        shapes.push(read(&document, &[]).unwrap());
        let (document, bytes) = square();
        let glb = gltf::binary::Glb {
            header: gltf::binary::Header {
                magic: *b"glTF",
                version: 2,
                length: 0,
            },
            json: document.to_string().into_bytes().into(),
            bin: Some(bytes.into()),
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.GLB");
        std::fs::write(&path, glb.to_vec().unwrap()).unwrap();
        shapes.push(Mesh::read(&path).unwrap());
        for shape in shapes {
            assert_eq!((shape.triangles().len(), shape.positions().len()), (2, 4));
            let widest = shape.positions().iter().map(|p| p.x).fold(0.0, f32::max);
            let highest = shape.positions().iter().map(|p| p.y).fold(0.0, f32::max);
            assert!((widest - 2.0 * highest).abs() < 1e-6);
        }
    }

    #[test]
    fn what_points_outside_its_buffer_or_folder_is_an_error() {
        let changes: [(&str, Value); 9] = [
            ("/accessors/0/count", json!(5)),
            ("/accessors/1/byteOffset", json!(2)),
            ("/accessors/0/componentType", json!(5123)),
            ("/accessors/0/type", json!("VEC2")),
            ("/bufferViews/1/byteOffset", json!(u32::MAX)),
            ("/buffers/0/byteLength", json!(61)),
            ("/buffers/0/uri", json!("../a.bin")),
            ("/buffers/0/uri", json!("data:text/plain,abc")),
            ("/meshes/0/primitives/0/attributes/POSITION", json!(7)),
        ];
        for (place, value) in changes {
            let (mut document, bytes) = square();
            document["buffers"][0]["uri"] = json!("a.bin");
            document["accessors"][1]["byteOffset"] = json!(0);
            *document.pointer_mut(place).unwrap() = value;
            let error = read(&document, &bytes).unwrap_err().to_string();
            assert!(error.contains("a.gltf"), "{place}: {error}");
        }
    }

    #[test]
    fn materials_are_read_with_their_pictures_and_roughness() {
        let picture = image::RgbImage::from_fn(1, 2, |_, y| image::Rgb([255, 255 * y as u8, 0]));
        let mut png = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
        let png = png.into_inner();
        let (mut document, mut bytes) = square();
        // Texture coordinates at the lower edge and at the upper one, v running downwards.
        let coordinates = [[0.5_f32, 0.75], [0.5, 0.75], [0.5, 0.25], [0.5, 0.25]];
        bytes.extend(coordinates.iter().flatten().flat_map(|v| v.to_le_bytes()));
        bytes.extend(&png);
        document["buffers"][0] = json!({"byteLength": bytes.len(), "uri": "a.bin"});
        let views = document["bufferViews"].as_array_mut().unwrap();
        views.push(json!({"buffer": 0, "byteOffset": 60, "byteLength": 32}));
        views.push(json!({"buffer": 0, "byteOffset": 92, "byteLength": png.len()}));
        let accessors = document["accessors"].as_array_mut().unwrap();
        accessors.push(json!({"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2"}));
        document["images"] = json!([{"bufferView": 3, "mimeType": "image/png"}]);
        document["textures"] = json!([{"source": 0}]);
        document["materials"] = json!([{"pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0}, "baseColorFactor": [0.5, 1.0, 1.0, 1.0],
            "metallicFactor": 0.0, "roughnessFactor": 0.4}}]);
        document["meshes"][0]["primitives"][0]["material"] = json!(0);
        document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(2);
        let mesh = read(&document, &bytes).unwrap();
        let look = |corner: usize| {
            let weights = std::array::from_fn(|at| f32::from(u8::from(at == corner)));
            mesh.own_surface(0, weights).unwrap()
        };
        assert_eq!(look(0).colour, Vec3::new(0.5, 1.0, 0.0));
        assert_eq!(look(2).colour, Vec3::new(0.5, 0.0, 0.0));
        assert_eq!((look(0).roughness, look(0).metallic), (0.4, 0.0));
        for (place, value, told) in [
            ("/bufferViews/3/byteLength", json!(20), "cannot be used"),
            (
                "/bufferViews/3/byteLength",
                json!(9000),
                "beyond its buffer",
            ),
            ("/images/0", json!({"uri": "../a.png"}), "in the folder"),
            ("/images/0", json!({}), "neither"),
            (
                "/materials/0/pbrMetallicRoughness/baseColorTexture/texCoord",
                json!(1),
                "the first",
            ),
        ] {
            let mut document = document.clone();
            let (parent, key) = place.rsplit_once('/').unwrap();
            match document.pointer_mut(parent).unwrap() {
                Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
                object => object[key] = value,
            }
            let error = read(&document, &bytes).unwrap_err().to_string();
            assert!(error.contains(told), "{place}: {error}");
        }
    }

    #[test]
    fn nodes_that_go_in_a_circle_are_an_error() {
        let (mut document, bytes) = square();
        document["buffers"][0]["uri"] = json!("a.bin");
        document["nodes"][0]["children"] = json!([0, 0]);
        let error = read(&document, &bytes).unwrap_err().to_string();
        assert!(error.contains("circle"), "{error}");
    }

    #[test]
    fn strips_and_fans_are_read_as_triangles() {
        let strip = triangles(Mode::TriangleStrip, &[0, 1, 2, 3]);
        assert_eq!(strip, [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(
            triangles(Mode::TriangleFan, &[0, 1, 2, 3]),
            [[0, 1, 2], [0, 2, 3]]
        );
        assert!(triangles(Mode::TriangleFan, &[]).is_empty());
    }

    #[test]
    fn an_index_beyond_the_vertices_is_an_error() {
        let (mut document, mut bytes) = square();
        document["buffers"][0]["uri"] = json!("a.bin");
        bytes[48] = 9;
        let error = read(&document, &bytes).unwrap_err().to_string();
        assert!(error.contains("vertex 9 of 4"), "{error}");
    }
}
