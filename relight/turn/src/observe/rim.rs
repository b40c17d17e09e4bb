//! The table's round rim in the video, whose ellipse says how high the camera looks down on the table.
//!
//! Camera and table turn together, so the rim stands still in the picture while the background moves behind it. In the
//! mean of the frames the background is a smear along its rows, and the rim is the sharpest edge there is beside the
//! object.
//!
//! A camera is near: it looks down on the middle of the table by several degrees more than along its own axis, which is
//! what the elevation means. So the ellipse is taken for the picture of a circle by a camera whose focal length the
//! panorama strip has found.

use relight_core::image::{Extent, Planes, Rgb, Srgb};
use relight_core::light::NormalEquations;

use crate::model::frame::Elevation;
use crate::observe::reading::ReadTurn;

/// Parameters of the search for the rim.
struct RimParameters {
    /// Columns in which edges are looked for. By hand.
    columns: usize,
    /// Distance over which brightness is compared, heights of the picture. By hand.
    reach: f64,
    /// Least edge, as the logarithm of the ratio of brightness. By hand.
    least_edge: f32,
    /// Edges of a column that are kept. By hand: the rim above and below, and one of the background.
    edges: usize,
    /// Around the object's mask nothing is looked at, in widths of the picture. By hand: its shadow and its reflection.
    margin: f64,
    /// Ellipses that are tried. By hand.
    trials: u32,
    /// Distance of an edge from its ellipse, heights of the picture. By hand.
    tolerance: f64,
    /// Rounds of least squares over the edges that belong to it. By hand.
    rounds: usize,
    /// Least part of the columns that show the rim. By hand.
    least_part: f64,
    /// Range of the rim's width, widths of the picture. By hand.
    width: (f64, f64),
    /// Range of the elevation, degrees. By hand.
    elevation_deg: (f64, f64),
    /// Parts of the edges that are left out in turn for the uncertainty (jackknife). By convention.
    parts: usize,
    /// Uncertainty of the focal length, as a part of it. By hand: the strip's angle is found in whole degrees.
    focal: f64,
    /// Uncertainty of the lens's middle in the picture, in halves of the picture's width. By hand.
    middle: f64,
    /// What it is off besides, degrees. Measured: 0.1, 0.7 and 0.8 on three rendered sessions.
    own_deg: f64,
    /// Step in which the elevation is looked for before it is narrowed down, degrees. Numerical.
    step_deg: f64,
    /// Largest uncertainty that counts as an answer, degrees. By hand.
    most_uncertainty_deg: f64,
}

const PARAMETERS: RimParameters = RimParameters {
    columns: 200,
    reach: 1.0 / 160.0,
    least_edge: 0.12,
    edges: 3,
    margin: 0.02,
    trials: 3000,
    tolerance: 1.0 / 160.0,
    rounds: 4,
    least_part: 0.35,
    width: (0.3, 2.0),
    elevation_deg: (3.0, 75.0),
    parts: 6,
    focal: 0.03,
    middle: 0.02,
    own_deg: 0.7,
    step_deg: 0.5,
    most_uncertainty_deg: 5.0,
};

/// Numbers that an ellipse with level axes has: `x² + c y² + d x + e y + f = 0`.
const UNKNOWNS: usize = 4;

/// The mean of the video's frames, in which what rides on the table stands still.
#[derive(Debug)]
pub(crate) struct RimBuilder {
    extent: Extent,
    light: Vec<f32>,
    frames: u32,
}

/// An edge of the mean picture, from its middle, in halves of its width; y downwards.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Edge {
    x: f64,
    y: f64,
    column: usize,
}

/// An ellipse with level axes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ellipse {
    centre: [f64; 2],
    /// Half its width and half its height.
    halves: [f64; 2],
}

impl RimBuilder {
    /// For frames of this size.
    pub(crate) fn new(extent: Extent) -> Self {
        Self {
            extent,
            light: vec![0.0; extent.pixels()],
            frames: 0,
        }
    }

    /// Takes up a frame.
    pub(crate) fn push(&mut self, frame: &Rgb<Srgb>) {
        if frame.planes().extent() != self.extent {
            return;
        }
        for plane in frame.planes().planes() {
            for (sum, &value) in self.light.iter_mut().zip(plane) {
                *sum += value;
            }
        }
        self.frames += 1;
    }

    /// The elevation by the rim of the turn's table, as a camera of this focal length sees it, pixels; none where the
    /// video does not show it clearly.
    pub(crate) fn finish(self, turn: &ReadTurn, focal: f64) -> Option<Elevation> {
        let hidden = hidden_by(turn, self.extent)?;
        let mean = self.mean()?;
        let focal = 2.0 * focal / self.extent.width as f64;
        elevation_of(&edges_of(&mean, &hidden), self.extent, focal)
    }

