//! Width and height.

/// Width and height of an image, pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Extent {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Extent {
    /// An image of `width` x `height` pixels.
    pub const fn new(width: usize, height: usize) -> Self {
        Self { width, height }
    }

    /// Width and height as files have them.
    pub fn sides(self) -> [u32; 2] {
        [self.width, self.height].map(|side| u32::try_from(side).unwrap_or(u32::MAX))
    }

    /// This size, or the same shape with so many pixels along the longer side if that is less.
    #[must_use]
    pub fn at_most(self, longest: usize) -> Self {
        let own = self.width.max(self.height).max(1);
        let side = |side: usize| (side * longest.min(own) / own).max(1);
        Self::new(side(self.width), side(self.height))
    }

    /// How many pixels there are.
    pub const fn pixels(self) -> usize {
        self.width * self.height
    }
}
