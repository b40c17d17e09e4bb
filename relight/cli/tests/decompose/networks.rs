//! How good the shipped weights are.

use std::path::Path;

use relight_core::image::{Planes, Rgb};
use relight_core::light::{Normals, Order, ShLight};
use relight_core::metrics::{Comparison, ScaleFit, angular_error};
use relight_core::render::{DiffuseForm, DiffuseLayer};
use relight_photo::decompose::{DecomposeOptions, Decomposer};
use relight_photo::nets::{Weights, decomposer};

/// How far normals and shading are from the ground truth, over how far those are that say nothing: normals towards the
/// viewer, and constant shading.
struct Quality {
    normals: f64,
    shading: f64,
}

/// The quality of the layers of a painted ball in the light of a lamp.
fn quality(weights: &Weights) -> Quality {
    let truth = Normals::sphere(120);
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
