use std::fs;
use std::path::Path;

use glam::Vec3;

use crate::mesh::SurfaceSample;
use crate::{Mesh, SynthError};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
/// Two materials, each with a colour of its own.
const MATERIALS: &str = "newmtl red\nKd 0.8 0.1 0.1\nnewmtl blue\nKd 0.1 0.2 0.8\n";
/// The square in both of them.
const COLOURED: &str = "usemtl red\nf 1 2 3\nusemtl blue\nf 1 3 4\n";

/// Reads a mesh with other files in its folder.
fn read_beside(obj: &[u8], others: &[(&str, &[u8])]) -> Result<Mesh, SynthError> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in others {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    let path = folder.path().join("a.obj");
    fs::write(&path, obj).unwrap();
    Mesh::read(&path)
}

fn read(text: &str) -> Result<Mesh, SynthError> {
    read_beside(text.as_bytes(), &[])
}

/// Why a file is refused.
fn refusal(text: &str) -> String {
    match read(text) {
        Err(SynthError::Unusable { path, fault }) => {
            assert!(path.ends_with("a.obj"));
            fault
        }
        other => panic!("{text:?}: {other:?}"),
    }
}

fn look(mesh: &Mesh, triangle: usize, corner: usize) -> SurfaceSample {
    let weights = std::array::from_fn(|at| f32::from(u8::from(at == corner)));
    mesh.own_surface(triangle, weights).unwrap()
}

/// Whether the first triangle is red and the second blue.
fn is_red_and_blue(mesh: &Mesh) -> bool {
    let colours = [0, 1].map(|triangle| look(mesh, triangle, 0).colour);
    colours == [Vec3::new(0.8, 0.1, 0.1), Vec3::new(0.1, 0.2, 0.8)]
}

/// The area of a mesh in the plane z = 0, where the sides of its box are `width` and `height`.
fn area(mesh: &Mesh, (width, height): (f32, f32)) -> f32 {
    let scale = 0.5 * width.hypot(height);
    let twice = mesh.triangles.iter().map(|corners| {
        let [a, b, c] = corners.map(|vertex| mesh.positions[vertex as usize]);
        let twice = (b - a).cross(c - a).z;
        assert!(twice > 0.0, "a triangle faces the other way");
        twice
    });
    0.5 * twice.sum::<f32>() * scale * scale
}

fn png() -> Vec<u8> {
    let picture = image::RgbImage::from_fn(2, 1, |x, _| image::Rgb([255 * x as u8, 0, 255]));
    let mut png = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
    png.into_inner()
}

#[test]
fn polygons_become_triangles_and_keep_their_texture_coordinates() {
    let textured = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nmtllib missing.mtl\nf 1/1 2/2 3/3 4/4\n";
    let mesh = read(&format!("{SQUARE}{textured}")).unwrap();
    assert_eq!(mesh.triangles.len(), 2);
    for (corners, coordinates) in mesh.triangles.iter().zip(mesh.texture().unwrap()) {
        for (&vertex, uv) in corners.iter().zip(coordinates) {
            let position = mesh.positions[vertex as usize];
            assert_eq!(position.x > 0.0, uv.x > 0.5);
            assert_eq!(position.y > 0.0, uv.y > 0.5);
        }
    }
    // Nothing is lost where no face has a material.
    assert!(mesh.left_out.is_empty());
}

#[test]
fn concave_faces_keep_their_notch_and_their_texture_coordinates() {
    let corners = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)];
    for first in 0..corners.len() {
        let mut text = String::new();
        for (x, y) in corners {
            text += &format!("v {x} {y} 0\nvt {x} {y}\n");
        }
        text += "f";
        for k in 0..corners.len() {
            let corner = (first + k) % corners.len() + 1;
            text += &format!(" {corner}/{corner}");
        }
        let mesh = read(&text).unwrap();
        assert!((area(&mesh, (3.0, 3.0)) - 5.0).abs() < 1e-4, "{first}");
        for (corners, coordinates) in mesh.triangles.iter().zip(mesh.texture().unwrap()) {
            for (&vertex, uv) in corners.iter().zip(coordinates) {
                let position = mesh.positions[vertex as usize];
                let scale = 0.5 * 3_f32.hypot(3.0);
                assert!((position.x * scale + 1.5 - uv.x).abs() < 1e-5);
            }
        }
    }
}

#[test]
fn parts_become_one_surface_without_texture_coordinates_where_there_are_none() {
    let mesh = read(&format!("{SQUARE}o a\nf 1 2 3\no b\nf 1 3 4\n")).unwrap();
    assert!(mesh.texture().is_none());
    assert_eq!((mesh.triangles.len(), mesh.positions.len()), (2, 4));
}

