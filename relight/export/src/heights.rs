//! Heights out of normals, by least squares. Knows nothing of meshes and files.

use relight_core::image::Extent;
use relight_core::light::{Normals, YUp};

/// Normals that face the viewer less than this count as if they did so much: the rim is as steep as can be seen.
const LEAST_FACING: f32 = 0.12;
/// The residual at which the solver ends, as a part of that of flat heights.
const RESIDUAL: f64 = 1e-5;
/// The most steps of the solver.
const STEPS: usize = 4000;

/// The heights towards the viewer, in pixels, of the pixels inside; 0 elsewhere. Differences from pixel to pixel are
/// nearest to the slopes of the normals, by least squares. The rim of each part that hangs together is at 0 in the mean.
///
/// # Panics
/// Where `inside` is not as long as the map has pixels.
#[must_use]
pub fn integrated(normals: &Normals<YUp>, inside: &[bool]) -> Vec<f32> {
    let extent = normals.extent();
    assert_eq!(inside.len(), extent.pixels());
    let grid = Grid { extent, inside };
    let mut heights = grid.solved(&grid.divergence(normals));
    grid.settle(&mut heights);
    heights.into_iter().map(|height| height as f32).collect()
}

/// Pixels and those of them that belong to the object.
struct Grid<'a> {
    extent: Extent,
    inside: &'a [bool],
}

impl Grid<'_> {
    /// The neighbours of a pixel inside that are inside too.
    fn neighbours(&self, at: usize) -> impl Iterator<Item = usize> + '_ {
        relight_core::image::beside(self.extent, at)
            .into_iter()
            .flatten()
            .filter(|&other| self.inside[other])
    }

    /// The right side of the normal equations: what the slopes say about each pixel's height over its neighbours'.
    fn divergence(&self, normals: &Normals<YUp>) -> Vec<f64> {
        let [x, y, z] = normals.planes().planes();
        let width = self.extent.width;
        // Of a pixel's slope, the rise towards the right and downwards: rows go down, y goes up.
        let slope = |at: usize| {
            let facing = z[at].max(LEAST_FACING);
            [-x[at] / facing, y[at] / facing]
        };
        let rise = |from: usize, to: usize| {
            let axis = usize::from(from.abs_diff(to) == width && width > 1);
            let sign = if to > from { 1.0 } else { -1.0 };
            f64::from(sign * f32::midpoint(slope(from)[axis], slope(to)[axis]))
        };
        (0..self.inside.len())
            .map(|at| match self.inside[at] {
                true => self.neighbours(at).map(|other| -rise(at, other)).sum(),
                false => 0.0,
            })
            .collect()
    }

    /// Solves the normal equations by conjugate gradients, preconditioned by the number of neighbours.
    fn solved(&self, right: &[f64]) -> Vec<f64> {
        let degrees: Vec<f64> = (0..right.len())
            .map(|at| match self.inside[at] {
                true => self.neighbours(at).count().max(1) as f64,
                false => 1.0,
            })
            .collect();
        let mut heights = vec![0.0; right.len()];
        let mut residual = right.to_vec();
        let mut scaled = divided(&residual, &degrees);
        let mut direction = scaled.clone();
        let mut energy = product(&residual, &scaled);
        let least = energy * RESIDUAL * RESIDUAL;
        for _ in 0..STEPS {
            if energy <= least {
                break;
            }
            let image = self.laplacian(&direction);
            let curvature = product(&direction, &image);
            if curvature <= 0.0 {
                break;
            }
            let step = energy / curvature;
            for at in 0..heights.len() {
                heights[at] += step * direction[at];
                residual[at] -= step * image[at];
            }
            scaled = divided(&residual, &degrees);
            let next = product(&residual, &scaled);
            let turn = next / energy;
            for (direction, scaled) in direction.iter_mut().zip(&scaled) {
                *direction = scaled + turn * *direction;
            }
            energy = next;
        }
        heights
    }

    fn laplacian(&self, values: &[f64]) -> Vec<f64> {
        (0..values.len())
            .map(|at| match self.inside[at] {
                true => self
                    .neighbours(at)
                    .map(|other| values[at] - values[other])
                    .sum(),
                false => 0.0,
            })
            .collect()
    }

    /// Brings the rim of each part that hangs together to 0 in the mean.
    fn settle(&self, heights: &mut [f64]) {
        let mut is_seen: Vec<bool> = self.inside.iter().map(|inside| !inside).collect();
        for first in 0..heights.len() {
            if is_seen[first] {
                continue;
            }
            is_seen[first] = true;
            let mut part = vec![first];
            let mut next = 0;
            while next < part.len() {
                for other in self.neighbours(part[next]) {
                    if !is_seen[other] {
                        is_seen[other] = true;
                        part.push(other);
                    }
                }
                next += 1;
            }
            let is_rim = |at: usize| self.neighbours(at).count() < 4;
            let rim: Vec<f64> = part
                .iter()
                .filter(|&&at| is_rim(at))
                .map(|&at| heights[at])
                .collect();
            let level = rim.iter().sum::<f64>() / rim.len().max(1) as f64;
            for at in part {
                heights[at] -= level;
            }
        }
    }
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn divided(values: &[f64], by: &[f64]) -> Vec<f64> {
    values
        .iter()
        .zip(by)
        .map(|(value, by)| value / by)
        .collect()
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
        let normals = Normals::<YUp>::new(Planes::from_fn(extent, |x, _| {
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
