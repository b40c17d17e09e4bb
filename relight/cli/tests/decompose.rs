//! Photographs in, folders of layers out. But for one test, the network is not trained: they are about files, masks,
//! encodings and faults, not about how good the layers are.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use image::{GrayImage, ImageBuffer, Luma, Rgb as Pixel, RgbImage, Rgba};
use relight_core::files::read_planes;
use relight_core::image::{Extent, Planes, Rgb, Transfer};
use relight_core::light::NormalsFrame;
use relight_core::light::{Normals, Order, Panorama, ShLight, YUp};
use relight_core::metrics::{Comparison, ScaleFit, angular_error};
use relight_core::render::{DiffuseForm, DiffuseLayer};
use relight_nets::paper::{Head, light_net, normal_net};
use relight_nets::{WeightPrecision, Weights, decomposer, to_onnx};
use relight_photo::decompose::{
    DecomposeError, DecomposeOptions, Decomposer, Decomposition, MaskSource, Photo, Rectangle,
    SpecularGate,
};
use relight_photo::files::{DecompositionFiles, PhotoInput, PhotoReading};
use relit_data::causes::with_causes;
use relit_data::geometry::Rect;
use relit_data::image_stats::MaskSpans;
use relit_data::shard::{FrameRecord, Layout, Sample, ShardWriter};

const WIDTH: u32 = 60;
const HEIGHT: u32 = 48;

fn untrained() -> Decomposer {
    Decomposer::with_side(&Weights::initial(&decomposer(), 3), 32).unwrap()
}

fn is_inside(x: u32, y: u32) -> bool {
    let distance = (f64::from(x) - 30.0).hypot(f64::from(y) - 24.0);
    distance < 20.0
}

/// An object before a background of this grey.
fn object(background: u8) -> RgbImage {
    RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        if is_inside(x, y) {
            Pixel([120 + x as u8, 100, 60 + 2 * y as u8])
        } else {
            Pixel([background; 3])
        }
    })
}

fn mask() -> GrayImage {
    GrayImage::from_fn(WIDTH, HEIGHT, |x, y| {
        Luma([if is_inside(x, y) { 255 } else { 0 }])
    })
}

fn load(path: &Path, reading: &PhotoReading) -> Result<Photo, DecomposeError> {
    PhotoInput::File(path.to_owned()).load(reading)
}

