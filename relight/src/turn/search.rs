//! The normal of one pixel: the one whose curve is nearest to what was seen.

use std::f64::consts::PI;

use super::light::WAVES;
use super::moments::{Moments, PAIRS, squares};
use super::{TableFrame, TableLight};

/// How many normals are tried first, evenly over the half sphere that faces the viewer: about 6 degrees apart.
const TRIED: usize = 600;
/// A surface that is seen faces the viewer by at least this.
const LEAST_FACING: f64 = 0.02;
/// The first step of the refinement, radians, and the last.
const FIRST_STEP: f64 = 0.06;
const LAST_STEP: f64 = 5e-4;
/// The step by which a residual's bend is measured, radians.
const BEND_STEP: f64 = 0.06;

/// A normal of the viewer's frame, where a network or a shape expects it, and how much that counts:
/// `weight (1 - cos)` is added to the residual.
#[derive(Debug, Clone, Copy)]
pub(super) struct Expected {
    pub(super) normal: [f64; 3],
    pub(super) weight: f64,
}

/// A pixel's answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PixelFit {
    /// In the viewer's frame.
    pub(super) normal: [f64; 3],
    pub(super) albedo: [f64; 3],
    /// What is left of the curve, over the energy of its variation.
    pub(super) residual: f64,
}

/// The normals that are tried under a light.
pub(super) struct Search<'a> {
    light: &'a TableLight,
    frame: &'a TableFrame,
    tried: Vec<Tried>,
}

struct Tried {
    normal: [f64; 3],
    waves: [[f64; WAVES]; 3],
    squares: [[f64; PAIRS]; 3],
}

impl<'a> Search<'a> {
    pub(super) fn new(light: &'a TableLight, frame: &'a TableFrame) -> Self {
        let tried = half_sphere(TRIED).map(|normal| {
            let waves = light.waves(frame.to_table(normal));
            Tried {
                normal,
                waves,
                squares: waves.each_ref().map(squares),
            }
        });
        Self {
            light,
            frame,
            tried: tried.collect(),
        }
    }

    /// The best normal anywhere.
    pub(super) fn anywhere(&self, moments: &Moments, expected: Option<Expected>) -> PixelFit {
        let mut best = (f64::INFINITY, [0.0, 0.0, 1.0]);
        for tried in &self.tried {
            let cost =
                moments.residual(&tried.waves, &tried.squares) + bias(expected, tried.normal);
            if cost < best.0 {
                best = (cost, tried.normal);
            }
        }
        self.near(moments, expected, best.1)
    }

    /// The best normal that is reached from `start` downhill.
    pub(super) fn near(
        &self,
        moments: &Moments,
        expected: Option<Expected>,
        start: [f64; 3],
    ) -> PixelFit {
        let cost = |normal: [f64; 3]| self.residual(moments, normal) + bias(expected, normal);
        let mut normal = start;
        let mut least = cost(normal);
        let mut step = FIRST_STEP;
        while step > LAST_STEP {
            let [u, v] = tangents(normal);
            let mut moved = false;
            for turn in 0..8 {
                let (sin, cos) = (PI / 4.0 * f64::from(turn)).sin_cos();
                let other = leant(normal, [u, v], [step * cos, step * sin]);
                if other[2] < LEAST_FACING {
                    continue;
                }
                let found = cost(other);
                if found < least {
                    (least, normal, moved) = (found, other, true);
                    break;
                }
            }
            if !moved {
                step *= 0.5;
            }
        }
        PixelFit {
            normal,
            albedo: moments.albedo(&self.waves(normal)),
            residual: self.residual(moments, normal),
        }
    }

    /// What a normal leaves of a curve.
    pub(super) fn residual(&self, moments: &Moments, normal: [f64; 3]) -> f64 {
        let waves = self.waves(normal);
        moments.residual(&waves, &waves.each_ref().map(squares))
    }

    /// How far the normal may lean before the residual grows by as much as it is: the standard deviation of
    /// the angle, radians, were what is left of the curve noise of `freedom` degrees of freedom.
    pub(super) fn looseness(
        &self,
        moments: &Moments,
        expected: Option<Expected>,
        fit: &PixelFit,
        freedom: f64,
    ) -> f64 {
        let [u, v] = tangents(fit.normal);
        let cost = |a: f64, b: f64| {
            let normal = leant(fit.normal, [u, v], [a, b]);
            self.residual(moments, normal) + bias(expected, normal)
        };
        let h = BEND_STEP;
        let middle = cost(0.0, 0.0);
        let uu = (cost(h, 0.0) + cost(-h, 0.0) - 2.0 * middle) / (h * h);
        let vv = (cost(0.0, h) + cost(0.0, -h) - 2.0 * middle) / (h * h);
        let uv = (cost(h, h) - cost(h, -h) - cost(-h, h) + cost(-h, -h)) / (4.0 * h * h);
        // The eigenvalues of the bend, which at a border of what is allowed need not be positive.
        let (half, rest) = (
            (uu + vv) / 2.0,
            (((uu - vv) / 2.0).powi(2) + uv * uv).sqrt(),
        );
        let inverse: f64 = [half + rest, half - rest]
            .into_iter()
            .map(|bend| 1.0 / bend.max(1e-3))
            .sum();
        (2.0 * fit.residual / freedom * inverse).sqrt()
    }

    fn waves(&self, normal: [f64; 3]) -> [[f64; WAVES]; 3] {
        self.light.waves(self.frame.to_table(normal))
    }
}

fn bias(expected: Option<Expected>, normal: [f64; 3]) -> f64 {
    expected.map_or(0.0, |expected| {
        expected.weight * (1.0 - dot(expected.normal, normal))
    })
}

/// Directions of a half sphere around the viewer, by a spiral.
fn half_sphere(count: usize) -> impl Iterator<Item = [f64; 3]> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |at| {
        let z = 1.0 - (1.0 - LEAST_FACING) * (at as f64 + 0.5) / count as f64;
        let (sin, cos) = (golden * at as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        [radius * cos, radius * sin, z]
    })
}

/// Two directions at right angles to a normal and to each other.
fn tangents(normal: [f64; 3]) -> [[f64; 3]; 2] {
    let helper = if normal[2].abs() < 0.9 {
        [0.0, 0.0, 1.0]
    } else {
        [1.0, 0.0, 0.0]
    };
    let u = unit(cross(helper, normal));
    [u, cross(normal, u)]
}

fn leant(normal: [f64; 3], [u, v]: [[f64; 3]; 2], [a, b]: [f64; 2]) -> [f64; 3] {
    unit([0, 1, 2].map(|i| normal[i] + a * u[i] + b * v[i]))
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The vector at length 1; towards the viewer where it has none.
pub(super) fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = dot(v, v).sqrt();
    if length > 1e-12 {
        v.map(|c| c / length)
    } else {
        [0.0, 0.0, 1.0]
    }
}
