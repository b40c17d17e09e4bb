//! A ball on the table, whose frames follow from the model itself: what is found has to be what it was made of.

use std::sync::LazyLock;

use proptest::prelude::*;

use super::gloss::{GlossLight, MIRROR};
use super::light::basis_at;
use super::robust::lit;
use super::search::Room;
use super::*;
use relight_core::files::MovieReader;
use relight_core::image::{Extent, Linear, Planes, Rgb};
use relight_core::light::{Direction, Normals, Order, Rotation, ShLight, YUp};
use relight_core::metrics::angular_error;
use relight_core::render::{DiffuseForm, DiffuseLayer, Surface};
use relight_reader::{TruthLayout, TruthSet};

const SIDE: usize = 24;
const ELEVATION: f64 = 22.0;

/// A room with a bright side: its coefficients at the table's angle 0.
fn room() -> ShLight {
    let values = [1.1, 0.3, 0.24, 0.36, 0.07, -0.06, 0.03, 0.12, 0.09];
    ShLight::new(values.map(|v| [v, 0.9 * v, 0.8 * v + 0.02]).to_vec()).unwrap()
}

fn elevation() -> Elevation {
    Elevation::given(ELEVATION).unwrap()
}

/// A ball in three colours.
fn ball() -> Surface {
    let normals = Normals::sphere(SIDE);
    let albedo = Planes::from_fn(normals.extent(), |x, y| match (x / 5 + y / 7) % 3 {
        0 => [0.12, 0.10, 0.05],
        1 => [0.05, 0.16, 0.10],
        _ => [0.20, 0.20, 0.22],
    });
    Surface::new(normals, Rgb::new(albedo), None).unwrap()
}

fn mask(surface: &Surface) -> Planes<1> {
    let normals = surface.normals().planes();
    Planes::from_fn(surface.extent(), |x, y| [normals.pixel(x, y)[2].ceil()])
}

/// How a turn is filmed.
#[derive(Debug, Clone, Copy)]
struct Take {
    frames: u32,
    /// The table's angle of the first frame, degrees.
    first_deg: f64,
    /// The part of the turn that is filmed.
    part: f64,
    gain: f64,
}

const TAKE: Take = Take {
    frames: 90,
    first_deg: 0.0,
    part: 1.0,
    gain: 1.0,
};

/// A frame: what the surface shows when the light has turned.
fn frame(surface: &Surface, light: &ShLight, angle_deg: f64) -> Rgb<Linear> {
    let (sin, cos) = ELEVATION.to_radians().sin_cos();
    let axis = Direction::new(0.0, cos, sin).unwrap();
    let turned = light.rotated(&Rotation::about(axis, -angle_deg.to_radians()));
    let shading = DiffuseLayer::new(&turned, DiffuseForm::Irradiance).shading(surface.normals());
    Rgb::new(Planes::from_fn(surface.extent(), |x, y| {
        let (a, s) = (
            surface.albedo().planes().pixel(x, y),
            shading.planes().pixel(x, y),
        );
        [0, 1, 2].map(|c| a[c] * s[c])
    }))
}

fn film(surface: &Surface, light: &ShLight, take: Take) -> TurnCurves {
    let mut builder = CurveBuilder::new(surface.extent(), mask(surface).plane(0)).unwrap();
    for k in 0..take.frames {
        let at = f64::from(k) / f64::from(take.frames);
        let angle = take.first_deg + 360.0 * take.part * at;
        let image = frame(surface, light, angle - take.first_deg);
        let image = image
            .into_planes()
            .map(|v| (f64::from(v) * take.gain).min(1.0) as f32);
        builder
            .push(angle, surface.extent(), image.planes())
            .unwrap();
    }
    builder.finish().unwrap()
}

fn known(light: &ShLight) -> TurnOptions {
    TurnOptions {
        elevation: elevation(),
        light: Some(light.clone()),
        ..TurnOptions::default()
    }
}