#[test]
fn files_are_read_as_programs_write_them() {
    let normal = "vn 0 0 1\nvt 0.5 0.5\n";
    for text in [
        // Corners: with normals, with texture coordinates, with neither, mixed, backwards, and in another order.
        format!("{SQUARE}{normal}f 1//1 2//1 3//1 4//1\n"),
        format!("{SQUARE}{normal}f 1/1/1 2/1/1 3/1/1 4/1/1\n"),
        format!("{SQUARE}{normal}f 1/1 2//1 3 4/1/1\n"),
        format!("{SQUARE}{normal}f 1/ 2/ 3// 4//\n"),
        format!("{SQUARE}f -4 -3 -2 -1\n"),
        format!("{SQUARE}f -4 -3 -2 -1\nv 9 9 9\n"),
        format!("f 1 2 3 4\n{SQUARE}"),
        format!("{SQUARE}fo 1 2 3 4\n"),
        // Texture coordinates that are numbered and not written.
        format!("{SQUARE}f 1/1 2/2 3/3 4/4\n"),
        // Numbers.
        "v 0 0 0\nv 1e0 0 0\nv +1.0 1.E+0 -0\nv 0 .1e1 0\nf 1 2 3 4\n".to_owned(),
        // Weights, and colours that are all alike.
        "v 0 0 0 1\nv 1 0 0 1\nv 1 1 0 1\nv 0 1 0 1\nf 1 2 3 4\n".to_owned(),
        "v 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 1 1 0 1 1 1\nv 0 1 0 1 1 1\nf 1 2 3 4\n".to_owned(),
        // Comments, tabs, spaces, ends of lines, lines that go on.
        format!("{SQUARE}f 1 2 3 4 # square\n"),
        format!("# C:\\models\\\n{SQUARE}f\t1  2\t3 4\t\n"),
        format!("{SQUARE}f 1 2 3 4").replace('\n', "\r\n"),
        format!("  {SQUARE}\n\nf 1 \\\n 2 \\\r\n3\\\n4"),
        format!("\u{feff}{SQUARE}f 1 2 3 4\n"),
        // What is no surface, or says nothing of it.
        format!(
            "{SQUARE}g a b\no c\ns off\np 1 2\nl 1 2 3\nvp 1 2\nf 1 2\nf 3\nf 1 2 3 4\nunknown\n"
        ),
        format!("v nan inf 0\n{SQUARE}f 2 3 4 5\n"),
    ] {
        let mesh = read(&text).unwrap_or_else(|error| panic!("{text:?}: {error}"));
        assert!((area(&mesh, (1.0, 1.0)) - 1.0).abs() < 1e-5, "{text:?}");
        assert!(mesh.left_out.is_empty() && !mesh.has_own_surface());
    }
    let latin1 = [
        b"# Caf\xe9\no T\xfcr\n",
        format!("{SQUARE}f 1 2 3 4").as_bytes(),
    ]
    .concat();
    assert_eq!(read_beside(&latin1, &[]).unwrap().triangles.len(), 2);
}

#[test]
fn damage_is_named_with_its_line() {
    for (text, line) in [
        ("v 0 0 x\nf 1 1 1\n", 1),
        ("v 0 0\n", 1),
        ("v 0,5 0,5 0,5\n", 1),
        ("v 1.#QNAN 0 0\n", 1),
        ("v 0 0 0\nf 1 2 3\n", 2),
        ("f 1 2 3\n", 1),
        (&format!("{SQUARE}f 1 2 99999999999\n"), 5),
        (&format!("{SQUARE}f 1 2 99999999999999999999\n"), 5),
        (&format!("{SQUARE}f 1 2 4294967296\n"), 5),
        (&format!("{SQUARE}f 1 2 0\n"), 5),
        (&format!("{SQUARE}f 1 2 -5\n"), 5),
        (&format!("{SQUARE}f 1 2 a\n"), 5),
        (&format!("{SQUARE}f\n"), 5),
        (&format!("{SQUARE}vt 0 0\nf 1/1 2/1 \\\n3/2\n"), 6),
        (&format!("{SQUARE}vt\n"), 5),
    ] {
        let reason = refusal(text);
        let named = format!("line {line}:");
        assert!(reason.contains(&named), "{text:?}: {reason}");
    }
    for text in ["", SQUARE, "\u{0}\u{1}binary"] {
        refusal(text);
    }
    refusal("v nan 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n");
}

