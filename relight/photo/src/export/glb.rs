//! The mesh with its material as one binary glTF 2.0 file.
//!
//! | of the object | in the file |
//! | --- | --- |
//! | albedo, alpha | `baseColorTexture`, cut out at one half |
//! | normals | `normalTexture`. Every vertex has the normal +z and the tangent +x: so the texture holds the normals as they were captured, also on a relief |
//! | smoothness α | roughness (2 / (α + 2))^(1/4), in the green channel of `metallicRoughnessTexture` |
//! | specular reflectance s_p | `KHR_materials_specular`: a surface that faces the viewer reflects 8 s_p / (α + 2) of even light |

use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use relight_core::captured_object::CapturedObject;
use relight_core::image::{Depth, Extent, ImageError, Planes, Rgb, Srgb, encode_png};
use relight_core::render::Gloss;
use serde_json::{Value, json};

use super::mesh::{ObjectMesh, bled};
use super::not_encoded;

/// "glTF", the version, and the kinds of the two chunks.
const MAGIC: u32 = 0x4654_6c67;
const VERSION: u32 = 2;
const JSON: u32 = 0x4e4f_534a;
const BINARY: u32 = 0x004e_4942;
/// Component types and targets of glTF.
const FLOAT: u32 = 5126;
const UNSIGNED: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;
/// The reflectance of a dielectric that `KHR_materials_specular` scales.
const DIELECTRIC: f32 = 0.04;
/// Pixels by which colours go on beyond the outline.
const BLEED: usize = 4;

/// The content of a GLB file: the object on this mesh. The longer side of the picture is a metre long.
///
/// # Errors
/// If a map cannot be encoded, or the file would be too large.
pub fn to_glb(object: &CapturedObject, mesh: &ObjectMesh) -> Result<Vec<u8>, ImageError> {
    let mut parts = Parts::default();
    let positions = &mesh.positions;
    let position = parts.floats(positions, Some(bounds(positions)));
    let count = positions.len();
    let normal = parts.floats(&vec![[0.0, 0.0, 1.0]; count], None);
    let tangent = parts.floats(&vec![[1.0, 0.0, 0.0, 1.0]; count], None);
    let texture = parts.floats(&mesh.texture, None);
    let indices = parts.indices(&mesh.triangles);
    let colours = parts.picture(colours(object)?);
    let normals = parts.picture(normal_map(object)?);
    let mut pbr = json!({
        "baseColorTexture": { "index": colours },
        "metallicFactor": 0.0,
        "roughnessFactor": 1.0,
    });
    let reflection = match object.surface().gloss() {
        None => json!({ "specularFactor": 0.0 }),
        Some(gloss) => {
            pbr["metallicRoughnessTexture"] = json!({ "index": parts.picture(roughness(gloss)?) });
            let (map, factor) = specular(gloss)?;
            json!({
                "specularColorFactor": [factor, factor, factor],
                "specularColorTexture": { "index": parts.picture(map) },
            })
        }
    };
    let material = json!({
        "name": object.name(),
        "pbrMetallicRoughness": pbr,
        "normalTexture": { "index": normals },
        "alphaMode": "MASK",
        "alphaCutoff": 0.5,
        "doubleSided": true,
        "extensions": { "KHR_materials_specular": reflection },
    });
    let primitive = json!({
        "attributes": { "POSITION": position, "NORMAL": normal, "TANGENT": tangent, "TEXCOORD_0": texture },
        "indices": indices,
        "material": 0,
    });
    let document = json!({
        "asset": { "version": "2.0", "generator": format!("relight {}", env!("CARGO_PKG_VERSION")) },
        "extensionsUsed": ["KHR_materials_specular"],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "name": object.name(), "mesh": 0 }],
        "meshes": [{ "name": object.name(), "primitives": [primitive] }],
        "materials": [material],
        "samplers": [{ "magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071 }],
        "textures": (0..parts.images.len()).map(|image| json!({ "source": image, "sampler": 0 })).collect::<Vec<_>>(),
        "images": parts.images,
        "accessors": parts.accessors,
        "bufferViews": parts.views,
        "buffers": [{ "byteLength": parts.bytes.len() }],
    });
    packed(document.to_string().into_bytes(), parts.bytes)
}

/// Header and chunks, each padded to four bytes.
fn packed(mut json: Vec<u8>, mut binary: Vec<u8>) -> Result<Vec<u8>, ImageError> {
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let length = 12 + 8 + json.len() + 8 + binary.len();
    let too_large = |_| not_encoded(format!("{length} bytes exceed the 4 GiB of a GLB"));
    let whole = u32::try_from(length).map_err(too_large)?;
    let mut file = Vec::with_capacity(length);
    for word in [MAGIC, VERSION, whole, json.len() as u32, JSON] {
        file.extend(word.to_le_bytes());
    }
    file.extend(&json);
    for word in [binary.len() as u32, BINARY] {
        file.extend(word.to_le_bytes());
    }
    file.extend(&binary);
    Ok(file)
}