/// The median of the angle between normals, degrees: at the rim a few pixels have two answers.
fn off(surface: &Surface, normals: &Normals<YUp>) -> f64 {
    let mask: Vec<bool> = mask(surface).plane(0).iter().map(|&m| m >= 0.5).collect();
    let truth = surface.normals().planes().planes();
    angular_error(surface.extent(), truth, normals.planes().planes(), &mask)
        .unwrap()
        .median
}

/// The relative difference of albedo that one in twenty pixels exceeds, where there is a surface.
fn albedo_off(surface: &Surface, albedo: &Rgb<Linear>, gain: f32) -> f32 {
    let mask = mask(surface);
    let mut all = Vec::new();
    for c in 0..3 {
        let pairs = surface
            .albedo()
            .planes()
            .plane(c)
            .iter()
            .zip(albedo.planes().plane(c));
        for ((truth, found), mask) in pairs.zip(mask.plane(0)) {
            if *mask >= 0.5 {
                all.push((found / (truth * gain) - 1.0).abs());
            }
        }
    }
    let at = all.len() * 19 / 20;
    *all.select_nth_unstable_by(at, f32::total_cmp).1
}

/// The ball's turn, and what is found of it in known light.
static SOLVED: LazyLock<(ReadTurn, TurnSolution)> = LazyLock::new(|| {
    let turn = read(&ball(), &room());
    let solution = solve_turn(&turn.curves, &known(&room())).unwrap();
    (turn, solution)
});

#[test]
fn a_matt_ball_in_known_light_is_found_as_it_is() {
    let (turn, found) = &*SOLVED;
    let (surface, curves) = (ball(), &turn.curves);
    assert!(off(&surface, &found.normals(curves)) < 0.3);
    assert!(albedo_off(&surface, &found.albedo(curves), 1.0) < 0.01);
    assert!(found.residual() < 1e-4, "{}", found.residual());
    assert!(found.expected_error_deg() < 15.0);
    let confidence = found.confidence(curves);
    assert!(confidence.plane(0).iter().copied().fold(0.0, f32::max) > 0.6);
}

#[test]
fn the_light_of_a_known_surface_is_found_as_it_is() {
    let (surface, light) = (ball(), room());
    let frame = TableFrame::new(elevation());
    let found = fit_turn_light(&SOLVED.0.curves, &surface, BodyKind::Diffuse, &frame).unwrap();
    let largest = 1.1;
    for (a, b) in found.coefficients().iter().zip(light.coefficients()) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 0.01 * largest, "{a} {b}");
        }
    }
}

#[test]
fn with_its_own_normals_as_the_prior_unknown_light_is_found_up_to_its_colour() {
    let (surface, light) = (ball(), room());
    let curves = film(&surface, &light, TAKE);
    let options = TurnOptions {
        elevation: elevation(),
        prior: Some(surface.normals().clone()),
        ..TurnOptions::default()
    };
    let found = solve_turn(&curves, &options).unwrap();
    assert!(off(&surface, &found.normals(&curves)) < 1.0);
    let coefficients = found.light().to_viewer(found.frame()).unwrap();
    for c in 0..3 {
        let scale = light.coefficients()[0][c] / coefficients.coefficients()[0][c];
        for (a, b) in coefficients.coefficients().iter().zip(light.coefficients()) {
            assert!(
                (a[c] * scale - b[c]).abs() < 0.01 * 1.1,
                "{} {}",
                a[c] * scale,
                b[c]
            );
        }
    }
    // Four that lean on the prior, and three that lean on the outline alone.
    assert_eq!(found.starts().len(), 7);
    assert_eq!(found.starts().iter().filter(|start| start.taken).count(), 1);
    assert!(!found.is_prior_left_out());
}