fn with_mask(path: PathBuf) -> PhotoReading {
    PhotoReading {
        mask: Some(path),
        ..PhotoReading::default()
    }
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Saves an image, and its path.
    fn save(&self, name: &str, save: impl FnOnce(&Path)) -> PathBuf {
        let path = self.path(name);
        save(&path);
        path
    }
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn decomposed(photo: &Photo, specular: SpecularGate) -> (Decomposition, DecomposeOptions) {
    let options = photo.options(&DecomposeOptions {
        specular,
        ..DecomposeOptions::default()
    });
    let found = untrained().decompose(&photo.picture, &photo.mask, &options);
    (found.unwrap(), options)
}

fn write(photo: &Photo, out: &Path) -> Result<Decomposition, DecomposeError> {
    let (found, options) = decomposed(photo, SpecularGate::On);
    let files = DecompositionFiles {
        photo,
        found: &found,
        options: &options,
        weights: "untrained",
    };
    files.write(out)?;
    Ok(found)
}

#[test]
fn a_folder_holds_every_layer_the_light_and_the_figures() {
    let folder = Folder::new();
    let path = folder.save("cup.png", |path| object(0).save(path).unwrap());
    let photo = load(&path, &PhotoReading::default()).unwrap();
    assert_eq!(photo.mask_source, MaskSource::BlackBackground);
    let out = folder.path("sub/cup");
    let found = write(&photo, &out).unwrap();
    let expected = [
        "albedo.png",
        "contact.png",
        "decomposition.json",
        "diffuse.png",
        "light-panorama.exr",
        "light-sphere.png",
        "light.txt",
        "mask.png",
        "normal.png",
        "shading.png",
        "specular.png",
    ];
    assert_eq!(names_in(&out), expected);
    assert_eq!(names_in(&folder.path("sub")), ["cup"]);

    let json = fs::read(out.join("decomposition.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(json["schema"], "relight.decomposition/1");
    assert_eq!(json["mask"]["source"], "black-background");
    assert_eq!(json["size"], serde_json::json!([WIDTH, HEIGHT]));
    assert_eq!(json["light"]["coefficients"].as_array().unwrap().len(), 9);
    assert_eq!(json["specular"]["separated"], true);

    // What the files hold is what was found, in the file's white.
    for (name, layer) in [("albedo", &found.albedo), ("diffuse", &found.diffuse)] {
        let white = json["white"][name].as_f64().unwrap() as f32;
        let file = Rgb::read(&out.join(format!("{name}.png")), Transfer::Srgb).unwrap();
        for (a, b) in file.planes().plane(0).iter().zip(layer.planes().plane(0)) {
            assert!((a * white - b).abs() < 1e-3 * white, "{name}: {a} {b}");
        }
    }
    let normals = Normals::<YUp>::read(&out.join("normal.png")).unwrap();
    let pairs = normals
        .planes()
        .plane(1)
        .iter()
        .zip(found.normals.planes().plane(1));
    assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-3));
    assert_eq!(ShLight::read(&out.join("light.txt")).unwrap(), found.light);
    Panorama::read(&out.join("light-panorama.exr")).unwrap();
    let (contact, _) = read_planes(&out.join("contact.png")).unwrap();
    assert_eq!(contact.extent(), Extent::new(4 * 256, 2 * 256));
}

#[test]
fn an_earlier_decomposition_is_replaced_and_nothing_else() {
    let folder = Folder::new();
    let path = folder.save("cup.png", |path| object(0).save(path).unwrap());
    let photo = load(&path, &PhotoReading::default()).unwrap();
    let out = folder.path("out");
    write(&photo, &out).unwrap();
    fs::write(out.join("albedo.png"), "old").unwrap();
    write(&photo, &out).unwrap();
    assert!(fs::read(out.join("albedo.png")).unwrap().len() > 100);

    fs::write(out.join("notes.txt"), "mine").unwrap();
    fs::write(out.join("albedo.png"), "old").unwrap();
    let text = write(&photo, &out).unwrap_err().to_string();
    assert!(
        text.contains("out holds notes.txt, which is no file of"),
        "{text}"
    );
    assert_eq!(fs::read(out.join("notes.txt")).unwrap(), b"mine");
    assert_eq!(fs::read(out.join("albedo.png")).unwrap(), b"old");
    fs::remove_file(out.join("notes.txt")).unwrap();
    fs::create_dir(out.join("mask.png.d")).unwrap();
    assert!(write(&photo, &out).is_err());

    let foreign = folder.path("foreign");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("albedo.png"), "mine").unwrap();
    let text = write(&photo, &foreign).unwrap_err().to_string();
    assert!(text.contains("foreign holds albedo.png"), "{text}");
    assert_eq!(names_in(&foreign), ["albedo.png"]);
    for path in [path.clone(), path.join("in")] {
        let text = write(&photo, &path).unwrap_err().to_string();
        assert!(text.contains("cup.png cannot be the folder"), "{text}");
    }
    let empty = folder.path("empty");
    fs::create_dir(&empty).unwrap();
    write(&photo, &empty).unwrap();
    assert_eq!(
        names_in(folder.0.path()),
        ["cup.png", "empty", "foreign", "out"]
    );
}

#[test]
fn alpha_is_the_mask_and_what_it_hides_does_not_count() {
    let folder = Folder::new();
    let with_alpha = |hidden: u8| {
        let picture = object(hidden);
        ImageBuffer::from_fn(WIDTH, HEIGHT, |x, y| {
            let Pixel([r, g, b]) = *picture.get_pixel(x, y);
            Rgba([r, g, b, if is_inside(x, y) { 255 } else { 0 }])
        })
    };
    let found: Vec<_> = [0, 255]
        .into_iter()
        .map(|hidden| {
            let path = folder.save(&format!("{hidden}.png"), |path| {
                with_alpha(hidden).save(path).unwrap();
            });
            let photo = load(&path, &PhotoReading::default()).unwrap();
            assert_eq!(photo.mask_source, MaskSource::Alpha);
            decomposed(&photo, SpecularGate::Auto).0
        })
        .collect();
    assert_eq!(found[0], found[1]);
}

