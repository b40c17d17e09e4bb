//! The shape of an object out of its normals, as far as its shadow needs it. Knows nothing of light.

use relight_core::image::{Extent, Planes, beside};
use relight_core::light::Normals;

/// The longest side of the grid on which heights are found, cells.
const MAX_SIDE: usize = 72;
/// Normals that face the viewer less than this count as if they did so much: the rim is as steep as can be seen.
const MIN_FACING: f32 = 0.2;
/// Rounds of successive over-relaxation. A round reaches all cells; so many join the ends of a grid.
const ROUNDS: usize = 300;
/// Its factor, for grids of this size.
const RELAXATION: f32 = 1.9;
/// Half the thickness that the flattest object has, cells.
const MIN_THICKNESS: f32 = 0.75;
/// The side of a block of cells, as a power of two.
const BLOCK_BITS: u32 = 3;
/// The side of a block, cells.
pub(crate) const BLOCK: usize = 1 << BLOCK_BITS;

/// The part of an object's width over which a foot is the lowest of its outline.
const FOOT: f64 = 1.0 / 16.0;
/// The largest distance of a foot from the lowest one, as a part of the object's width: anything further hangs in the air.
const MAX_DEPTH: f64 = 0.5;

/// The height of an object towards the viewer, cell by cell. The back is not seen: it is assumed to be the front,
/// mirrored at the plane of the rim.
#[derive(Debug, Clone)]
pub(crate) struct HeightField {
    pub(crate) extent: Extent,
    /// Cells of a pixel's side of the picture.
    pub(crate) scale: f64,
    /// Half the thickness, cells; 0 where there is nothing.
    pub(crate) half: Vec<f32>,
    /// The depth of the middle of the thickness in each column, cells towards the viewer.
    pub(crate) middle: Vec<f32>,
    /// The most by which anything is before or behind the plane of the rim.
    pub(crate) thickest: f32,
    /// The most of it in each block of cells and in those that touch it.
    near: Vec<f32>,
    /// Blocks side by side.
    blocks: usize,
}

impl HeightField {
    /// The shape whose normals these are, where alpha is at least one half; `None` if it is less everywhere.
    ///
    /// Heights are those whose differences from cell to cell are nearest to the slopes that the normals have, by least squares.
    pub(crate) fn new(normals: &Normals, alpha: &Planes<1>) -> Option<Self> {
        let picture = normals.extent();
        let longest = picture.width.max(picture.height);
        let scale = (MAX_SIDE as f64 / longest as f64).min(1.0);
        let side = |pixels: usize| ((pixels as f64 * scale).round() as usize).max(1);
        let extent = Extent::new(side(picture.width), side(picture.height));
        let inside: Vec<bool> = alpha
            .resized(extent)
            .plane(0)
            .iter()
            .map(|&a| a >= 0.5)
            .collect();
        if !inside.contains(&true) {
            return None;
        }
        let vectors = Normals::new(normals.planes().resized(extent)).completed(&inside);
        let solver = HeightSolver {
            least_facing: MIN_FACING,
            relaxation: RELAXATION,
            rounds: ROUNDS,
        };
        let heights = solver.heights(&vectors, &inside);
        let rim = rim_height(&heights, &inside, extent);
        let half = heights.iter().zip(&inside).map(|(&height, &inside)| {
            if inside {
                (height - rim).max(MIN_THICKNESS)
            } else {
                0.0
            }
        });
        let half: Vec<f32> = half.collect();
        Some(Self::from_cells(
            extent,
            scale,
            half,
            vec![0.0; extent.width],
        ))
    }

    fn from_cells(extent: Extent, scale: f64, half: Vec<f32>, middle: Vec<f32>) -> Self {
        let reach = |(at, &half): (usize, &f32)| {
            if half > 0.0 {
                half + middle[at % extent.width].abs()
            } else {
                0.0
            }
        };
        let reach: Vec<f32> = half.iter().enumerate().map(reach).collect();
        Self {
            extent,
            scale,
            thickest: reach.iter().fold(0.0, |a, &b| a.max(b)),
            near: near(&reach, extent),
            blocks: extent.width.div_ceil(BLOCK),
            half,
            middle,
        }
    }

