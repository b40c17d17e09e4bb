//! One bit per pixel: connected components, dilation, counting.

use std::ops::Range;

use image::GrayImage;
use relit_data::geometry::Rect;

/// Pixels of a mask at or above this level belong to the object.
const OBJECT_FROM: u8 = 128;

/// One bit for each pixel of an image. At least one pixel, sides below 2^31.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Bitmap {
    width: usize,
    height: usize,
    bits: Vec<bool>,
}

/// Which neighbours of a pixel are connected to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Connectivity {
    /// Left, right, above, below.
    Four,
    /// Also the diagonal ones.
    Eight,
}

/// A connected component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Component {
    /// Number of pixels.
    pub(super) area: u64,
    /// The smallest rectangle around it.
    pub(super) bounds: Rect,
}

/// The connected components of the set pixels, in the order of their first pixels.
#[derive(Debug)]
pub(super) struct Components {
    /// For each pixel the index of its component in `list`, plus 1; 0 for pixels that are not set.
    label: Vec<u32>,
    pub(super) list: Vec<Component>,
}

impl Bitmap {
    /// The bits row by row; missing bits are not set, surplus bits are dropped.
    pub(super) fn new((width, height): (u32, u32), bits: impl Iterator<Item = bool>) -> Self {
        let (width, height) = (width as usize, height as usize);
        let mut bits: Vec<bool> = bits.take(width * height).collect();
        bits.resize(width * height, false);
        Self {
            width,
            height,
            bits,
        }
    }