#[test]
fn a_table_that_turns_the_other_way_is_noticed() {
    let (surface, light) = (ball(), room());
    let mut builder = CurveBuilder::new(surface.extent(), mask(&surface).plane(0)).unwrap();
    for k in 0..90 {
        let angle = f64::from(k) * 4.0;
        let image = frame(&surface, &light, -angle);
        builder
            .push(angle, surface.extent(), image.planes().planes())
            .unwrap();
    }
    let curves = builder.finish().unwrap();
    let unknown = TurnOptions {
        elevation: elevation(),
        prior: Some(surface.normals().clone()),
        ..TurnOptions::default()
    };
    for options in [known(&light), unknown] {
        let wrong = solve_turn(&curves, &options).unwrap().sense().unwrap();
        assert!(wrong.is_doubted(), "{wrong:?}");
        let right = solve_turn(&SOLVED.0.curves, &options).unwrap();
        let right = right.sense().unwrap();
        assert!(!right.is_doubted(), "{right:?}");
    }
}

#[test]
fn in_unknown_light_the_outline_alone_tells_a_ball_roughly() {
    let (surface, light) = (ball(), room());
    let curves = film(&surface, &light, TAKE);
    let options = TurnOptions {
        elevation: elevation(),
        ..TurnOptions::default()
    };
    let found = solve_turn(&curves, &options).unwrap();
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 12.0, "{off}");
    let shading = found.shading(&curves);
    let inside = curves.pixels() as f32;
    let mean = shading.planes().plane(1).iter().sum::<f32>() / inside;
    assert!((mean - 1.0).abs() < 1e-3, "{mean}");
}

#[test]
fn clipped_light_is_left_out() {
    let (surface, light) = (ball(), room());
    let take = Take { gain: 4.0, ..TAKE };
    let curves = film(&surface, &light, take);
    assert!(
        (0.02..0.5).contains(&curves.clipped()),
        "{}",
        curves.clipped()
    );
    let found = solve_turn(&curves, &known(&light)).unwrap();
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 0.3, "{off}");
}

#[test]
fn a_turn_of_which_a_third_is_missing_tells_the_same() {
    let (surface, light) = (ball(), room());
    let curves = film(&surface, &light, Take { part: 0.67, ..TAKE });
    let found = solve_turn(&curves, &known(&light)).unwrap();
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 0.3, "{off}");
    let albedo_off = albedo_off(&surface, &found.albedo(&curves), 1.0);
    assert!(albedo_off < 0.01, "{albedo_off}");
}

/// What a reader makes of a take.
fn read(surface: &Surface, light: &ShLight) -> ReadTurn {
    let first_angles = vec![0.0, 120.0, 240.0];
    ReadTurn {
        name: "ball".to_owned(),
        curves: film(surface, light, TAKE),
        first: first_angles
            .iter()
            .map(|&angle| frame(surface, light, angle))
            .collect(),
        first_angles,
        sources: Vec::new(),
        origin: None,
        mask: mask(surface),
        has_angles: true,
        damage: Vec::new(),
    }
}

/// The curves of the ball in a room.
fn film_in(room: &Room, surface: &Surface) -> TurnCurves {
    let extent = surface.extent();
    let mut builder = CurveBuilder::new(extent, mask(surface).plane(0)).unwrap();
    for k in 0..90 {
        let angle = f64::from(k) * 4.0;
        let basis = basis_at(angle.to_radians());
        let image = Planes::from_fn(extent, |x, y| {
            let normal = surface.normals().planes().pixel(x, y).map(f64::from);
            let [body, gloss] = lit(room, normal, &basis);
            let albedo = surface.albedo().planes().pixel(x, y).map(f64::from);
            [0, 1, 2].map(|c| (albedo[c] * body[c] + gloss[c]) as f32)
        });
        builder.push(angle, extent, image.planes()).unwrap();
    }
    builder.finish().unwrap()
}

