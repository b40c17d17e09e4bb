//! Which pixels of a picture are needed.

use std::ops::Range;

/// For each row of a picture, the columns that are needed.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Region {
    width: usize,
    rows: Vec<Range<usize>>,
}

impl Region {
    /// All pixels of a picture of this width and height.
    pub(super) fn whole((width, height): (u32, u32)) -> Self {
        let width = width as usize;
        Self {
            width,
            rows: vec![0..width; height as usize],
        }
    }

    /// Pixels up to `by` beside some in both directions, and those of a row that lie between them.
    pub(super) fn around(
        pixels: impl Iterator<Item = (u32, u32)>,
        by: usize,
        (width, height): (u32, u32),
    ) -> Self {
        let mut rows = vec![0..0; height as usize];
        for (x, y) in pixels {
            if let Some(row) = rows.get_mut(y as usize) {
                *row = joined(row, &(x as usize..x as usize + 1));
            }
        }
        let width = width as usize;
        Self { width, rows }.grown(by, by)
    }

    /// With the pixels up to this many rows and columns beside.
    pub(super) fn grown(&self, down: usize, across: usize) -> Self {
        let last = self.rows.len();
        let row = |y: usize| {
            let near = self
                .rows
                .get(y.saturating_sub(down)..(y + down + 1).min(last));
            let near = near.unwrap_or_default().iter();
            let hull = near.fold(0..0, |all, row| joined(&all, row));
            if hull.is_empty() {
                hull
            } else {
                hull.start.saturating_sub(across)..(hull.end + across).min(self.width)
            }
        };
        Self {
            width: self.width,
            rows: (0..last).map(row).collect(),
        }
    }

    /// The pixels of either.
    pub(super) fn or(&self, other: &Self) -> Self {
        let rows = self.rows.iter().zip(&other.rows);
        Self {
            width: self.width,
            rows: rows.map(|(a, b)| joined(a, b)).collect(),
        }
    }

    /// The pixels of a picture of twice this size, or one more, that halving turns into these.
    pub(super) fn doubled(&self, (width, height): (u32, u32)) -> Self {
        let row = |y: usize| {
            let row = self.row(y / 2);
            2 * row.start..2 * row.end
        };
        Self {
            width: width as usize,
            rows: (0..height as usize).map(row).collect(),
        }
    }

    /// The columns of a row; none beyond the picture.
    pub(super) fn row(&self, y: usize) -> Range<usize> {
        self.rows.get(y).cloned().unwrap_or_default()
    }
}

/// The range that holds both; an empty one holds nothing.
fn joined(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    match (a.is_empty(), b.is_empty()) {
        (true, _) => b.clone(),
        (_, true) => a.clone(),
        _ => a.start.min(b.start)..a.end.max(b.end),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_grows_in_both_directions_and_ends_at_the_picture() {
        let region = Region::around([(4, 2), (6, 2)].into_iter(), 0, (9, 6));
        assert_eq!(region.row(2), 4..7);
        let grown = region.grown(1, 3);
        let rows: Vec<Range<usize>> = (0..7).map(|y| grown.row(y)).collect();
        assert_eq!(rows, [0..0, 1..9, 1..9, 1..9, 0..0, 0..0, 0..0]);
        let doubled = region.doubled((19, 13));
        assert_eq!(
            [3, 4, 5, 6].map(|y| doubled.row(y)),
            [0..0, 8..14, 8..14, 0..0]
        );
        assert_eq!(doubled.row(12), 0..0);
        let other = Region::around([(0, 2), (1, 5)].into_iter(), 0, (9, 6));
        let both = region.or(&other);
        assert_eq!([both.row(2), both.row(5), both.row(0)], [0..7, 1..2, 0..0]);
    }
}
