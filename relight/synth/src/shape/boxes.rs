//! Boxes: one that is open at the top, or a few that stick in one another.

use glam::{Mat3, Vec3};

use super::super::mesh::RawMesh;
use super::super::random::Random;
use super::surface::add_quad;

/// A random arrangement.
pub(super) fn draw(random: &mut Random) -> RawMesh {
    let mut raw = RawMesh::default();
    if random.chance(0.55) {
        open(&mut raw, random);
    } else {
        for _ in 0..random.count(1..5) {
            let turn = if random.chance(0.5) {
                random.rotation()
            } else {
                Mat3::IDENTITY
            };
            let half = Vec3::from_array([(); 3].map(|()| random.uniform(0.15..0.6)));
            add_box(&mut raw, random.in_box(0.5), half, turn);
        }
    }
    raw
}

/// Four walls and a floor.
fn open(raw: &mut RawMesh, random: &mut Random) {
    let side = Vec3::from_array([(); 3].map(|()| random.uniform(0.4..1.0)));
    let wall = random.uniform(0.02..0.08) / 2.0;
    let mut add = |centre, half| add_box(raw, centre, half, Mat3::IDENTITY);
    for sign in [-1.0, 1.0] {
        add(
            Vec3::Z * side.z * sign,
            Vec3::new(side.x + wall, side.y, wall),
        );
        add(
            Vec3::X * side.x * sign,
            Vec3::new(wall, side.y, side.z - wall),
        );
    }
    add(
        Vec3::NEG_Y * (side.y - wall),
        Vec3::new(side.x - wall, wall, side.z - wall),
    );
}

fn add_box(raw: &mut RawMesh, centre: Vec3, half: Vec3, turn: Mat3) {
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let first = raw.positions.len() as u32;
            for (u, v) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                let mut corner = [0.0; 3];
                corner[axis] = sign;
                corner[(axis + 1) % 3] = u * sign;
                corner[(axis + 2) % 3] = v;
                raw.positions
                    .push(centre + turn * (Vec3::from_array(corner) * half));
            }
            add_quad(raw, [first, first + 1, first + 2, first + 3]);
        }
    }
}
