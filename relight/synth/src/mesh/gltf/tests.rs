use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::Vec3;
use serde_json::{Value, json};

use super::*;
use crate::{Mesh, SynthError};

const BYTES_OF_A_SQUARE: usize = 60;

fn bytes_of(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|one| one.to_le_bytes()).collect()
}

/// A square of two triangles in the plane z = 0, in a node that stretches it by 2 along x.
fn square() -> (Value, Vec<u8>) {
    let mut bytes = bytes_of(&[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
    bytes.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|v| v.to_le_bytes()));
    let document = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "scale": [2.0, 1.0, 1.0]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": bytes.len(), "uri": "a.bin"}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
             "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 0.0]},
            {"bufferView": 1, "byteOffset": 0, "componentType": 5123, "count": 6, "type": "SCALAR"}],
    });
    (document, bytes)
}

/// Adds bytes with an accessor of them; its number.
fn with_accessor(
    document: &mut Value,
    bytes: &mut Vec<u8>,
    new: &[u8],
    mut accessor: Value,
) -> usize {
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let view = json!({"buffer": 0, "byteOffset": bytes.len(), "byteLength": new.len()});
    bytes.extend(new);
    let views = document["bufferViews"].as_array_mut().unwrap();
    views.push(view);
    accessor["bufferView"] = json!(views.len() - 1);
    let accessors = document["accessors"].as_array_mut().unwrap();
    accessors.push(accessor);
    let number = accessors.len() - 1;
    document["buffers"][0]["byteLength"] = json!(bytes.len());
    number
}

fn read(document: &Value, binary: &[u8]) -> Result<Mesh, SynthError> {
    let folder = tempfile::tempdir().unwrap();
    read_in(folder.path(), document, binary)
}

fn read_in(folder: &Path, document: &Value, binary: &[u8]) -> Result<Mesh, SynthError> {
    std::fs::write(folder.join("a.bin"), binary).unwrap();
    let path = folder.join("a.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    Mesh::read(&path)
}

/// Why a file is refused.
fn refusal(document: &Value, binary: &[u8]) -> String {
    match read(document, binary) {
        Err(SynthError::Unusable { path, fault }) => {
            assert!(path.ends_with("a.gltf"));
            fault
        }
        other => panic!("{other:?}"),
    }
}

/// The look at a corner of a triangle.
fn look(mesh: &Mesh, triangle: usize, corner: usize) -> crate::mesh::SurfaceSample {
    let weights = std::array::from_fn(|at| f32::from(u8::from(at == corner)));
    mesh.own_surface(triangle, weights).unwrap()
}

/// How much wider a mesh is than high.
fn aspect(mesh: &Mesh) -> f32 {
    let largest = |axis: usize| mesh.positions.iter().map(|p| p[axis]).fold(0.0, f32::max);
    largest(0) / largest(1)
}

fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let part = |kind: &[u8; 4], bytes: &[u8]| {
        [&(bytes.len() as u32).to_le_bytes(), kind.as_slice(), bytes].concat()
    };
    let parts = [part(b"JSON", &json), part(b"BIN\0", binary)].concat();
    let length = (12 + parts.len()) as u32;
    [
        b"glTF".as_slice(),
        &2_u32.to_le_bytes(),
        &length.to_le_bytes(),
        &parts,
    ]
    .concat()
}

fn read_glb(bytes: &[u8]) -> Result<Mesh, SynthError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.GLB");
    std::fs::write(&path, bytes).unwrap();
    Mesh::read(&path)
}

#[test]
fn a_buffer_may_lie_in_a_file_in_the_text_or_in_the_binary_part() {
    let (mut document, bytes) = square();
    let mut shapes = vec![read(&document, &bytes).unwrap()];
    let data = STANDARD.encode(&bytes);
    document["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{data}"));
    shapes.push(read(&document, &[]).unwrap());
    document["buffers"][0]
        .as_object_mut()
        .unwrap()
        .remove("uri");
    shapes.push(read_glb(&glb(&document, &bytes)).unwrap());
    for shape in shapes {
        assert_eq!((shape.triangles.len(), shape.positions.len()), (2, 4));
        assert!((aspect(&shape) - 2.0).abs() < 1e-6);
    }
}

