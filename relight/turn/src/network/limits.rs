//! The numbers by which curves become the network's input, here and in training.

/// Harmonics that the network sees in all channels.
pub const COLOURED: usize = 4;
/// Harmonics that it sees.
pub const HARMONICS: usize = 6;
/// Harmonics that it also sees undivided, with their mean.
pub const STRONG: usize = 2;
/// Least mean of a curve, in means over the object. By hand: below, harmonics are noise.
pub const MIN_MEAN: f32 = 0.002;
/// Largest harmonic, in means of the curve. Derived: of non-negative light it is at most 2.
pub const MAX_RATIO: f32 = 1.5;
/// Largest harmonic, in effective values over the object. By hand.
pub const MAX_VALUE: f32 = 4.0;
/// Pixels darker than this, in means over the object, count less for the phase of the light. By hand.
pub const DARK: f32 = 0.1;
/// Largest logarithm of a mean beside that of all. By hand.
pub const MAX_LOG: f32 = 3.0;
/// Added to effective values. Numerical.
pub const SMALL: f32 = 1e-4;
/// By what the logarithms of effective values are divided, so that they are about 1. By hand.
pub const LOG_SCALE: f32 = 1.5;
