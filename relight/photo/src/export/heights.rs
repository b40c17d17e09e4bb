//! Heights out of normals, by least squares. Knows nothing of meshes and files.

use std::f32::consts::{PI, SQRT_2};

use relight_core::image::{Extent, beside, connected_parts};
use relight_core::light::Normals;

use crate::relighting::HeightSolver;

/// Normals that face the viewer less than this count as if they did so much: the rim is as steep as can be seen.
const MIN_FACING: f32 = 0.12;
/// Rounds of the solver for each pixel of the longer side: they reduce the residual to e^-17.
const ROUNDS: usize = 4;

/// The heights towards the viewer, in pixels, of the pixels inside; 0 elsewhere. Differences from pixel to pixel are
/// nearest to the slopes of the normals, by least squares. The rim of each part that hangs together is at 0 in the mean.
///
/// # Panics
/// Where `inside` is not as long as the map has pixels.
pub(super) fn integrated(normals: &Normals, inside: &[bool]) -> Vec<f32> {
    let extent = normals.extent();
    assert_eq!(inside.len(), extent.pixels());
    let longest = extent.width.max(extent.height);
    let solver = HeightSolver {
        least_facing: MIN_FACING,
        // The best for waves as long as the grid, whose ends are free.
        relaxation: 2.0 / (1.0 + PI / (SQRT_2 * longest as f32)),
        rounds: ROUNDS * longest,
    };
    let mut heights = solver.heights(normals, inside);
    settle(&mut heights, extent, inside);
    heights
}

/// Brings the rim of each part that hangs together to 0 in the mean.
fn settle(heights: &mut [f32], extent: Extent, inside: &[bool]) {
    let neighbours = |at: usize| beside(extent, at).into_iter().flatten();
    let is_rim = |at: usize| neighbours(at).filter(|&other| inside[other]).count() < 4;
    for part in connected_parts(extent, inside.to_vec()) {
        let rim = part.iter().filter(|&&at| is_rim(at));
        let rim: Vec<f32> = rim.map(|&at| heights[at]).collect();
        let level = rim.iter().sum::<f32>() / rim.len().max(1) as f32;
        for at in part {
            heights[at] -= level;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::Planes;

    #[test]
    fn a_ball_is_as_high_as_its_radius() {
        let side = 200;
        let normals = Normals::sphere(side);
        let inside: Vec<bool> = normals.planes().plane(2).iter().map(|&z| z > 0.0).collect();
        let heights = integrated(&normals, &inside);
        let at = |x: usize, y: usize| heights[y * side + x];
        let radius = side as f32 / 2.0;
        // The ground is the rim's mean: half a pixel to one pixel inside, a ball of this radius is 10 to 14 pixels high.
        let top = at(100, 100);
        assert!((86.0..=92.0).contains(&top), "{top}");
        // Half a radius from the middle a ball is lower by 1 - sqrt(3) / 2.
        let fall = at(100, 100) - at(150, 100);
        assert!((fall / radius - 0.134).abs() < 0.01, "{fall}");
        assert!((at(100, 50) - at(100, 150)).abs() < 1.0);
    }

    #[test]
    fn parts_that_do_not_touch_stand_on_the_same_ground() {
        let extent = Extent::new(21, 8);
        let normals = Normals::new(Planes::from_fn(extent, |x, _| {
            if x < 10 {
                [0.6, 0.0, 0.8]
            } else {
                [0.0, 0.0, 1.0]
            }
        }));
        let inside: Vec<bool> = (0..extent.pixels()).map(|at| at % 21 != 10).collect();
        let heights = integrated(&normals, &inside);
        // A slope falls to the right by 3/4 of a pixel a pixel.
        assert!((heights[0] - heights[8] - 6.0).abs() < 1e-2);
        assert!(heights[12].abs() < 1e-6);
    }
}
