use std::f32::consts::PI;

use glam::Vec3;
use half::f16;
use relight_core::image::{Extent, Planes, Rgb};
use relight_core::light::{Direction, Panorama, Rotation, ShLight, basis};

use super::photo_view::ViewGeometry;
use super::turn_plan::terms_of;
use super::*;
use crate::geometry::{GBuffer, Occluder};
use crate::library::{Folders, Library};
use crate::lighting::{
    BlinnPhong, Environment, Lighting, Material, Method, Panoramas, SyntheticLamp, SyntheticScene,
};
use crate::made_panoramas;
use crate::mesh::Mesh;
use crate::shape::ShapeKind;
use crate::view::{Pose, Projection};

const MATT: TurnMaterial = TurnMaterial {
    is_metal: false,
    reflectance: 0.0,
    is_fresnel: true,
    is_tinted: false,
    blur: 0.2,
    bounce: 0.0,
};

/// A view of a white object whose pixels have these normals.
struct Seen {
    elevation: f32,
    buffer: GBuffer,
    base: Vec<f16>,
}

impl Seen {
    fn new(buffer: &GBuffer, occluder: Occluder, elevation: f32, rays: u32) -> Self {
        let seen = ViewGeometry::new(buffer.clone(), occluder, None);
        Self {
            elevation,
            buffer: buffer.clone(),
            base: turn_view::base(&seen, elevation, (rays, 3)),
        }
    }

    fn len(&self) -> usize {
        self.buffer.len()
    }

    fn at(&self, plane: usize, k: usize) -> f32 {
        let area = (self.buffer.size * self.buffer.size) as usize;
        f32::from(self.base[plane * area + self.buffer.pixels[k] as usize])
    }

    /// What each pixel shows of a light over a whole turn, by the formulas: irradiance, or with a material highlights.
    fn curves(&self, material: &TurnMaterial, light: &ShLight) -> Vec<CurveTerms> {
        let terms = terms_of(light);
        let to_table = cast::table_frame(self.elevation);
        let one = |k: usize| {
            let (normal, eye) = (self.buffer.normals[k], self.buffer.towards_eye[k]);
            let facing = normal.dot(eye).max(0.0);
            let is_gloss = material.reflectance > 0.0;
            let towards = if is_gloss {
                normal * (2.0 * facing) - eye
            } else {
                normal
            };
            let harmonics: [f32; COEFFICIENTS] =
                cast::harmonics_at(TRANSFER_ORDER, to_table * towards.normalize_or(normal));
            let mut curve = [[0.0; 3]; CURVE_TERMS];
            for (at, terms) in terms.iter().enumerate() {
                let l = band(at);
                let taken = if is_gloss {
                    let left = (-0.5 * (l * (l + 1)) as f32 * material.blur.powi(2)).exp();
                    harmonics[at] * left * material.reflectance * facing
                } else {
                    harmonics[at] * cosine_band(l) - self.at(TurnView::BLOCKED + at, k)
                };
                let pairs = curve
                    .as_flattened_mut()
                    .iter_mut()
                    .zip(terms.as_flattened());
                pairs.for_each(|(sum, light)| *sum += taken * light);
            }
            curve
        };
        (0..self.len()).map(one).collect()
    }
}

/// A ball far above any plate: nothing blocks its light.
fn open_ball(elevation: f32) -> Seen {
    let mesh: Mesh = ShapeKind::Sphere.build(0);
    let projection = Projection::Orthographic;
    let placement = Pose::upright(elevation, 0.3, 0.9).place(&mesh, projection);
    let buffer = GBuffer::render(&mesh, placement, projection, 32);
    Seen::new(&buffer, Occluder::new(&mesh, placement), elevation, 200)
}

fn a_room(seed: u64) -> ShLight {
    let made = made_panoramas().unwrap();
    let panoramas: Vec<_> = made.iter().map(|(_, panorama)| panorama).collect();
    EnvironmentLights::new(&panoramas, 2, 1).draw(seed)
}