    /// The logarithm of the mean brightness.
    fn mean(&self) -> Option<Planes<1>> {
        let frames = (3 * self.frames) as f32;
        let at =
            |x: usize, y: usize| [(self.light[y * self.extent.width + x] / frames + 0.01).ln()];
        (self.frames > 0).then(|| Planes::from_fn(self.extent, at))
    }
}

/// Where the object hides the table; none where it is not known which part of the video the shard shows.
fn hidden_by(turn: &ReadTurn, extent: Extent) -> Option<Vec<bool>> {
    let crop = turn.origin.as_ref()?.crop;
    let Extent { width, height } = turn.mask.extent();
    let mut hidden = vec![false; extent.pixels()];
    let margin = (PARAMETERS.margin * extent.width as f64).ceil() as i64;
    let scale = [
        f64::from(crop.w) / width as f64,
        f64::from(crop.h) / height as f64,
    ];
    for (at, _) in (0..)
        .zip(turn.mask.plane(0))
        .filter(|(_, mask)| **mask >= 0.5)
    {
        let corner =
            |from: i32, at: usize, scale: f64| i64::from(from) + (at as f64 * scale) as i64;
        let (x, y) = (
            corner(crop.x, at % width, scale[0]),
            corner(crop.y, at / width, scale[1]),
        );
        let far = [0, 1].map(|axis| margin + scale[axis].ceil() as i64);
        for row in (y - margin).max(0)..(y + far[1]).min(extent.height as i64) {
            let begin = (x - margin).clamp(0, extent.width as i64) as usize;
            let end = (x + far[0]).clamp(0, extent.width as i64) as usize;
            let row = row as usize * extent.width;
            hidden[row + begin..row + end.max(begin)].fill(true);
        }
    }
    Some(hidden)
}

/// The strongest edges of some columns, the object left out.
fn edges_of(mean: &Planes<1>, hidden: &[bool]) -> Vec<Edge> {
    let Extent { width, height } = mean.extent();
    let reach = ((PARAMETERS.reach * height as f64).round() as usize).max(1);
    let every = (width / PARAMETERS.columns).max(1);
    let light = mean.plane(0);
    let mut edges = Vec::new();
    for x in (every / 2..width).step_by(every) {
        // A few columns together: noise is no edge.
        let beside = x.saturating_sub(1)..(x + 2).min(width);
        let is_free = |y: usize| !hidden[y * width + x];
        let size = |y: usize| {
            let change = |x: usize| light[(y + reach) * width + x] - light[(y - reach) * width + x];
            beside.clone().map(change).sum::<f32>().abs() / beside.len() as f32
        };
        let rows = reach..height.saturating_sub(reach);
        let sizes: Vec<f32> = rows
            .clone()
            .map(|y| {
                if is_free(y - reach) && is_free(y + reach) {
                    size(y)
                } else {
                    0.0
                }
            })
            .collect();
        let mut peaks: Vec<(f32, usize)> = (0..sizes.len())
            .filter(|&k| sizes[k] >= PARAMETERS.least_edge)
            .filter(|&k| {
                let around = k.saturating_sub(reach)..(k + reach + 1).min(sizes.len());
                sizes[around].iter().all(|other| *other <= sizes[k])
            })
            .map(|k| (sizes[k], k + reach))
            .collect();
        peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
        let half = width as f64 / 2.0;
        edges.extend(peaks.iter().take(PARAMETERS.edges).map(|&(_, y)| Edge {
            x: (x as f64 + 0.5 - half) / half,
            y: (y as f64 + 0.5 - height as f64 / 2.0) / half,
            column: x / every,
        }));
    }
    edges
}

