//! Pictures that show their number, so that each is known wherever it comes out.

/// Width and height, pixels.
pub(crate) const WIDTH: usize = 96;
/// Height, pixels.
pub(crate) const HEIGHT: usize = 64;
/// Sides of the blocks that show the number, bit by bit, across the upper 32 rows.
const BLOCK: usize = 16;
const BITS: usize = WIDTH / BLOCK;

/// A picture in three planes, with colour halved across and down.
pub(crate) struct Planes {
    pub(crate) luma: Vec<u8>,
    pub(crate) blue: Vec<u8>,
    pub(crate) red: Vec<u8>,
}

impl Planes {
    /// The picture with this number, above a texture that moves.
    pub(crate) fn numbered(number: u64) -> Self {
        let mut luma = Vec::with_capacity(WIDTH * HEIGHT);
        for y in 0..HEIGHT {
            for x in 0..WIDTH {
                luma.push(if y >= 2 * BLOCK {
                    // The same in every picture of a field stream's group, whose lower half is repeated.
                    (70 + (7 * x + 13 * y) % 90) as u8
                } else if number >> (x / BLOCK) & 1 == 1 {
                    200
                } else {
                    50
                });
            }
        }
        let quarter = WIDTH * HEIGHT / 4;
        Self {
            luma,
            blue: vec![118; quarter],
            red: vec![138; quarter],
        }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        [&self.luma[..], &self.blue, &self.red].concat()
    }
}

/// The number that a picture shows; `luma` gives the brightness at a pixel.
pub(crate) fn number_of(luma: impl Fn(usize, usize) -> u8) -> u64 {
    let bit = |at: usize| u64::from(luma(BLOCK * at + BLOCK / 2, BLOCK) > 125);
    (0..BITS).map(|at| bit(at) << at).sum()
}