#[test]
fn nothing_is_blocked_on_an_open_ball_and_its_curves_are_the_irradiance_of_the_turned_light() {
    let elevation = 0.4_f32;
    let seen = open_ball(elevation);
    let light = a_room(4);
    let curves = seen.curves(&MATT, &light);
    let to_table = cast::table_frame(elevation);
    for k in (0..curves.len()).step_by(37) {
        let normal = seen.buffer.normals[k];
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

fn value(curve: &CurveTerms, angle: f64, c: usize) -> f64 {
    let mut sum = f64::from(curve[0][c]);
    for m in 1..=6 {
        let (sin, cos) = (m as f64 * angle).sin_cos();
        sum += f64::from(curve[2 * m - 1][c]) * cos - f64::from(curve[2 * m][c]) * sin;
    }
    sum
}

/// An object on a plate, with parts that shadow others.
fn standing(size: u32, rays: u32) -> (Seen, GBuffer, Occluder) {
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
    let again = Occluder::with_disc(&mesh, placement, &plate);
    let seen = Seen::new(&buffer, again, elevation, rays);
    (seen, buffer, occluder)
}

#[test]
fn under_even_light_a_pixel_shows_the_part_of_the_sky_that_it_sees() {
    let (seen, buffer, occluder) = standing(24, 600);
    let even = ShLight::even(TRANSFER_ORDER, [1.0 / PI as f64; 3]);
    let curves = seen.curves(&MATT, &even);
    let mut random = crate::random::Random::new(9);
    for k in (0..buffer.len()).step_by(11) {
        let (normal, from) = (buffer.normals[k], buffer.ray_starts[k]);
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

/// Light of few bands: a bright side, a second one, and a floor.
fn soft_panorama() -> Panorama {
    let extent = Extent::new(64, 32);
    let pixel = |x: usize, y: usize| {
        let around = (x as f32 + 0.5) / 64.0 * 2.0 * PI;
        let down = (y as f32 + 0.5) / 32.0 * PI;
        let side = (down.sin() * (around - 1.0).cos()).max(0.0).powi(3);
        let other = (down.sin() * (around - 4.4).cos() * 0.8 + down.cos() * 0.6).max(0.0);
        [
            0.1 + 4.0 * side + other.powi(4),
            0.1 + 3.0 * side + 2.0 * other.powi(4),
            0.2 + side + 2.5 * other.powi(4),
        ]
    };
    Panorama::new(Rgb::new(Planes::from_fn(extent, pixel))).unwrap()
}

/// Ninety frames of a turn, rendered with rays as `synth sequences` renders them.
const FRAMES: u32 = 90;

/// Mean and first harmonics of rendered frames: shading of a white object, or its highlights, pixel by pixel.
fn harmonics_of_frames(
    scene: &SyntheticScene,
    panoramas: &Panoramas,
    axis: Vec3,
    gloss: Option<BlinnPhong>,
) -> Vec<[[f32; 3]; 7]> {
    let pixels = scene.buffer().len();
    let material = Material {
        albedo: vec![Vec3::ONE; pixels],
        normals: scene.buffer().normals.to_vec(),
        gloss,
    };
    let [x, y, z] = axis.to_array().map(f64::from);
    let axis = Direction::new(x, y, z).unwrap();
    let mut sums = vec![[[0.0; 3]; 7]; pixels];
    for frame in 0..FRAMES {
        let angle = f64::from(frame) / f64::from(FRAMES) * std::f64::consts::TAU;
        let lighting = Lighting {
            environment: Some(Environment {
                panorama: 0,
                rotation: *Rotation::about(axis, -angle).matrix(),
                irradiance: Vec3::ONE,
                method: Method::MonteCarlo,
            }),
            has_shadows: true,
            ..Lighting::default()
        };
        let shaded = scene.light(&material, &lighting, panoramas, u64::from(frame));
        let seen = match gloss {
            Some(_) => &shaded.highlight,
            None => &shaded.shading,
        };
        for (sum, shading) in sums.iter_mut().zip(seen) {
            for (term, sum) in sum.iter_mut().enumerate() {
                let (sin, cos) = (term.div_ceil(2) as f64 * angle).sin_cos();
                let weight = match term {
                    0 => 1.0,
                    term if term % 2 == 1 => 2.0 * cos,
                    _ => -2.0 * sin,
                };
                for (sum, value) in sum.iter_mut().zip(shading.to_array()) {
                    *sum += weight as f32 * value / FRAMES as f32;
                }
            }
        }
    }
    sums
}

/// The soft panorama with a mean irradiance of 1, which is pi times the mean radiance: as it is rendered, and in
/// harmonics of the table's frame.
fn soft_room(elevation: f32) -> (Panoramas, ShLight) {
    let panorama = soft_panorama();
    let light = panorama.project(TRANSFER_ORDER);
    let mean = light.coefficients()[0].iter().sum::<f64>() / 3.0;
    let scale = 1.0 / (mean * std::f64::consts::PI.sqrt() / 2.0);
    let rows = cast::table_frame(elevation);
    let to_table = Rotation::from_matrix(crate::vectors::rotation_rows(rows)).unwrap();
    let light = light.rotated(&to_table).tinted([scale; 3]);
    (Panoramas::new(vec![("soft".to_owned(), panorama)]), light)
}

/// By how much mean and harmonics of curves are off rendered ones, and the energy of the latter.
fn differences(curves: &[CurveTerms], rendered: &[[[f32; 3]; 7]]) -> ([f64; 7], [f64; 7]) {
    let (mut off, mut energy) = ([0.0_f64; 7], [0.0_f64; 7]);
    for (curve, rendered) in curves.iter().zip(rendered) {
        for (term, rendered) in rendered.iter().enumerate() {
            for (a, b) in curve[term].iter().zip(rendered) {
                off[term] += f64::from(a - b).powi(2);
                energy[term] += f64::from(*b).powi(2);
            }
        }
    }
    (off, energy)
}

#[test]
fn rendered_frames_of_a_turn_have_the_fourier_coefficients_that_the_transfer_says() {
    let (seen, buffer, occluder) = standing(20, 1500);
    let axis = Vec3::new(0.0, seen.elevation.cos(), seen.elevation.sin());
    let (panoramas, light) = soft_room(seen.elevation);
    let curves = seen.curves(&MATT, &light);
    let scene = SyntheticScene::shaded(buffer, occluder, 16, 7);
    let rendered = harmonics_of_frames(&scene, &panoramas, axis, None);
    let (off, energy) = differences(&curves, &rendered);
    // What is left is the noise of the rays, alike in all harmonics: it is told as a part of the first one.
    let harmonics: [&[usize]; 4] = [&[0], &[1, 2], &[3, 4], &[5, 6]];
    let sum = |of: &[f64; 7], terms: &[usize]| terms.iter().map(|&term| of[term]).sum::<f64>();
    for terms in harmonics {
        let relative = (sum(&off, terms) / sum(&energy, &[1, 2])).sqrt();
        assert!(relative < 0.04, "{terms:?}: {relative}");
    }
    // The second harmonic is found for what it is, not by its noise.
    let relative = (sum(&off, &[3, 4]) / sum(&energy, &[3, 4])).sqrt();
    assert!(relative < 0.08, "{relative}");
}

#[test]
fn highlights_of_rendered_frames_are_as_strong_as_the_transfer_says() {
    let elevation = 0.35;
    let seen = open_ball(elevation);
    let mesh: Mesh = ShapeKind::Sphere.build(0);
    let projection = Projection::Orthographic;
    let placement = Pose::upright(elevation, 0.3, 0.9).place(&mesh, projection);
    let buffer = GBuffer::render(&mesh, placement, projection, 32);
    let (panoramas, light) = soft_room(elevation);
    let axis = Vec3::new(0.0, elevation.cos(), elevation.sin());
    let scene = SyntheticScene::open(buffer);
    for (reflectance, exponent) in [(0.5, 12.0), (0.8, 40.0)] {
        let gloss = BlinnPhong {
            reflectance: Vec3::splat(reflectance),
            exponent,
        };
        let rendered = harmonics_of_frames(&scene, &panoramas, axis, Some(gloss));
        let material = MATT.with_half_vector(reflectance, exponent);
        let curves = seen.curves(&material, &light);
        // An albedo of pi stands for a white surface in the transfer.
        let curves: Vec<CurveTerms> = curves
            .into_iter()
            .map(|curve| curve.map(|values| values.map(|value| PI * value)))
            .collect();
        let (off, energy) = differences(&curves, &rendered);
        let sum = |of: &[f64; 7]| of[1..3].iter().sum::<f64>();
        let relative = [off[0] / energy[0], sum(&off) / sum(&energy)].map(f64::sqrt);
        assert!(
            relative.iter().all(|part| *part < 0.25),
            "exponent {exponent}: {relative:?}"
        );
    }
}

#[test]
fn a_turn_is_the_same_for_the_same_seed_and_its_numbers_are_in_range() {
    let library = Library::read(&Folders::default()).unwrap();
    let recipe = ViewRecipe {
        seed: 3,
        size: 16,
        rays: 32,
    };
    let view = TurnView::cast(&recipe, &library, 5);
    assert_eq!(view, TurnView::cast(&recipe, &library, 5));
    assert_eq!(view.base.len(), TurnView::BASE * 256);
    let finishes = TurnView::FINISHES * TurnView::FINISH_PLANES;
    assert_eq!(view.finishes.len(), finishes * 256);
    let made = made_panoramas().unwrap();
    let panoramas: Vec<_> = made.iter().map(|(_, panorama)| panorama).collect();
    let rooms = EnvironmentLights::new(&panoramas, 2, 1);
    let plans: Vec<TurnPlan> = (0..200)
        .map(|seed| TurnPlan::draw(seed, view.elevation, &rooms))
        .collect();
    for (seed, plan) in (0..).zip(&plans) {
        assert_eq!(*plan, TurnPlan::draw(seed, view.elevation, &rooms));
        assert!(plan.finish < TurnView::FINISHES);
        assert!((plan.elevation - view.elevation).abs() < 8.1_f32.to_radians());
    }
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
}

#[test]
fn the_zenith_of_a_panorama_is_along_the_table_s_axis_in_most_rooms_and_its_azimuth_is_any() {
    let sky = |_: usize, y: usize| [if y < 16 { 1.0 } else { 0.1 }; 3];
    let sky = Panorama::new(Rgb::new(Planes::from_fn(Extent::new(64, 32), sky))).unwrap();
    let above: Vec<bool> = (0..200)
        .map(|seed| {
            // Band 1 of the basis is y, z, x: its middle one is along the axis.
            let light = EnvironmentLights::new(&[&sky], 1, 1).draw(seed);
            let [y, z, x] = [1, 2, 3].map(|at: usize| light.coefficients()[at][1]);
            z > 2.0 * x.hypot(y)
        })
        .collect();
    let part = above.iter().filter(|&&above| above).count();
    assert!((120..200).contains(&part), "{part} of 200");
    let lamp = |x: usize, _: usize| [if x < 8 { 1.0 } else { 0.0 }; 3];
    let lamp = Panorama::new(Rgb::new(Planes::from_fn(Extent::new(64, 32), lamp))).unwrap();
    let rooms = EnvironmentLights::new(&[&lamp], 1, 1);
    let quarters = (0..200).fold([0; 4], |mut counts, seed| {
        let light = rooms.draw(seed);
        let [y, x] = [1, 3].map(|at: usize| light.coefficients()[at][1]);
        counts[2 * usize::from(x > 0.0) + usize::from(y > 0.0)] += 1;
        counts
    });
    assert!(quarters.iter().all(|&count| count > 20), "{quarters:?}");
}

#[test]
fn the_light_of_rooms_and_lamps_on_a_photograph_is_that_of_rays() {
    let (_, buffer, occluder) = standing(24, 16);
    let table = Vec3::new(0.0, 0.35_f32.cos(), 0.35_f32.sin());
    let seen = ViewGeometry::new(buffer.clone(), occluder, Some(table));
    let mut random = crate::random::Random::new(6);
    let lamps: Vec<SyntheticLamp> = (0..4).map(|_| seen.lamp(&mut random)).collect();
    let area = 24 * 24;
    let base = seen.base(1500, 4);
    let of = |plane: usize, pixel: u32| f32::from(base[plane * area + pixel as usize]);
    let (panoramas, _) = soft_room(0.0);
    let room = panoramas.get(0).unwrap().project(PhotoView::ORDER);
    let visible: Vec<_> = lamps.iter().map(|lamp| seen.visibility(lamp, 3)).collect();
    let scene = SyntheticScene::shaded(buffer.clone(), seen.into_occluder(), 16, 7);
    let material = Material {
        albedo: vec![Vec3::ONE; buffer.len()],
        normals: buffer.normals.clone(),
        gloss: None,
    };
    let shaded = |lighting: Lighting| {
        let lighting = Lighting {
            has_shadows: true,
            ..lighting
        };
        scene.light(&material, &lighting, &panoramas, 1).shading
    };
    let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
    let apart = |found: &[f32], rays: &[f32]| {
        let off: Vec<f32> = found.iter().zip(rays).map(|(a, b)| (a - b).abs()).collect();
        (
            (mean(found) / mean(rays) - 1.0).abs(),
            mean(&off) / mean(rays),
        )
    };
    for (lamp, visible) in lamps.iter().zip(&visible) {
        let lamp = SyntheticLamp {
            irradiance: Vec3::ONE,
            ..*lamp
        };
        let rays = shaded(Lighting {
            lamps: vec![lamp],
            ..Lighting::default()
        });
        let rays: Vec<f32> = rays.iter().map(|light| light.x).collect();
        let centre = lamp.emitter.middle(1e3);
        let found: Vec<f32> = (0..buffer.len())
            .map(|k| {
                let way = centre - buffer.points[k];
                let towards = way.normalize();
                let falloff = towards.dot(centre.normalize()) * centre.length_squared()
                    / way.length_squared();
                let visible = f32::from(visible[buffer.pixels[k] as usize]);
                visible * falloff * buffer.normals[k].dot(towards).max(0.0)
            })
            .collect();
        let (in_all, each) = apart(&found, &rays);
        assert!(in_all < 0.03 && each < 0.06, "{lamp:?}: {in_all} {each}");
    }
    let environment = Environment {
        panorama: 0,
        rotation: *Rotation::IDENTITY.matrix(),
        irradiance: Vec3::ONE,
        method: Method::MonteCarlo,
    };
    let rays = shaded(Lighting {
        environment: Some(environment),
        ..Lighting::default()
    });
    let radiance: Vec<f32> = room.coefficients().iter().map(|c| c[0] as f32).collect();
    let found: Vec<f32> = (0..buffer.len())
        .map(|k| {
            let harmonics: [f32; 49] = cast::harmonics_at(PhotoView::ORDER, buffer.normals[k]);
            (0..49)
                .map(|at| {
                    let blocked = of(PhotoView::BLOCKED + at, buffer.pixels[k]);
                    (harmonics[at] * cosine_band(band(at)) - blocked) * radiance[at]
                })
                .sum()
        })
        .collect();
    // Rendered rooms have a mean irradiance of 1 on a sphere; this one is as it is.
    let rays: Vec<f32> = rays.iter().map(|light| light.x).collect();
    let scale = mean(&found) / mean(&rays);
    let unit = panoramas_irradiance(&room);
    assert!((scale / unit - 1.0).abs() < 0.03, "{scale} {unit}");
    let found: Vec<f32> = found.iter().map(|value| value / scale).collect();
    let (_, each) = apart(&found, &rays);
    assert!(each < 0.06, "{each}");
}

/// The mean irradiance, over all directions and channels, of a light.
fn panoramas_irradiance(light: &ShLight) -> f32 {
    let mean = light.coefficients()[0].iter().sum::<f64>() / 3.0;
    (mean * std::f64::consts::PI.sqrt() / 2.0) as f32
}

#[test]
fn a_photograph_is_the_same_for_the_same_seed_and_its_light_is_room_and_lamps() {
    let library = Library::read(&Folders::default()).unwrap();
    let recipe = ViewRecipe {
        seed: 3,
        size: 16,
        rays: 32,
    };
    let view = PhotoView::cast(&recipe, &library, 5);
    assert_eq!(view, PhotoView::cast(&recipe, &library, 5));
    assert_eq!(view.base.len(), PhotoView::BASE * 256);
    assert_eq!(
        view.finishes.len(),
        PhotoView::FINISHES * PhotoView::FINISH_PLANES * 256
    );
    assert_eq!(view.visibility.len(), PhotoView::LAMPS * 256);
    let made = made_panoramas().unwrap();
    let panoramas: Vec<_> = made.iter().map(|(_, panorama)| panorama).collect();
    let rooms = EnvironmentLights::new(&panoramas, 2, 1);
    for seed in 0..40 {
        let plan = PhotoPlan::draw(seed, &view.lamps, &rooms);
        assert_eq!(plan, PhotoPlan::draw(seed, &view.lamps, &rooms));
        let from_lamps: f32 = plan.lamps.iter().map(|lamp| lamp.irradiance[1]).sum();
        // The first harmonic is constant.
        let found = (plan.light[0][1] - plan.room[0][1]) / 0.282_094_8;
        assert!((found - from_lamps).abs() < 1e-4, "{found} {from_lamps}");
        assert!(plan.finish < PhotoView::FINISHES && plan.lamps.len() <= 3);
    }
}

#[test]
fn light_around_most_lamps_is_even_as_in_a_laboratory() {
    let made = made_panoramas().unwrap();
    let panoramas: Vec<_> = made.iter().map(|(_, panorama)| panorama).collect();
    let rooms = EnvironmentLights::new(&panoramas, 2, 1);
    let lamp = ViewLamp {
        centre: [0.0, 0.0, 5.0],
        half_angle: 0.1,
    };
    let is_even = |plan: &PhotoPlan| plan.room[1..].iter().flatten().all(|c| c.abs() < 1e-6);
    let plans: Vec<_> = (0..1000)
        .map(|seed| PhotoPlan::draw(seed, &[lamp], &rooms))
        .collect();
    let even: Vec<_> = plans.iter().filter(|plan| is_even(plan)).collect();
    // 0.8 of the photographs are by lamps, 0.6 of these in even light.
    assert!((430..530).contains(&even.len()), "{}", even.len());
    assert!(even.iter().all(|plan| !plan.lamps.is_empty()));
}

#[test]
fn a_light_that_turns_is_the_sum_of_its_terms() {
    let made = made_panoramas().unwrap();
    let light = made[0].1.project(TurnView::ORDER);
    let terms = terms_of(&light);
    let angle = 0.7_f64;
    let axis = Direction::new(0.0, 0.0, 1.0).unwrap();
    let turned = light.rotated(&Rotation::about(axis, -angle));
    for (k, terms) in terms.iter().enumerate() {
        let l = k.isqrt();
        if k.abs_diff(l * (l + 1)) > 6 {
            continue;
        }
        let mut sum = f64::from(terms[0][1]);
        for m in 1..=6 {
            let (sin, cos) = (m as f64 * angle).sin_cos();
            sum += f64::from(terms[2 * m - 1][1]) * cos - f64::from(terms[2 * m][1]) * sin;
        }
        let expected = turned.coefficients()[k][1];
        assert!(
            (sum - expected).abs() < 1e-4 * expected.abs().max(1.0),
            "{k}: {sum} {expected}"
        );
    }
}
