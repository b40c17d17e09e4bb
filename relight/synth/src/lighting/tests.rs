//! Light on balls and planes, held against formulas.

use std::f32::consts::PI;

use glam::{Affine3A, Quat, Vec3};

use super::*;
use crate::geometry::{GBuffer, Occluder};
use crate::mesh::{Mesh, RawMesh};
use crate::shape::ShapeKind;
use crate::vectors::direction;
use crate::view::Projection;
use relight_core::image::{Extent, Planes, Rgb};
use relight_core::light::{Direction, Panorama, Rotation, basis};

const SIZE: u32 = 64;

fn ball() -> (Mesh, Affine3A) {
    let at = Affine3A::from_scale(Vec3::splat(0.95));
    (ShapeKind::Sphere.build(0), at)
}

fn ball_scene() -> SyntheticScene {
    let (mesh, at) = ball();
    let buffer = GBuffer::render(&mesh, at, Projection::Orthographic, SIZE);
    SyntheticScene::shaded(buffer, Occluder::new(&mesh, at), 16, 3)
}

/// A square in the plane z = 0, to ±0.7, and a ball of radius 0.2 that floats over its middle.
const BALL: f32 = 0.2;
const HEIGHT: f32 = 0.5;

fn floor_scene() -> SyntheticScene {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let raw = RawMesh {
        positions: corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..RawMesh::default()
    };
    let plane = Mesh::new(raw, 1.0).unwrap();
    let buffer = GBuffer::render(&plane, Affine3A::IDENTITY, Projection::Orthographic, SIZE);
    let scale = Vec3::splat(BALL);
    let lifted = Affine3A::from_scale_rotation_translation(scale, Quat::IDENTITY, Vec3::Z * HEIGHT);
    SyntheticScene::shaded(
        buffer,
        Occluder::new(&ShapeKind::Sphere.build(0), lifted),
        256,
        3,
    )
}

fn white(scene: &SyntheticScene, gloss: Option<BlinnPhong>) -> Material {
    Material {
        albedo: vec![Vec3::ONE; scene.buffer().len()],
        normals: scene.buffer().normals.to_vec(),
        gloss,
    }
}

fn distant(towards: Vec3, rays: u32, half_angle: f32) -> SyntheticLamp {
    SyntheticLamp {
        emitter: Emitter::Distant {
            towards,
            half_angle,
        },
        irradiance: Vec3::new(1.0, 2.0, 0.5),
        rays,
    }
}

fn only_lamp(lamp: SyntheticLamp) -> Lighting {
    Lighting {
        lamps: vec![lamp],
        has_shadows: true,
        ..Lighting::default()
    }
}

fn lit(
    scene: &SyntheticScene,
    lighting: &Lighting,
    panoramas: &Panoramas,
    gloss: Option<BlinnPhong>,
) -> Shaded {
    scene.light(&white(scene, gloss), lighting, panoramas, 7)
}

#[test]
fn a_lamp_lights_a_ball_by_the_cosine_and_never_its_far_side() {
    let towards = Vec3::new(0.6, 0.64, 0.48);
    let scene = ball_scene();
    let shaded = lit(
        &scene,
        &only_lamp(distant(towards, 1, 0.0)),
        &Panoramas::default(),
        None,
    );
    for (point, shading) in scene.buffer().points.iter().zip(&shaded.shading) {
        // The sphere's own normal, not the buffer's.
        let cosine = (*point / 0.95).dot(towards).max(0.0);
        assert!((shading.x - cosine).abs() < 0.01, "{shading} for {cosine}");
        assert!((shading.y - 2.0 * shading.x).abs() < 1e-6);
    }
}

#[test]
fn a_lamp_s_highlight_is_blinn_and_phong_s() {
    let towards = Vec3::new(-0.48, 0.6, 0.64);
    let gloss = BlinnPhong {
        reflectance: Vec3::new(0.5, 0.25, 1.0),
        exponent: 20.0,
    };
    let scene = ball_scene();
    let lamp = distant(towards, 1, 0.0);
    let shaded = lit(&scene, &only_lamp(lamp), &Panoramas::default(), Some(gloss));
    let half = (towards + Vec3::Z).normalize();
    for (point, highlight) in scene.buffer().points.iter().zip(&shaded.highlight) {
        let normal = *point / 0.95;
        let is_lit = normal.dot(towards) > 0.02;
        let lobe = normal.dot(half).max(0.0).powi(20);
        if is_lit {
            assert!(
                (highlight.x - 0.5 * lobe).abs() < 0.02,
                "{highlight} for {lobe}"
            );
        }
        assert!((highlight.y - highlight.x).abs() < 1e-6);
    }
}

