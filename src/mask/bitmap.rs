//! One bit per pixel: connected components, dilation, counting.

use relit_data::geometry::Rect;

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
            .chunks(self.width)
            .zip(across.bits.chunks_mut(self.width))
        {
            for (x, _) in from.iter().enumerate().filter(|&(_, &bit)| bit) {
                to[x.saturating_sub(radius)..(x + radius + 1).min(self.width)].fill(true);
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

    /// The connected components of the set pixels.
    pub(super) fn components(&self, connectivity: Connectivity) -> Components {
        let mut components = Components {
            label: vec![0; self.bits.len()],
            list: Vec::new(),
        };
        for start in 0..self.bits.len() {
            if self.bits[start] && components.label[start] == 0 {
                let component = self.flood_fill(start, connectivity, &mut components);
                components.list.push(component);
            }
        }
        components
    }

    /// Labels the component that contains the pixel `start`.
    fn flood_fill(
        &self,
        start: usize,
        connectivity: Connectivity,
        components: &mut Components,
    ) -> Component {
        let label = &mut components.label;
        let number = components.list.len() as u32 + 1;
        let mut bounds = Bounds::default();
        let mut area = 0;
        let mut pending = vec![start];
        label[start] = number;
        while let Some(at) = pending.pop() {
            area += 1;
            bounds.add(at % self.width, at / self.width);
            for next in self.neighbours(at, connectivity) {
                if self.bits[next] && label[next] == 0 {
                    label[next] = number;
                    pending.push(next);
                }
            }
        }
        Component {
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
    fn add(&mut self, x: usize, y: usize) {
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