    /// The object of a mask: what is at least half white.
    pub(super) fn from_mask(mask: &GrayImage) -> Self {
        let levels = mask.as_raw().iter();
        Self::new(mask.dimensions(), levels.map(|&level| level >= OBJECT_FROM))
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn bits(&self) -> &[bool] {
        &self.bits
    }

    pub(super) fn count(&self) -> u64 {
        self.bits.iter().filter(|&&bit| bit).count() as u64
    }

    /// The smallest rectangle around the set pixels; of size 0 if none is set.
    pub(super) fn bounds(&self) -> Rect {
        let mut bounds = Bounds::default();
        for (at, _) in self.bits.iter().enumerate().filter(|&(_, &bit)| bit) {
            bounds.add(at % self.width, at / self.width);
        }
        bounds.rect()
    }

    /// The bitmap with all bits inverted.
    pub(super) fn inverted(&self) -> Self {
        self.map(|_, bit| !bit)
    }

    /// A bitmap of the same size whose bits are `f(position, bit)`.
    pub(super) fn map(&self, f: impl Fn(usize, bool) -> bool) -> Self {
        let bits = self.bits.iter().enumerate();
        Self {
            bits: bits.map(|(at, &bit)| f(at, bit)).collect(),
            ..*self
        }
    }

    /// Dilation: all pixels within `radius` rows and columns of a set one.
    pub(super) fn dilated(&self, radius: usize) -> Self {
        let mut across = Self {
            bits: vec![false; self.bits.len()],
            ..*self
        };
        for (from, to) in self
            .bits
            .chunks(self.width.max(1))
            .zip(across.bits.chunks_mut(self.width.max(1)))
        {
            for run in set_runs(from) {
                to[run.start.saturating_sub(radius)..(run.end + radius).min(self.width)].fill(true);
            }
        }
        let mut dilated = across.bits.clone();
        for y in 0..self.height {
            for near in y.saturating_sub(radius)..(y + radius + 1).min(self.height) {
                let from = &across.bits[near * self.width..(near + 1) * self.width];
                let to = &mut dilated[y * self.width..(y + 1) * self.width];
                to.iter_mut().zip(from).for_each(|(to, &from)| *to |= from);
            }
        }
        Self {
            bits: dilated,
            ..*self
        }
    }

    /// The bitmap `factor` times as large, cut to `width` x `height`.
    pub(crate) fn enlarged(&self, factor: usize, (width, height): (usize, usize)) -> Self {
        let is_set = |at: usize| {
            let (x, y) = (at % width / factor, at / width / factor);
            x < self.width && self.bits.get(y * self.width + x) == Some(&true)
        };
        let bits = (0..width * height).map(is_set);
        Self::new((width as u32, height as u32), bits)
    }

    /// Erosion: the set pixels whose neighbours within `radius` rows and columns are all set.
    pub(super) fn eroded(&self, radius: usize) -> Self {
        self.inverted().dilated(radius).inverted()
    }

    /// The pixels that are set in both.
    pub(super) fn and(&self, other: &Self) -> Self {
        self.map(|at, bit| bit && other.bits[at])
    }

    /// The pixels that are set in either.
    pub(super) fn or(&self, other: &Self) -> Self {
        self.map(|at, bit| bit || other.bits[at])
    }

    /// The set pixels that are not set in the other one.
    pub(super) fn minus(&self, other: &Self) -> Self {
        self.map(|at, bit| bit && !other.bits[at])
    }

    /// The share of the set pixels that are set in the other bitmap too, 0..=1.
    pub(super) fn share_in(&self, other: &Self) -> f64 {
        self.and(other).count() as f64 / self.count().max(1) as f64
    }

    /// Opening: the parts that are wider than twice `radius`.
    pub(super) fn opened(&self, radius: usize) -> Self {
        self.inverted().dilated(radius).inverted().dilated(radius)
    }

    /// Of the components those that `keep` wants by their figures; its second argument gives their pixels.
    pub(super) fn parts_where(
        &self,
        connectivity: Connectivity,
        keep: impl Fn(&Component, &dyn Fn() -> Self) -> bool,
    ) -> Self {
        let components = self.components(connectivity);
        let kept: Vec<bool> = (components.list.iter().enumerate())
            .map(|(index, part)| keep(part, &|| self.map(|at, _| components.at(at) == Some(index))))
            .collect();
        self.map(|at, _| components.at(at).is_some_and(|index| kept[index]))
    }

    /// Whether a component does not reach the border.
    pub(super) fn is_inside(&self, Component { bounds, .. }: &Component) -> bool {
        bounds.x > 0
            && bounds.y > 0
            && bounds.right() < self.width as i64
            && bounds.bottom() < self.height as i64
    }

    /// The connected components of the set pixels.
    pub(super) fn components(&self, connectivity: Connectivity) -> Components {
        let mut runs = self.joined_runs(connectivity);
        let mut components = Components {
            label: vec![0; self.bits.len()],
            list: Vec::new(),
        };
        let mut bounds: Vec<Bounds> = Vec::new();
        // The number of each run that is the first of its component.
        let mut numbers = vec![0; runs.len()];
        for index in 0..runs.len() {
            let first = first_of(&mut runs, index);
            if first == index {
                components.list.push(Component {
                    area: 0,
                    bounds: Rect::new(0, 0, 0, 0),
                });
                bounds.push(Bounds::default());
                numbers[index] = bounds.len();
            }
            let (number, Run { y, columns, .. }) = (numbers[first], &runs[index]);
            components.list[number - 1].area += columns.len() as u64;
            bounds[number - 1].add(columns.start, *y);
            bounds[number - 1].add(columns.end - 1, *y);
            let row = y * self.width;
            components.label[row + columns.start..row + columns.end].fill(number as u32);
        }
        for (component, bounds) in components.list.iter_mut().zip(bounds) {
            component.bounds = bounds.rect();
        }
        components
    }

    /// The runs of set pixels from top to bottom, joined where they touch.
    fn joined_runs(&self, connectivity: Connectivity) -> Vec<Run> {
        let reach = usize::from(connectivity == Connectivity::Eight);
        let mut runs: Vec<Run> = Vec::new();
        let mut above = 0..0;
        for (y, row) in self.bits.chunks(self.width.max(1)).enumerate() {
            let first_of_row = runs.len();
            for columns in set_runs(row) {
                let index = runs.len();
                let (from, to) = (columns.start, columns.end + reach);
                let first = index;
                runs.push(Run { y, columns, first });
                for other in above.clone() {
                    let near = &runs[other].columns;
                    if near.start >= to {
                        break;
                    }
                    if near.end + reach > from {
                        join(&mut runs, index, other);
                    } else {
                        // It ends before all further runs of this row, too.
                        above.start = other + 1;
                    }
                }
            }
            above = first_of_row..runs.len();
        }
        runs
    }
}

/// A run of set pixels in row `y`.
#[derive(Debug)]
struct Run {
    y: usize,
    columns: Range<usize>,
    /// An earlier run of the same component, or this one.
    first: usize,
}

/// The first run of a run's component.
fn first_of(runs: &mut [Run], index: usize) -> usize {
    let mut at = index;
    while runs[at].first != at {
        runs[at].first = runs[runs[at].first].first;
        at = runs[at].first;
    }
    at
}

/// Makes one component of those of two runs.
fn join(runs: &mut [Run], one: usize, other: usize) {
    let (one, other) = (first_of(runs, one), first_of(runs, other));
    runs[one.max(other)].first = one.min(other);
}

/// The runs of set pixels of a row.
fn set_runs(row: &[bool]) -> impl Iterator<Item = Range<usize>> {
    let mut end = 0;
    std::iter::from_fn(move || {
        let start = end + row[end..].iter().position(|&bit| bit)?;
        let length = row[start..].iter().position(|&bit| !bit);
        end = length.map_or(row.len(), |length| start + length);
        Some(start..end)
    })
}

impl Components {
    /// The index in `list` of the component that contains the pixel.
    pub(super) fn at(&self, pixel: usize) -> Option<usize> {
        let label = self.label.get(pixel).copied().unwrap_or(0);
        (label as usize).checked_sub(1)
    }