#[test]
fn a_ball_casts_its_shadow_where_rays_to_the_lamp_meet_it() {
    let towards = Vec3::new(0.36, 0.48, 0.8);
    let scene = floor_scene();
    let shaded = lit(
        &scene,
        &only_lamp(distant(towards, 1, 0.0)),
        &Panoramas::default(),
        None,
    );
    let mut in_shadow = 0;
    for (point, shading) in scene.buffer().points.iter().zip(&shaded.shading) {
        let from = Vec3::Z * HEIGHT - *point;
        let passes_at = (from - towards * from.dot(towards)).length();
        if (passes_at - BALL).abs() < 0.01 {
            continue;
        }
        let expected = if passes_at < BALL { 0.0 } else { 0.8 };
        assert!((shading.x - expected).abs() < 1e-5, "{point}: {shading}");
        in_shadow += usize::from(expected == 0.0);
    }
    assert!(in_shadow > 50);
}

#[test]
fn without_shadows_only_what_faces_away_is_dark() {
    let lighting = Lighting {
        has_shadows: false,
        ..only_lamp(distant(Vec3::new(0.36, 0.48, 0.8), 1, 0.0))
    };
    let shaded = lit(&floor_scene(), &lighting, &Panoramas::default(), None);
    assert!(shaded.shading.iter().all(|s| (s.x - 0.8).abs() < 1e-5));
}

/// Under an even disc of radius r at height h, parallel to the floor, the irradiance on its axis is
/// h^2 / (h^2 + r^2) of that of a point of the same strength.
#[test]
fn a_disc_lights_the_floor_below_it_as_the_integral_says() {
    let (height, radius) = (2.0, 1.5);
    let lamp = SyntheticLamp {
        emitter: Emitter::Disc {
            centre: Vec3::Z * height,
            radius,
        },
        irradiance: Vec3::ONE,
        rays: 64,
    };
    let lighting = Lighting {
        has_shadows: false,
        ..only_lamp(lamp)
    };
    let scene = floor_scene();
    let shaded = lit(&scene, &lighting, &Panoramas::default(), None);
    let expected = height * height / (height * height + radius * radius);
    for (point, shading) in scene.buffer().points.iter().zip(&shaded.shading) {
        if point.truncate().length() < 0.05 {
            assert!(
                (shading.x / expected - 1.0).abs() < 0.01,
                "{shading} {expected}"
            );
        }
    }
}

#[test]
fn a_soft_lamp_has_as_much_light_as_a_sharp_one_and_softer_shadows() {
    let towards = Vec3::new(0.36, 0.48, 0.8);
    let scene = floor_scene();
    let levels = |half_angle| {
        let lighting = only_lamp(distant(towards, 32, half_angle));
        lit(&scene, &lighting, &Panoramas::default(), None).shading
    };
    let (sharp, soft) = (levels(0.0), levels(0.15));
    let mean = |values: &[Vec3]| values.iter().map(|v| v.x).sum::<f32>() / values.len() as f32;
    assert!((mean(&sharp) / mean(&soft) - 1.0).abs() < 0.01);
    let partly = |values: &[Vec3]| values.iter().filter(|v| v.x > 0.05 && v.x < 0.75).count();
    assert!(partly(&soft) > 4 * partly(&sharp).max(20));
}

#[test]
fn below_a_ball_even_light_is_weakened_by_the_ball_s_form_factor() {
    let scene = floor_scene();
    let even = Panorama::new(Rgb::new(Planes::filled(Extent::new(64, 32), [0.3; 3]))).unwrap();
    let panoramas = Panoramas::new(vec![("even".to_owned(), even)]);
    for (method, tolerance) in [(Method::Smooth, 0.006), (Method::MonteCarlo, 0.04)] {
        let lighting = Lighting {
            environment: Some(Environment {
                panorama: 0,
                rotation: *Rotation::IDENTITY.matrix(),
                irradiance: Vec3::ONE,
                method,
            }),
            has_shadows: true,
            ..Lighting::default()
        };
        let shaded = lit(&scene, &lighting, &panoramas, None);
        let pairs = scene.buffer().points.iter().zip(&shaded.shading);
        let errors: Vec<f32> = pairs
            .map(|(point, shading)| {
                let distance = (point.truncate().length_squared() + HEIGHT * HEIGHT).sqrt();
                let blocked = (BALL / distance).powi(2) * HEIGHT / distance;
                shading.x - (1.0 - blocked)
            })
            .collect();
        let count = errors.len() as f32;
        let mean = errors.iter().sum::<f32>() / count;
        let deviation = (errors.iter().map(|e| e * e).sum::<f32>() / count).sqrt();
        assert!(mean.abs() < 0.003, "{method:?}: {mean}");
        assert!(deviation < tolerance, "{method:?}: {deviation}");
    }
}

