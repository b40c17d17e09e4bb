//! Which pixels of a picture are needed.

use std::ops::Range;

/// Columns between two runs that are not worth a run's end.
const SMALL_GAP: i32 = 8;

/// The runs of pixels that are needed, row by row. They may reach beyond the picture, so that they can be moved.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Region {
    width: i32,
    height: i32,
    /// The number of the first row.
    top: i32,
    rows: Vec<Vec<Range<i32>>>,
}

impl Region {
    /// All pixels of a picture of this width and height.
    pub(super) fn whole((width, height): (u32, u32)) -> Self {
        let (width, height) = (width.cast_signed(), height.cast_signed());
        let row = std::iter::once(0..width).collect();
        Self {
            width,
            height,
            top: 0,
            rows: vec![row; height.unsigned_abs() as usize],
        }
    }

    /// Pixels up to `by` beside some in both directions.
    pub(super) fn around(
        pixels: impl Iterator<Item = (u32, u32)>,
        by: usize,
        (width, height): (u32, u32),
    ) -> Self {
        let mut rows = vec![Vec::new(); height as usize];
        for (x, y) in pixels {
            if let Some(row) = rows.get_mut(y as usize) {
                row.push(x.cast_signed()..x.cast_signed() + 1);
            }
        }
        let region = Self {
            width: width.cast_signed(),
            height: height.cast_signed(),
            top: 0,
            rows: rows.into_iter().map(joined).collect(),
        };
        region.grown(by, by)
    }

    /// With the pixels up to this many rows and columns beside.
    pub(super) fn grown(&self, down: usize, across: usize) -> Self {
        let by = across as i32;
        let wide: Vec<Vec<Range<i32>>> = self.rows.iter().map(|row| grown_runs(row, by)).collect();
        let near = |at: usize| {
            let rows = wide.get(at.saturating_sub(2 * down)..(at + 1).min(wide.len()));
            joined(rows.unwrap_or_default().concat())
        };
        Self {
            top: self.top - down as i32,
            rows: (0..wide.len() + 2 * down).map(near).collect(),
            ..*self
        }
    }

    /// The pixels of either.
    pub(super) fn or(&self, other: &Self) -> Self {
        let top = self.top.min(other.top);
        let bottom = self.bottom().max(other.bottom());
        let row = |y: i32| joined([self.runs(y), other.runs(y)].concat());
        Self {
            top,
            rows: (top..bottom).map(row).collect(),
            ..*self
        }
    }

    /// The pixels, of a picture of twice this size or one more, of which these are the half.
    pub(super) fn doubled(&self, (width, height): (u32, u32)) -> Self {
        let row = |y: i32| {
            let runs = self.runs(y.div_euclid(2)).iter();
            runs.map(|run| 2 * run.start..2 * run.end).collect()
        };
        Self {
            width: width.cast_signed(),
            height: height.cast_signed(),
            top: 2 * self.top,
            rows: (2 * self.top..2 * self.bottom()).map(row).collect(),
        }
    }

    /// The runs of a picture's row, as far as they lie in the picture, when all are moved to the right and down by this.
    #[inline(always)]
    pub(super) fn row(
        &self,
        y: usize,
        [dx, dy]: [i32; 2],
    ) -> impl Iterator<Item = Range<usize>> + Clone + '_ {
        let width = self.width;
        let runs = self.runs(y as i32 - dy).iter();
        runs.filter_map(move |run| {
            let (start, end) = ((run.start + dx).max(0), (run.end + dx).min(width));
            (start < end).then_some(start as usize..end as usize)
        })
    }

    fn bottom(&self) -> i32 {
        self.top + self.rows.len() as i32
    }

    fn runs(&self, y: i32) -> &[Range<i32>] {
        let at = usize::try_from(y - self.top).ok();
        at.and_then(|at| self.rows.get(at))
            .map(Vec::as_slice)
            .unwrap_or_default()
    }
}

fn grown_runs(runs: &[Range<i32>], by: i32) -> Vec<Range<i32>> {
    let grown = runs.iter().map(|run| run.start - by..run.end + by);
    joined(grown.collect())
}

/// The runs in order; those that are near each other are one.
fn joined(mut runs: Vec<Range<i32>>) -> Vec<Range<i32>> {
    runs.sort_unstable_by_key(|run| run.start);
    let mut all: Vec<Range<i32>> = Vec::new();
    for run in runs {
        match all.last_mut() {
            Some(last) if run.start <= last.end + SMALL_GAP => last.end = last.end.max(run.end),
            _ => all.push(run),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each run's first column, and the one behind its last.
    fn runs(region: &Region, y: usize, by: [i32; 2]) -> Vec<(usize, usize)> {
        region.row(y, by).map(|run| (run.start, run.end)).collect()
    }

    #[test]
    fn a_region_grows_in_both_directions_and_ends_at_the_picture() {
        let region = Region::around([(4, 2), (6, 2), (30, 2)].into_iter(), 0, (40, 6));
        assert_eq!(runs(&region, 2, [0, 0]), [(4, 7), (30, 31)]);
        let grown = region.grown(1, 3);
        for y in 1..4 {
            assert_eq!(runs(&grown, y, [0, 0]), [(1, 10), (27, 34)]);
        }
        assert!(
            [0, 4, 9]
                .iter()
                .all(|&y| runs(&grown, y, [0, 0]).is_empty())
        );
        let doubled = region.doubled((81, 13));
        for y in [4, 5] {
            assert_eq!(runs(&doubled, y, [0, 0]), [(8, 14), (60, 62)]);
        }
        assert!(
            [3, 6, 12]
                .iter()
                .all(|&y| runs(&doubled, y, [0, 0]).is_empty())
        );
        let other = Region::around([(0, 2), (1, 5)].into_iter(), 0, (40, 6));
        let both = region.or(&other);
        assert_eq!(runs(&both, 2, [0, 0]), [(0, 7), (30, 31)]);
        assert_eq!(runs(&both, 5, [0, 0]), [(1, 2)]);
        assert_eq!(runs(&both, 0, [0, 0]), []);
    }

    #[test]
    fn a_region_that_is_moved_keeps_what_lay_beyond_the_picture_before() {
        let region = Region::around([(0, 0), (20, 3)].into_iter(), 2, (24, 4));
        assert_eq!(runs(&region, 0, [0, 0]), [(0, 3)]);
        assert_eq!(runs(&region, 0, [3, 2]), [(1, 6)]);
        assert_eq!(runs(&region, 3, [3, -1]), [(21, 24)]);
        assert_eq!(runs(&region, 3, [0, 9]), []);
        assert_eq!(runs(&region, 3, [-30, 0]), []);
    }

    #[test]
    fn runs_that_are_near_each_other_are_one() {
        let gap = SMALL_GAP as u32;
        let pixels = [(0, 0), (1 + gap, 0), (3 + 2 * gap, 0)];
        let region = Region::around(pixels.into_iter(), 0, (40, 1));
        let gap = SMALL_GAP as usize;
        let wanted = [(0, 2 + gap), (3 + 2 * gap, 4 + 2 * gap)];
        assert_eq!(runs(&region, 0, [0, 0]), wanted);
    }
}