/// Writes a PNG of 16 bits with what is given as a chunk gAMA.
fn write_gamma(path: &Path, values: &[u16], gamma: f32) {
    let file = BufWriter::new(File::create(path).unwrap());
    let mut encoder = png::Encoder::new(file, WIDTH, HEIGHT);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.set_source_gamma(png::ScaledFloat::new(gamma));
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
    encoder
        .write_header()
        .unwrap()
        .write_image_data(&bytes)
        .unwrap();
}

#[test]
fn a_file_says_itself_whether_it_is_linear() {
    let folder = Folder::new();
    let mask = folder.save("mask.png", |path| mask().save(path).unwrap());
    let values = vec![0x8000_u16; (3 * WIDTH * HEIGHT) as usize];
    let value = |gamma: f32, transfer: Option<Transfer>| {
        let path = folder.save("photo.png", |path| write_gamma(path, &values, gamma));
        let reading = PhotoReading {
            transfer,
            ..with_mask(mask.clone())
        };
        Ok::<f32, DecomposeError>(load(&path, &reading)?.picture.planes().plane(0)[0])
    };
    assert!((value(1.0, None).unwrap() - 0.5).abs() < 1e-4);
    assert!((value(1.0 / 2.2, None).unwrap() - 0.2140).abs() < 1e-3);
    assert!((value(1.0, Some(Transfer::Srgb)).unwrap() - 0.2140).abs() < 1e-3);
    assert!((value(1.0, Some(Transfer::Gamma22)).unwrap() - 0.2176).abs() < 1e-3);
    let text = value(1.0 / 1.8, None).unwrap_err().to_string();
    assert!(
        text.contains("1 / 1.8") && text.contains("--transfer"),
        "{text}"
    );

    let exr = folder.save("photo.exr", |path| {
        let bright = ImageBuffer::from_fn(WIDTH, HEIGHT, |_, _| Pixel([3.0_f32, 0.5, 0.25]));
        image::DynamicImage::ImageRgb32F(bright).save(path).unwrap();
    });
    let photo = load(&exr, &with_mask(mask)).unwrap();
    assert_eq!(photo.picture.planes().pixel(5, 5), [3.0, 0.5, 0.25]);
}

#[test]
fn a_png_of_high_dynamic_range_is_not_taken_for_srgb() {
    let folder = Folder::new();
    let mask = folder.save("mask.png", |path| mask().save(path).unwrap());
    let load = |function: u8, transfer: Option<Transfer>| {
        let path = folder.save("photo.png", |path| {
            let file = BufWriter::new(File::create(path).unwrap());
            let mut encoder = png::Encoder::new(file, WIDTH, HEIGHT);
            encoder.set_color(png::ColorType::Rgb);
            let mut writer = encoder.write_header().unwrap();
            let points = [9, function, 0, 1];
            let cicp = png::chunk::ChunkType(*b"cICP");
            writer.write_chunk(cicp, &points).unwrap();
            writer.write_image_data(object(0).as_raw()).unwrap();
        });
        let reading = PhotoReading {
            transfer,
            ..with_mask(mask.clone())
        };
        load(&path, &reading).map(|photo| photo.picture.planes().pixel(30, 24)[0])
    };
    let srgb = load(13, None).unwrap();
    assert!(load(8, None).unwrap() > 1.2 * srgb);
    for (function, name) in [(16, "PQ"), (18, "HLG"), (9, "logarithm"), (77, "unknown")] {
        let text = load(function, None).unwrap_err().to_string();
        assert!(text.contains(name) && text.contains("--transfer"), "{text}");
        assert_eq!(load(function, Some(Transfer::Srgb)).unwrap(), srgb);
    }
    for same in [1, 2] {
        assert_eq!(load(same, None).unwrap(), srgb);
    }
}