#[test]
fn a_file_beside_is_found_by_its_encoded_name_and_text_may_have_a_byte_order_mark() {
    let (mut document, bytes) = square();
    document["buffers"][0]["uri"] = json!("my%20shape.bin");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("my shape.bin"), &bytes).unwrap();
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, format!("\u{feff}{document}")).unwrap();
    assert_eq!(Mesh::read(&path).unwrap().triangles.len(), 2);
    std::fs::remove_file(folder.path().join("my shape.bin")).unwrap();
    let error = Mesh::read(&path).unwrap_err().to_string();
    assert!(error.contains("my%20shape.bin"), "{error}");
}

#[test]
fn what_points_outside_its_buffer_or_folder_is_an_error() {
    let changes: [(&str, Value); 15] = [
        ("/accessors/0/count", json!(5)),
        ("/accessors/0/count", json!(u64::MAX)),
        ("/accessors/1/byteOffset", json!(2)),
        ("/accessors/1/byteOffset", json!(u64::MAX)),
        ("/accessors/0/componentType", json!(5123)),
        ("/accessors/0/componentType", json!(1)),
        ("/accessors/0/type", json!("VEC2")),
        ("/accessors/0/bufferView", json!(9)),
        ("/bufferViews/1/byteOffset", json!(u32::MAX)),
        ("/bufferViews/0/buffer", json!(1)),
        ("/buffers/0/byteLength", json!(61)),
        ("/buffers/0/uri", json!("../a.bin")),
        ("/buffers/0/uri", json!("data:text/plain;base64,a")),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(7)),
        ("/nodes/0/mesh", json!(1)),
    ];
    for (place, value) in changes {
        let (mut document, bytes) = square();
        *document.pointer_mut(place).unwrap() = value;
        refusal(&document, &bytes);
    }
}

#[test]
fn a_binary_file_that_is_cut_off_or_of_another_version_is_refused() {
    let (mut document, bytes) = square();
    document["buffers"][0]
        .as_object_mut()
        .unwrap()
        .remove("uri");
    let whole = glb(&document, &bytes);
    for length in 0..whole.len() {
        assert!(read_glb(&whole[..length]).is_err());
    }
    let mut other = whole.clone();
    other[4] = 1;
    let error = read_glb(&other).unwrap_err().to_string();
    assert!(error.contains("glTF 1"), "{error}");
    for length in [0_u32, 11, u32::MAX] {
        let mut other = whole.clone();
        other[8..12].copy_from_slice(&length.to_le_bytes());
        assert!(read_glb(&other).is_err());
    }
    document["asset"]["version"] = json!("1.0");
    assert!(refusal(&document, &bytes).contains("glTF 1.0"));
}

fn png() -> Vec<u8> {
    let picture = image::RgbImage::from_fn(1, 2, |_, y| image::Rgb([255, 255 * y as u8, 0]));
    let mut png = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
    png.into_inner()
}

fn webp() -> Vec<u8> {
    let picture = image::RgbImage::from_fn(1, 2, |_, y| image::Rgb([255, 255 * y as u8, 0]));
    let mut webp = std::io::Cursor::new(Vec::new());
    picture
        .write_to(&mut webp, image::ImageFormat::WebP)
        .unwrap();
    webp.into_inner()
}

/// The square under a picture, red below and yellow above.
fn painted(picture: &[u8]) -> (Value, Vec<u8>) {
    let (mut document, mut bytes) = square();
    // Texture coordinates at the lower edge and at the upper one, v running downwards.
    let coordinates = bytes_of(&[0.5, 0.75, 0.5, 0.75, 0.5, 0.25, 0.5, 0.25]);
    let vec2 = json!({"componentType": 5126, "count": 4, "type": "VEC2"});
    let coordinates = with_accessor(&mut document, &mut bytes, &coordinates, vec2);
    let views = document["bufferViews"].as_array_mut().unwrap();
    views.push(json!({"buffer": 0, "byteOffset": bytes.len(), "byteLength": picture.len()}));
    bytes.extend(picture);
    document["buffers"][0]["byteLength"] = json!(bytes.len());
    document["images"] = json!([{"bufferView": 3, "mimeType": "image/png"}]);
    document["textures"] = json!([{"source": 0}]);
    document["materials"] = json!([{"pbrMetallicRoughness": {
        "baseColorTexture": {"index": 0}, "baseColorFactor": [0.5, 1.0, 1.0, 1.0],
        "metallicFactor": 0.0, "roughnessFactor": 0.4}}]);
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(coordinates);
    (document, bytes)
}

