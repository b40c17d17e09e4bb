//! Turns of a ball whose frames follow from the model itself: what is fitted has to be what they were made of.

use std::sync::LazyLock;
use std::time::Duration;

use relight_core::image::{Linear, Planes, Rgb};
use relight_core::light::{Direction, Normals, Order, Rotation, ShLight};
use relight_core::metrics::angular_error;
use relight_core::render::{DiffuseForm, DiffuseLayer, Surface};

use crate::fit::by_network::solve_by_network;
use crate::model::harmonics::{COEFFICIENTS, HARMONICS};
use crate::model::shading::ShadingModel;
use crate::network::predict::NetworkFigures;
use crate::network::predict::TurnPrediction;
use crate::observe::curves::CurveBuilder;
use crate::{
    Elevation, FactSource, MaterialKind, ReadTurn, SolvedTurn, TableFrame, TableRotation,
    TurnCurves, TurnSolution,
};

pub(crate) const SIDE: usize = 24;

pub(crate) const ELEVATION: f64 = 22.0;

/// An environment light with a bright side: its coefficients at the table's angle 0.
pub(crate) fn environment() -> ShLight {
    let values = [1.1, 0.3, 0.24, 0.36, 0.07, -0.06, 0.03, 0.12, 0.09];
    ShLight::new(values.map(|v| [v, 0.9 * v, 0.8 * v + 0.02]).to_vec()).unwrap()
}

pub(crate) fn elevation() -> Elevation {
    Elevation::measured(ELEVATION).unwrap()
}

/// A ball in three colours.
pub(crate) fn ball() -> Surface {
    let normals = Normals::sphere(SIDE);
    let albedo = Planes::from_fn(normals.extent(), |x, y| match (x / 5 + y / 7) % 3 {
        0 => [0.12, 0.10, 0.05],
        1 => [0.05, 0.16, 0.10],
        _ => [0.20, 0.20, 0.22],
    });
    Surface::new(normals, Rgb::new(albedo), None).unwrap()
}

pub(crate) fn mask(surface: &Surface) -> Planes<1> {
    let normals = surface.normals().planes();
    Planes::from_fn(surface.extent(), |x, y| [normals.pixel(x, y)[2].ceil()])
}

/// How a turn is filmed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Take {
    pub(crate) frames: u32,
    /// The table's angle of the first frame, degrees.
    pub(crate) first_deg: f64,
    /// The part of the turn that is filmed.
    pub(crate) part: f64,
    pub(crate) gain: f64,
}

pub(crate) const TAKE: Take = Take {
    frames: 90,
    first_deg: 0.0,
    part: 1.0,
    gain: 1.0,
};

