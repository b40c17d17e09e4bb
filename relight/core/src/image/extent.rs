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
    #[must_use]
    pub const fn new(width: usize, height: usize) -> Self {
        Self { width, height }
    }

    /// How many pixels there are.
    #[must_use]
    pub const fn pixels(self) -> usize {
        self.width * self.height
    }
}