#[test]
fn a_mask_is_a_files_brightest_channel_or_its_alpha() {
    let folder = Folder::new();
    let photo = folder.save("photo.png", |path| object(90).save(path).unwrap());
    let plain = folder.save("plain.png", |path| mask().save(path).unwrap());
    let wanted = load(&photo, &with_mask(plain)).unwrap().mask;
    let level = |x, y, inside: u8, outside: u8| if is_inside(x, y) { inside } else { outside };
    let blue = folder.save("blue.png", |path| {
        let pixel = |x, y| Pixel([0, 0, level(x, y, 255, 0)]);
        RgbImage::from_fn(WIDTH, HEIGHT, pixel).save(path).unwrap();
    });
    // A dark object that was cut out.
    let cut = folder.save("cut.png", |path| {
        let pixel = |x, y| Rgba([30, 20, 10, level(x, y, 255, 0)]);
        ImageBuffer::from_fn(WIDTH, HEIGHT, pixel)
            .save(path)
            .unwrap();
    });
    let hardly_transparent = folder.save("hardly.png", |path| {
        let pixel = |x, y| {
            let white = level(x, y, 255, 0);
            Rgba([white, white, white, level(x, y, 255, 250)])
        };
        ImageBuffer::from_fn(WIDTH, HEIGHT, pixel)
            .save(path)
            .unwrap();
    });
    for path in [blue, cut, hardly_transparent] {
        let name = path.display().to_string();
        let found = load(&photo, &with_mask(path)).unwrap();
        assert_eq!(found.mask, wanted, "{name}");
    }
}

#[test]
fn an_object_without_light_is_not_decomposed() {
    let folder = Folder::new();
    let black = folder.save("black.png", |path| {
        RgbImage::new(WIDTH, HEIGHT).save(path).unwrap();
    });
    let numberless = folder.save("nan.exr", |path| {
        let nan = ImageBuffer::from_pixel(WIDTH, HEIGHT, Pixel([f32::NAN; 3]));
        image::DynamicImage::ImageRgb32F(nan).save(path).unwrap();
    });
    let reading = PhotoReading {
        rectangle: Some(Rectangle {
            x: 5,
            y: 5,
            width: 30,
            height: 30,
        }),
        ..PhotoReading::default()
    };
    for path in [black, numberless] {
        let photo = load(&path, &reading).unwrap();
        let found = untrained().decompose(
            &photo.picture,
            &photo.mask,
            &photo.options(&DecomposeOptions::default()),
        );
        assert!(matches!(found, Err(DecomposeError::Unlit)));
        let found = load(&path, &PhotoReading::default());
        assert!(matches!(found, Err(DecomposeError::Black { .. })));
    }
}

#[test]
fn a_rectangle_is_the_mask_where_nothing_else_is() {
    let folder = Folder::new();
    let path = folder.save("grey.png", |path| object(90).save(path).unwrap());
    let reading = PhotoReading {
        rectangle: Some(Rectangle {
            x: 10,
            y: 4,
            width: 40,
            height: 40,
        }),
        ..PhotoReading::default()
    };
    let photo = load(&path, &reading).unwrap();
    assert_eq!(photo.mask_source, MaskSource::Rectangle);
    assert_eq!(photo.mask.plane(0).iter().sum::<f32>(), 1600.0);
}