fn speckled() -> Panorama {
    let pixel = |x: usize, y: usize| {
        let level = ((x * 7 + y * 13) % 11) as f32 / 10.0;
        let lamp = if (20..26).contains(&x) && (5..9).contains(&y) {
            12.0
        } else {
            0.0
        };
        [level + lamp, level * 0.5 + lamp, 0.2 + lamp * 0.6]
    };
    Panorama::new(Rgb::new(Planes::from_fn(Extent::new(64, 32), pixel))).unwrap()
}

fn around(method: Method, turn: &Rotation) -> Lighting {
    Lighting {
        environment: Some(Environment {
            panorama: 0,
            rotation: *turn.matrix(),
            irradiance: Vec3::new(1.0, 0.8, 0.6),
            method,
        }),
        ..Lighting::default()
    }
}

/// Irradiance and Blinn-Phong highlight of red light on a normal, by a sum over parts of the panorama's pixels.
fn summed(panorama: &Panorama, normal: Direction, exponent: f64) -> [f64; 2] {
    const PARTS: usize = 4;
    let Extent { width, height } = panorama.extent();
    let mut sums = [0.0; 2];
    for row in 0..height * PARTS {
        let edge = |row: usize| (std::f64::consts::PI * row as f64 / (height * PARTS) as f64).cos();
        let area = (edge(row) - edge(row + 1)) * std::f64::consts::TAU / (width * PARTS) as f64;
        for column in 0..width * PARTS {
            let place = [column, row].map(|at| (at as f64 + 0.5) / PARTS as f64);
            let towards = panorama.direction(place[0], place[1]);
            let cosine = normal.dot(towards);
            if cosine <= 0.0 {
                continue;
            }
            let [x, y, z] = towards.components();
            let half = Direction::new(x, y, z + 1.0).map_or(0.0, |half| normal.dot(half).max(0.0));
            let light = area * f64::from(panorama.radiance(towards)[0]);
            sums[0] += light * cosine;
            sums[1] += light * half.powf(exponent);
        }
    }
    sums
}

#[test]
fn rays_to_a_panorama_give_what_a_sum_over_its_pixels_gives() {
    let panorama = speckled();
    let panoramas = Panoramas::new(vec![("speckled".to_owned(), panorama.clone())]);
    let (mesh, at) = ball();
    let scene = SyntheticScene::open(GBuffer::render(&mesh, at, Projection::Orthographic, 32));
    let gloss = BlinnPhong {
        reflectance: Vec3::splat(0.7),
        exponent: 30.0,
    };
    let lighting = around(Method::MonteCarlo, &Rotation::IDENTITY);
    let material = white(&scene, Some(gloss));
    let draws = [1, 2, 3, 4, 5, 6].map(|seed| scene.light(&material, &lighting, &panoramas, seed));
    // What scales the panorama to the irradiance that was asked for.
    let mean = f64::from(
        panorama.project(Order::TWO).coefficients()[0]
            .iter()
            .sum::<f64>() as f32,
    ) / 3.0;
    let scale = 1.0 / (mean * std::f64::consts::PI / (4.0 * std::f64::consts::PI).sqrt());
    let mut errors = [0.0; 2];
    let mut sums = [0.0; 2];
    for k in (0..scene.buffer().len()).step_by(7) {
        let normal = direction(scene.buffer().normals[k]);
        let [irradiance, highlight] = summed(&panorama, normal, 30.0);
        let truths = [irradiance, highlight * 0.7];
        let mean = |value: &dyn Fn(&Shaded) -> f32| {
            f64::from(draws.iter().map(value).sum::<f32>() / draws.len() as f32)
        };
        let ours = [mean(&|d| d.shading[k].x), mean(&|d| d.highlight[k].x)];
        for layer in 0..2 {
            errors[layer] += ours[layer] - truths[layer] * scale;
            sums[layer] += truths[layer] * scale;
        }
    }
    for layer in 0..2 {
        let bias = errors[layer] / sums[layer];
        assert!(bias.abs() < 0.01, "layer {layer}: {bias}");
    }
}