#[test]
fn materials_are_read_with_their_pictures_and_roughness() {
    let (document, bytes) = painted(&png());
    let mesh = read(&document, &bytes).unwrap();
    assert_eq!(look(&mesh, 0, 0).colour, Vec3::new(0.5, 1.0, 0.0));
    assert_eq!(look(&mesh, 0, 2).colour, Vec3::new(0.5, 0.0, 0.0));
    let plain = look(&mesh, 0, 0);
    assert_eq!((plain.roughness, plain.metallic), (0.4, 0.0));
    assert!(mesh.left_out.is_empty());
}

#[test]
fn a_picture_that_cannot_be_used_is_left_out_and_named() {
    let (document, bytes) = painted(&png());
    for (place, value, named) in [
        ("/bufferViews/3/byteLength", json!(20), ""),
        ("/bufferViews/3/byteLength", json!(9000), "buffer"),
        ("/images/0", json!({"uri": "../a.png"}), "../a.png"),
        ("/images/0", json!({"uri": "C:\\a.png"}), "a.png"),
        (
            "/images/0",
            json!({"uri": "none.png", "name": "wood"}),
            "wood",
        ),
        ("/images/0", json!({}), ""),
        ("/textures/0", json!({}), "texture 0"),
        ("/textures/0", json!({"source": 7}), "7"),
        (
            "/textures/0",
            json!({"extensions": {"KHR_texture_basisu": {"source": 0}}}),
            "KHR_texture_basisu",
        ),
        (
            "/materials/0/pbrMetallicRoughness/baseColorTexture/index",
            json!(3),
            "3",
        ),
    ] {
        let mut document = document.clone();
        // The same thing twice is one thing.
        let twice = document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"].clone();
        document["materials"][0]["pbrMetallicRoughness"]["metallicRoughnessTexture"] = twice;
        let (parent, key) = place.rsplit_once('/').unwrap();
        match document.pointer_mut(parent).unwrap() {
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
            object => object[key] = value,
        }
        let mesh = read(&document, &bytes).unwrap();
        assert_eq!(mesh.triangles.len(), 2);
        let found = &mesh.left_out;
        assert!(
            !found.is_empty() && found[0].contains(named),
            "{place}: {found:?}"
        );
        assert!(
            !place.starts_with("/images") || found.len() == 1,
            "{found:?}"
        );
    }
}

#[test]
fn a_texture_in_webp_is_read_with_and_without_another_source() {
    let (mut document, bytes) = painted(&webp());
    document["extensionsUsed"] = json!(["EXT_texture_webp"]);
    document["extensionsRequired"] = json!(["EXT_texture_webp"]);
    document["images"][0]["mimeType"] = json!("image/webp");
    for texture in [
        json!({"extensions": {"EXT_texture_webp": {"source": 0}}}),
        json!({"source": 0, "extensions": {"EXT_texture_webp": {"source": 5}}}),
    ] {
        document["textures"][0] = texture;
        let mesh = read(&document, &bytes).unwrap();
        assert!(mesh.left_out.is_empty());
        assert_eq!(look(&mesh, 0, 0).colour, Vec3::new(0.5, 1.0, 0.0));
    }
}

#[test]
fn pictures_lie_on_the_texture_coordinates_that_their_material_names() {
    let (mut document, mut bytes) = painted(&png());
    let swapped = bytes_of(&[0.5, 0.25, 0.5, 0.25, 0.5, 0.75, 0.5, 0.75]);
    let vec2 = json!({"componentType": 5126, "count": 4, "type": "VEC2"});
    let swapped = with_accessor(&mut document, &mut bytes, &swapped, vec2);
    document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(swapped);
    let surface = &mut document["materials"][0]["pbrMetallicRoughness"];
    surface["baseColorTexture"]["texCoord"] = json!(1);
    let mesh = read(&document, &bytes).unwrap();
    assert_eq!(look(&mesh, 0, 0).colour, Vec3::new(0.5, 0.0, 0.0));
    let surface = &mut document["materials"][0]["pbrMetallicRoughness"];
    surface["metallicRoughnessTexture"] = json!({"index": 0});
    let mesh = read(&document, &bytes).unwrap();
    assert_eq!(mesh.left_out.len(), 1);
    assert_eq!(look(&mesh, 0, 0).roughness, 0.4);
}