/// What the binary chunk holds, and where.
#[derive(Default)]
struct Parts {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    images: Vec<Value>,
}

impl Parts {
    fn view(&mut self, content: &[u8], target: Option<u32>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({
            "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": content.len(),
        });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.bytes.extend(content);
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Vectors, one a vertex.
    fn floats<const N: usize>(
        &mut self,
        vectors: &[[f32; N]],
        bounds: Option<[[f32; 3]; 2]>,
    ) -> usize {
        let content: Vec<u8> = vectors
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let mut accessor = json!({
            "bufferView": self.view(&content, Some(VERTICES)),
            "componentType": FLOAT,
            "count": vectors.len(),
            "type": format!("VEC{N}"),
        });
        if let Some([least, most]) = bounds {
            accessor["min"] = json!(least);
            accessor["max"] = json!(most);
        }
        self.accessor(accessor)
    }

    fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let content: Vec<u8> = triangles
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let view = self.view(&content, Some(INDICES));
        self.accessor(json!({
            "bufferView": view, "componentType": UNSIGNED, "count": 3 * triangles.len(), "type": "SCALAR",
        }))
    }

    /// A texture of the bytes of a PNG: its number.
    fn picture(&mut self, png: Vec<u8>) -> usize {
        let view = self.view(&png, None);
        self.images
            .push(json!({ "bufferView": view, "mimeType": "image/png" }));
        self.images.len() - 1
    }
}

/// The least and the most of each coordinate.
fn bounds(positions: &[[f32; 3]]) -> [[f32; 3]; 2] {
    let fold = |start: f32, pick: fn(f32, f32) -> f32| {
        [0, 1, 2].map(|axis| positions.iter().map(|p| p[axis]).fold(start, pick))
    };
    [
        fold(f32::INFINITY, f32::min),
        fold(f32::NEG_INFINITY, f32::max),
    ]
}

/// Albedo, brought to 1 where it is brighter, with alpha.
fn colours(object: &CapturedObject) -> Result<Vec<u8>, ImageError> {
    let alpha = object.alpha();
    let linear = bled(object.surface().albedo().planes().clone(), alpha, BLEED);
    let colours = Rgb::new(linear.map(|value| value.min(1.0))).encode::<Srgb>();
    let Extent { width, height } = alpha.extent();
    let colours = colours.planes().to_bytes();
    let pixels: Vec<u8> = colours
        .chunks_exact(3)
        .zip(alpha.plane(0))
        .flat_map(|(rgb, alpha)| [rgb[0], rgb[1], rgb[2], (alpha * 255.0).round() as u8])
        .collect();
    let mut png = Vec::new();
    PngEncoder::new_with_quality(&mut png, CompressionType::Fast, FilterType::Adaptive)
        .write_image(
            &pixels,
            width as u32,
            height as u32,
            ExtendedColorType::Rgba8,
        )
        .map_err(not_encoded)?;
    Ok(png)
}

/// Normals in glTF's frame, which is ours; towards the viewer outside the object.
fn normal_map(object: &CapturedObject) -> Result<Vec<u8>, ImageError> {
    let normals = object.surface().normals();
    let all = vec![true; normals.extent().pixels()];
    let colours = normals.completed(&all).to_colours();
    let colours = colours.map(|value| value.clamp(0.0, 1.0));
    encode_png(Path::new("normal.png"), &colours, Depth::Eight)
}

/// The roughness of glTF, whose square is the width of its lobe, that is as wide as that of smoothness α.
fn roughness(gloss: &Gloss) -> Result<Vec<u8>, ImageError> {
    let map = gloss
        .smoothness()
        .clone()
        .map(|smoothness| (2.0 / (smoothness.max(0.0) + 2.0)).powf(0.25));
    let extent = map.extent();
    let [green] = map.into_planes();
    let none = vec![0.0; extent.pixels()];
    let planes = Planes::from_planes(extent, [none.clone(), green, none])?;
    encode_png(Path::new("roughness.png"), &planes, Depth::Eight)
}

/// The colour of the reflection over its largest value, and that value over what a dielectric reflects.
fn specular(gloss: &Gloss) -> Result<(Vec<u8>, f32), ImageError> {
    let part = (gloss.reflectance().clone()).zip(gloss.smoothness(), |value, smoothness| {
        (value * 8.0 / (smoothness.max(0.0) + 2.0)).clamp(0.0, 1.0)
    });
    let most = part
        .planes()
        .into_iter()
        .flatten()
        .fold(0.0_f32, |a, &b| a.max(b));
    let map = Rgb::new(part.map(|value| if most > 0.0 { value / most } else { 0.0 }));
    let map = map.encode::<Srgb>();
    let png = encode_png(Path::new("specular.png"), map.planes(), Depth::Eight)?;
    Ok((png, most / DIELECTRIC))
}