#[test]
fn what_is_wrong_with_a_photograph_is_said_in_a_sentence() {
    let folder = Folder::new();
    let grey = folder.save("grey.png", |path| object(90).save(path).unwrap());
    let black = folder.save("black.png", |path| RgbImage::new(8, 8).save(path).unwrap());
    let small = folder.save("small.png", |path| GrayImage::new(8, 8).save(path).unwrap());
    let none = folder.save("none.png", |path| {
        GrayImage::new(WIDTH, HEIGHT).save(path).unwrap()
    });
    let text = folder.save("text.png", |path| fs::write(path, "hello").unwrap());
    let full = folder.path("full");
    fs::create_dir(&full).unwrap();
    GrayImage::new(WIDTH, HEIGHT)
        .save(full.join("grey.png"))
        .unwrap();
    let cup = folder.save("cup.png", |path| object(0).save(path).unwrap());
    let in_corner = PhotoReading {
        rectangle: Some(Rectangle {
            x: 0,
            y: 0,
            width: 2,
            height: 2,
        }),
        ..PhotoReading::default()
    };
    let beside = PhotoReading {
        rectangle: Some(Rectangle {
            x: 100,
            y: 0,
            width: 5,
            height: 5,
        }),
        ..PhotoReading::default()
    };
    let plain = PhotoReading::default();
    for (path, reading, expected) in [
        (&grey, plain.clone(), "Make a mask with `relit-mask`"),
        (&black, plain.clone(), "black.png is black all over"),
        (
            &cup,
            in_corner,
            "in the rectangle 0,0,2,2 there is nothing of the object",
        ),
        (
            &grey,
            with_mask(small),
            "the mask has 8 x 8 pixels, and the photograph 60 x 48",
        ),
        (&grey, with_mask(none), "the mask is empty"),
        (
            &grey,
            with_mask(folder.path("no.png")),
            "no.png cannot be read",
        ),
        (&grey, with_mask(full), "the mask is empty"),
        (&grey, beside, "100,0,5,5 does not touch the photograph"),
        (&text, plain.clone(), "is not a readable PNG"),
        (&folder.path("gone.png"), plain, "gone.png cannot be read"),
    ] {
        let error = load(path, &reading).map(|photo| photo.name).unwrap_err();
        let found = with_causes(&error);
        assert!(found.contains(expected), "{found}");
    }
    let huge = folder.save("huge.png", |path| {
        let file = BufWriter::new(File::create(path).unwrap());
        let encoder = png::Encoder::new(file, 9000, 8000);
        let mut writer = encoder.write_header().unwrap();
        writer.write_chunk(png::chunk::IDAT, &[0x78, 0x9c]).unwrap();
    });
    let error = load(&huge, &PhotoReading::default()).map(|photo| photo.name);
    let text = error.unwrap_err().to_string();
    assert!(
        text.contains("9000 x 8000 pixels, and at most 64000000"),
        "{text}"
    );
    let masks = folder.path("masks");
    fs::create_dir(&masks).unwrap();
    let error = load(&grey, &with_mask(masks.clone())).map(|photo| photo.name);
    assert!(error.unwrap_err().to_string().ends_with("masks/grey.png"));
    let find = |paths: &[&PathBuf]| {
        let paths: Vec<PathBuf> = paths.iter().map(|path| (*path).clone()).collect();
        PhotoInput::find(&paths, None).map(|found| found.len())
    };
    assert!(
        find(&[&masks])
            .unwrap_err()
            .to_string()
            .contains("holds no photographs")
    );
    let twice = find(&[&grey, &masks.join("grey.jpg")]).unwrap_err();
    assert!(twice.to_string().contains("would both be written to grey"));
}

const SESSION: &str = "20261120T093015Z-mug";

/// A shard of three frames, and its path.
fn write_shard(folder: &Path) -> PathBuf {
    let mut writer = ShardWriter::create(folder, Layout::Webdataset, SESSION, 3, &mask()).unwrap();
    for (index, saturated) in [(0, 0.01), (1, 0.2), (2, 0.0)] {
        writer.push(sample(index, saturated)).unwrap();
    }
    writer.finish().unwrap();
    folder.join(format!("{SESSION}.tar"))
}

fn sample(index: u32, saturated: f64) -> Sample {
    let image = RgbImage::from_fn(WIDTH, HEIGHT, |x, y| match is_inside(x, y) {
        true => *object(0).get_pixel(x, y),
        false => Pixel([0; 3]),
    });
    let measures = MaskSpans::of(&mask()).measure(&image, 250).unwrap();
    let record = FrameRecord {
        session: SESSION.to_owned(),
        object: "mug".to_owned(),
        index,
        source_frame: u64::from(index),
        t_us: 0,
        angle_deg: None,
        duplicate: false,
        crop: Rect::new(0, 0, WIDTH, HEIGHT),
        size: [WIDTH, HEIGHT],
        shift_px: None,
        shift_applied: false,
        align_confidence: None,
        mask_px: measures.mask_px,
        saturated_px: (saturated * measures.mask_px as f64) as u64,
        saturated_fraction: saturated,
        saturated_any_px: 0,
        spec_net: saturated > 0.05,
        mean_rgb: measures.mean_rgb,
        sharpness: measures.sharpness,
        exposure_step: None,
        identical_to: None,
        blur: None,
    };
    Sample::encode(record, image).unwrap()
}

