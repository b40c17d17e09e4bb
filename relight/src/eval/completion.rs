//! Normals where the truth has none.

use crate::image::Planes;
use crate::light::{Normals, YUp};

/// The normals, with those of the nearest known pixel where the mask is true and none is known.
pub(super) fn completed(normals: &Normals<YUp>, mask: &[bool]) -> Normals<YUp> {
    let extent = normals.extent();
    let (width, height) = (extent.width, extent.height);
    let mut planes: Planes<3> = normals.planes().clone();
    let mut known: Vec<bool> = (0..extent.pixels())
        .map(|at| {
            normals
                .planes()
                .planes()
                .iter()
                .any(|plane| plane[at] != 0.0)
        })
        .collect();
    let mut front: Vec<usize> = (0..known.len()).filter(|&at| known[at]).collect();
    while !front.is_empty() {
        let mut next = Vec::new();
        for at in front {
            let (x, y) = (at % width, at / width);
            let beside = [
                (x > 0).then(|| at - 1),
                (x + 1 < width).then_some(at + 1),
                (y > 0).then(|| at - width),
                (y + 1 < height).then_some(at + width),
            ];
            for other in beside.into_iter().flatten() {
                if !known[other] && mask[other] {
                    known[other] = true;
                    planes.set_pixel(other % width, other / width, planes.pixel(x, y));
                    next.push(other);
                }
            }
        }
        front = next;
    }
    Normals::new(planes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Extent;

    #[test]
    fn unknown_normals_are_those_of_the_nearest_neighbour_under_the_mask() {
        let vectors = [
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0; 3],
            [0.0; 3],
            [0.0, 1.0, 0.0],
        ];
        let normals = Normals::new(Planes::from_fn(Extent::new(5, 1), |x, _| vectors[x]));
        let full = completed(&normals, &[false, true, true, true, true]);
        let planes = full.planes();
        assert_eq!(planes.pixel(0, 0), [0.0; 3]);
        assert_eq!(planes.pixel(2, 0), [1.0, 0.0, 0.0]);
        assert_eq!(planes.pixel(3, 0), [0.0, 1.0, 0.0]);
    }
}
