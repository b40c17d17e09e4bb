//! The normal of one pixel: the one whose curve is nearest to what was seen.

use std::f64::consts::PI;

use super::body::BodyKind;
use super::gloss::{GlossLight, mirror_terms};
use super::light::{MATT_WAVES, WAVES};
use super::moments::{Moments, PixelWaves, WaveProducts, dot as sum_of_products};
use super::{TableFrame, TableLight};

/// How many normals are tried first, evenly over the half sphere that faces the viewer: about 7 degrees apart.
const TRIED: usize = 400;
/// How many of them are refined: the best ones.
const STARTS: usize = 3;
/// A surface that is seen faces the viewer by at least this.
const LEAST_FACING: f64 = 0.02;
/// Steps by which each of these is refined before the best is taken.
const FIRST_STEPS: usize = 4;
/// Most steps of the refinement, the one at which it ends, radians, and the longest.
const STEPS: usize = 16;
const LAST_STEP: f64 = 1e-4;
const LONGEST_STEP: f64 = 0.2;
/// The step by which a slope is measured, radians.
const SLOPE_STEP: f64 = 1e-4;
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

/// The light of the room, as a pixel shows it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room {
    pub(super) frame: TableFrame,
    pub(super) light: TableLight,
    /// What gloss shows of it beside the matt part; of metal, what a white one shows.
    pub(super) gloss: GlossLight,
    pub(super) body: BodyKind,
}

impl Room {
    /// The waves of a normal in the viewer's frame.
    pub(super) fn waves(&self, normal: [f64; 3]) -> PixelWaves {
        let reflected = self.frame.to_table(reflected(normal));
        match self.body {
            BodyKind::Diffuse => PixelWaves {
                body: self.light.waves(self.frame.to_table(normal)),
                count: MATT_WAVES,
                gloss: self.gloss.waves(normal[2], reflected),
            },
            BodyKind::Metal => PixelWaves {
                body: self.gloss.waves_of(&mirror_terms(reflected)),
                count: WAVES,
                gloss: [[0.0; WAVES]; 3],
            },
        }
    }
}

/// Where the viewer's direction is reflected to.
pub(super) fn reflected([x, y, z]: [f64; 3]) -> [f64; 3] {
    [2.0 * z * x, 2.0 * z * y, 2.0 * z * z - 1.0]
}

/// The normals that are tried in a room.
pub(super) struct Search<'a> {
    room: &'a Room,
    tried: Vec<Tried>,
}

struct Tried {
    normal: [f64; 3],
    waves: PixelWaves,
    products: WaveProducts,
}

impl<'a> Search<'a> {
    pub(super) fn new(room: &'a Room) -> Self {
        let tried = half_sphere(TRIED).map(|normal| {
            let waves = room.waves(normal);
            Tried {
                normal,
                waves,
                products: WaveProducts::of(&waves),
            }
        });
        Self {
            room,
            tried: tried.collect(),
        }
    }

    /// The best normal anywhere.
    pub(super) fn anywhere(&self, moments: &Moments, expected: Option<Expected>) -> PixelFit {
        let mut best = [(f64::INFINITY, [0.0, 0.0, 1.0]); STARTS];
        for tried in &self.tried {
            let cost =
                moments.residual(&tried.waves, &tried.products) + bias(expected, tried.normal);
            if cost < best[STARTS - 1].0 {
                insert(&mut best, (cost, tried.normal));
            }
        }
        let refined = best.map(|(_, start)| self.downhill(moments, expected, start, FIRST_STEPS));
        let [first, rest @ ..] = refined;
        let (start, _) = rest.into_iter().fold(
            first,
            |best, other| {
                if other.1 < best.1 { other } else { best }
            },
        );
        self.near(moments, expected, start)
    }

    /// The best normal that is reached from `start` downhill.
    pub(super) fn near(
        &self,
        moments: &Moments,
        expected: Option<Expected>,
        start: [f64; 3],
    ) -> PixelFit {
        let (normal, _) = self.downhill(moments, expected, start, STEPS);
        PixelFit {
            normal,
            albedo: moments.albedo(&self.room.waves(normal)),
            residual: self.residual(moments, normal),
        }
    }

    /// Where so many steps lead, and what it costs there: Gauss and Newton's steps, damped as Levenberg and Marquardt do,
    /// with the albedo at its best for each normal.
    fn downhill(
        &self,
        moments: &Moments,
        expected: Option<Expected>,
        start: [f64; 3],
        steps: usize,
    ) -> ([f64; 3], f64) {
        let cost = |normal| self.residual(moments, normal) + bias(expected, normal);
        let mut normal = start;
        let mut least = cost(normal);
        let mut damping = 1e-3;
        for _ in 0..steps {
            let axes = tangents(normal);
            let slope = self.slope(moments, expected, normal, axes);
            let step = slope.step(damping);
            let other = leant(normal, axes, step);
            let found = cost(other);
            let length = step[0].hypot(step[1]);
            if other[2] >= LEAST_FACING && found < least {
                (normal, least) = (other, found);
                damping *= 0.2;
            } else {
                damping *= 8.0;
            }
            if length < LAST_STEP {
                break;
            }
        }
        (normal, least)
    }

    /// How the cost changes as a normal leans.
    fn slope(
        &self,
        moments: &Moments,
        expected: Option<Expected>,
        normal: [f64; 3],
        axes: [[f64; 3]; 2],
    ) -> Slope {
        let leaning = self.leaning(moments, normal, axes);
        let mut slope = Slope::default();
        for (channel, ways) in leaning.ways.iter().enumerate() {
            slope.add(moments, channel, ways, &leaning.seen[channel]);
        }
        slope.scale(moments.unit());
        if let Some(expected) = expected {
            slope.lean(expected, normal, axes);
        }
        slope
    }

