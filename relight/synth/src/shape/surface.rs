//! Triangles for a distance field (naive surface nets) and for grids of points.

use glam::Vec3;

use super::super::mesh::RawMesh;

/// Samples along each side of the field's cube.
const SIDE: usize = 80;
/// Samples along each side of a block that is looked at as a whole first.
const BLOCK: usize = 8;
/// Half of the cube's side.
const REACH: f32 = 1.25;
/// Length between two samples.
const STEP: f32 = 2.0 * REACH / (SIDE - 1) as f32;
/// How much faster than a true distance a field may grow: blends, twists and bumps bend it.
const STEEPEST: f32 = 2.0;

/// Adds a grid of `columns` x `rows` cells, whose points `place` gives for u and v in -1..=1;
/// seen from outside, u runs right and v up.
pub(super) fn add_grid(
    raw: &mut RawMesh,
    columns: u32,
    rows: u32,
    place: impl Fn(f32, f32) -> Vec3,
) {
    let first = raw.positions.len() as u32;
    // Exactly opposite at opposite ends, so that seams meet.
    let part = |k: u32, of: u32| (2.0 * k as f32 - of as f32) / of as f32;
    for row in 0..=rows {
        let points = (0..=columns).map(|column| place(part(column, columns), part(row, rows)));
        raw.positions.extend(points);
    }
    let at = |column: u32, row: u32| first + row * (columns + 1) + column;
    for row in 0..rows {
        for column in 0..columns {
            let corners = [
                at(column, row),
                at(column + 1, row),
                at(column + 1, row + 1),
                at(column, row + 1),
            ];
            add_quad(raw, corners);
        }
    }
}

/// Two triangles for four corners, counter-clockwise as seen from outside.
pub(super) fn add_quad(raw: &mut RawMesh, [a, b, c, d]: [u32; 4]) {
    raw.triangles.push([a, b, c]);
    raw.triangles.push([a, c, d]);
}

/// The surface where `distance` is 0 in the cube from -1.25 to 1.25; negative is inside. At the cube's
/// border everything is outside. Only the largest connected part is kept.
pub(super) fn surface_of(distance: impl Fn(Vec3) -> f32) -> RawMesh {
    let field = Field::sample(distance);
    largest_part(field.net())
}

fn sample_place(index: [usize; 3]) -> Vec3 {
    Vec3::from_array(index.map(|i| i as f32)) * STEP - Vec3::splat(REACH)
}

fn offset([x, y, z]: [usize; 3]) -> usize {
    (z * SIDE + y) * SIDE + x
}

/// Distances on a lattice.
struct Field {
    values: Vec<f32>,
}

impl Field {
    fn sample(distance: impl Fn(Vec3) -> f32) -> Self {
        let mut values = vec![1.0; SIDE * SIDE * SIDE];
        let blocks = SIDE / BLOCK;
        // From the middle of a block to the farthest sample that touches one of its cells.
        let reach = STEP * (BLOCK as f32 / 2.0 + 0.5) * 3.0_f32.sqrt();
        for block in 0..blocks.pow(3) {
            let corner =
                [block, block / blocks, block / blocks / blocks].map(|b| b % blocks * BLOCK);
            let middle = sample_place(corner) + Vec3::splat(STEP * (BLOCK - 1) as f32 / 2.0);
            let centre = distance(middle);
            let is_uniform = centre.abs() > STEEPEST * reach;
            for inner in 0..BLOCK.pow(3) {
                let step = [inner, inner / BLOCK, inner / BLOCK / BLOCK].map(|i| i % BLOCK);
                let index = [0, 1, 2].map(|axis| corner[axis] + step[axis]);
                if index.iter().any(|&i| i == 0 || i == SIDE - 1) {
                    continue;
                }
                values[offset(index)] = if is_uniform {
                    centre
                } else {
                    distance(sample_place(index))
                };
            }
        }
        Self { values }
    }

    fn at(&self, index: [usize; 3]) -> f32 {
        self.values[offset(index)]
    }

    /// One vertex a cell that the surface passes through, one quad an edge that it cuts.
    fn net(&self) -> RawMesh {
        let mut raw = RawMesh::default();
        let mut vertices = vec![u32::MAX; self.values.len()];
        for z in 0..SIDE - 1 {
            for y in 0..SIDE - 1 {
                for x in 0..SIDE - 1 {
                    if let Some(position) = self.vertex([x, y, z]) {
                        vertices[offset([x, y, z])] = raw.positions.len() as u32;
                        raw.positions.push(position);
                    }
                }
            }
        }
        for z in 0..SIDE - 1 {
            for y in 0..SIDE - 1 {
                for x in 0..SIDE - 1 {
                    for axis in 0..3 {
                        self.quad([x, y, z], axis, &vertices, &mut raw);
                    }
                }
            }
        }
        raw
    }