#[test]
fn frames_of_a_shard_have_its_mask_and_the_saturation_that_was_counted_on_the_video() {
    let folder = Folder::new();
    let name = SESSION;
    let shard = write_shard(folder.0.path());
    let inputs = PhotoInput::find(std::slice::from_ref(&shard), None).unwrap();
    assert_eq!(inputs.len(), 3);
    assert_eq!(PhotoInput::find(&[shard], Some(2)).unwrap().len(), 2);
    let photos = inputs
        .iter()
        .map(|input| input.load(&PhotoReading::default()).unwrap());
    let mut found: Vec<(String, bool)> = photos
        .map(|photo| {
            assert_eq!(photo.mask_source, MaskSource::Shard);
            let glossy = decomposed(&photo, SpecularGate::Auto).0.is_glossy;
            (photo.name, glossy)
        })
        .collect();
    found.sort();
    let expected = [("0000", false), ("0001", true), ("0002", false)];
    let expected = expected.map(|(index, glossy)| (format!("{name}/{index}"), glossy));
    assert_eq!(found, expected);
}

#[test]
fn shards_whose_frames_have_the_same_names_are_refused_together() {
    let folder = Folder::new();
    let [first, second] = ["first", "second"].map(|name| {
        fs::create_dir(folder.path(name)).unwrap();
        write_shard(&folder.path(name))
    });
    let find = |paths: &[&Path]| {
        let paths: Vec<PathBuf> = paths.iter().map(|path| path.to_path_buf()).collect();
        PhotoInput::find(&paths, None).map(|found| found.len())
    };
    assert_eq!(find(&[&first]).unwrap(), 3);
    let renamed = folder.path("second/other.tar");
    fs::rename(&second, &renamed).unwrap();
    let text = find(&[&first, &renamed]).unwrap_err().to_string();
    for part in ["first/", "second/other.tar", SESSION] {
        assert!(text.contains(part), "{text}");
    }
    let photo = folder.path(&format!("{SESSION}.png"));
    object(0).save(&photo).unwrap();
    assert!(find(&[&photo, &first]).is_err());
}

#[test]
fn a_folder_of_photographs_and_shards_gives_both() {
    let folder = Folder::new();
    write_shard(folder.0.path());
    folder.save("cup.png", |path| object(0).save(path).unwrap());
    let found = PhotoInput::find(&[folder.0.path().to_owned()], Some(2)).unwrap();
    let names = found
        .iter()
        .map(|input| input.load(&PhotoReading::default()).unwrap().name);
    let mut names: Vec<String> = names.collect();
    names.sort();
    assert_eq!(names.len(), 3);
    assert_eq!(names[2], "cup");
    assert!(names[..2].iter().all(|name| name.starts_with(SESSION)));
}

#[test]
fn normals_of_another_network_replace_ours() {
    let folder = Folder::new();
    let path = folder.save("cup.png", |path| object(0).save(path).unwrap());
    let photo = load(&path, &PhotoReading::default()).unwrap();
    let graph = normal_net();
    let weights = Weights::initial(&graph, 9);
    let file = folder.save("normals.onnx", |path| {
        fs::write(path, to_onnx(&graph, &weights, 1, (32, 32)).unwrap()).unwrap();
    });
    let decompose = |decomposer: &Decomposer| {
        let options = DecomposeOptions::default();
        decomposer
            .decompose(&photo.picture, &photo.mask, &options)
            .unwrap()
    };
    let mut net = untrained();
    let own = decompose(&net);
    net.read_normals(&file, NormalsFrame::YUp).unwrap();
    let up = decompose(&net);
    net.read_normals(&file, NormalsFrame::YDown).unwrap();
    let down = decompose(&net);
    assert_eq!(own.albedo, up.albedo);
    assert_ne!(own.normals, up.normals);
    let apart = |a: &[f32], b: &[f32]| {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a + b).abs())
            .fold(0.0, f32::max)
    };
    let [up, down] = [up, down].map(|found| found.normals.planes().plane(1).to_vec());
    assert!(apart(&up, &down) < 1e-5);

    let graph = light_net(Head::Pooled);
    let weights = Weights::initial(&graph, 9);
    fs::write(&file, to_onnx(&graph, &weights, 1, (32, 32)).unwrap()).unwrap();
    let error = net.read_normals(&file, NormalsFrame::YUp).unwrap_err();
    assert!(
        error.to_string().contains("does not answer a picture"),
        "{error}"
    );
    fs::write(&file, "no network").unwrap();
    let error = net.read_normals(&file, NormalsFrame::YUp).unwrap_err();
    assert!(
        error.to_string().contains("normals.onnx cannot be run"),
        "{error}"
    );
}

