//! Libraries built from archives and folders, and read again.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use glam::Vec3;
use proptest::prelude::*;
use relight_core::image::Extent;
use relight_core::light::{Order, Panorama, ShLight};
use tempfile::TempDir;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::*;
use crate::library::{Folders, Library};
use crate::mesh::Mesh;

/// A box from the origin, its front side in another material.
fn box_of(size: [f32; 3]) -> String {
    let mut text = "mtllib m.mtl\n".to_owned();
    for z in [0.0, size[2]] {
        for (x, y) in [(0., 0.), (1., 0.), (1., 1.), (0., 1.)] {
            text += &format!("v {} {} {z}\n", x * size[0], y * size[1]);
        }
    }
    text += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl red\n";
    for face in ["1 4 3 2", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8"] {
        text += &format!("f {face}\n");
    }
    text + "usemtl print\nf 5/1 6/2 7/3 8/4\n"
}

const MATERIALS: &str = "newmtl red\nKd 0.8 0.1 0.1\nnewmtl print\nmap_Kd p.png\n";

fn png(at: impl Fn(u32) -> u8) -> Vec<u8> {
    let image = image::RgbImage::from_fn(8, 8, |x, _| image::Rgb([at(x), 20, 200]));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// An archive of furniture with five models: one lacks its picture, one is broken, one is a window, one is flat.
fn write_furniture(path: &Path) {
    let mut archive = ZipWriter::new(File::create(path).unwrap());
    let mut add = |name: &str, bytes: &[u8]| {
        archive
            .start_file(name, SimpleFileOptions::default())
            .unwrap();
        archive.write_all(bytes).unwrap();
    };
    add(
        "LICENSE.TXT",
        b"http://creativecommons.org/licenses/by/3.0/",
    );
    let mut catalogue = "name=Test catalog\nversion=1.8\n".to_owned();
    let models = [
        ("chair", "Chair", "Office", "false"),
        ("lamp", "Lamp", "Lights", "false"),
        ("broken", "Bed", "Bedroom", "false"),
        ("pane", "Bow window", "Doors and windows", "true"),
        ("rug", "Rug", "Living room", "false"),
    ];
    for (number, (model, title, category, is_window)) in (1..).zip(models) {
        catalogue += &format!(
            "id#{number}={model}\nname#{number}={title}\ncategory#{number}={category}\nmodel#{number}=/t/{model}/{model}.obj\n\
             doorOrWindow#{number}={is_window}\ncreator#{number}=Ann, of \"B\"\n"
        );
    }
    add("PluginFurnitureCatalog.properties", catalogue.as_bytes());
    for (model, size) in [
        ("chair", [1., 2., 1.]),
        ("lamp", [1., 3., 1.]),
        ("pane", [2., 2., 1.]),
        ("rug", [2., 0.01, 3.]),
    ] {
        add(&format!("t/{model}/{model}.obj"), box_of(size).as_bytes());
        add(&format!("t/{model}/m.mtl"), MATERIALS.as_bytes());
        if model != "lamp" {
            add(&format!("t/{model}/p.png"), &png(|x| x as u8 * 30));
        }
    }
    add("t/broken/broken.obj", b"v 0 0 0\nf 1 2 3\n");
    archive.finish().unwrap();
}

fn write_panorama(path: &Path, towards: usize) {
    let mut coefficients = ShLight::even(Order::TWO, [1.0, 0.8, 0.6]);
    coefficients = coefficients.tinted([1.0 + towards as f64; 3]);
    let panorama = Panorama::from_light(&coefficients, Extent::new(64, 32));
    let mut planes = panorama.image().planes().clone();
    for y in 0..32 {
        for x in 0..64 {
            let level = if (x / 8 + y / 8) % (2 + towards) == 0 {
                4.0
            } else {
                0.1
            };
            planes.set_pixel(x, y, [level, level, 0.5]);
        }
    }
    relight_core::files::write_exr(path, &planes).unwrap();
}

struct Case {
    folder: TempDir,
    sources: LibrarySources,
}

impl Case {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("archives")).unwrap();
        write_furniture(&at("archives/test.sh3f"));
        fs::create_dir_all(at("own/deep")).unwrap();
        fs::write(at("own/deep/block.obj"), box_of([1., 1., 1.5])).unwrap();
        fs::write(at("own/again.obj"), box_of([1., 1., 1.5])).unwrap();
        fs::write(
            at("own/origin.toml"),
            "author = \"Me\"\nlicence = \"CC0-1.0\"\n",
        )
        .unwrap();
        fs::create_dir_all(at("light")).unwrap();
        for number in 0..4 {
            write_panorama(&at(&format!("light/{number}.exr")), number);
        }
        write_panorama(&at("light/same.exr"), 0);
        fs::write(at("light/damaged.hdr"), "#?RADIANCE\n").unwrap();
        let sources = LibrarySources {
            meshes: vec![at("archives"), at("own")],
            panoramas: vec![at("light")],
        };
        Self { folder, sources }
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("library.relib")
    }

    fn build(&self) -> LibrarySummary {
        build_library(&self.sources, &self.out(), &|_| {}).unwrap()
    }

    fn folders(&self) -> Folders {
        Folders {
            meshes: Some(self.out()),
            panoramas: Some(self.out()),
        }
    }
}