#[test]
fn gloss_beside_the_matt_part_is_found_in_known_light() {
    let (surface, light) = (ball(), room());
    let table = TableFrame::new(elevation());
    let shown = GlossLight::bands(&light.rotated(&table.rotation()));
    let glossy = Room {
        frame: table,
        light: TableLight::from_viewer(&light, &table),
        gloss: GlossLight::sum(&shown, &[0.5, 0.4, 0.3]),
        body: BodyKind::Diffuse,
    };
    let curves = film_in(&glossy, &surface);
    let found = solve_turn(&curves, &known(&light)).unwrap();
    assert_eq!(found.body(), BodyKind::Diffuse);
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 1.0, "{off}");
    let gloss = found.gloss(&curves).unwrap().unwrap();
    assert!(gloss.reflectance > 0.0 && gloss.residual < 0.8, "{gloss:?}");
    let maps = TurnMaps::new(&curves, &found);
    assert!(maps.highlight.pixel(SIDE / 2, SIDE / 2)[0] > 0.002);
}

/// A room with so much in its higher bands that it has small bright windows.
fn windows() -> ShLight {
    let mut light = room().with_order(Order::new(4).unwrap());
    for (at, values) in light.coefficients_mut().iter_mut().enumerate().skip(9) {
        let value = 0.15 * (1.7 * at as f64).sin();
        *values = [value, 0.9 * value, 0.8 * value];
    }
    light
}

/// A ball of metal in a room, whose lobe leaves less of each band.
fn metal_ball() -> (Surface, ShLight, TurnCurves) {
    let (surface, light) = (ball(), windows());
    let table = TableFrame::new(elevation());
    let shown = GlossLight::bands(&light.rotated(&table.rotation()));
    let factors = [1.0, 0.95, 0.9, 0.8, 0.7].map(|factor| MIRROR * factor);
    let metal = Room {
        frame: table,
        light: TableLight::from_viewer(&light, &table),
        gloss: GlossLight::sum(&shown, &factors),
        body: BodyKind::Metal,
    };
    let curves = film_in(&metal, &surface);
    (surface, light, curves)
}

#[test]
fn metal_is_told_by_what_it_leaves_and_found_in_known_light() {
    let (surface, light, curves) = metal_ball();
    let found = solve_turn(&curves, &known(&light)).unwrap();
    assert_eq!(found.body(), BodyKind::Metal);
    let [diffuse, metal] = found.bodies() else {
        panic!("{:?}", found.bodies());
    };
    assert!(
        diffuse.residual > 10.0 * metal.residual,
        "{diffuse:?} {metal:?}"
    );
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 1.0, "{off}");
    assert!(albedo_off(&surface, &found.albedo(&curves), 1.0) < 0.05);
    let lit = found.surface(&curves).unwrap();
    assert_eq!(lit.albedo().planes().pixel(SIDE / 2, SIDE / 2), [0.0; 3]);
    let [r, g, _] = lit.gloss().unwrap().reflectance().pixel(SIDE / 2, SIDE / 2);
    let [red, green, _] = surface.albedo().planes().pixel(SIDE / 2, SIDE / 2);
    assert!((r / g - red / green).abs() < 0.1, "{r} {g}");
}

#[test]
fn metal_is_found_in_unknown_light_with_normals_to_lean_on() {
    let (surface, _, curves) = metal_ball();
    let options = TurnOptions {
        elevation: elevation(),
        prior: Some(surface.normals().clone()),
        ..TurnOptions::default()
    };
    let found = solve_turn(&curves, &options).unwrap();
    assert_eq!(found.body(), BodyKind::Metal);
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 1.0, "{off}");
}

