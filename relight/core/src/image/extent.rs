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

    /// How many pixels there are.
    pub const fn pixels(self) -> usize {
        self.width * self.height
    }
}