    /// How the waves of a pixel change as its normal leans.
    pub(super) fn leaning(
        &self,
        moments: &Moments,
        normal: [f64; 3],
        [u, v]: [[f64; 3]; 2],
    ) -> Leaning {
        let here = self.room.waves(normal);
        let albedo = moments.albedo(&here);
        let there = [[SLOPE_STEP, 0.0], [0.0, SLOPE_STEP]]
            .map(|step| self.room.waves(leant(normal, [u, v], step)));
        let body = here.body;
        let seen: [_; 3] = std::array::from_fn(|c| sum(&body[c], albedo[c], &here.gloss[c]));
        let ways = std::array::from_fn(|c| {
            let along = moments.times(c, &body[c]);
            let own = sum_of_products(&body[c], &along);
            there.map(|there| {
                let moved = sum(&there.body[c], albedo[c], &there.gloss[c]);
                let mut way: [f64; WAVES] =
                    std::array::from_fn(|i| (moved[i] - seen[c][i]) / SLOPE_STEP);
                // The albedo follows the normal.
                if own > 1e-12 && albedo[c] > 0.0 {
                    let share = sum_of_products(&way, &along) / own;
                    way.iter_mut()
                        .zip(&body[c])
                        .for_each(|(way, body)| *way -= share * body);
                }
                way
            })
        });
        Leaning {
            albedo,
            body,
            seen,
            ways,
        }
    }

    /// What a normal leaves of a curve.
    pub(super) fn residual(&self, moments: &Moments, normal: [f64; 3]) -> f64 {
        let waves = self.room.waves(normal);
        moments.residual(&waves, &WaveProducts::of(&waves))
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
}

/// The waves of a pixel, channel by channel, and how they change as its normal leans.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leaning {
    pub(super) albedo: [f64; 3],
    /// Those of its body, for an albedo of 1.
    pub(super) body: [[f64; WAVES]; 3],
    /// Those of all that is seen.
    pub(super) seen: [[f64; WAVES]; 3],
    /// The change of the latter with a normal that leans to either side, while the albedo follows.
    pub(super) ways: [[[f64; WAVES]; 2]; 3],
}

/// Half the gradient of the cost over two leanings, and half its second derivative.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Slope {
    pub(super) gradient: [f64; 2],
    /// uu, uv, vv.
    pub(super) bend: [f64; 3],
}

impl Slope {
    pub(super) fn add(
        &mut self,
        moments: &Moments,
        channel: usize,
        [u, v]: &[[f64; WAVES]; 2],
        seen: &[f64; WAVES],
    ) {
        let rest = moments.rest(channel, seen);
        for (gradient, way) in self.gradient.iter_mut().zip([u, v]) {
            *gradient -= sum_of_products(way, &rest);
        }
        let [of_u, of_v] = [u, v].map(|way| moments.times(channel, way));
        for (bend, (a, b)) in self.bend.iter_mut().zip([(u, of_u), (u, of_v), (v, of_v)]) {
            *bend += sum_of_products(a, &b);
        }
    }

    pub(super) fn scale(&mut self, factor: f64) {
        self.gradient.iter_mut().for_each(|value| *value *= factor);
        self.bend.iter_mut().for_each(|value| *value *= factor);
    }

    /// Adds the prior's part.
    pub(super) fn lean(&mut self, expected: Expected, normal: [f64; 3], axes: [[f64; 3]; 2]) {
        let half = 0.5 * expected.weight;
        for (gradient, axis) in self.gradient.iter_mut().zip(axes) {
            *gradient -= half * dot(expected.normal, axis);
        }
        let bend = half * dot(expected.normal, normal).max(0.1);
        self.bend[0] += bend;
        self.bend[2] += bend;
    }

    /// The step to the least cost, were it a parabola.
    fn step(&self, damping: f64) -> [f64; 2] {
        let [uu, uv, vv] = self.bend;
        let more = damping * (uu + vv) + 1e-12;
        let (uu, vv) = (uu + more, vv + more);
        let determinant = uu * vv - uv * uv;
        let [a, b] = self.gradient;
        let step = [
            (uv * b - vv * a) / determinant,
            (uv * a - uu * b) / determinant,
        ];
        let length = step[0].hypot(step[1]);
        if length > LONGEST_STEP {
            step.map(|value| value * LONGEST_STEP / length)
        } else {
            step
        }
    }
}

fn sum(body: &[f64; WAVES], albedo: f64, gloss: &[f64; WAVES]) -> [f64; WAVES] {
    std::array::from_fn(|i| albedo * body[i] + gloss[i])
}

/// Puts one of less cost in its place, and the last one out.
fn insert(best: &mut [(f64, [f64; 3]); STARTS], one: (f64, [f64; 3])) {
    best[STARTS - 1] = one;
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
}

fn bias(expected: Option<Expected>, normal: [f64; 3]) -> f64 {
    expected.map_or(0.0, |expected| {
        expected.weight * (1.0 - dot(expected.normal, normal))
    })
}

/// Directions of a half sphere around the viewer, by a spiral.
pub(super) fn half_sphere(count: usize) -> impl Iterator<Item = [f64; 3]> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |at| {
        let z = 1.0 - (1.0 - LEAST_FACING) * (at as f64 + 0.5) / count as f64;
        let (sin, cos) = (golden * at as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        [radius * cos, radius * sin, z]
    })
}

/// Two directions at right angles to a normal and to each other.
pub(super) fn tangents(normal: [f64; 3]) -> [[f64; 3]; 2] {
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
