//! The measures against published implementations on the same arrays (`fixtures/metrics`), and what
//! must hold for any arrays.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::path::{Path, PathBuf};

use proptest::prelude::*;
use relight_core::files::read_planes;
use relight_core::image::{Extent, Planes};
use relight_core::metrics::{
    AngularError, Comparison, Convention, MetricError, ScaleFit, Windows, angular_error, dssim,
    intrinsic_error,
};
use serde_json::Value;

/// How far from a published implementation a measure may be.
const TOLERANCE: f64 = 1e-5;
const SMALL: Windows = Windows { side: 7, step: 3 };

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/metrics")
}

/// The plane of a grey file.
fn plane(name: &str) -> Vec<f32> {
    let (planes, _) = read_planes(&fixtures().join(name)).unwrap();
    let [plane, _, _] = planes.into_planes();
    plane
}

/// The image of which each channel has a file.
fn image(name: &str) -> Planes<3> {
    let planes = ["r", "g", "b"].map(|channel| plane(&format!("{name}-{channel}.png")));
    Planes::from_planes(Extent::new(52, 44), planes).unwrap()
}

fn mask() -> Vec<bool> {
    plane("mask.png").iter().map(|&value| value > 0.5).collect()
}

fn expected() -> Value {
    let text = std::fs::read(fixtures().join("expected.json")).unwrap();
    serde_json::from_slice(&text).unwrap()
}

fn assert_near(found: f64, expected: &Value, what: &str) {
    let expected = expected.as_f64().unwrap_or_else(|| panic!("{what}"));
    let difference = (found - expected).abs();
    assert!(difference < TOLERANCE, "{what}: {found}, not {expected}");
}

#[test]
fn squared_errors_are_those_of_their_definition() {
    let (truth, estimate, mask) = (image("truth"), image("estimate"), mask());
    let pair = Comparison::new(truth.extent(), &truth.planes(), &estimate.planes(), &mask).unwrap();
    let expected = expected();
    assert_near(pair.mse(ScaleFit::None), &expected["mse"], "MSE");
    let scaled = pair.mse(ScaleFit::Image);
    assert_near(scaled, &expected["mse_one_scale"], "SMSE");
}

#[test]
fn smse_and_lmse_are_those_of_grosse_et_al_by_either_convention() {
    let (truth, estimate, mask) = (image("truth"), image("estimate"), mask());
    let expected = expected();
    for (convention, name) in [
        (Convention::Strict, "strict"),
        (Convention::FileUnits, "file_units"),
    ] {
        for (windows, size) in [(Windows::GROSSE, "20_10"), (SMALL, "7_3")] {
            let (truth, estimate) = (truth.planes(), estimate.planes());
            let extent = Extent::new(52, 44);
            let found =
                intrinsic_error(convention, extent, &truth, &estimate, &mask, windows).unwrap();
            let expected = &expected[format!("{name}_{size}")];
            assert_near(found.smse, &expected["smse"], "SMSE");
            assert_near(found.lmse, &expected["lmse"], "LMSE");
        }
    }
}

#[test]
fn ssim_is_that_of_scikit_image() {
    let (mut truth, mut estimate, mask) = (image("truth"), image("estimate"), mask());
    let expected = expected();
    let whole = vec![true; mask.len()];
    let found = |truth: &Planes<3>, estimate: &Planes<3>, mask: &[bool]| {
        let (a, b) = (truth.planes(), estimate.planes());
        Comparison::new(truth.extent(), &a, &b, mask)
            .unwrap()
            .ssim()
    };
    let stated = &expected["ssim_gaussian"];
    let masked = found(&truth, &estimate, &mask).unwrap();
    assert_near(masked, &stated["masked"], "SSIM");
    for image in [&mut truth, &mut estimate] {
        for plane in image.planes_mut() {
            for (value, counts) in plane.iter_mut().zip(&mask) {
                *value *= f32::from(u8::from(*counts));
            }
        }
    }
    let all = found(&truth, &estimate, &whole).unwrap();
    assert_near(all, &stated["whole"], "SSIM");
}