    /// The index in `list` of the largest component, the first one if there are several.
    pub(super) fn largest(&self) -> Option<usize> {
        let areas = self.list.iter().map(|component| component.area).enumerate();
        areas.rev().max_by_key(|&(_, area)| area).map(|(at, _)| at)
    }
}

/// Left, top, and what is one past right and bottom of some pixels; none of no pixels.
#[derive(Debug, Clone, Copy, Default)]
struct Bounds(Option<[usize; 4]>);

impl Bounds {
    fn add(&mut self, x: usize, y: usize) {
        let [left, top, right, bottom] = self.0.unwrap_or([x, y, x, y]);
        let (right, bottom) = (right.max(x + 1), bottom.max(y + 1));
        self.0 = Some([left.min(x), top.min(y), right, bottom]);
    }

    fn rect(self) -> Rect {
        let [left, top, right, bottom] = self.0.unwrap_or_default();
        let (w, h) = (right - left, bottom - top);
        Rect::new(left as i32, top as i32, w as u32, h as u32)
    }
}

#[cfg(test)]
impl Bitmap {
    /// A bitmap from rows of `#` (set) and anything else.
    pub(super) fn drawn(rows: &[&str]) -> Self {
        let size = (rows[0].len() as u32, rows.len() as u32);
        Self::new(size, rows.concat().chars().map(|c| c == '#'))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diagonal_neighbours_are_connected_only_with_eight() {
        let bitmap = Bitmap::drawn(&["#..", ".#.", "..."]);
        assert_eq!(bitmap.components(Connectivity::Eight).list.len(), 1);
        assert_eq!(bitmap.components(Connectivity::Four).list.len(), 2);
    }

    #[test]
    fn components_have_area_and_bounds_and_the_first_of_equals_is_the_largest() {
        let bitmap = Bitmap::drawn(&["##...", "....#", "....#"]);
        let components = bitmap.components(Connectivity::Eight);
        let found: Vec<_> = components.list.iter().map(|c| (c.area, c.bounds)).collect();
        let wanted = [(2, Rect::new(0, 0, 2, 1)), (2, Rect::new(4, 1, 1, 2))];
        assert_eq!(found, wanted);
        assert_eq!(components.largest(), Some(0));
        let at = [1, 2, 9, 99].map(|pixel| components.at(pixel));
        assert_eq!(at, [Some(0), None, Some(1), None]);
    }

    #[test]
    fn branches_that_meet_further_down_are_one_component() {
        let rows = ["#.#.#.", "#.#..#", "###.#.", "....#.", "#....#"];
        let count = |connectivity| Bitmap::drawn(&rows).components(connectivity).list;
        let px = |list: Vec<Component>| list.iter().map(|c| c.area).collect::<Vec<_>>();
        assert_eq!(px(count(Connectivity::Four)), [7, 1, 1, 2, 1, 1]);
        assert_eq!(px(count(Connectivity::Eight)), [7, 5, 1]);
        assert_eq!(count(Connectivity::Eight)[1].bounds, Rect::new(4, 0, 2, 5));
    }

    #[test]
    fn dilation_stops_at_the_border() {
        let bitmap = Bitmap::drawn(&["#....", ".....", ".....", "....."]);
        let wanted = Bitmap::drawn(&["###..", "###..", "###..", "....."]);
        assert_eq!(bitmap.dilated(2), wanted);
        assert_eq!(bitmap.dilated(9).count(), 20);
    }

    #[test]
    fn an_empty_bitmap_has_no_components_and_no_bounds() {
        let bitmap = Bitmap::drawn(&["...", "..."]);
        assert_eq!(bitmap.components(Connectivity::Eight).largest(), None);
        assert_eq!(bitmap.bounds(), Rect::new(0, 0, 0, 0));
        assert_eq!(bitmap.inverted().bounds(), Rect::new(0, 0, 3, 2));
    }
}