/// The irradiance of order-2 light, from its definition.
fn irradiance(light: &ShLight, normal: Vec3) -> [f64; 3] {
    let pi = std::f64::consts::PI;
    let lobe = [pi, 2.0 * pi / 3.0, pi / 4.0];
    let values = basis(Order::TWO, direction(normal));
    let mut sum = [0.0; 3];
    for (at, (value, coefficient)) in values.iter().zip(light.coefficients()).enumerate() {
        for channel in 0..3 {
            sum[channel] += lobe[at.isqrt()] * value * coefficient[channel];
        }
    }
    sum
}

#[test]
fn smooth_light_is_the_diffuse_layer_of_the_turned_coefficients() {
    let panoramas = Panoramas::new(vec![("speckled".to_owned(), speckled())]);
    let turn = Rotation::about(direction(Vec3::new(0.3, 0.8, -0.2)), 1.3);
    let lighting = around(Method::OrderTwo, &turn);
    let (mesh, at) = ball();
    let scene = SyntheticScene::open(GBuffer::render(&mesh, at, Projection::Orthographic, SIZE));
    let shaded = lit(&scene, &lighting, &panoramas, None);
    let light = speckled().project(Order::TWO).rotated(&turn);
    let truths = scene
        .buffer()
        .normals
        .iter()
        .map(|n| irradiance(&light, *n));
    let ratios: Vec<f32> = truths
        .zip(&shaded.shading)
        .map(|(truth, ours)| ours.y / truth[1] as f32)
        .collect();
    for ratio in &ratios {
        assert!(
            (ratio / ratios[0] - 1.0).abs() < 1e-4,
            "{ratio} {}",
            ratios[0]
        );
    }
}

#[test]
fn smooth_light_has_all_the_bands_that_rays_bring() {
    let panoramas = Panoramas::new(vec![("speckled".to_owned(), speckled())]);
    let turn = Rotation::about(direction(Vec3::new(0.3, 0.8, -0.2)), 1.3);
    let (mesh, at) = ball();
    let scene = SyntheticScene::open(GBuffer::render(&mesh, at, Projection::Orthographic, 32));
    let material = white(&scene, None);
    let by_rays: Vec<Shaded> = (1..40)
        .map(|seed| {
            let lighting = around(Method::MonteCarlo, &turn);
            scene.light(&material, &lighting, &panoramas, seed)
        })
        .collect();
    let off = [Method::OrderTwo, Method::Smooth].map(|method| {
        let smooth = lit(&scene, &around(method, &turn), &panoramas, None);
        let squares = smooth.shading.iter().enumerate().map(|(k, smooth)| {
            let rays: Vec3 = by_rays.iter().map(|one| one.shading[k]).sum();
            (*smooth - rays / by_rays.len() as f32).length_squared()
        });
        (squares.sum::<f32>() / smooth.shading.len() as f32).sqrt()
    });
    assert!(off[1] < 0.5 * off[0], "{off:?}");
}

#[test]
fn the_coefficients_of_a_lighting_shade_a_ball_as_its_lights_do_when_smoothed() {
    // The mean over the whole sphere is kept by the expansion: E/4 for a lamp, E for even light.
    let lighting = Lighting {
        lamps: vec![distant(Vec3::Y, 1, 0.0)],
        ambient: Vec3::new(0.2, 0.3, 0.4),
        ..Lighting::default()
    };
    let light = lighting.coefficients(Order::TWO, &Panoramas::default());
    // The first harmonic's diffuse coefficient is pi Y_0.
    let mean = light.coefficients()[0]
        .map(|c| c * std::f64::consts::PI / (4.0 * std::f64::consts::PI).sqrt());
    for (mean, expected) in mean.iter().zip([0.25 + 0.2, 0.5 + 0.3, 0.125 + 0.4]) {
        assert!((mean - expected).abs() < 1e-6, "{mean} {expected}");
    }
    assert!(irradiance(&light, Vec3::Y)[0] > irradiance(&light, Vec3::NEG_Y)[0] + 0.5);
}