#[test]
fn angles_between_normals_are_those_of_their_definition() {
    let signed = |name| image(name).map(|value| value * 2.0 - 1.0);
    let (truth, tilted, mask) = (signed("normal"), signed("tilted"), mask());
    let found = angular_error(truth.extent(), truth.planes(), tilted.planes(), &mask).unwrap();
    let expected = &expected()["angles"];
    assert_near(found.mean, &expected["mean"], "mean");
    assert_near(found.median, &expected["median"], "median");
    for (at, limit) in AngularError::LIMITS.into_iter().enumerate() {
        let what = format!("within {limit} degrees");
        assert_near(found.within[at], &expected["within"][at], &what);
    }
}

#[test]
fn a_truth_that_is_black_has_no_relative_error() {
    let mask = [true; 400];
    let (dark, bright) = ([0.0_f32; 400], [1.0_f32; 400]);
    let extent = Extent::new(20, 20);
    let pair = Comparison::new(extent, &[&dark], &[&bright], &mask).unwrap();
    let found = pair.lmse(ScaleFit::Image, Windows::GROSSE);
    assert_eq!(found, Err(MetricError::DarkGroundTruth));
    for convention in Convention::ALL {
        let (truth, estimate): (&[&[f32]], &[&[f32]]) = (&[&dark], &[&bright]);
        let found = intrinsic_error(convention, extent, truth, estimate, &mask, SMALL);
        assert_eq!(
            found,
            Err(MetricError::DarkGroundTruth),
            "{}",
            convention.fit().name()
        );
    }
}

#[test]
fn images_and_masks_that_hold_no_window_are_told_apart() {
    let (values, mut mask) = ([0.5_f32; 400], [false; 400]);
    mask[0] = true;
    let extent = Extent::new(20, 20);
    let pair = Comparison::new(extent, &[&values], &[&values], &mask).unwrap();
    let error = pair.ssim().unwrap_err().to_string();
    assert!(
        error.contains("11x11") && !error.contains("20x20"),
        "{error}"
    );
    let extent = Extent::new(40, 10);
    let pair = Comparison::new(extent, &[&values], &[&values], &mask).unwrap();
    for found in [pair.ssim(), pair.lmse(ScaleFit::Image, Windows::GROSSE)] {
        let error = found.unwrap_err().to_string();
        assert!(error.contains("40x10"), "{error}");
    }
}

#[test]
fn a_normal_without_length_is_named() {
    let (ones, zeros) = ([1.0_f32; 4], [0.0_f32; 4]);
    let (truth, mut estimate) = ([&ones[..]; 3], [&ones[..]; 3]);
    let hole = [1.0, 1.0, 1.0, 0.0];
    estimate[2] = &hole;
    assert!(angular_error(Extent::new(2, 2), truth, estimate, &[true; 4]).is_ok());
    let error = angular_error(Extent::new(2, 2), truth, [&zeros; 3], &[true; 4]).unwrap_err();
    for named in ["estimate", "normal", "(0, 0)"] {
        assert!(error.to_string().contains(named), "{named}: {error}");
    }
}

/// Two planes of 24 x 22 pixels and a mask that holds some of them.
fn arrays() -> impl Strategy<Value = (Vec<f32>, Vec<f32>, Vec<bool>)> {
    let pixels = 24 * 22;
    (
        prop::collection::vec(0.01_f32..1.0, pixels),
        prop::collection::vec(0.01_f32..1.0, pixels),
        prop::collection::vec(prop::bool::weighted(0.8), pixels),
    )
}

