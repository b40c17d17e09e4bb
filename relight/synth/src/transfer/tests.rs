use std::f32::consts::PI;

use glam::Vec3;
use relight_core::light::{Direction, ShLight, basis};

use super::*;
use crate::geometry::{GBuffer, Occluder};
use crate::library::{Folders, Library};
use crate::made_panoramas;
use crate::mesh::Mesh;
use crate::shape::ShapeKind;
use crate::view::{Pose, Projection};

fn recipe() -> TransferRecipe {
    TransferRecipe {
        seed: 5,
        size: 32,
        rays: 400,
    }
}

const MATT: TransferMaterial = TransferMaterial {
    is_metal: false,
    reflectance: 0.0,
    blur: 0.2,
    bounce: 0.0,
};

/// A ball far above any plate: nothing blocks its light.
fn open_ball(elevation: f32) -> Transfer {
    let mesh: Mesh = ShapeKind::Sphere.build(0);
    let projection = Projection::Orthographic;
    let placement = Pose::upright(elevation, 0.3, 0.9).place(&mesh, projection);
    let buffer = GBuffer::render(&mesh, placement, projection, 32);
    let mut transfer = Transfer::cast(&buffer, &Occluder::new(&mesh, placement), elevation, 200, 3);
    transfer.finishes = vec![TransferFinish {
        normals: buffer.normals().to_vec(),
        albedo: vec![Vec3::splat(PI); buffer.len()],
    }];
    transfer
}

fn a_room(seed: u64) -> ShLight {
    let made = made_panoramas().unwrap();
    let panoramas: Vec<_> = made.iter().map(|(_, panorama)| panorama).collect();
    Rooms::new(&panoramas, 2, 1).draw(seed)
}

#[test]
fn nothing_is_blocked_on_an_open_ball_and_its_curves_are_the_irradiance_of_the_turned_light() {
    let elevation = 0.4_f32;
    let transfer = open_ball(elevation);
    let light = a_room(4);
    let curves = transfer.curves(&transfer.finishes[0], &MATT, &light);
    let to_table = cast::table_frame(elevation);
    for k in (0..curves.len()).step_by(37) {
        let normal = transfer.finishes[0].normals[k];
        for step in 0..5 {
            let angle = step as f64 * 1.1;
            // At the table's angle a the light has turned by -a about the axis, or the normal by a.
            let turned = glam::Mat3::from_rotation_z(angle as f32) * (to_table * normal);
            let [x, y, z] = turned.to_array().map(f64::from);
            let at = basis(TRANSFER_ORDER, Direction::new(x, y, z).unwrap());
            for c in 0..3 {
                let expected: f64 = (0..COEFFICIENTS)
                    .filter(|&i| order_of(i) <= 6)
                    .map(|i| f64::from(cosine_band(band(i))) * at[i] * light.coefficients()[i][c])
                    .sum();
                let found = value(&curves[k], angle, c);
                let open = 0.04 * f64::from(curves[k][0][c]);
                assert!((found - expected).abs() < open, "{found} {expected}");
            }
        }
    }
}

/// The m of a coefficient, without its sign.
fn order_of(coefficient: usize) -> usize {
    let l = band(coefficient);
    coefficient.abs_diff(l * (l + 1))
}

fn value(curve: &CurveCoefficients, angle: f64, c: usize) -> f64 {
    let mut sum = f64::from(curve[0][c]);
    for m in 1..=6 {
        let (sin, cos) = (m as f64 * angle).sin_cos();
        sum += f64::from(curve[2 * m - 1][c]) * cos - f64::from(curve[2 * m][c]) * sin;
    }
    sum
}

#[test]
fn the_cosine_s_bands_are_those_of_the_published_table() {
    let expected = [3.141593, 2.094395, 0.785398, 0.0, -0.130900, 0.0, 0.049087];
    for (l, expected) in expected.into_iter().enumerate() {
        assert!((cosine_band(l) - expected).abs() < 1e-5, "{l}");
    }
}