#[test]
fn materials_are_found_by_the_names_that_programs_write() {
    let bom = format!("\u{feff}{MATERIALS}");
    let named = |statement: &str| format!("{statement}\n{SQUARE}{COLOURED}").into_bytes();
    for (statement, file) in [
        ("mtllib a.mtl", "a.mtl"),
        ("mtllib\ta.mtl\t", "a.mtl"),
        ("mtllib my fine  file.mtl", "my fine  file.mtl"),
        ("mtllib \"a b.mtl\"", "a b.mtl"),
        ("mtllib A.MTL", "a.mtl"),
        ("mtllib maps\\a.mtl", "maps/a.mtl"),
        ("mtllib C:\\Users\\me\\a.mtl", "a.mtl"),
        ("mtllib a.mtl # the materials", "a.mtl"),
        ("mtllib a#1.mtl", "a#1.mtl"),
        ("mtllib none.mtl a.mtl", "a.mtl"),
        ("mtllib materials", "materials"),
    ] {
        let mesh = read_beside(&named(statement), &[(file, bom.as_bytes())]).unwrap();
        assert!(
            is_red_and_blue(&mesh) && mesh.left_out.is_empty(),
            "{statement}"
        );
    }
    let behind = format!("{SQUARE}{COLOURED}mtllib a.mtl\r\n").into_bytes();
    assert!(is_red_and_blue(
        &read_beside(&behind, &[("a.mtl", bom.as_bytes())]).unwrap()
    ));
    let marked = [b"\xEF\xBB\xBF".as_slice(), &named("mtllib a.mtl")].concat();
    assert!(is_red_and_blue(
        &read_beside(&marked, &[("a.mtl", bom.as_bytes())]).unwrap()
    ));
    let latin1 = [named("mtllib Stra\u{df}e.mtl")].concat();
    let latin1: Vec<u8> = String::from_utf8(latin1)
        .unwrap()
        .chars()
        .map(|c| c as u8)
        .collect();
    let file = ("Stra\u{df}e.mtl", MATERIALS.as_bytes());
    assert!(is_red_and_blue(&read_beside(&latin1, &[file]).unwrap()));
}

#[test]
fn several_files_of_materials_are_one_list_in_which_the_first_counts() {
    let (red, blue) = MATERIALS.split_at(MATERIALS.find("newmtl blue").unwrap());
    let other = format!("newmtl red\nKd 1 1 1\n{blue}");
    let files = [("r.mtl", red.as_bytes()), ("b.mtl", other.as_bytes())];
    for statements in ["mtllib r.mtl b.mtl", "mtllib r.mtl\nmtllib b.mtl"] {
        let text = format!("{statements}\n{SQUARE}{COLOURED}");
        let mesh = read_beside(text.as_bytes(), &files).unwrap();
        assert!(is_red_and_blue(&mesh) && mesh.left_out.is_empty());
    }
}

#[test]
fn names_of_materials_may_hold_spaces_number_signs_and_comments() {
    let materials = MATERIALS
        .replace("red", "Material #25")
        .replace("blue", "a b");
    let coloured = COLOURED
        .replace("red", "Material #25")
        .replace("blue", "a b # ink");
    let text = format!("mtllib a.mtl\n{SQUARE}{coloured}");
    let mesh = read_beside(text.as_bytes(), &[("a.mtl", materials.as_bytes())]).unwrap();
    assert!(is_red_and_blue(&mesh));
}

#[test]
fn materials_that_are_not_there_are_named_where_faces_have_some() {
    let text = format!("mtllib none.mtl\n{SQUARE}{COLOURED}");
    let mesh = read(&text).unwrap();
    assert!(!mesh.has_own_surface());
    assert!(mesh.left_out.len() == 1 && mesh.left_out[0].contains("none.mtl"));
    let red = ("a.mtl", b"newmtl red\nKd 1 0 0\n".as_slice());
    let text = format!("mtllib a.mtl\n{SQUARE}{COLOURED}");
    let mesh = read_beside(text.as_bytes(), &[red]).unwrap();
    assert!(mesh.left_out.len() == 1 && mesh.left_out[0].contains("blue"));
    // A name alone promises nothing, and some names say that there is no material.
    assert!(
        read(&format!("{SQUARE}{COLOURED}"))
            .unwrap()
            .left_out
            .is_empty()
    );
    let text = format!(
        "mtllib a.mtl\n{SQUARE}{}",
        COLOURED.replace("blue", "(null)")
    );
    assert!(
        read_beside(text.as_bytes(), &[red])
            .unwrap()
            .left_out
            .is_empty()
    );
}

#[test]
fn free_form_surfaces_are_left_out_and_named() {
    let text = format!("{SQUARE}f 1 2 3\ncstype bspline\nsurf 0 1 0 1 1 2 3 4\nend\n");
    assert_eq!(read(&text).unwrap().left_out.len(), 1);
}