/// How far normals and shading are from the ground truth, over how far those are that say nothing: normals towards the
/// viewer, and constant shading.
struct Quality {
    normals: f64,
    shading: f64,
}

/// The quality of the layers of a painted ball in the light of a lamp.
fn quality(weights: &Weights) -> Quality {
    let truth = Normals::<YUp>::sphere(120);
    let extent = truth.extent();
    let mut light = ShLight::even(Order::TWO, [0.25; 3]);
    for (at, value) in [(1, 0.35), (2, 0.35), (3, -0.3)] {
        light.coefficients_mut()[at] = [value; 3];
    }
    let shading = DiffuseLayer::new(&light, DiffuseForm::Irradiance).shading(&truth);
    let picture = Planes::from_fn(extent, |x, y| {
        let paint = match (x / 24 + y / 24) % 3 {
            0 => [0.7, 0.65, 0.6],
            1 => [0.6, 0.25, 0.2],
            _ => [0.2, 0.3, 0.5],
        };
        let [shading, ..] = shading.planes().pixel(x, y);
        paint.map(|paint| paint * shading)
    });
    let is_ball: Vec<bool> = truth.planes().plane(2).iter().map(|&z| z > 0.0).collect();
    let mask = Planes::from_planes(
        extent,
        [is_ball.iter().map(|&m| f32::from(u8::from(m))).collect()],
    );
    let decomposer = Decomposer::with_side(weights, 128).unwrap();
    let options = DecomposeOptions::default();
    let found = decomposer
        .decompose(&Rgb::new(picture), &mask.unwrap(), &options)
        .unwrap();

    let angle = |estimate: [&[f32]; 3]| {
        let truth = truth.planes().planes();
        angular_error(extent, truth, estimate, &is_ball)
            .unwrap()
            .mean
    };
    let flat = Planes::filled(extent, [0.0, 0.0, 1.0]);
    let error = |estimate: &[f32]| {
        let truth = [shading.planes().plane(0)];
        let pair = Comparison::new(extent, &truth, &[estimate], &is_ball).unwrap();
        pair.mse(ScaleFit::Image)
    };
    Quality {
        normals: angle(found.normals.planes().planes()) / angle(flat.planes()),
        shading: error(found.shading.plane(0)) / error(flat.plane(2)),
    }
}

/// The weights that the program comes with.
fn shipped() -> Weights {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("weights/decompose.safetensors");
    Weights::read(&path).unwrap()
}

#[test]
fn the_shipped_weights_find_shape_and_shading_and_untrained_ones_do_not() {
    let shipped = quality(&shipped());
    assert!(shipped.normals < 0.6, "normals: {}", shipped.normals);
    assert!(shipped.shading < 0.4, "shading: {}", shipped.shading);
    let untrained = quality(&Weights::initial(&decomposer(), 3));
    assert!(untrained.normals > 0.8, "normals: {}", untrained.normals);
    assert!(untrained.shading > 0.8, "shading: {}", untrained.shading);
}

fn relight(folder: &Folder, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_relight"))
        .args(arguments.split(' '))
        .current_dir(folder.0.path())
        .output()
        .unwrap()
}

fn code_and_errors(output: &Output) -> (i32, String) {
    let errors = String::from_utf8(output.stderr.clone()).unwrap();
    (output.status.code().unwrap(), errors)
}