/// An object of which parts shade others, on a plate.
fn standing(size: u32, rays: u32) -> (Transfer, GBuffer, Occluder) {
    let mesh: Mesh = ShapeKind::Blend.build(2);
    let elevation = 0.35;
    let projection = Projection::Perspective { distance: 5.0 };
    let placement = Pose::upright(elevation, 0.3, 0.9).place(&mesh, projection);
    let axis = Vec3::new(0.0, elevation.cos(), elevation.sin());
    let plate = crate::geometry::Disc {
        centre: axis * -0.6,
        normal: axis,
        radius: 2.5,
    };
    let buffer = GBuffer::render(&mesh, placement, projection, size);
    let occluder = Occluder::with_disc(&mesh, placement, &plate);
    let mut transfer = Transfer::cast(&buffer, &occluder, elevation, rays, 3);
    transfer.finishes = vec![TransferFinish {
        normals: buffer.normals().to_vec(),
        albedo: vec![Vec3::ONE; buffer.len()],
    }];
    (transfer, buffer, occluder)
}

#[test]
fn under_even_light_a_pixel_shows_the_part_of_the_sky_that_it_sees() {
    let (transfer, buffer, occluder) = standing(24, 600);
    let even = ShLight::even(TRANSFER_ORDER, [1.0; 3]);
    let curves = transfer.curves(&transfer.finishes[0], &MATT, &even);
    let mut random = crate::random::Random::new(9);
    for k in (0..buffer.len()).step_by(11) {
        let (normal, from) = (buffer.normals()[k], buffer.ray_starts()[k]);
        let count = 2000;
        let mut open = 0.0;
        for _ in 0..count {
            let towards = (normal + random.direction() * 0.999).normalize();
            if !occluder.blocks(from, towards, f32::INFINITY) {
                open += 1.0 / count as f32;
            }
        }
        let found = curves[k][0][0];
        assert!(
            (found - open).abs() < 0.08,
            "pixel {k}: {found}, by other rays {open}"
        );
        assert!(curves[k][1..].as_flattened().iter().all(|c| c.abs() < 1e-5));
    }
}

#[test]
fn views_are_cast_once_and_a_damaged_one_again() {
    let library = Library::read(&Folders::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let cache = TransferCache::open(folder.path(), recipe(), &library).unwrap();
    let first = cache.view(&library, 0).unwrap();
    assert_eq!(cache.view(&library, 0).unwrap(), first);
    let files = || {
        std::fs::read_dir(folder.path())
            .unwrap()
            .map(|e| e.unwrap().path())
    };
    assert_eq!(files().count(), 1);
    let path = files().next().unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(cache.view(&library, 0).unwrap(), first);
    let other = TransferRecipe {
        rays: 300,
        ..recipe()
    };
    TransferCache::open(folder.path(), other, &library)
        .unwrap()
        .view(&library, 0)
        .unwrap();
    assert_eq!(files().count(), 2);
}

#[test]
fn rooms_are_of_any_kind_and_never_darker_than_nothing_in_the_mean() {
    for seed in 0..40 {
        let light = a_room(seed);
        assert!(
            light.coefficients()[0]
                .iter()
                .all(|&c| c > 0.0 && c.is_finite())
        );
    }
    assert!(Rooms::new(&[], 2, 1).is_empty());
}

#[test]
fn a_mirror_image_has_the_normals_and_curves_of_the_mirrored_object_under_the_mirrored_light() {
    let transfer = open_ball(0.3);
    let mut seed = 0;
    // Two draws that differ in nothing but whether they are mirrored cannot be asked for; the ball is its own mirror
    // image, so that its mirrored curves have to be those of its own normals.
    let rooms = {
        let made = made_panoramas().unwrap();
        let panoramas: Vec<_> = made.iter().map(|(_, panorama)| panorama).collect();
        Rooms::new(&panoramas, 1, 1)
    };
    let drawn = loop {
        seed += 1;
        let drawn = DrawnTurn::draw(&transfer, &rooms, seed);
        if drawn.pixels != transfer.pixels || drawn.normals != transfer.finishes[0].normals {
            break drawn;
        }
        assert!(seed < 50);
    };
    assert!(drawn.pixels.is_sorted());
    for (&pixel, normal) in drawn.pixels.iter().zip(&drawn.normals) {
        let x = ((pixel % 32) as f32 + 0.5) / 16.0 - 1.0;
        assert!(normal.x * x >= -0.02 && normal.z >= 0.0, "{normal} at {x}");
    }
    let half = drawn.halved();
    assert_eq!(half.size, 16);
    assert!((half.pixels.len() as f32 * 4.0 / drawn.pixels.len() as f32 - 1.0).abs() < 0.15);
}