#[test]
fn what_cannot_be_used_is_left_out_and_named_and_the_rest_is_packed() {
    let case = Case::new();
    let summary = case.build();
    let names: Vec<&str> = summary
        .objects
        .iter()
        .map(|one| one.name.as_str())
        .collect();
    assert_eq!(
        names,
        [
            "test/t/chair/chair.obj",
            "test/t/lamp/lamp.obj",
            "own/again.obj"
        ]
    );
    let chair = &summary.objects[0];
    assert_eq!(
        (chair.title.as_str(), chair.category.as_str()),
        ("Chair", "Office")
    );
    assert_eq!(
        (chair.author.as_str(), chair.licence.as_str()),
        ("Ann, of \"B\"", "CC-BY-3.0")
    );
    assert_eq!(chair.origin, "Test catalog 1.8");
    assert_eq!(summary.objects[2].licence, "CC0-1.0");
    assert_eq!(summary.panoramas.len(), 4);
    // Of objects a damaged one, a flat one, one that is there already, and a window; of panoramas two.
    let of_kind = |kind: &str| {
        let reasons = summary.left_out.iter();
        let counts = reasons.filter(|(reason, _)| reason.starts_with(kind));
        counts.map(|(_, &count)| count).collect::<Vec<usize>>()
    };
    assert_eq!(of_kind("objects: "), [1; 4], "{:?}", summary.left_out);
    assert_eq!(of_kind("panoramas: "), [1; 2], "{:?}", summary.left_out);
    let faults: Vec<String> = summary.faults.iter().map(ToString::to_string).collect();
    for (name, what) in [
        ("lamp", "p.png"),
        ("broken", "line 2"),
        ("damaged.hdr", "read"),
    ] {
        let named = |fault: &&String| fault.contains(name) && fault.contains(what);
        assert_eq!(faults.iter().filter(named).count(), 1, "{name}: {faults:?}");
    }
    assert_eq!(summary.without_licence(), ["light"]);
    let table = fs::read_to_string(case.out().with_extension("csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + 7 + 6);
    assert!(table.contains("object,test/t/chair/chair.obj,Chair,Office,\"Ann, of \"\"B\"\"\",CC-BY-3.0,Test catalog 1.8,"));
}

#[test]
fn a_packed_object_is_that_of_its_file() {
    let case = Case::new();
    case.build();
    let library = Library::read(&case.folders()).unwrap();
    let archive =
        furniture::Furniture::open(&case.folder.path().join("archives/test.sh3f")).unwrap();
    let own = Mesh::read(&archive.models()[0].path).unwrap();
    let (_, packed) = &library.meshes[0];
    assert_eq!(packed.triangles.len(), own.triangles.len());
    assert!(packed.has_own_surface());
    let centre = |mesh: &Mesh, triangle: usize| {
        let corners = mesh.triangles[triangle].map(|v| mesh.positions[v as usize]);
        corners.into_iter().sum::<Vec3>() / 3.0
    };
    for triangle in 0..own.triangles.len() {
        let place = centre(&own, triangle);
        let mut others = 0..packed.triangles.len();
        let other = others
            .find(|&other| centre(packed, other).distance(place) < 1e-3)
            .unwrap();
        let weights = [0.6, 0.3, 0.1];
        let [own_look, look] = [(&own, triangle), (packed, other)]
            .map(|(mesh, triangle)| mesh.own_surface(triangle, weights).unwrap());
        // Corners may begin elsewhere: on the picture, the look is another one there.
        if own_look.colour.x > 0.7 {
            assert!((own_look.colour - look.colour).abs().max_element() < 0.01);
        }
        assert!(packed.normals[other][0].dot(own.normals[triangle][0]) > 0.999);
    }
    let panorama = Panorama::read(&case.folder.path().join("light/1.exr")).unwrap();
    let packed = library.panoramas.get(1).unwrap();
    let [own, read] = [&panorama, packed].map(|one| one.project(Order::TWO).coefficients()[0][0]);
    assert!((own - read).abs() < 0.01 * own);
}

#[test]
fn the_same_sources_give_the_same_bytes_and_a_file_the_same_library_as_its_bytes() {
    let case = Case::new();
    case.build();
    let first = fs::read(case.out()).unwrap();
    let library = Library::read(&case.folders()).unwrap();
    case.build();
    assert_eq!(fs::read(case.out()).unwrap(), first);
    let again = Library::from_bytes(&case.out(), &first).unwrap();
    assert_eq!(again.mesh_names(), library.mesh_names());
    for ((_, mesh), (_, other)) in again.meshes.iter().zip(&library.meshes) {
        assert_eq!(mesh.positions, other.positions);
    }
}

#[test]
fn a_tenth_is_for_validation_by_its_name_alone() {
    let held = (0..2000)
        .filter(|k| is_for_validation(&format!("a/{k}.obj")))
        .count();
    assert!((150..250).contains(&held), "{held}");
    let case = Case::new();
    case.build();
    let mut library = Library::read(&case.folders()).unwrap();
    let names: Vec<String> = library
        .meshes
        .iter()
        .map(|(name, _)| name.clone())
        .collect();
    let light: Vec<String> = (0..4)
        .map(|number| library.panoramas.name(number).unwrap().to_owned())
        .collect();
    // Whatever their names are: one of each.
    for name in names.iter().chain(&light) {
        library
            .is_for_validation
            .insert(name.clone(), *name == names[1] || *name == light[2]);
    }
    let training = library.clone().training().unwrap();
    assert_eq!(
        (
            training.meshes.len(),
            training.panoramas.len(),
            training.pictures.len()
        ),
        (2, 3, 3)
    );
    let validation = library.clone().validation().unwrap();
    assert_eq!(validation.meshes[0].0, names[1]);
    assert_eq!(validation.panoramas.name(0), Some(light[2].as_str()));
    assert_eq!(validation.pictures.len(), 1);
    library
        .is_for_validation
        .values_mut()
        .for_each(|own| *own = false);
    assert!(library.validation().is_err());
}

#[test]
fn what_is_kept_apart_under_one_name_is_not_learned_from_under_another() {
    let case = Case::new();
    let origin = "licence = \"CC0-1.0\"\nvalidation = false\n";
    let held = format!("{origin}[files.\"same.exr\"]\nvalidation = true\n");
    fs::write(case.folder.path().join("light/origin.toml"), held).unwrap();
    let summary = case.build();
    let marks: Vec<bool> = summary
        .panoramas
        .iter()
        .map(|one| one.is_for_validation)
        .collect();
    assert_eq!(marks, [true, false, false, false]);
    let table = fs::read_to_string(case.out().with_extension("csv")).unwrap();
    assert!(
        table.contains("light/0.exr,0,,unknown,CC0-1.0,light,validation,"),
        "{table}"
    );
}

#[test]
fn folders_that_hold_nothing_and_files_that_are_no_library_are_refused() {
    let case = Case::new();
    let empty = case.folder.path().join("empty");
    fs::create_dir(&empty).unwrap();
    let sources = LibrarySources {
        meshes: vec![empty],
        panoramas: Vec::new(),
    };
    assert!(build_library(&sources, &case.out(), &|_| {}).is_err());
    assert!(build_library(&LibrarySources::default(), &case.out(), &|_| {}).is_err());
    fs::write(case.out(), "no library").unwrap();
    let error = Library::read(&case.folders()).unwrap_err().to_string();
    assert!(error.contains("library.relib"), "{error}");
}

#[test]
fn a_library_that_is_damaged_anywhere_ends_in_an_error_or_is_read() {
    let case = Case::new();
    case.build();
    let bytes = fs::read(case.out()).unwrap();
    for cut in [0, 1, bytes.len() / 2, bytes.len() - 1] {
        assert!(Library::from_bytes(&case.out(), &bytes[..cut]).is_err());
    }
    for step in 0..200 {
        let mut damaged = bytes.clone();
        let at = step * bytes.len() / 200;
        damaged[at] ^= 1 << (step % 8);
        let _ = Library::from_bytes(&case.out(), &damaged);
    }
}

proptest! {
    #[test]
    fn no_bytes_are_a_library_by_accident(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(Library::from_bytes(Path::new("a.relib"), &bytes).is_err());
    }
}