#[test]
fn a_body_that_was_given_is_taken_but_doubted_and_metal_has_no_labels() {
    let turn = read(&ball(), &room());
    let options = TurnOptions {
        body: Some(BodyKind::Metal),
        ..known(&room())
    };
    let found = solve_turn(&turn.curves, &options).unwrap();
    assert_eq!((found.body(), found.bodies().len()), (BodyKind::Metal, 2));
    let (_, light, curves) = metal_ball();
    let wrongly = TurnOptions {
        body: Some(BodyKind::Diffuse),
        ..known(&light)
    };
    let wrong = solve_turn(&curves, &wrongly).unwrap();
    assert_eq!(wrong.body(), BodyKind::Diffuse);
    assert_eq!(wrong.doubted_body(), Some(BodyKind::Metal));
    let rightly = TurnOptions {
        body: Some(BodyKind::Diffuse),
        ..known(&room())
    };
    let right = solve_turn(&turn.curves, &rightly).unwrap();
    assert_eq!(right.doubted_body(), None);
    assert_eq!(SOLVED.1.doubted_body(), None);
    let labels = TurnLabels {
        turn: &turn,
        solution: &found,
        least_confidence: 0.5,
    };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("labels");
    assert!(matches!(labels.write(&out), Err(TurnError::NoMattPart)));
    assert!(!out.exists());
}

/// A room that is nearly the same all around.
fn even_room() -> ShLight {
    let mut even = ShLight::even(Order::TWO, [0.3; 3]);
    even.coefficients_mut()[3] = [0.01; 3];
    even
}

#[test]
fn a_turn_that_tells_nothing_and_pixels_that_are_not_believed_have_no_labels() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("labels");
    let even = read(&ball(), &even_room());
    let of_even = solve_turn(&even.curves, &known(&even_room())).unwrap();
    let labels = TurnLabels {
        turn: &even,
        solution: &of_even,
        least_confidence: 0.0,
    };
    assert!(matches!(labels.write(&out), Err(TurnError::NothingTold)));
    let (turn, solution) = &*SOLVED;
    let labels = TurnLabels {
        turn,
        solution,
        least_confidence: 1.0,
    };
    let refused = labels.write(&out);
    assert!(matches!(refused, Err(TurnError::NothingBelieved { .. })));
    assert!(!out.exists());
}

#[test]
fn an_even_light_is_not_trusted_though_it_was_given() {
    // Of the turn that it lit, and of one that another light did.
    for (light, is_at_odds) in [(even_room(), false), (room(), true)] {
        let curves = film(&ball(), &light, TAKE);
        let found = solve_turn(&curves, &known(&even_room())).unwrap();
        let conditioning = found.conditioning();
        assert_eq!(conditioning.verdict, RoomVerdict::TooEven);
        assert_eq!(conditioning.is_given_at_odds(), is_at_odds);
        let expected = found.expected_error_deg();
        assert!(expected > 45.0, "{expected}");
    }
    let found = SOLVED.1.conditioning();
    assert_eq!(found.verdict, RoomVerdict::Good);
    assert!(!found.is_given_at_odds());
    let ratio = found.given_modulation.unwrap() / found.modulation;
    assert!((0.5..2.0).contains(&ratio), "{found:?}");
}

#[test]
fn labels_of_a_turn_are_read_as_samples_with_truth() {
    let surface = ball();
    let (turn, solution) = &*SOLVED;
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("labels");
    let labels = TurnLabels {
        turn,
        solution,
        least_confidence: 0.5,
    };
    assert_eq!(labels.write(&out).unwrap(), 3);
    let set = TruthSet::open(&out, TruthLayout::Synth).unwrap();
    assert_eq!(set.names().len(), 3);
    let sample = set.load(1).unwrap();
    let believed = sample.normals.unwrap();
    let believed = believed.completed(
        &mask(&surface)
            .plane(0)
            .iter()
            .map(|&m| m >= 0.5)
            .collect::<Vec<_>>(),
    );
    assert!(off(&surface, &believed) < 1.0);
    let at = |image: &Rgb<Linear>| image.planes().pixel(SIDE / 2, SIDE / 3)[1];
    let (image, diffuse) = (sample.image.unwrap(), sample.diffuse.unwrap());
    assert!((at(&image) - at(&diffuse)).abs() < 0.005);
    assert!(at(&sample.highlight.unwrap()) < 0.005);
}

