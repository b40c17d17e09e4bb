//! Bodies of revolution: an outline turned about the vertical axis, hollow ones with a wall, some with
//! a handle.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::super::mesh::RawMesh;
use super::super::random::Random;
use super::surface::add_grid;

/// Steps around the axis.
const AROUND: u32 = 96;
/// Points of a rounded outline.
const FINE: usize = 40;

/// A random solid.
pub(super) fn draw(random: &mut Random) -> RawMesh {
    let outer = outline(random);
    let widest = outer.iter().map(|p| p.x).fold(0.0, f32::max);
    let is_hollow = random.chance(0.55);
    let profile = if is_hollow {
        hollow(&outer, random.uniform(0.03..0.1))
    } else {
        closed(&outer)
    };
    let mut raw = RawMesh::default();
    turn(&mut raw, &profile);
    if random.chance(0.4) {
        let middle = outer[outer.len() / 2].x;
        handle(&mut raw, random, middle.max(widest * 0.6));
    }
    raw
}

/// Radius and height from the bottom to the top, at -1 and 1.
fn outline(random: &mut Random) -> Vec<Vec2> {
    let slimness = random.uniform(0.5..1.6);
    let is_straight = random.chance(0.4);
    let count = if is_straight { 2 } else { random.count(3..7) };
    let mut heights: Vec<f32> = (0..count).map(|_| random.uniform(-1.0..1.0)).collect();
    heights.sort_by(f32::total_cmp);
    heights[0] = -1.0;
    heights[count - 1] = 1.0;
    let low = if is_straight { 0.4 } else { 0.2 };
    let knots: Vec<Vec2> = heights
        .iter()
        .map(|&y| Vec2::new(random.uniform(low..0.9) / slimness, y))
        .collect();
    if is_straight || random.chance(0.35) {
        return knots;
    }
    let steps = (0..FINE).map(|k| k as f32 / (FINE - 1) as f32 * 2.0 - 1.0);
    steps
        .map(|y| Vec2::new(smooth_radius(&knots, y), y))
        .collect()
}

/// Between two knots the radius goes over as a cosine does: without corners, and never beyond them.
fn smooth_radius(knots: &[Vec2], y: f32) -> f32 {
    let after = knots
        .iter()
        .position(|knot| knot.y >= y)
        .unwrap_or(knots.len() - 1)
        .max(1);
    let (from, to) = (knots[after - 1], knots[after]);
    let part = ((y - from.y) / (to.y - from.y).max(1e-6)).clamp(0.0, 1.0);
    let eased = 0.5 - 0.5 * (part * TAU / 2.0).cos();
    from.x + (to.x - from.x) * eased
}

/// The outline with a bottom and a lid.
fn closed(outer: &[Vec2]) -> Vec<Vec2> {
    let (first, last) = (outer[0], outer[outer.len() - 1]);
    let ends = [Vec2::new(0.0, first.y), Vec2::new(0.0, last.y)];
    [&ends[..1], outer, &ends[1..]].concat()
}

/// The outline with a bottom, a rim and an inside.
fn hollow(outer: &[Vec2], wall: f32) -> Vec<Vec2> {
    let floor = outer[0].y + wall;
    let bottom = [Vec2::new(0.0, outer[0].y)];
    let inside: Vec<Vec2> = outer
        .iter()
        .rev()
        .map(|p| Vec2::new((p.x - wall).max(0.02), p.y.max(floor)))
        .collect();
    [&bottom[..], outer, &inside, &[Vec2::new(0.0, floor)]].concat()
}

fn turn(raw: &mut RawMesh, profile: &[Vec2]) {
    let rows = profile.len() as u32 - 1;
    add_grid(raw, AROUND, rows, |u, v| {
        let row = ((v + 1.0) / 2.0 * rows as f32).round() as usize;
        let Vec2 { x: radius, y } = profile[row];
        // The seam's two ends are one place.
        let angle = if u >= 1.0 { -1.0 } else { u } * TAU / 2.0;
        Vec3::new(radius * angle.sin(), y, radius * angle.cos())
    });
}

/// A ring that stands upright at the side.
fn handle(raw: &mut RawMesh, random: &mut Random, radius: f32) {
    let (major, minor) = (random.uniform(0.25..0.5), random.uniform(0.05..0.1));
    let height = random.uniform(-0.3..0.3);
    add_grid(raw, 48, 24, |u, v| {
        let (around, across) = (u * TAU / 2.0, v * TAU / 2.0);
        let ring = major + minor * across.cos();
        let place = Vec3::new(
            ring * around.cos(),
            ring * around.sin(),
            minor * across.sin(),
        );
        place + Vec3::new(radius + major * 0.3, height, 0.0)
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rounded_outline_passes_through_its_knots_and_never_beyond() {
        let knots = [
            Vec2::new(0.3, -1.0),
            Vec2::new(0.8, 0.2),
            Vec2::new(0.5, 1.0),
        ];
        for knot in knots {
            assert!((smooth_radius(&knots, knot.y) - knot.x).abs() < 1e-6);
        }
        for k in 0..100 {
            let radius = smooth_radius(&knots, k as f32 / 50.0 - 1.0);
            assert!((0.3..=0.8).contains(&radius));
        }
    }

    #[test]
    fn a_hollow_body_has_an_inside_that_stays_within_it() {
        let outer = [Vec2::new(0.5, -1.0), Vec2::new(0.6, 1.0)];
        let profile = hollow(&outer, 0.1);
        assert_eq!(profile.first().map(|p| p.x), Some(0.0));
        assert_eq!(profile.last(), Some(&Vec2::new(0.0, -0.9)));
        assert!(profile[3..].iter().all(|p| p.x <= 0.5 && p.y >= -0.9));
    }
}
