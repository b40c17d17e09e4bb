//! Bits in rows and columns: parts that hang together, growing, counting.

use relit_data::geometry::Rect;

/// A bit for each pixel of an image. At least one pixel, sides under 2^31.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Bitmap {
    width: usize,
    height: usize,
    bits: Vec<bool>,
}

/// Which neighbours hang together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Connectivity {
    /// Left, right, above, below.
    Four,
    /// Those and the diagonals.
    Eight,
}

/// Pixels of equal value that hang together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Part {
    /// Pixels.
    pub(super) area: u64,
    /// The smallest rectangle around it.
    pub(super) bounds: Rect,
}

/// The set pixels of a bitmap, part by part, in the order of their first pixels.
#[derive(Debug)]
pub(super) struct Parts {
    /// For each pixel the index of its part in `list`, plus 1; 0 for pixels that are not set.
    label: Vec<u32>,
    pub(super) list: Vec<Part>,
}

impl Bitmap {
    /// The bits row by row; those that `bits` lacks are not set, those too many are dropped.
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

    pub(super) fn bits(&self) -> &[bool] {
        &self.bits
    }

    pub(super) fn count(&self) -> u64 {
        self.bits.iter().filter(|&&bit| bit).count() as u64
    }

    /// The smallest rectangle around the set pixels; of no size where none is set.
    pub(super) fn bounds(&self) -> Rect {
        let mut bounds = Bounds::default();
        for (at, _) in self.bits.iter().enumerate().filter(|&(_, &bit)| bit) {
            bounds.take(at % self.width, at / self.width);
        }
        bounds.rect()
    }

    /// The set pixels where the others are not, and the other way round.
    pub(super) fn inverted(&self) -> Self {
        self.map(|_, bit| !bit)
    }

    /// A bitmap of the same size whose bits are `f` of position and bit.
    pub(super) fn map(&self, f: impl Fn(usize, bool) -> bool) -> Self {
        let bits = self.bits.iter().enumerate();
        Self {
            bits: bits.map(|(at, &bit)| f(at, bit)).collect(),
            ..*self
        }
    }

    /// Sets all pixels within `radius` rows and columns of a set one.
    pub(super) fn grown(&self, radius: usize) -> Self {
        let mut across = Self {
            bits: vec![false; self.bits.len()],
            ..*self
        };
        for (from, to) in self
            .bits
            .chunks(self.width)
            .zip(across.bits.chunks_mut(self.width))
        {
            for (x, _) in from.iter().enumerate().filter(|&(_, &bit)| bit) {
                to[x.saturating_sub(radius)..(x + radius + 1).min(self.width)].fill(true);
            }
        }
        let mut grown = across.bits.clone();
        for y in 0..self.height {
            for near in y.saturating_sub(radius)..(y + radius + 1).min(self.height) {
                let from = &across.bits[near * self.width..(near + 1) * self.width];
                let to = &mut grown[y * self.width..(y + 1) * self.width];
                to.iter_mut().zip(from).for_each(|(to, &from)| *to |= from);
            }
        }
        Self {
            bits: grown,
            ..*self
        }
    }

    /// The set pixels, part by part.
    pub(super) fn parts(&self, connectivity: Connectivity) -> Parts {
        let mut parts = Parts {
            label: vec![0; self.bits.len()],
            list: Vec::new(),
        };
        for start in 0..self.bits.len() {
            if self.bits[start] && parts.label[start] == 0 {
                let part = self.flood(start, connectivity, &mut parts);
                parts.list.push(part);
            }
        }
        parts
    }

    fn flood(&self, start: usize, connectivity: Connectivity, parts: &mut Parts) -> Part {
        let number = parts.list.len() as u32 + 1;
        let mut bounds = Bounds::default();
        let mut area = 0;
        let mut waiting = vec![start];
        parts.label[start] = number;
        while let Some(at) = waiting.pop() {
            area += 1;
            bounds.take(at % self.width, at / self.width);
            for next in self.neighbours(at, connectivity) {
                if self.bits[next] && parts.label[next] == 0 {
                    parts.label[next] = number;
                    waiting.push(next);
                }
            }
        }
        Part {
            area,
            bounds: bounds.rect(),
        }
    }