/// The frames of the video that is written of a turn, as planes of sRGB.
fn film_of(turn: &ReadTurn, solution: &TurnSolution, out: &std::path::Path) -> Vec<Planes<3>> {
    let maps = TurnMaps::new(&turn.curves, solution);
    let files = TurnFiles {
        turn,
        solution,
        maps: &maps,
        light_source: None,
        normals_source: None,
        strip: None,
        asset: None,
        has_movie: true,
    };
    files.write(out).unwrap();
    let mut movie = MovieReader::open(&out.join("relit.mp4")).unwrap();
    let mut frames = Vec::new();
    while let Some(frame) = movie.frame().unwrap() {
        frames.push(frame.planes().clone());
    }
    frames
}

/// The mean of a part of the ball's columns.
fn columns(frame: &Planes<3>, columns: std::ops::Range<usize>) -> f32 {
    let rows = SIDE / 3..2 * SIDE / 3;
    let count = (columns.len() * rows.len()) as f32;
    let all = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
    all.map(|(x, y)| frame.pixel(x, y)[1]).sum::<f32>() / count
}

#[test]
fn the_film_shows_the_object_while_a_lamp_goes_around_it() {
    let run = std::process::Command::new("ffmpeg")
        .arg("-version")
        .output();
    if run.is_err() {
        relit_test_support::say_skipped("the program ffmpeg is not installed");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (surface, light, curves) = metal_ball();
    let metal = ReadTurn {
        curves,
        ..read(&surface, &light)
    };
    let of_metal = solve_turn(&metal.curves, &known(&light)).unwrap();
    let (turn, solution) = &*SOLVED;
    for (name, turn, solution) in [("matt", turn, solution), ("metal", &metal, &of_metal)] {
        let frames = film_of(turn, solution, &folder.path().join(name));
        assert_eq!(frames.len(), 90);
        let [left, right] = [2..SIDE / 3, 2 * SIDE / 3..SIDE - 2];
        let leaning =
            |frame: &Planes<3>| columns(frame, right.clone()) - columns(frame, left.clone());
        let most = frames.iter().map(leaning).fold(f32::MIN, f32::max);
        let least = frames.iter().map(leaning).fold(f32::MAX, f32::min);
        assert!(most > 0.02 && least < -0.02, "{name}: {least} to {most}");
        let middle = |frame: &Planes<3>| columns(frame, SIDE / 3..2 * SIDE / 3);
        assert!(
            frames.iter().map(middle).fold(f32::MIN, f32::max) > 0.2,
            "{name}"
        );
    }
}

#[test]
fn a_turn_becomes_an_object_whose_edge_has_its_own_colour() {
    let (turn, solution) = &*SOLVED;
    let asset = solution.asset(turn).unwrap();
    assert_eq!(asset.name(), "ball");
    assert!(asset.alpha().pixel(SIDE / 2, SIDE / 2)[0] > 0.99);
    let mut partly = 0;
    for (at, &alpha) in asset.alpha().plane(0).iter().enumerate() {
        if alpha > 0.0 {
            let albedo = asset.surface().albedo().planes().plane(1)[at];
            assert!(albedo > 0.03, "{albedo}");
        }
        partly += usize::from(alpha > 0.1 && alpha < 0.9);
    }
    assert!(partly > SIDE, "{partly}");
}

#[test]
fn even_light_is_called_too_even() {
    let surface = ball();
    let good = Conditioning::of(&film(&surface, &room(), TAKE));
    assert_eq!(good.verdict, RoomVerdict::Good);
    assert!(good.verdict.advice().is_none());
    let bad = Conditioning::of(&film(&surface, &even_room(), TAKE));
    assert_eq!(bad.verdict, RoomVerdict::TooEven);
    let advice = bad.verdict.advice().unwrap();
    assert!(advice.contains("turn on one lamp"), "{advice}");
}

#[test]
fn shadows_and_highlights_of_some_frames_are_left_out_and_shown() {
    let (surface, light) = (ball(), room());
    let extent = surface.extent();
    let mut builder = CurveBuilder::new(extent, mask(&surface).plane(0)).unwrap();
    for k in 0..90 {
        let angle = f64::from(k) * 4.0;
        let mut image = frame(&surface, &light, angle).into_planes();
        for y in 0..SIDE {
            for x in 0..SIDE {
                // The shadow of a pole goes from the left to the right, and a spot of light back.
                let factor = match k {
                    20..40 if (k - 20) / 2 == x as u32 / 4 => 0.5,
                    60..72 if (71 - k) / 2 == x as u32 / 4 => 1.5,
                    _ => 1.0,
                };
                let value = image.pixel(x, y);
                image.set_pixel(x, y, value.map(|v| v * factor));
            }
        }
        builder.push(angle, extent, image.planes()).unwrap();
    }
    let curves = builder.finish().unwrap();
    let found = solve_turn(&curves, &known(&light)).unwrap();
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 2.0, "{off}");
    let maps = TurnMaps::new(&curves, &found);
    let middle = maps.shadow.pixel(SIDE / 2, SIDE / 2)[0];
    // Two of 90 frames, half of their light.
    assert!((0.005..0.02).contains(&middle), "{middle}");
    assert!(maps.highlight.pixel(SIDE / 2, SIDE / 2)[0] > 0.01);
    let darkest = maps
        .over_angle
        .iter()
        .max_by(|a, b| a.shadow.total_cmp(&b.shadow))
        .unwrap();
    assert!((80.0..130.0).contains(&darkest.angle_deg), "{darkest:?}");
}