/// The elevation by the ellipse that most columns have an edge on. `focal` is in halves of the picture's width.
fn elevation_of(edges: &[Edge], extent: Extent, focal: f64) -> Option<Elevation> {
    let tolerance = 2.0 * PARAMETERS.tolerance * extent.height as f64 / extent.width as f64;
    let columns = edges.iter().map(|edge| edge.column).max()? + 1;
    let mut best: (usize, Option<Ellipse>) = (0, None);
    let mut random = Draws(0x9e37_79b9_7f4a_7c15);
    for _ in 0..PARAMETERS.trials {
        let drawn: [Edge; UNKNOWNS] = std::array::from_fn(|_| edges[random.below(edges.len())]);
        let Some(ellipse) = Ellipse::of(&drawn) else {
            continue;
        };
        let count = columns_of(edges, &ellipse, tolerance);
        if count > best.0 {
            best = (count, Some(ellipse));
        }
    }
    let mut ellipse = best.1?;
    let mut members = Vec::new();
    for _ in 0..PARAMETERS.rounds {
        members = edges
            .iter()
            .copied()
            .filter(|edge| ellipse.distance(edge) < tolerance)
            .collect::<Vec<Edge>>();
        ellipse = Ellipse::of(&members)?;
    }
    let shown = columns_of(edges, &ellipse, tolerance) as f64;
    let both_sides = [-1.0, 1.0].iter().all(|side| {
        let edge = |edge: &&Edge| (edge.x - ellipse.centre[0]) * side > 0.5 * ellipse.halves[0];
        members.iter().filter(edge).count() >= 4
    });
    if shown < PARAMETERS.least_part * columns as f64 || !both_sides {
        return None;
    }
    let degrees = ellipse.elevation_deg(focal)?;
    Elevation::seen(degrees, uncertainty_deg(&members, &ellipse, focal)?)
        .ok()
        .filter(|elevation| elevation.uncertainty_deg() <= PARAMETERS.most_uncertainty_deg)
}

/// The uncertainty of an ellipse's elevation: by leaving out a part of its edges in turn, and by the camera's own numbers.
fn uncertainty_deg(members: &[Edge], ellipse: &Ellipse, focal: f64) -> Option<f64> {
    let degrees = ellipse.elevation_deg(focal)?;
    let parts = PARAMETERS.parts;
    let mut sum = 0.0;
    for part in 0..parts {
        // Parts beside each other, so that none is measured by its own neighbours.
        let (begin, end) = (
            part * members.len() / parts,
            (part + 1) * members.len() / parts,
        );
        let rest: Vec<Edge> = [&members[..begin], &members[end..]].concat();
        sum += (Ellipse::of(&rest)?.elevation_deg(focal)? - degrees).powi(2);
    }
    let of_edges = (sum * (parts - 1) as f64 / parts as f64).sqrt();
    let of_focal = ellipse.elevation_deg(focal * (1.0 + PARAMETERS.focal))? - degrees;
    let [x, y] = ellipse.centre;
    let moved = Ellipse {
        centre: [x, y + PARAMETERS.middle],
        ..*ellipse
    };
    let of_middle = moved.elevation_deg(focal)? - degrees;
    let of_camera = of_focal.hypot(of_middle).hypot(PARAMETERS.own_deg);
    Some(of_edges.hypot(of_camera))
}

/// Columns that have an edge on an ellipse.
fn columns_of(edges: &[Edge], ellipse: &Ellipse, tolerance: f64) -> usize {
    let mut last = None;
    let mut count = 0;
    for edge in edges {
        if last != Some(edge.column) && ellipse.distance(edge) < tolerance {
            last = Some(edge.column);
            count += 1;
        }
    }
    count
}

impl Ellipse {
    /// Through edges, by least squares; none where that is no rim.
    fn of(edges: &[Edge]) -> Option<Self> {
        let mut equations = NormalEquations::new(UNKNOWNS);
        for edge in edges {
            let row = [edge.y * edge.y, edge.x, edge.y, 1.0];
            equations.add(&row, [-edge.x * edge.x, 0.0, 0.0]);
        }
        let solved = equations.solve()?;
        let [c, d, e, f] = [0, 1, 2, 3].map(|k: usize| solved[k][0]);
        // Seen from above a rim is wider than high.
        if c.is_nan() || c <= 1.0 {
            return None;
        }
        let centre = [-d / 2.0, -e / (2.0 * c)];
        let square = centre[0].powi(2) + c * centre[1].powi(2) - f;
        if square.is_nan() || square <= 0.0 {
            return None;
        }
        let found = Self {
            centre,
            halves: [square.sqrt(), (square / c).sqrt()],
        };
        found.is_rim().then_some(found)
    }

    /// How far the camera looks down whose picture of a level circle this is, degrees; none where there is no such camera.
    fn elevation_deg(&self, focal: f64) -> Option<f64> {
        let (low, high) = PARAMETERS.elevation_deg;
        let wider = |degrees: f64| Some(self.width_at(degrees, focal)? - self.halves[0]);
        let steps = ((high - low) / PARAMETERS.step_deg) as u32;
        let mut at = (0..steps).map(|step| low + PARAMETERS.step_deg * f64::from(step));
        let mut begin = at.find(|&degrees| {
            let ends = [degrees, degrees + PARAMETERS.step_deg].map(wider);
            matches!(ends, [Some(a), Some(b)] if a * b <= 0.0)
        })?;
        let mut end = begin + PARAMETERS.step_deg;
        for _ in 0..30 {
            let middle = (begin + end) / 2.0;
            if wider(begin)? * wider(middle)? <= 0.0 {
                end = middle;
            } else {
                begin = middle;
            }
        }
        Some(begin)
    }