#[test]
fn a_picture_is_scaled_turned_and_moved() {
    let (mut document, bytes) = painted(&png());
    // Half a picture further down.
    for (transform, colour) in [
        (json!({"offset": [0.0, 0.5]}), Vec3::new(0.5, 0.0, 0.0)),
        (json!({"scale": [1.0, -1.0]}), Vec3::new(0.5, 0.0, 0.0)),
        (
            json!({"rotation": std::f32::consts::PI}),
            Vec3::new(0.5, 0.0, 0.0),
        ),
        // The specification's example: the lower left quarter, turned.
        (
            json!({"offset": [0.0, 1.0], "rotation": std::f32::consts::FRAC_PI_2, "scale": [0.5, 0.5]}),
            Vec3::new(0.5, 1.0, 0.0),
        ),
        (json!({"texCoord": 0}), Vec3::new(0.5, 1.0, 0.0)),
    ] {
        document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
            json!({"KHR_texture_transform": transform});
        let mesh = read(&document, &bytes).unwrap();
        let found = look(&mesh, 0, 0).colour;
        assert!(
            (found - colour).abs().max_element() < 1e-4,
            "{transform}: {found}"
        );
    }
}

#[test]
fn colours_of_vertices_multiply_those_of_the_material() {
    let (mut document, mut bytes) = square();
    let levels = [
        255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 0,
    ];
    let accessor = json!({"componentType": 5121, "normalized": true, "count": 4, "type": "VEC4"});
    let colours = with_accessor(&mut document, &mut bytes, &levels, accessor);
    document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colours);
    document["materials"] = json!([{"pbrMetallicRoughness": {
        "baseColorFactor": [0.5, 0.5, 0.5, 1.0], "metallicFactor": 0.0}}]);
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    let mesh = read(&document, &bytes).unwrap();
    let found: Vec<Vec3> = (0..3).map(|corner| look(&mesh, 0, corner).colour).collect();
    assert_eq!(found, [0.5 * Vec3::X, 0.5 * Vec3::Y, 0.5 * Vec3::Z]);
    // White for all tells nothing.
    bytes[BYTES_OF_A_SQUARE..].fill(255);
    assert!(!read(&document, &bytes).unwrap().has_own_surface());
}

#[test]
fn an_extension_that_is_required_and_not_read_is_named() {
    for extension in [
        "KHR_draco_mesh_compression",
        "EXT_meshopt_compression",
        "EXT_mesh_gpu_instancing",
        "X_of_tomorrow",
    ] {
        let (mut document, bytes) = square();
        document["extensionsRequired"] = json!([extension]);
        assert!(refusal(&document, &bytes).contains(extension));
    }
    let (mut document, bytes) = square();
    document["extensionsRequired"] = json!([
        "KHR_texture_transform",
        "KHR_materials_unlit",
        "KHR_materials_transmission",
        "KHR_lights_punctual",
        "KHR_texture_basisu"
    ]);
    assert!(read(&document, &bytes).is_ok());
}

#[test]
fn compressed_parts_without_plain_ones_beside_them_are_named() {
    let (mut document, bytes) = square();
    let primitive = &mut document["meshes"][0]["primitives"][0];
    primitive["extensions"] = json!({"KHR_draco_mesh_compression": {"bufferView": 0}});
    assert!(read(&document, &bytes).is_ok());
    document["accessors"][0]
        .as_object_mut()
        .unwrap()
        .remove("bufferView");
    assert!(refusal(&document, &bytes).contains("KHR_draco_mesh_compression"));
    let (mut document, bytes) = square();
    document["buffers"][0]
        .as_object_mut()
        .unwrap()
        .remove("uri");
    document["bufferViews"][0]["extensions"] = json!({"EXT_meshopt_compression": {"buffer": 1}});
    assert!(refusal(&document, &bytes).contains("EXT_meshopt_compression"));
}