const EXTENT: Extent = Extent::new(24, 22);

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn a_fitted_scale_never_makes_the_error_larger((truth, estimate, mask) in arrays()) {
        let (a, b) = (&truth[..], &estimate[..]);
        let pair = Comparison::new(EXTENT, &[a, b], &[b, a], &mask).unwrap();
        let plain = pair.mse(ScaleFit::None);
        let image = pair.mse(ScaleFit::Image);
        prop_assert!(image <= plain + 1e-12);
        prop_assert!(pair.mse(ScaleFit::Channel) <= image + 1e-12);
    }

    #[test]
    fn scale_invariant_errors_do_not_know_the_unit_of_the_estimate(
        (truth, estimate, mask) in arrays(),
        exponent in -60_i32..60,
    ) {
        let scaled: Vec<f32> = estimate.iter().map(|v| v * 2.0_f32.powi(exponent)).collect();
        let measures = |estimate: &[f32]| {
            let pair = Comparison::new(EXTENT, &[&truth], &[estimate], &mask).unwrap();
            let lmse = pair.lmse(ScaleFit::Image, SMALL).unwrap();
            (pair.mse(ScaleFit::Image), lmse)
        };
        let (a, b) = (measures(&estimate), measures(&scaled));
        prop_assert!((a.0 - b.0).abs() < 1e-12 && (a.1 - b.1).abs() < 1e-12);
        prop_assert!((0.0..=1.0).contains(&a.1));
    }

    #[test]
    fn a_scaled_truth_has_no_scale_invariant_error(
        (truth, _, mask) in arrays(),
        gain in 0.01_f32..100.0,
    ) {
        let scaled: Vec<f32> = truth.iter().map(|value| value * gain).collect();
        let pair = Comparison::new(EXTENT, &[&truth], &[&scaled], &mask).unwrap();
        prop_assert!(pair.mse(ScaleFit::Image) < 1e-12);
        prop_assert!(pair.lmse(ScaleFit::Image, SMALL).unwrap() < 1e-12);
    }

    #[test]
    fn an_image_is_most_similar_to_itself((truth, estimate, mask) in arrays()) {
        let similarity = |a: &[f32], b: &[f32]| {
            let pair = Comparison::new(EXTENT, &[a], &[b], &mask).unwrap();
            pair.ssim().unwrap()
        };
        prop_assert!((similarity(&truth, &truth) - 1.0).abs() < 1e-12);
        let other = similarity(&truth, &estimate);
        prop_assert!((-1.0..1.0).contains(&other));
        prop_assert!((other - similarity(&estimate, &truth)).abs() < 1e-12);
        prop_assert!((0.0..=1.0).contains(&dssim(other)));
    }

    #[test]
    fn what_lies_outside_the_mask_does_not_matter((truth, estimate, mask) in arrays()) {
        let spoiled: Vec<f32> = estimate
            .iter()
            .zip(&mask)
            .map(|(&value, &counts)| if counts { value } else { f32::NAN })
            .collect();
        let measures = |estimate: &[f32]| {
            let pair = Comparison::new(EXTENT, &[&truth], &[estimate], &mask).unwrap();
            [
                pair.mse(ScaleFit::None),
                pair.lmse(ScaleFit::Image, SMALL).unwrap(),
                pair.ssim().unwrap(),
            ]
        };
        prop_assert_eq!(measures(&estimate), measures(&spoiled));
    }

    #[test]
    fn the_angle_between_vectors_does_not_know_their_lengths(
        vectors in prop::collection::vec((-1.0_f32..1.0, -1.0_f32..1.0, 0.1_f32..1.0), 9),
        gain in 0.1_f32..10.0,
    ) {
        let planes = |gain: f32| -> [Vec<f32>; 3] {
            [
                vectors.iter().map(|v| v.0 * gain).collect(),
                vectors.iter().map(|v| v.1 * gain).collect(),
                vectors.iter().map(|v| v.2 * gain).collect(),
            ]
        };
        let (a, b) = (planes(1.0), planes(gain));
        let viewer = [vec![0.0; 9], vec![0.0; 9], vec![2.0; 9]];
        let error = |a: &[Vec<f32>; 3], b: &[Vec<f32>; 3]| {
            let [a, b] = [a, b].map(|planes| planes.each_ref().map(Vec::as_slice));
            angular_error(Extent::new(3, 3), a, b, &[true; 9]).unwrap()
        };
        prop_assert!(error(&a, &b).mean < 1e-4);
        let (plain, scaled) = (error(&viewer, &a), error(&b, &viewer));
        prop_assert!((plain.mean - scaled.mean).abs() < 1e-4);
        prop_assert!(plain.mean < 90.0);
    }
}