    /// Half the width that the circle has whose far and near side are those of this ellipse, for a camera that looks down
    /// by so many degrees.
    fn width_at(&self, degrees: f64, focal: f64) -> Option<f64> {
        let down = degrees.to_radians();
        let reach = [-1.0, 1.0].map(|side| {
            let below = ((self.centre[1] + side * self.halves[1]) / focal).atan();
            // How far away, in heights of the camera over the table.
            1.0 / (down + below).tan()
        });
        let [far, near] = reach;
        let (middle, radius) = ((far + near) / 2.0, (far - near) / 2.0);
        let (sin, cos) = down.sin_cos();
        let (depth, change) = (middle * cos + sin, radius * cos);
        (radius > 0.0 && near > 0.0 && depth > change)
            .then(|| focal * radius / (depth * depth - change * change).sqrt())
    }

    fn is_rim(&self) -> bool {
        let (narrow, wide) = PARAMETERS.width;
        let (low, high) = PARAMETERS.elevation_deg;
        (narrow..=wide).contains(&self.halves[0])
            && (low..=high).contains(&(self.halves[1] / self.halves[0]).asin().to_degrees())
            && self.centre[0].abs() < 0.5
    }

    /// How far an edge is above or below it.
    fn distance(&self, edge: &Edge) -> f64 {
        let along = (edge.x - self.centre[0]) / self.halves[0];
        let height = self.halves[1] * (1.0 - along * along).max(0.0).sqrt();
        let beside = self.halves[0] * (along.abs() - 1.0).max(0.0);
        let off = ((edge.y - self.centre[1]).abs() - height).abs();
        // Where it is steep, by how far the edge is beside it.
        let steep =
            self.halves[1] * along.abs() / (1.0 - along * along).max(1e-3).sqrt() / self.halves[0];
        off / steep.hypot(1.0) + beside
    }
}

/// Numbers that look random, the same in every run.
struct Draws(u64);

impl Draws {
    fn below(&mut self, count: usize) -> usize {
        // Knuth's MMIX generator; its upper bits are good.
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % count.max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXTENT: Extent = Extent {
        width: 320,
        height: 240,
    };

    /// Of the camera, in halves of the picture's width: a field of 26 degrees.
    const FOCAL: f64 = 4.33;

    /// A black table of some radius before a background that brightens upwards, seen by a camera that looks down by so
    /// many degrees on a point above the table's middle; in radii of a rather large table.
    fn mean(degrees: f64, radius: f64) -> Planes<1> {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let (away, above) = (3.8 * cos, 3.8 * sin + 0.4);
        Planes::from_fn(EXTENT, |x, y| {
            let right = (x as f64 + 0.5 - 160.0) / 160.0 / FOCAL;
            let down = (y as f64 + 0.5 - 120.0) / 160.0 / FOCAL;
            // The ray, forwards and downwards in the room.
            let (forwards, downwards) = (cos - down * sin, sin + down * cos);
            let reach = above / downwards;
            let is_table =
                downwards > 0.0 && (reach * right).hypot(reach * forwards - away) < radius;
            let light = if is_table {
                0.06
            } else {
                0.5 - y as f64 / 1000.0
            };
            [(light as f32 + 0.01).ln()]
        })
    }

    /// The object before the middle of the table.
    fn hidden() -> Vec<bool> {
        (0..EXTENT.pixels())
            .map(|at| (110..210).contains(&(at % 320)) && (40..175).contains(&(at / 320)))
            .collect()
    }

    #[test]
    fn the_rim_of_a_table_says_by_how_much_the_camera_looks_down() {
        for (degrees, radius) in [(14.0, 0.95), (20.0, 0.9), (30.0, 0.8)] {
            let edges = edges_of(&mean(degrees, radius), &hidden());
            let found = elevation_of(&edges, EXTENT, FOCAL).unwrap();
            let off = (found.degrees() - degrees).abs();
            assert!(off < 1.0, "{degrees}: {found:?}");
            assert!((0.3..4.0).contains(&found.uncertainty_deg()), "{found:?}");
        }
    }

    #[test]
    fn a_picture_without_a_rim_has_no_elevation() {
        let found = |mean: Planes<1>| elevation_of(&edges_of(&mean, &hidden()), EXTENT, FOCAL);
        let floor = |_, y| [if y > 150 { -2.0 } else { -0.5 }];
        assert_eq!(found(Planes::from_fn(EXTENT, floor)), None);
        assert_eq!(found(Planes::from_fn(EXTENT, |_, _| [-1.0])), None);
    }
}