    /// The same shape with all its feet on the ground; `depth` is the ground's distance towards the viewer at a row.
    ///
    /// A foot that ends higher in the picture than the lowest one stands further away. Feet are the columns whose outline is lower
    /// than that of their neighbours, within [`MAX_DEPTH`]; between feet, depth is interpolated linearly.
    pub(crate) fn standing(&self, depth: impl Fn(f64) -> f64) -> Self {
        let Extent { width, height } = self.extent;
        let lowest: Vec<Option<usize>> = (0..width)
            .map(|x| (0..height).rfind(|y| self.half[y * width + x] > 0.0))
            .collect();
        let across = lowest.iter().flatten().count() as f64;
        let nearest = depth(
            lowest
                .iter()
                .flatten()
                .max()
                .map_or(0.0, |&row| row as f64 + 1.0),
        );
        let beside = (across * FOOT).ceil() as usize;
        let foot = |x: usize| {
            let row = lowest[x]?;
            let around = x.saturating_sub(beside)..(x + beside + 1).min(width);
            let is_lowest = lowest[around].iter().flatten().all(|&other| other <= row);
            let middle = (depth(row as f64 + 1.0) - nearest) as f32;
            (is_lowest && f64::from(middle.abs()) <= MAX_DEPTH * across).then_some((x, middle))
        };
        let feet: Vec<(usize, f32)> = (0..width).filter_map(foot).collect();
        let middle = (0..width).map(|x| between_feet(&feet, x)).collect();
        Self::from_cells(self.extent, self.scale, self.half.clone(), middle)
    }

    /// The most of half the thickness and of the depth of all cells that are less than a block's side away from this one.
    pub(crate) fn thickest_near(&self, column: usize, row: usize) -> f32 {
        self.near[(row >> BLOCK_BITS) * self.blocks + (column >> BLOCK_BITS)]
    }
}

/// The depth at a column: interpolated between the feet to its left and right, or that of the nearest one.
fn between_feet(feet: &[(usize, f32)], x: usize) -> f32 {
    let next = feet.partition_point(|&(column, _)| column < x);
    match (
        next.checked_sub(1).and_then(|at| feet.get(at)),
        feet.get(next),
    ) {
        (Some(&(left, a)), Some(&(right, b))) => {
            a + (b - a) * (x - left) as f32 / (right - left) as f32
        }
        (Some(&(_, depth)), None) | (None, Some(&(_, depth))) => depth,
        (None, None) => 0.0,
    }
}

/// The largest value of each block and those that touch it.
fn near(half: &[f32], extent: Extent) -> Vec<f32> {
    let [across, down] = [extent.width, extent.height].map(|side| side.div_ceil(BLOCK));
    let mut most = vec![0.0_f32; across * down];
    for (at, &half) in half.iter().enumerate() {
        let block = at / extent.width / BLOCK * across + at % extent.width / BLOCK;
        most[block] = most[block].max(half);
    }
    let around = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
    (0..most.len())
        .map(|block| {
            around(block / across, down)
                .flat_map(|row| around(block % across, across).map(move |column| [column, row]))
                .fold(0.0_f32, |all, [column, row]| {
                    all.max(most[row * across + column])
                })
        })
        .collect()
}

/// A cell with its neighbours inside.
struct Cell {
    at: u32,
    /// The four neighbours, left, right, above and below; the cell itself in place of a missing one.
    around: [u32; 4],
    /// How many there are not.
    missing: f32,
    /// One over the number of neighbours.
    share: f32,
    /// How much higher it is than their mean, by the slopes.
    step: f32,
}

impl Cell {
    /// `None` if it has no neighbour.
    fn new(at: usize, extent: Extent, inside: &[bool], slopes: &[[f32; 2]]) -> Option<Self> {
        let (mut cell, mut count) = ([at as u32; 4], 0.0);
        let mut sum = 0.0;
        let sides = [(0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0)];
        for (side, other) in beside(extent, at).into_iter().enumerate() {
            let Some(other) = other.filter(|&other| inside[other]) else {
                continue;
            };
            // Rows go down, as slopes are told.
            let (axis, sign) = sides[side];
            sum -= sign * (slopes[at][axis] + slopes[other][axis]) / 2.0;
            count += 1.0;
            cell[side] = other as u32;
        }
        (count > 0.0).then(|| Self {
            at: at as u32,
            around: cell,
            missing: 4.0 - count,
            share: 1.0 / count,
            step: sum / count,
        })
    }
}

/// Heights out of normals, by successive over-relaxation.
pub(crate) struct HeightSolver {
    /// Normals that face the viewer less count as if they did so much: the rim is as steep as can be seen.
    pub(crate) least_facing: f32,
    /// The factor of the over-relaxation.
    pub(crate) relaxation: f32,
    /// How often all cells are gone through.
    pub(crate) rounds: usize,
}

