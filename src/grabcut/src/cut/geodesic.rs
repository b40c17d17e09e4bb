//! Which marks a pixel is connected with: distances along paths in the image, which are longer across edges (Bai and
//! Sapiro, "A geodesic framework for fast interactive image and video segmentation", 2007).
//!
//! Marks show few of an object's colours. Its other parts are often connected with them by soft gradients, and what has
//! the colours of the marks elsewhere is not.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::grab_cut::{Field, Label, contrast_scale, neighbour};

/// What it says at most that one of the sides is next to a pixel, in units of the log-likelihood.
const WEIGHT: f32 = 5.0;
/// The length of a step between equal neighbours; between others, the root of their relative contrast is added.
const STEP: f32 = 0.3;

/// For each pixel, evidence for the object if it is nearer to what is surely object, and against it if it is nearer to
/// what is surely background. Empty if one of them is not marked.
pub(super) fn evidence<const D: usize>(field: &impl Field<D>, labels: &[Label]) -> Vec<f32> {
    let sides = [Label::Object, Label::Background];
    if !sides.iter().all(|side| labels.contains(side)) {
        return Vec::new();
    }
    let [object, ground] = sides.map(|side| distances(field, labels, side));
    let pairs = object.iter().zip(&ground);
    pairs
        .map(|(object, ground)| WEIGHT * (ground - object) / (ground + object).max(f32::EPSILON))
        .collect()
}

/// The distance of each pixel from the nearest one with this label, by Dijkstra's algorithm.
fn distances<const D: usize>(field: &impl Field<D>, labels: &[Label], from: Label) -> Vec<f32> {
    let scale = contrast_scale(field);
    let mut distances = vec![f32::MAX; labels.len()];
    let mut open = BinaryHeap::new();
    for (at, _) in labels
        .iter()
        .enumerate()
        .filter(|(_, label)| **label == from)
    {
        distances[at] = 0.0;
        // The bits of positive numbers have the order of the numbers.
        open.push(Reverse((0_f32.to_bits(), at)));
    }
    while let Some(Reverse((bits, at))) = open.pop() {
        let distance = f32::from_bits(bits);
        if distance > distances[at] {
            continue;
        }
        for next in (0..8).filter_map(|direction| neighbour(at, direction, field.size())) {
            let contrast = scale * field.contrast(at.min(next), at.max(next));
            let distance = distance + STEP + contrast.sqrt();
            if distance < distances[next] {
                distances[next] = distance;
                open.push(Reverse((distance.to_bits(), next)));
            }
        }
    }
    distances
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Levels in a row.
    struct Row([f32; 7]);

    impl Field<1> for Row {
        const VARIANCE_FLOOR: f64 = 1.0;

        fn size(&self) -> (usize, usize) {
            (self.0.len(), 1)
        }

        fn feature(&self, at: usize) -> [f32; 1] {
            [self.0[at]]
        }

        fn contrast(&self, a: usize, b: usize) -> f32 {
            (self.0[a] - self.0[b]).powi(2)
        }
    }

    #[test]
    fn an_edge_is_farther_than_a_gradient() {
        let row = Row([0.0, 10.0, 20.0, 30.0, 40.0, 140.0, 140.0]);
        let mut labels = [Label::ProbablyBackground; 7];
        labels[0] = Label::Object;
        labels[6] = Label::Background;
        let found = evidence(&row, &labels);
        assert_eq!([found[0], found[6]], [WEIGHT, -WEIGHT]);
        assert!(found[4] > 0.0 && found[5] < 0.0, "{found:?}");
    }
}