#[test]
fn turns_that_tell_nothing_are_refused_by_what_is_wrong() {
    let extent = Extent::new(4, 4);
    let empty = CurveBuilder::new(extent, &[0.0; 16]);
    assert!(matches!(empty, Err(TurnError::Empty)));
    let builder = || CurveBuilder::new(extent, &[1.0; 16]).unwrap();
    let grey = [0.3; 16];
    let mut few = builder();
    for k in 0..100 {
        few.push(f64::from(k % 4), extent, [&grey; 3]).unwrap();
    }
    assert!(matches!(
        few.finish(),
        Err(TurnError::TooFewAngles { angles: 1, .. })
    ));
    let other = builder().push(0.0, Extent::new(8, 2), [&grey; 3]);
    assert!(matches!(other, Err(TurnError::FrameSize { .. })));
    let mut lost = builder();
    lost.push(f64::NAN, extent, [&grey; 3]).unwrap();
    lost.push(f64::INFINITY, extent, [&grey; 3]).unwrap();
    assert!(matches!(
        lost.finish(),
        Err(TurnError::TooFewAngles { angles: 0, .. })
    ));
}

#[test]
fn a_dark_turn_and_a_white_one_are_wrongly_exposed_and_a_prior_of_another_size_is_refused() {
    let extent = Extent::new(4, 4);
    let of = |level: f32| {
        let mut builder = CurveBuilder::new(extent, &[1.0; 16]).unwrap();
        let grey = [level; 16];
        for k in 0..36 {
            builder
                .push(f64::from(k) * 10.0, extent, [&grey; 3])
                .unwrap();
        }
        builder.finish().unwrap()
    };
    for (level, verdict, says) in [
        (0.0, RoomVerdict::Underexposed, "the object is underexposed"),
        (1.0, RoomVerdict::Overexposed, "the object is overexposed"),
    ] {
        let curves = of(level);
        let unknown = solve_turn(&curves, &TurnOptions::default()).unwrap_err();
        assert!(matches!(unknown, TurnError::Unfit(found) if found == verdict));
        assert!(unknown.to_string().contains(says), "{unknown}");
        let found = solve_turn(&curves, &known(&room())).unwrap();
        assert_eq!(found.conditioning().verdict, verdict);
        assert_eq!(found.albedo(&curves).planes().pixel(1, 1), [0.0; 3]);
        assert!(found.confidence(&curves).plane(0)[0] < 0.1);
    }
    let options = TurnOptions {
        prior: Some(Normals::sphere(5)),
        ..TurnOptions::default()
    };
    let refused = solve_turn(&of(0.3), &options);
    assert!(matches!(refused, Err(TurnError::PriorSize { .. })));
}

