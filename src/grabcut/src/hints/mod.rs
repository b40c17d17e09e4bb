//! Hints from a person, and what is known of each pixel from them before the cut.

pub(crate) mod marks;
pub(crate) mod strokes;
pub(crate) mod trimap;
