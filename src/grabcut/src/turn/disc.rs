//! The table's disc in the image: an ellipse through the points at which the table ends and the room begins.

use crate::bitmap::Bitmap;

/// Points of the rim that are needed, as a share of the image's width.
const MIN_POINTS: f64 = 0.12;
/// And on which share of the width they have to be spread.
const MIN_SPAN: f64 = 0.25;
/// The rim's points are so near to the ellipse in the median, as a share of the width.
const NEAR: f64 = 0.003;
/// Rounds of leaving out the points that are far from the ellipse.
const ROUNDS: usize = 5;
/// Those further than so many times the median are left out.
const FAR: f64 = 2.5;

/// An ellipse whose axes are level and upright: x^2 + b y^2 + c x + d y + e = 0, in widths of the image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Disc {
    terms: [f64; 4],
    width: f64,
}

impl Disc {
    /// From the pixels of the table, and those that are far from the object; `None` if the rim is not seen well.
    pub(crate) fn fit(
        table: &Bitmap,
        far: &Bitmap,
        (width, height): (usize, usize),
    ) -> Option<Self> {
        let margin = ((width as f64 * NEAR).ceil() as usize).max(2);
        let top = |x: usize| (0..height).find(|y| table.bits()[y * width + x]);
        let rim = (0..width).filter_map(|x| Some((x, top(x)?)));
        let is_free = |&(x, y): &(usize, usize)| {
            let above = y.checked_sub(2 * margin);
            above.is_some_and(|from| (from..y).all(|row| far.bits()[row * width + x]))
        };
        let mut points: Vec<[f64; 2]> = rim
            .filter(is_free)
            .map(|(x, y)| [x as f64 / width as f64, y as f64 / width as f64])
            .collect();
        let mut best: Option<(f64, Self)> = None;
        for _ in 0..ROUNDS {
            let Some(disc) = Self::through(&points, width as f64) else {
                break;
            };
            let off = |point: &[f64; 2]| {
                let rims = disc.rims(point[0]);
                rims.map_or(f64::INFINITY, |[top, _]| (top - point[1]).abs())
            };
            let mut apart: Vec<f64> = points.iter().map(off).collect();
            apart.sort_by(f64::total_cmp);
            let Some(&median) = apart.get(apart.len() / 2) else {
                break;
            };
            let is_better = median < best.map_or(NEAR, |(least, _)| least);
            if is_better && disc.is_plausible(&points) {
                best = Some((median, disc));
            }
            points.retain(|point| off(point) <= FAR * median);
        }
        best.map(|(_, disc)| disc)
    }

    /// The height of the disc's upper rim in a column of pixels.
    pub(crate) fn top(&self, x: usize) -> Option<f64> {
        let rims = self.rims(x as f64 / self.width);
        rims.map(|[top, _]| top * self.width)
    }

    /// The heights of the upper and the lower rim.
    fn rims(&self, x: f64) -> Option<[f64; 2]> {
        let [b, c, d, e] = self.terms;
        let rest = x * x + c * x + e;
        let root = (d * d - 4.0 * b * rest).sqrt();
        let rims = || [-1.0, 1.0].map(|side| (side * root - d) / (2.0 * b));
        (root.is_finite() && b > 0.0).then(rims)
    }

    fn is_plausible(&self, points: &[[f64; 2]]) -> bool {
        let columns = || points.iter().map(|point| point[0]);
        let span = columns().fold(0.0, f64::max) - columns().fold(1.0, f64::min);
        // A circle that is seen from above: wider than high.
        self.terms[0] > 1.0 && span >= MIN_SPAN && points.len() as f64 >= MIN_POINTS * self.width
    }

    /// The ellipse with the least squares of its equation.
    fn through(points: &[[f64; 2]], width: f64) -> Option<Self> {
        let mut equations = [[0.0; 5]; 4];
        for &[x, y] in points {
            let row = [y * y, x, y, 1.0, -x * x];
            for (equation, left) in equations.iter_mut().zip(row) {
                equation
                    .iter_mut()
                    .zip(row)
                    .for_each(|(sum, right)| *sum += left * right);
            }
        }
        let terms = solve(equations)?;
        Some(Self { terms, width })
    }
}

/// The solution of four linear equations, whose last column is the right side.
fn solve(mut rows: [[f64; 5]; 4]) -> Option<[f64; 4]> {
    for step in 0..4 {
        let best =
            (step..4).max_by(|&a, &b| rows[a][step].abs().total_cmp(&rows[b][step].abs()))?;
        rows.swap(step, best);
        let pivot = rows[step];
        if pivot[step].abs() < 1e-11 {
            return None;
        }
        for (at, row) in rows.iter_mut().enumerate() {
            if at != step {
                let by = row[step] / pivot[step];
                row.iter_mut()
                    .zip(pivot)
                    .for_each(|(value, pivot)| *value -= by * pivot);
            }
        }
    }
    Some(std::array::from_fn(|at| rows[at][4] / rows[at][at]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (320, 240);

    fn is_disc(x: f64, y: f64) -> bool {
        ((x - 165.0) / 190.0).powi(2) + ((y - 200.0) / 60.0).powi(2) < 1.0
    }

    fn bitmap(is: impl Fn(usize, usize) -> bool) -> Bitmap {
        Bitmap::new((320, 240), (0..320 * 240).map(|at| is(at % 320, at / 320)))
    }

    #[test]
    fn the_disc_is_found_behind_an_object_and_beyond_the_image() {
        let object = |x: usize, y: usize| (100..200).contains(&x) && (60..220).contains(&y);
        let table = bitmap(|x, y| is_disc(x as f64, y as f64) && !object(x, y));
        let far = bitmap(|x, y| !object(x, y));
        let disc = Disc::fit(&table, &far, SIZE).unwrap();
        let top = disc.top(150).unwrap();
        assert!((137.0..143.0).contains(&top), "{top}");
    }

    #[test]
    fn a_level_border_is_no_disc() {
        let floor = bitmap(|_, y| y > 150);
        assert!(Disc::fit(&floor, &bitmap(|_, _| true), SIZE).is_none());
    }
}