    /// The mean of the places where the surface cuts the edges of a cell.
    fn vertex(&self, cell: [usize; 3]) -> Option<Vec3> {
        let corner = |k: usize| {
            [
                cell[0] + (k & 1),
                cell[1] + ((k >> 1) & 1),
                cell[2] + (k >> 2),
            ]
        };
        let values: [f32; 8] = std::array::from_fn(|k| self.at(corner(k)));
        let inside = values.iter().filter(|&&v| v < 0.0).count();
        if inside == 0 || inside == 8 {
            return None;
        }
        let (mut sum, mut cuts) = (Vec3::ZERO, 0.0);
        for from in 0..8 {
            for bit in [1, 2, 4] {
                let to = from | bit;
                if to == from || (values[from] < 0.0) == (values[to] < 0.0) {
                    continue;
                }
                let part = values[from] / (values[from] - values[to]);
                sum += sample_place(corner(from)).lerp(sample_place(corner(to)), part);
                cuts += 1.0;
            }
        }
        Some(sum / cuts)
    }

    /// The quad around the edge that starts at `index` along `axis`, where the surface cuts it.
    fn quad(&self, index: [usize; 3], axis: usize, vertices: &[u32], raw: &mut RawMesh) {
        let mut end = index;
        end[axis] += 1;
        let (starts_inside, ends_inside) = (self.at(index) < 0.0, self.at(end) < 0.0);
        if starts_inside == ends_inside {
            return;
        }
        // At the cube's border all is outside, so an edge that is cut has cells all around it.
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let around = [(1, 1), (0, 1), (0, 0), (1, 0)].map(|(back_u, back_v)| {
            let mut cell = index;
            cell[u] -= back_u;
            cell[v] -= back_v;
            vertices[offset(cell)]
        });
        let [a, b, c, d] = around;
        let corners = if starts_inside {
            [a, b, c, d]
        } else {
            [d, c, b, a]
        };
        add_quad(raw, corners);
    }
}

/// What hangs together and has the most triangles.
fn largest_part(raw: RawMesh) -> RawMesh {
    let mut parents: Vec<u32> = (0..raw.positions.len() as u32).collect();
    for corners in &raw.triangles {
        let [a, b, c] = corners.map(|vertex| root(&mut parents, vertex));
        parents[b as usize] = a;
        let c = root(&mut parents, c);
        parents[c as usize] = a;
    }
    let mut counts = vec![0_usize; raw.positions.len()];
    let roots: Vec<u32> = raw
        .triangles
        .iter()
        .map(|corners| root(&mut parents, corners[0]))
        .collect();
    for &part in &roots {
        counts[part as usize] += 1;
    }
    let largest = roots
        .iter()
        .copied()
        .max_by_key(|&part| (counts[part as usize], part));
    let kept = raw.triangles.iter().zip(&roots);
    let triangles = kept
        .filter(|(_, part)| Some(**part) == largest)
        .map(|(corners, _)| *corners)
        .collect();
    RawMesh { triangles, ..raw }
}

fn root(parents: &mut [u32], mut vertex: u32) -> u32 {
    while parents[vertex as usize] != vertex {
        let above = parents[vertex as usize];
        parents[vertex as usize] = parents[above as usize];
        vertex = above;
    }
    vertex
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_net_of_a_sphere_lies_on_it_and_faces_outwards() {
        let raw = surface_of(|p| p.length() - 0.8);
        assert!(raw.triangles.len() > 5000);
        for position in &raw.positions {
            assert!((position.length() - 0.8).abs() < 0.005, "{position}");
        }
        for corners in &raw.triangles {
            let [a, b, c] = corners.map(|v| raw.positions[v as usize]);
            assert!((b - a).cross(c - a).dot(a) >= 0.0);
        }
    }

    #[test]
    fn what_is_cut_off_by_the_cube_is_closed() {
        let raw = surface_of(|p| p.x - 0.3);
        // In a closed surface every edge is used once in each direction.
        let mut edges = std::collections::HashMap::new();
        for [a, b, c] in &raw.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((*from, *to)).or_insert(0) += 1;
            }
        }
        for ((from, to), count) in &edges {
            assert_eq!((count, edges.get(&(*to, *from))), (&1, Some(&1)));
        }
    }

    #[test]
    fn of_several_parts_the_largest_is_kept() {
        let two = |p: Vec3| {
            let large = (p - Vec3::X * 0.5).length() - 0.4;
            large.min((p + Vec3::X * 0.6).length() - 0.2)
        };
        let raw = surface_of(two);
        for corners in &raw.triangles {
            assert!(raw.positions[corners[0] as usize].x > 0.0);
        }
    }
}