#[test]
fn positions_may_be_whole_numbers_where_the_file_says_so() {
    for (kind, normalized, numbers) in [
        (
            5121,
            false,
            [0_u8, 0, 0, 0, 9, 0, 0, 0, 9, 9, 0, 0, 0, 9, 0, 0],
        ),
        (
            5120,
            true,
            [0_u8, 0, 0, 0, 127, 0, 0, 0, 127, 127, 0, 0, 0, 127, 0, 0],
        ),
    ] {
        let (mut document, mut bytes) = square();
        let accessor =
            json!({"componentType": kind, "normalized": normalized, "count": 4, "type": "VEC3"});
        let positions = with_accessor(&mut document, &mut bytes, &numbers, accessor);
        // Each item fills four bytes, as the format asks.
        let view = document["bufferViews"]
            .as_array_mut()
            .unwrap()
            .last_mut()
            .unwrap();
        view["byteStride"] = json!(4);
        document["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(positions);
        assert!(refusal(&document, &bytes).contains("accessor 2"));
        document["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        let mesh = read(&document, &bytes).unwrap();
        assert!((aspect(&mesh) - 2.0).abs() < 1e-6);
    }
}

#[test]
fn a_sparse_accessor_is_named() {
    let (mut document, bytes) = square();
    document["accessors"][0]["sparse"] = json!({"count": 2,
        "indices": {"bufferView": 1, "componentType": 5121}, "values": {"bufferView": 0}});
    assert!(refusal(&document, &bytes).contains("accessor 0"));
}

#[test]
fn items_may_stand_among_those_of_others() {
    let (mut document, _) = square();
    let mut bytes = Vec::new();
    for [x, y] in [[0.0_f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
        bytes.extend(bytes_of(&[9.0, x, y, 0.0, 7.0]));
    }
    let indices = bytes.len();
    bytes.extend([0_u8, 1, 2, 0, 2, 3]);
    document["buffers"][0]["byteLength"] = json!(bytes.len());
    document["bufferViews"] = json!([
        {"buffer": 0, "byteLength": indices, "byteStride": 20},
        {"buffer": 0, "byteOffset": indices, "byteLength": 6}]);
    document["accessors"][0]["byteOffset"] = json!(4);
    document["accessors"][1]["componentType"] = json!(5121);
    let mesh = read(&document, &bytes).unwrap();
    assert!((aspect(&mesh) - 2.0).abs() < 1e-6);
}

#[test]
fn nodes_that_go_in_a_circle_are_an_error() {
    let (mut document, bytes) = square();
    document["nodes"][0]["children"] = json!([0, 0]);
    refusal(&document, &bytes);
    document["nodes"][0]["children"] = json!([5]);
    assert!(refusal(&document, &bytes).contains("node 5"));
}

#[test]
fn a_file_without_scenes_has_all_its_nodes() {
    let (mut document, bytes) = square();
    document["nodes"] = json!([{"mesh": 0}, {"children": [0], "scale": [3.0, 1.0, 1.0]}]);
    let object = document.as_object_mut().unwrap();
    object.remove("scene");
    object.remove("scenes");
    let mesh = read(&document, &bytes).unwrap();
    assert!((aspect(&mesh) - 3.0).abs() < 1e-6);
    assert_eq!(mesh.triangles.len(), 2);
}

#[test]
fn a_mirrored_part_keeps_its_outside() {
    let (mut document, bytes) = square();
    for (scale, z) in [
        ([2.0, 1.0, 1.0], 1.0),
        ([-2.0, 1.0, 1.0], 1.0),
        ([-2.0, -1.0, -1.0], -1.0),
    ] {
        document["nodes"][0]["scale"] = json!(scale);
        let mesh = read(&document, &bytes).unwrap();
        assert!(
            mesh.normals
                .iter()
                .flatten()
                .all(|normal| normal.z * z > 0.99)
        );
    }
}

#[test]
fn a_part_that_a_skeleton_carries_lies_where_its_node_is_and_is_named() {
    let (mut document, bytes) = square();
    document["skins"] = json!([{"joints": [1]}]);
    document["nodes"] = json!([{"mesh": 0, "skin": 0, "scale": [3.0, 1.0, 1.0]}, {}]);
    let mesh = read(&document, &bytes).unwrap();
    assert!((aspect(&mesh) - 3.0).abs() < 1e-5);
    assert_eq!(mesh.left_out.len(), 1, "{:?}", mesh.left_out);
}

#[test]
fn strips_and_fans_are_read_as_triangles() {
    let strip = triangles(TRIANGLE_STRIP, &[0, 1, 2, 3]);
    assert_eq!(strip, [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(
        triangles(TRIANGLE_FAN, &[0, 1, 2, 3]),
        [[0, 1, 2], [0, 2, 3]]
    );
    assert!(triangles(TRIANGLE_FAN, &[]).is_empty());
    // Points and lines are no surface.
    let (mut document, bytes) = square();
    let surface = document["meshes"][0]["primitives"][0].clone();
    document["meshes"][0]["primitives"] =
        json!([surface, {"attributes": {"POSITION": 0}, "mode": 1}]);
    assert_eq!(read(&document, &bytes).unwrap().triangles.len(), 2);
}

#[test]
fn an_index_beyond_the_vertices_is_an_error() {
    let (document, mut bytes) = square();
    bytes[48] = 9;
    assert!(refusal(&document, &bytes).contains("vertex 9"));
}