#[test]
fn the_program_decomposes_what_it_can_and_names_what_it_left_out() {
    let folder = Folder::new();
    let weights = Weights::initial(&decomposer(), 3);
    weights
        .write(&folder.path("w.safetensors"), WeightPrecision::Half)
        .unwrap();
    fs::create_dir(folder.path("photos")).unwrap();
    object(0).save(folder.path("photos/black.png")).unwrap();
    object(90).save(folder.path("photos/grey.png")).unwrap();
    let command = "decompose photos -o out --weights w.safetensors --no-mirror --json";
    let output = relight(&folder, command);
    let (code, errors) = code_and_errors(&output);
    assert_eq!(code, 3, "{errors}");
    assert!(errors.contains("photos/grey.png"), "{errors}");
    assert_eq!(names_in(&folder.path("out")), ["black"]);
    let lines = String::from_utf8(output.stdout).unwrap();
    let events: Vec<serde_json::Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    // Side by side: in the order in which they were done.
    let of = |name: &str| events.iter().find(|event| event["event"] == name);
    assert_eq!(
        of("decomposed").unwrap()["figures"]["weights"],
        "w.safetensors"
    );
    assert_eq!(of("failed").unwrap()["photo"], "photos/grey.png");
    assert_eq!(events.len(), 2);

    fs::create_dir(folder.path("shards")).unwrap();
    write_shard(&folder.path("shards"));
    for (command, code, expected) in [
        (
            "decompose shards --rect 1,2,3,4 -o o",
            2,
            "--rect is for photographs",
        ),
        (
            "decompose shards/20261120T093015Z-mug.tar --transfer linear -o o",
            2,
            "--transfer is for photographs",
        ),
        (
            "decompose photos shards --mask photos -o o",
            2,
            "Usage: relight decompose [OPTIONS]",
        ),
        (
            "decompose photos --count 3 -o o",
            2,
            "--count is for shards",
        ),
        (
            "weights export w.safetensors -o w.txt",
            2,
            "Usage: relight weights export [OPTIONS]",
        ),
        (
            "decompose photos -o w.safetensors --weights w.safetensors",
            1,
            "w.safetensors cannot be the folder for the results",
        ),
        (
            "decompose photos/black.png -o o --weights none.pth",
            1,
            "none.pth could not be read",
        ),
        (
            "decompose photos --mask w.safetensors -o o",
            2,
            "give a folder of masks",
        ),
        (
            "decompose photos/black.png --rect 1,2,3 -o o",
            2,
            "give X,Y,W,H",
        ),
        ("decompose photos/black.png", 2, "--output"),
        (
            "weights export w.safetensors -o w.txt",
            2,
            "give .onnx or .safetensors",
        ),
        (
            "weights export w.safetensors --net normal-net -o w.onnx",
            1,
            "another network's",
        ),
    ] {
        let (found, errors) = code_and_errors(&relight(&folder, command));
        assert_eq!(found, code, "{command}: {errors}");
        assert!(errors.contains(expected), "{command}: {errors}");
    }
    assert!(!folder.path("o").exists() && !folder.path("w.onnx").exists());

    let command = "weights export w.safetensors -o w.onnx --size 64";
    assert_eq!(
        code_and_errors(&relight(&folder, command)),
        (0, String::new())
    );
    assert!(fs::metadata(folder.path("w.onnx")).unwrap().len() > 1_000_000);
}

#[test]
fn photographs_side_by_side_come_out_as_one_by_one() {
    let folder = Folder::new();
    let weights = Weights::initial(&decomposer(), 3);
    weights
        .write(&folder.path("w.safetensors"), WeightPrecision::Half)
        .unwrap();
    fs::create_dir(folder.path("photos")).unwrap();
    for (name, shade) in [("a", 0), ("b", 3), ("c", 6), ("d", 90), ("e", 9)] {
        object(shade)
            .save(folder.path(&format!("photos/{name}.png")))
            .unwrap();
    }
    for threads in ["1", "3"] {
        let command =
            format!("decompose photos --weights w.safetensors --threads {threads} -o {threads}");
        let (code, errors) = code_and_errors(&relight(&folder, &command));
        assert_eq!((code, errors.lines().count()), (3, 1), "{errors}");
        assert!(errors.contains("photos/d.png"), "{errors}");
    }
    assert_eq!(names_in(&folder.path("1")), ["a", "b", "c", "e"]);
    for name in names_in(&folder.path("1")) {
        let [one, three] = ["1", "3"].map(|threads| folder.path(threads).join(&name));
        assert_eq!(names_in(&one), names_in(&three));
        for file in names_in(&one) {
            let [one, three] = [&one, &three].map(|results| fs::read(results.join(&file)).unwrap());
            assert!(one == three, "{name}/{file}");
        }
    }
}