#[test]
fn pictures_are_read_from_the_files_beside() {
    let materials =
        "newmtl a\nKd 0.6 0.6 0.6\nKs 1 1 1\nNs 30\nmap_Kd maps\\a.png\nnewmtl b\nKd 0.25 0.5 1\n";
    let text = format!(
        "mtllib a.mtl\n{SQUARE}vt 0.25 0.5\nvt 0.75 0.5\nusemtl a\nf 1/1 2/2 3/2\nusemtl b\nf 1/1 3/1 4/1\n"
    );
    let with = |materials: &str, picture: &str| {
        let files = [("a.mtl", materials.as_bytes()), (picture, &png())];
        read_beside(text.as_bytes(), &files).unwrap()
    };
    let mesh = with(materials, "maps/a.png");
    assert_eq!(look(&mesh, 0, 0).colour, Vec3::Z);
    assert_eq!(look(&mesh, 0, 1).colour, Vec3::new(1.0, 0.0, 1.0));
    assert!((look(&mesh, 0, 0).roughness - 0.5).abs() < 1e-6);
    assert_eq!(look(&mesh, 1, 2).colour, Vec3::new(0.25, 0.5, 1.0));
    assert_eq!(look(&mesh, 1, 2).roughness, 1.0);
    for (name, picture) in [
        ("A.PNG", "a.png"),
        ("-o 0 0 0 -s 1 1 1 -bm 1 -clamp on a b.png", "a b.png"),
        ("\"a.png\"", "a.png"),
        ("a.png # wood", "a.png"),
        ("../textures/a.png", "a.png"),
        ("D:\\work\\a.png", "a.png"),
        ("textures/a.png", "Textures/a.png"),
    ] {
        let mesh = with(&format!("newmtl a\nmap_Kd {name}\n"), picture);
        assert_eq!(look(&mesh, 0, 0).colour, Vec3::Z, "{name}");
    }
    // Moved by half a picture.
    let mesh = with("newmtl a\nmap_Kd -o 0.5 0 0 a.png\n", "a.png");
    assert_eq!(look(&mesh, 0, 0).colour, Vec3::new(1.0, 0.0, 1.0));
}

#[test]
fn a_picture_that_cannot_be_used_is_left_out_and_named_once() {
    let text = format!("mtllib a.mtl\n{SQUARE}{COLOURED}");
    for name in [
        "none.png",
        "C:\\none.png",
        "damaged.png",
        "../../none.png",
        "/etc/passwd",
    ] {
        let materials =
            format!("newmtl red\nKd 0.5 0 0\nmap_Kd {name}\nnewmtl blue\nmap_Kd {name}\n");
        let files = [
            ("a.mtl", materials.as_bytes()),
            ("damaged.png", b"no picture"),
        ];
        let mesh = read_beside(text.as_bytes(), &files).unwrap();
        assert_eq!(look(&mesh, 0, 0).colour, Vec3::new(0.5, 0.0, 0.0));
        let left_out = &mesh.left_out;
        let stem = Path::new(name).file_stem().unwrap().to_string_lossy();
        let named = stem.rsplit('\\').next().unwrap();
        assert!(
            left_out.len() == 1 && left_out[0].contains(named),
            "{left_out:?}"
        );
    }
    // Of a material that no triangle has, it is not missed.
    let spare = format!("{MATERIALS}newmtl c\nmap_Kd none.png\n");
    let mesh = read_beside(text.as_bytes(), &[("a.mtl", spare.as_bytes())]).unwrap();
    assert!(is_red_and_blue(&mesh) && mesh.left_out.is_empty());
}

#[test]
fn colours_of_vertices_are_srgb_in_either_range_and_stand_for_the_materials_colour() {
    for scale in [1.0, 255.0] {
        let vertex = |x: u8, y: u8, [r, g, b]: [f32; 3]| {
            format!("v {x} {y} 0 {} {} {}\n", r * scale, g * scale, b * scale)
        };
        let text = [
            "mtllib a.mtl\nusemtl red\n".to_owned(),
            vertex(0, 0, [1.0, 0.0, 0.0]),
            vertex(1, 0, [0.0, 1.0, 0.0]),
            vertex(1, 1, [0.5, 0.5, 0.5]),
            "f 1 2 3\n".to_owned(),
        ];
        let files = [("a.mtl", MATERIALS.as_bytes())];
        let mesh = read_beside(text.concat().as_bytes(), &files).unwrap();
        assert_eq!(look(&mesh, 0, 0).colour, Vec3::X);
        assert_eq!(look(&mesh, 0, 1).colour, Vec3::Y);
        let grey = look(&mesh, 0, 2).colour;
        assert!((grey - 0.214).abs().max_element() < 1e-3, "{grey}");
    }
}