#[test]
fn steps_of_the_exposure_are_found_and_taken_out() {
    let (surface, light) = (ball(), room());
    let extent = surface.extent();
    let mut builder = CurveBuilder::new(extent, mask(&surface).plane(0)).unwrap();
    for k in 0..180 {
        let angle = f64::from(k) * 2.0;
        let exposure = if (51..120).contains(&k) { 0.8 } else { 1.0 };
        let image = frame(&surface, &light, angle).into_planes();
        builder
            .push(angle, extent, image.map(|v| exposure * v).planes())
            .unwrap();
    }
    let curves = builder.finish().unwrap();
    let [down, up] = curves.exposure_steps() else {
        panic!("{:?}", curves.exposure_steps());
    };
    assert_eq!((down.angle_deg, up.angle_deg), (102.0, 240.0));
    assert!((down.factor - 0.8).abs() < 0.01, "{down:?}");
    assert!((up.factor - 1.25).abs() < 0.015, "{up:?}");
    let found = solve_turn(&curves, &known(&light)).unwrap();
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 0.5, "{off}");
    assert!(albedo_off(&surface, &found.albedo(&curves), 1.0) < 0.02);
    assert!(SOLVED.0.curves.exposure_steps().is_empty());
}

#[test]
fn missing_frames_of_a_coarse_turn_are_no_steps_of_the_exposure() {
    let surface = ball();
    let extent = surface.extent();
    // Strong light from one side, of which the frames show much from one to the next.
    let mut light = room();
    for at in [1, 3] {
        light.coefficients_mut()[at] = [0.55; 3];
    }
    let missing = [3, 10, 11, 24, 31, 43, 44, 58, 66, 67, 80];
    let steps = |factor: f32| {
        let mut builder = CurveBuilder::new(extent, mask(&surface).plane(0)).unwrap();
        for k in (0..90).filter(|k| !missing.contains(k)) {
            let angle = 4.0 * f64::from(k);
            let exposure = if (20..70).contains(&k) { factor } else { 1.0 };
            let image = frame(&surface, &light, angle).into_planes();
            builder
                .push(angle, extent, image.map(|v| exposure * v).planes())
                .unwrap();
        }
        let curves = builder.finish().unwrap();
        curves
            .exposure_steps()
            .iter()
            .map(|step| step.angle_deg)
            .collect::<Vec<_>>()
    };
    assert_eq!(steps(1.0), [0.0; 0]);
    assert_eq!(steps(0.8), [80.0, 280.0]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4))]

    #[test]
    fn where_the_turn_starts_changes_nothing_but_the_light_s_angle(first_deg in -400.0_f64..400.0) {
        let (surface, light) = (ball(), room());
        let curves = film(&surface, &light, Take { first_deg, ..TAKE });
        // At the angle 0 the light is as it was when the table still had `first_deg` to go.
        let (sin, cos) = ELEVATION.to_radians().sin_cos();
        let axis = Direction::new(0.0, cos, sin).unwrap();
        let turned = light.rotated(&Rotation::about(axis, first_deg.to_radians()));
        let found = solve_turn(&curves, &known(&turned)).unwrap();
        prop_assert!(off(&surface, &found.normals(&curves)) < 0.3);
        prop_assert!(albedo_off(&surface, &found.albedo(&curves), 1.0) < 0.01);
    }

    #[test]
    fn brighter_frames_make_a_brighter_albedo_and_the_same_normals(gain in 0.05_f64..1.2) {
        let (surface, light) = (ball(), room());
        let curves = film(&surface, &light, Take { gain, ..TAKE });
        let found = solve_turn(&curves, &known(&light)).unwrap();
        prop_assert!(off(&surface, &found.normals(&curves)) < 0.3);
        prop_assert!(albedo_off(&surface, &found.albedo(&curves), gain as f32) < 0.01);
    }
}