#[test]
fn bounced_light_comes_only_where_the_sky_is_hidden() {
    let lighting = Lighting {
        bounce: Vec3::splat(0.5),
        ..only_lamp(distant(Vec3::Z, 1, 0.0))
    };
    let scene = floor_scene();
    let shaded = lit(&scene, &lighting, &Panoramas::default(), None);
    let at_corner = shaded.shading[0];
    let largest = shaded.shading.iter().map(|s| s.x).fold(0.0, f32::max);
    assert!((at_corner.x - 1.0).abs() < 0.03, "{at_corner}");
    assert!(largest < 1.2);
    let below: Vec<Vec3> = scene
        .buffer()
        .points
        .iter()
        .zip(&shaded.shading)
        .filter(|(point, _)| point.truncate().length() < 0.1)
        .map(|(_, s)| *s)
        .collect();
    assert!(below.iter().all(|s| s.x > 0.005 && s.x < 0.2), "{below:?}");
}

#[test]
fn what_bounces_has_the_albedo_of_where_it_comes_from() {
    let scene = floor_scene();
    let lighting = Lighting {
        bounce: Vec3::ONE,
        ..only_lamp(distant(Vec3::Z, 1, 0.0))
    };
    let added = |albedo: Vec3| {
        let shading = |lighting: &Lighting| {
            let mut material = white(&scene, None);
            material.albedo.fill(albedo);
            scene
                .light(&material, lighting, &Panoramas::default(), 1)
                .shading
        };
        let direct = Lighting {
            bounce: Vec3::ZERO,
            ..lighting.clone()
        };
        let pairs = shading(&lighting).into_iter().zip(shading(&direct));
        pairs.map(|(with, without)| with - without).sum::<Vec3>()
    };
    let white = added(Vec3::ONE);
    assert!(white.min_element() > 0.1, "{white}");
    assert_eq!(added(Vec3::ZERO), Vec3::ZERO);
    let red = added(Vec3::new(0.8, 0.2, 0.2));
    assert!((red - white * Vec3::new(0.8, 0.2, 0.2)).abs().max_element() < 1e-3 * white.x);
}

#[test]
fn a_lamp_turns_with_its_light() {
    let turn = Rotation::about(direction(Vec3::Y), 0.9);
    let lamp = SyntheticLamp {
        emitter: Emitter::Disc {
            centre: Vec3::new(1.0, 2.0, 2.0),
            radius: 0.5,
        },
        ..distant(Vec3::Y, 4, 0.0)
    };
    let turned = lamp.turned(&turn);
    let Emitter::Disc { centre, radius } = turned.emitter else {
        panic!("another lamp")
    };
    assert!((centre.length() - 3.0).abs() < 1e-5 && radius == 0.5);
    let expected = lamp.coefficients(Order::TWO).rotated(&turn);
    for (a, b) in turned
        .coefficients(Order::TWO)
        .coefficients()
        .iter()
        .zip(expected.coefficients())
    {
        assert!((a[0] - b[0]).abs() < 1e-6);
    }
}

#[test]
fn drawn_lightings_have_light_and_come_back_from_their_json() {
    let panoramas = Panoramas::new(vec![("speckled".to_owned(), speckled())]);
    let (mesh, at) = ball();
    let scene = SyntheticScene::open(GBuffer::render(&mesh, at, Projection::Orthographic, 24));
    let mut random = crate::random::Random::new(2);
    let kinds = [
        LightKind::Mixed,
        LightKind::Lamps,
        LightKind::Sh,
        LightKind::MonteCarlo,
    ];
    for kind in kinds {
        for _ in 0..12 {
            let lighting = Lighting::draw(&mut random, kind, scene.buffer(), &panoramas);
            let text = serde_json::to_string(&lighting).unwrap();
            assert_eq!(serde_json::from_str::<Lighting>(&text).unwrap(), lighting);
            let shaded = lit(&scene, &lighting, &panoramas, None);
            let mean =
                shaded.shading.iter().map(|s| s.y).sum::<f32>() / shaded.shading.len() as f32;
            assert!((0.02..PI * 2.0).contains(&mean), "{kind:?} {mean}");
            match kind {
                LightKind::Lamps => assert!((1..=3).contains(&lighting.lamps.len())),
                LightKind::Sh | LightKind::MonteCarlo => assert!(lighting.lamps.is_empty()),
                LightKind::Mixed => {}
            }
        }
    }
}
