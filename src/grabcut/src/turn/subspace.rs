//! A few directions that explain most of many courses.

use super::pixel_series::dot;

/// Rounds of the power method.
const ROUNDS: usize = 12;

/// Orthonormal directions.
#[derive(Debug)]
pub(crate) struct Subspace {
    pub(crate) basis: Vec<Vec<f32>>,
}

impl Subspace {
    /// The mean and the `more` principal directions of the samples.
    pub(crate) fn learn(samples: &[Vec<f32>], more: usize) -> Self {
        let length = samples.first().map_or(0, Vec::len);
        let mut mean = vec![0.0_f32; length];
        for sample in samples {
            mean.iter_mut().zip(sample).for_each(|(m, s)| *m += s);
        }
        let mut basis = Vec::new();
        basis.extend(unit(mean));
        let mut rest: Vec<Vec<f32>> = samples.to_vec();
        while let Some(last) = basis.last() {
            rest.iter_mut().for_each(|sample| remove(sample, last));
            match principal(&rest) {
                Some(next) if basis.len() <= more => basis.push(next),
                _ => break,
            }
        }
        Self { basis }
    }

    /// The squared length of what the directions do not explain.
    pub(crate) fn residual(&self, course: &[f32]) -> f32 {
        let explained = self.basis.iter().map(|axis| dot(axis, course).powi(2));
        (dot(course, course) - explained.sum::<f32>()).max(0.0)
    }
}

/// The direction in which the samples are longest, by the power method from the longest of them.
fn principal(samples: &[Vec<f32>]) -> Option<Vec<f32>> {
    let longest = samples
        .iter()
        .max_by(|a, b| dot(a, a).total_cmp(&dot(b, b)))?;
    let mut axis = unit(longest.clone())?;
    for _ in 0..ROUNDS {
        let mut next = vec![0.0_f32; axis.len()];
        for sample in samples {
            let along = dot(sample, &axis);
            next.iter_mut()
                .zip(sample)
                .for_each(|(n, s)| *n += along * s);
        }
        axis = unit(next)?;
    }
    Some(axis)
}

fn remove(course: &mut [f32], axis: &[f32]) {
    let along = dot(course, axis);
    course
        .iter_mut()
        .zip(axis)
        .for_each(|(c, a)| *c -= along * a);
}

/// The course with length 1; none of one without length.
fn unit(mut course: Vec<f32>) -> Option<Vec<f32>> {
    let length = dot(&course, &course).sqrt();
    course.iter_mut().for_each(|value| *value /= length);
    (length > 1e-12).then_some(course)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn courses_of_two_kinds_of_light_need_two_directions() {
        let sample = |at: usize| {
            let (one, other) = ((at * 7 % 11) as f32, (at * 3 % 5) as f32);
            let noise = 0.01 * (at % 3) as f32;
            vec![one, one + other, other + noise, 0.0]
        };
        let space = Subspace::learn(&(0..200).map(sample).collect::<Vec<_>>(), 1);
        assert_eq!(space.basis.len(), 2);
        assert!(space.residual(&[3.0, 5.0, 2.0, 0.0]) < 0.01);
        assert!(space.residual(&[0.0, 0.0, 0.0, 5.0]) > 20.0);
        assert!(dot(&space.basis[0], &space.basis[1]).abs() < 1e-4);
    }

    #[test]
    fn no_samples_and_black_ones_have_no_direction() {
        assert!(Subspace::learn(&[], 3).basis.is_empty());
        assert!(Subspace::learn(&vec![vec![0.0; 6]; 9], 3).basis.is_empty());
    }
}