/// A frame: what the surface shows when the light has turned.
pub(crate) fn frame(surface: &Surface, light: &ShLight, angle_deg: f64) -> Rgb<Linear> {
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

pub(crate) fn film(surface: &Surface, light: &ShLight, take: Take) -> TurnCurves {
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

/// By how much the normals of [`leaning`] are off, degrees.
pub(crate) const LEAN_DEG: f64 = 12.0;

/// A network of turns that knows the ball, but that all its normals lean to the right.
pub(crate) fn leaning() -> TurnPrediction {
    let mut prediction = knowing(&ball(), LEAN_DEG as f32);
    let (sin, cos) = (LEAN_DEG as f32).to_radians().sin_cos();
    let right = prediction.normals.planes();
    let normals = Planes::from_fn(right.extent(), |x, y| {
        let [x, y, z] = right.pixel(x, y);
        [cos * x + sin * z, y, cos * z - sin * x]
    });
    prediction.normals = Normals::new(normals);
    prediction
}

/// What is found of the ball's curves in a light that is known, by such a network.
pub(crate) fn solve(curves: &TurnCurves, light: &ShLight) -> TurnSolution {
    let facts = (elevation(), MaterialKind::Diffuse);
    solve_by_network(curves, &leaning(), ball().albedo(), Some(light), facts).unwrap()
}

/// The median of the angle between normals, degrees: at the rim a few pixels have two answers.
pub(crate) fn off(surface: &Surface, normals: &Normals) -> f64 {
    let mask: Vec<bool> = mask(surface).plane(0).iter().map(|&m| m >= 0.5).collect();
    let truth = surface.normals().planes().planes();
    angular_error(surface.extent(), truth, normals.planes().planes(), &mask)
        .unwrap()
        .median
}

/// The relative difference of albedo that one in twenty pixels exceeds, where there is a surface.
pub(crate) fn albedo_off(surface: &Surface, albedo: &Rgb<Linear>, gain: f32) -> f32 {
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
pub(crate) static SOLVED: LazyLock<(ReadTurn, TurnSolution)> = LazyLock::new(|| {
    let turn = read(&ball(), &environment());
    let solution = solve(&turn.curves, &environment());
    (turn, solution)
});

/// What a reader makes of a take.
pub(crate) fn read(surface: &Surface, light: &ShLight) -> ReadTurn {
    ReadTurn {
        name: "ball".to_owned(),
        curves: film(surface, light, TAKE),
        rotation: TableRotation::default(),
        first: [0.0, 120.0, 240.0]
            .map(|angle| frame(surface, light, angle))
            .into(),
        sources: Vec::new(),
        origin: None,
        mask: mask(surface),
        has_angles: true,
        damage: Vec::new(),
    }
}

/// The curves of the ball in an environment.
pub(crate) fn film_in(environment: &ShadingModel, surface: &Surface) -> TurnCurves {
    let extent = surface.extent();
    let mut builder = CurveBuilder::new(extent, mask(surface).plane(0)).unwrap();
    for k in 0..90 {
        let angle = f64::from(k) * 4.0;
        let basis = basis_at(angle.to_radians());
        let image = Planes::from_fn(extent, |x, y| {
            let normal = surface.normals().planes().pixel(x, y).map(f64::from);
            let albedo = surface.albedo().planes().pixel(x, y).map(f64::from);
            let shown = environment.harmonics(normal);
            [0, 1, 2].map(|c| {
                let pairs = shown[c].iter().zip(&basis);
                (albedo[c] * pairs.map(|(a, b)| a * b).sum::<f64>()) as f32
            })
        });
        builder.push(angle, extent, image.planes()).unwrap();
    }
    builder.finish().unwrap()
}

/// An environment with so much in its higher bands that it has small bright windows.
pub(crate) fn windows() -> ShLight {
    let mut light = environment().with_order(Order::new(4).unwrap());
    for (at, values) in light.coefficients_mut().iter_mut().enumerate().skip(9) {
        let value = 0.15 * (1.7 * at as f64).sin();
        *values = [value, 0.9 * value, 0.8 * value];
    }
    light
}

/// A ball of metal in an environment, whose lobe attenuates each band.
pub(crate) fn metal_ball() -> (Surface, ShLight, TurnCurves) {
    let (surface, light) = (ball(), windows());
    let mut metal =
        ShadingModel::in_light(&light, TableFrame::new(elevation()), MaterialKind::Metal);
    metal.shown = metal
        .shown
        .scaled(|l, _| [1.0, 0.95, 0.9, 0.8, 0.7, 0.6, 0.5][l]);
    let curves = film_in(&metal, &surface);
    (surface, light, curves)
}

/// An environment that is nearly the same all around.
pub(crate) fn even_environment() -> ShLight {
    let mut even = ShLight::even(Order::TWO, [0.3; 3]);
    even.coefficients_mut()[3] = [0.01; 3];
    even
}

/// What the network of turns expects in the direction that was taken and in the other one, degrees.
pub(crate) fn expecting(this: f32, other: f32) -> NetworkFigures {
    NetworkFigures {
        expected_error_deg: this,
        other_direction_deg: other,
    }
}

/// A network of turns that knows a surface, each channel of its albedo in a unit of its own, and expects such errors, degrees.
pub(crate) fn knowing(surface: &Surface, expected_deg: f32) -> TurnPrediction {
    let albedo = surface.albedo().planes();
    let extent = surface.extent();
    TurnPrediction {
        normals: surface.normals().clone(),
        expected_errors: Planes::filled(extent, [expected_deg]),
        albedo: Rgb::new(Planes::from_fn(extent, |x, y| {
            let [red, green, blue] = albedo.pixel(x, y);
            [2.0 * red, 3.0 * green, 0.5 * blue]
        })),
        figures: expecting(expected_deg, 2.0 * expected_deg),
    }
}

/// A turn that was read with its rotation given, and what was found of it.
pub(crate) fn solved(mut turn: ReadTurn, solution: TurnSolution) -> SolvedTurn {
    turn.rotation.source = FactSource::Given;
    SolvedTurn {
        turn,
        solution,
        network: expecting(10.0, 20.0),
        ball: None,
        broken: None,
        reading: Duration::ZERO,
    }
}

/// The values of the harmonics at an angle of the table, radians.
pub(crate) fn basis_at(angle: f64) -> [f64; COEFFICIENTS] {
    let mut basis = [1.0; COEFFICIENTS];
    for harmonic in 1..=HARMONICS {
        let (sin, cos) = (harmonic as f64 * angle).sin_cos();
        basis[2 * harmonic - 1] = cos;
        basis[2 * harmonic] = -sin;
    }
    basis
}