    fn neighbours(&self, at: usize, connectivity: Connectivity) -> impl Iterator<Item = usize> {
        let (width, height) = (self.width, self.height);
        let (x, y) = (at % width, at / width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.flat_map(move |row| {
            let columns = x.saturating_sub(1)..(x + 2).min(width);
            columns
                .filter(move |&column| {
                    connectivity == Connectivity::Eight || row == y || column == x
                })
                .map(move |column| row * width + column)
        })
    }
}

impl Parts {
    /// The index in `list` of the part that the pixel belongs to.
    pub(super) fn at(&self, pixel: usize) -> Option<usize> {
        let label = self.label.get(pixel).copied().unwrap_or(0);
        (label as usize).checked_sub(1)
    }

    /// The index in `list` of the largest part, the first of several.
    pub(super) fn largest(&self) -> Option<usize> {
        let areas = self.list.iter().map(|part| part.area).enumerate();
        areas.rev().max_by_key(|&(_, area)| area).map(|(at, _)| at)
    }
}

#[derive(Debug, Clone, Copy)]
struct Bounds {
    left: usize,
    top: usize,
    right: usize,
    bottom: usize,
}

impl Default for Bounds {
    fn default() -> Self {
        Self {
            left: usize::MAX,
            top: usize::MAX,
            right: 0,
            bottom: 0,
        }
    }
}

impl Bounds {
    fn take(&mut self, x: usize, y: usize) {
        self.left = self.left.min(x);
        self.top = self.top.min(y);
        self.right = self.right.max(x + 1);
        self.bottom = self.bottom.max(y + 1);
    }

    fn rect(self) -> Rect {
        if self.right == 0 {
            return Rect::new(0, 0, 0, 0);
        }
        let (w, h) = (self.right - self.left, self.bottom - self.top);
        Rect::new(self.left as i32, self.top as i32, w as u32, h as u32)
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
    fn diagonal_neighbours_hang_together_only_with_eight() {
        let bitmap = Bitmap::drawn(&["#..", ".#.", "..."]);
        assert_eq!(bitmap.parts(Connectivity::Eight).list.len(), 1);
        assert_eq!(bitmap.parts(Connectivity::Four).list.len(), 2);
    }

    #[test]
    fn parts_carry_area_and_bounds_and_the_first_of_equals_is_the_largest() {
        let bitmap = Bitmap::drawn(&["##...", "....#", "....#"]);
        let parts = bitmap.parts(Connectivity::Eight);
        let found: Vec<_> = parts.list.iter().map(|p| (p.area, p.bounds)).collect();
        let wanted = [(2, Rect::new(0, 0, 2, 1)), (2, Rect::new(4, 1, 1, 2))];
        assert_eq!(found, wanted);
        assert_eq!(parts.largest(), Some(0));
        assert_eq!(
            (parts.at(1), parts.at(2), parts.at(9)),
            (Some(0), None, Some(1))
        );
        assert_eq!(parts.at(99), None);
    }

    #[test]
    fn growing_stops_at_the_border() {
        let bitmap = Bitmap::drawn(&["#....", ".....", ".....", "....."]);
        let wanted = Bitmap::drawn(&["###..", "###..", "###..", "....."]);
        assert_eq!(bitmap.grown(2), wanted);
        assert_eq!(bitmap.grown(9).count(), 20);
    }

    #[test]
    fn an_empty_bitmap_has_no_parts_and_no_bounds() {
        let bitmap = Bitmap::drawn(&["...", "..."]);
        assert_eq!(bitmap.parts(Connectivity::Eight).largest(), None);
        assert_eq!(bitmap.bounds(), Rect::new(0, 0, 0, 0));
        assert_eq!(bitmap.inverted().bounds(), Rect::new(0, 0, 3, 2));
    }
}