impl HeightSolver {
    /// Heights of the cells inside, in cells, up to a constant; 0 elsewhere. Their differences from cell to cell are nearest to
    /// the slopes of the normals, by least squares.
    pub(crate) fn heights(&self, normals: &Normals, inside: &[bool]) -> Vec<f32> {
        let extent = normals.extent();
        let [x, y, z] = normals.planes().planes();
        let slope = |at: usize| {
            let facing = z[at].max(self.least_facing);
            // Rows go down, y goes up.
            [-x[at] / facing, y[at] / facing]
        };
        let slopes: Vec<[f32; 2]> = (0..inside.len()).map(slope).collect();
        let cells: Vec<Cell> = (0..inside.len())
            .filter(|&at| inside[at])
            .filter_map(|at| Cell::new(at, extent, inside, &slopes))
            .collect();
        let mut heights = vec![0.0_f32; inside.len()];
        for _ in 0..self.rounds {
            for cell in &cells {
                let sum: f32 = cell.around.iter().map(|&at| heights[at as usize]).sum();
                // A side without a neighbour counts the cell itself, which is taken out again.
                let height = &mut heights[cell.at as usize];
                let mean = (sum - cell.missing * *height) * cell.share + cell.step;
                *height += self.relaxation * (mean - *height);
            }
        }
        heights
    }
}

/// The mean height of the cells with a neighbour outside.
fn rim_height(heights: &[f32], inside: &[bool], extent: Extent) -> f32 {
    let is_rim = |at: usize| {
        inside[at]
            && relight_core::image::beside(extent, at)
                .into_iter()
                .any(|other| other.is_none_or(|other| !inside[other]))
    };
    let rim: Vec<f32> = (0..inside.len())
        .filter(|&at| is_rim(at))
        .map(|at| heights[at])
        .collect();
    rim.iter().sum::<f32>() / rim.len().max(1) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_is_half_as_thick_as_it_is_wide() {
        let normals = Normals::sphere(160);
        let alpha = Planes::from_fn(normals.extent(), |x, y| {
            [f32::from(u8::from(normals.planes().pixel(x, y)[2] > 0.0))]
        });
        let relief = HeightField::new(&normals, &alpha).unwrap();
        assert_eq!(relief.extent, Extent::new(MAX_SIDE, MAX_SIDE));
        let radius = MAX_SIDE as f32 / 2.0;
        let middle = relief.half[MAX_SIDE / 2 * MAX_SIDE + MAX_SIDE / 2];
        assert!((middle / radius - 0.85).abs() < 0.15, "{middle}");
        let beside = relief.half[MAX_SIDE / 2 * MAX_SIDE + MAX_SIDE / 2 + MAX_SIDE / 4];
        assert!(beside < middle && beside > 0.6 * middle, "{beside}");
        assert_eq!(relief.half[0], 0.0);
    }

    #[test]
    fn what_faces_the_viewer_is_thin_and_nothing_has_no_shape() {
        let extent = Extent::new(50, 80);
        let flat = Normals::new(Planes::filled(extent, [0.0, 0.0, 1.0]));
        let relief = HeightField::new(&flat, &Planes::filled(extent, [1.0])).unwrap();
        assert!(relief.half.iter().all(|&half| half == MIN_THICKNESS));
        assert!(HeightField::new(&flat, &Planes::zeros(extent)).is_none());
    }

    /// A table with two legs, the right one eight rows shorter, and an arm that ends far above.
    fn table() -> HeightField {
        let extent = Extent::new(60, 60);
        let flat = Normals::new(Planes::filled(extent, [0.0, 0.0, 1.0]));
        let alpha = Planes::from_fn(extent, |x, y| {
            let end = match x {
                2..6 => 14,
                10..16 => 58,
                40..46 => 50,
                _ => 0,
            };
            let is_top = (4..10).contains(&y) && (2..46).contains(&x);
            [f32::from(u8::from(is_top || (4..end).contains(&y)))]
        });
        HeightField::new(&flat, &alpha).unwrap()
    }

    #[test]
    fn feet_that_end_higher_stand_further_away_and_what_hangs_stays() {
        // Ground that goes away by two cells for each row up.
        let standing = table().standing(|below| 2.0 * below + 5.0);
        assert!(standing.middle[12].abs() < 1e-4, "{:?}", standing.middle);
        assert!(
            (standing.middle[42] + 16.0).abs() < 1e-4,
            "{:?}",
            standing.middle
        );
        assert!(
            (standing.middle[28] + 8.0).abs() < 1.0,
            "{:?}",
            standing.middle
        );
        // The arm would have to stand 88 cells away.
        assert_eq!(standing.middle[3], standing.middle[10]);
        assert!((standing.thickest - 16.0 - MIN_THICKNESS).abs() < 1e-4);
    }
}
