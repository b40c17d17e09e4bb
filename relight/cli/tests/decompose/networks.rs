//! Another network's normals, and how good the shipped weights are.

use std::fs;
use std::path::Path;

use relight_core::image::{ColourSpace, Planes, Rgb, Srgb};
use relight_core::light::{Normals, NormalsFrame, Order, ShLight, YUp};
use relight_core::metrics::{Comparison, ScaleFit, angular_error};
use relight_core::render::{DiffuseForm, DiffuseLayer};
use relight_photo::decompose::{DecomposeError, DecomposeOptions, Decomposer};
use relight_photo::files::PhotoReading;
use relight_photo::nets::paper::{Head, light_net, normal_net};
use relight_photo::nets::{NetError, WeightPrecision, Weights, decomposer, to_onnx};

use relit_data::causes::with_causes;

use crate::onnx_file::{OnnxNode, OnnxPort, integer, integers, onnx_file};
use crate::support::{Folder, load, object, untrained};

#[test]
fn normals_of_another_network_replace_ours() {
    let folder = Folder::new();
    let path = folder.save("cup.png", |path| object(0).save(path).unwrap());
    let photo = load(&path, &PhotoReading::default()).unwrap();
    let graph = normal_net();
    let weights = Weights::initial(&graph, 9);
    let single = WeightPrecision::Single;
    let file = folder.save("normals.onnx", |path| {
        fs::write(path, to_onnx(&graph, &weights, single, &[]).unwrap()).unwrap();
    });
    let decompose = |decomposer: &Decomposer| {
        let options = DecomposeOptions::default();
        decomposer
            .decompose(&photo.picture, &photo.mask, &options)
            .unwrap()
    };
    let mut net = untrained();
    let own = decompose(&net);
    net.read_normals(&file, Some(NormalsFrame::YUp)).unwrap();
    let up = decompose(&net);
    net.read_normals(&file, Some(NormalsFrame::YDown)).unwrap();
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
    fs::write(&file, to_onnx(&graph, &weights, single, &[]).unwrap()).unwrap();
    let error = net
        .read_normals(&file, Some(NormalsFrame::YUp))
        .unwrap_err();
    assert!(matches!(error, DecomposeError::Net(_)), "{error:?}");
    fs::write(&file, "no network").unwrap();
    let error = net
        .read_normals(&file, Some(NormalsFrame::YUp))
        .unwrap_err();
    assert!(
        matches!(&error, DecomposeError::Net(NetError::File { path, .. }) if *path == file),
        "{error:?}"
    );
}

fn node(kind: &'static str, input: &'static str, output: &'static str) -> OnnxNode {
    OnnxNode {
        kind,
        input,
        output,
        attributes: Vec::new(),
    }
}

fn port(name: &'static str, element: u64, sides: &[u64]) -> OnnxPort {
    let sides = sides.to_vec();
    OnnxPort {
        name,
        element,
        sides,
    }
}

/// A network in the signature of MoGe-2's published files. Its normals are the colours, turned to the viewer.
fn moge() -> Vec<u8> {
    let turned = OnnxNode {
        attributes: vec![integers("perm", &[0, 2, 3, 1])],
        ..node("Transpose", "image", "turned")
    };
    let scale = OnnxNode {
        attributes: vec![integer("to", 1)],
        ..node("Cast", "num_tokens", "metric_scale")
    };
    onnx_file(
        &[
            turned,
            node("Identity", "turned", "points"),
            node("Neg", "turned", "normal"),
            node("Sigmoid", "turned", "mask"),
            scale,
        ],
        &[port("image", 1, &[0, 3, 0, 0]), port("num_tokens", 7, &[])],
        &["points", "normal", "mask", "metric_scale"].map(|name| port(name, 1, &[])),
    )
}

/// A network in the signature of Metric3D's published files, for pictures that are wider than high. Its normals are the
/// colours.
fn metric3d() -> Vec<u8> {
    onnx_file(
        &[
            node("Neg", "pixel_values", "predicted_depth"),
            node("Identity", "pixel_values", "predicted_normal"),
            node("Sigmoid", "pixel_values", "normal_confidence"),
        ],
        &[port("pixel_values", 1, &[1, 3, 32, 48])],
        &["predicted_depth", "predicted_normal", "normal_confidence"]
            .map(|name| port(name, 1, &[])),
    )
}

#[test]
fn published_networks_are_known_by_their_names_and_taken_in_their_own_axes() {
    let folder = Folder::new();
    let path = folder.save("cup.png", |path| object(0).save(path).unwrap());
    let photo = load(&path, &PhotoReading::default()).unwrap();
    for (name, bytes) in [("MoGe-2", moge()), ("Metric3D", metric3d())] {
        let file = folder.save("normals.onnx", |path| fs::write(path, &bytes).unwrap());
        let mut net = untrained();
        assert_eq!(net.normals_network(), None);
        net.read_normals(&file, None).unwrap();
        let said = net.normals_network().unwrap();
        assert!(said.starts_with(name), "{said}");
        let options = DecomposeOptions::default();
        let found = net
            .decompose(&photo.picture, &photo.mask, &options)
            .unwrap();
        let (mut inside, mut steps) = (0, 0.0_f32);
        for at in 0..photo.mask.extent().pixels() {
            let [x, y, z] = found.normals.planes().planes().map(|plane| plane[at]);
            if photo.mask.plane(0)[at] < 0.5 {
                assert_eq!([x, y, z], [0.0; 3]);
                continue;
            }
            inside += 1;
            // OpenCV's y points down and its z away: of colours, which are positive, x is turned over too.
            let colour = photo.picture.planes().planes().map(|plane| plane[at]);
            let encoded = colour.map(Srgb::from_linear);
            let length = encoded.iter().map(|v| v * v).sum::<f32>().sqrt();
            let [r, g, b] = encoded.map(|v| v / length);
            let apart = [x + r, y - g, z - b].map(f32::abs);
            steps += apart.into_iter().fold(0.0, f32::max);
        }
        // The network sees a smaller picture, so that edges differ.
        let mean = steps / inside as f32;
        assert!(mean < 0.1, "{name}: {mean}");
    }
    let two = onnx_file(
        &[node("Identity", "left", "depth")],
        &[
            port("left", 1, &[1, 3, 32, 32]),
            port("right", 1, &[1, 3, 32, 32]),
        ],
        &[port("depth", 1, &[])],
    );
    let file = folder.save("normals.onnx", |path| fs::write(path, &two).unwrap());
    let error = untrained().read_normals(&file, None).unwrap_err();
    assert!(with_causes(&error).contains("left, right"), "{error}");
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
