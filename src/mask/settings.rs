//! How a mask is made, apart from the hints.

use serde::{Deserialize, Serialize};

use super::Error;

/// Rounds of GrabCut, 1..=[`Iterations::MOST`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct Iterations(u32);

impl Iterations {
    /// The most that is accepted; a bound on the time that a slip of the finger can cost.
    pub const MOST: u32 = 100;

    /// # Errors
    /// [`Error::Iterations`] outside 1..=[`Self::MOST`].
    pub fn new(count: u32) -> Result<Self, Error> {
        if (1..=Self::MOST).contains(&count) {
            Ok(Self(count))
        } else {
            Err(Error::Iterations(count))
        }
    }

    /// The number.
    #[must_use]
    pub fn get(self) -> u32 {
        self.0
    }
}

impl Default for Iterations {
    fn default() -> Self {
        Self(5)
    }
}

/// Width of the mask's soft edge, pixels, 0..=[`Feather::MOST`]: over that distance the mask
/// rises from 10 % to 90 % at a straight edge. 0 is a hard edge.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct Feather(u32);

impl Feather {
    /// The widest edge, pixels.
    pub const MOST: u32 = 100;

    /// # Errors
    /// [`Error::Feather`] above [`Self::MOST`].
    pub fn new(px: u32) -> Result<Self, Error> {
        if px <= Self::MOST {
            Ok(Self(px))
        } else {
            Err(Error::Feather(px))
        }
    }

    /// The width, pixels.
    #[must_use]
    pub fn px(self) -> u32 {
        self.0
    }
}

/// How a mask is made, apart from the hints.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Rounds of GrabCut.
    pub iterations: Iterations,
    /// Keep every part of the object, not only the largest.
    pub keep_all: bool,
    /// Width of the soft edge.
    pub feather: Feather,
}

impl TryFrom<u32> for Iterations {
    type Error = Error;

    fn try_from(count: u32) -> Result<Self, Error> {
        Self::new(count)
    }
}

impl From<Iterations> for u32 {
    fn from(iterations: Iterations) -> Self {
        iterations.0
    }
}

impl TryFrom<u32> for Feather {
    type Error = Error;

    fn try_from(px: u32) -> Result<Self, Error> {
        Self::new(px)
    }
}

impl From<Feather> for u32 {
    fn from(feather: Feather) -> Self {
        feather.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_iterations_and_too_many_are_refused() {
        assert!(Iterations::new(0).is_err());
        assert!(Iterations::new(Iterations::MOST + 1).is_err());
        assert_eq!(Iterations::new(7).unwrap().get(), 7);
        assert!(serde_json::from_str::<Iterations>("0").is_err());
    }

    #[test]
    fn a_feather_wider_than_the_most_is_refused() {
        assert!(Feather::new(Feather::MOST + 1).is_err());
        assert_eq!(Feather::new(0).unwrap(), Feather::default());
    }
}
