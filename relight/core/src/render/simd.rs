//! Arithmetic on several pixels at once, and the loop that does it for a whole image.
//!
//! Kernels are written once for a group of pixels; the compiler makes vector instructions of them,
//! in a version for the widest that the processor has. Products and sums are not fused, so that
//! every processor gives the same bits.

use std::array;
use std::ops::{Add, Div, Mul, Sub};

#[cfg(not(target_family = "wasm"))]
use pulp::Arch;
use pulp::WithSimd;

use crate::parallel;

/// Pixels in a group.
pub(super) const WIDTH: usize = 16;

/// Pixels that a thread takes at a time.
const BLOCK: usize = 256 * WIDTH;

/// One value for each pixel of a group.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Lanes([f32; WIDTH]);

/// The number type of formulas: `f64` to differentiate, [`Lanes`] for speed.
pub(super) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// How constants are stored for it.
    type Constant: Copy;

    /// A constant.
    fn splat(value: f64) -> Self;

    /// A stored constant.
    fn constant(value: Self::Constant) -> Self;
}

impl Number for f64 {
    type Constant = Self;

    #[inline(always)]
    fn constant(value: Self) -> Self {
        value
    }

    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }
}

impl Number for Lanes {
    type Constant = f32;

    #[inline(always)]
    fn constant(value: f32) -> Self {
        Self::all(value)
    }

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value as f32; WIDTH])
    }
}

macro_rules! elementwise {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl $trait for Lanes {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let mut result = self;
                for (a, b) in result.0.iter_mut().zip(other.0) {
                    *a $operator b;
                }
                result
            }
        }
    };
}

elementwise!(Add, add, +=);
elementwise!(Sub, sub, -=);
elementwise!(Mul, mul, *=);
elementwise!(Div, div, /=);

impl Lanes {
    /// The same constant for all pixels.
    #[inline(always)]
    pub(super) fn all(value: f32) -> Self {
        Self([value; WIDTH])
    }

    /// `change` for each pixel; it has to be free of branches.
    #[inline(always)]
    pub(super) fn map(mut self, change: impl Fn(f32) -> f32) -> Self {
        for value in &mut self.0 {
            *value = change(*value);
        }
        self
    }

    /// Negative values become 0.
    #[inline(always)]
    pub(super) fn at_least_zero(self) -> Self {
        self.map(|v| v.max(0.0))
    }

    /// 1 where a unit normal stands, 0 outside the object.
    #[inline(always)]
    pub(super) fn surface([x, y, z]: [Self; 3]) -> Self {
        (x * x + y * y + z * z).map(|square| if square > 0.25 { 1.0 } else { 0.0 })
    }

    /// `sign(v) |v|^exponent`, at most 2^126 in size; 0 below 2^-100.
    #[inline(always)]
    pub(super) fn signed_power(self, exponent: Self) -> Self {
        let mut result = self;
        for (value, exponent) in result.0.iter_mut().zip(exponent.0) {
            let logarithm = exponent * log2(value.abs());
            // Smaller ones would be subnormal in products, which takes a hundred times as long.
            let is_some = logarithm > -100.0 && value.abs() > 0.0;
            let power = if is_some { exp2(logarithm) } else { 0.0 };
            *value = power.copysign(*value);
        }
        result
    }
}

/// The binary logarithm of a positive, normal number, to 3e-7 of it or of 1.
#[inline(always)]
fn log2(value: f32) -> f32 {
    const SQRT_HALF: u32 = 0x3f35_04f3;
    let shifted = value.to_bits().wrapping_sub(SQRT_HALF);
    let exponent = (shifted as i32) >> 23;
    // Between the square roots of 1/2 and 2.
    let mantissa = f32::from_bits((shifted & 0x007f_ffff).wrapping_add(SQRT_HALF));
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let square = s * s;
    let series = 1.0 + square * (1.0 / 3.0 + square * (0.2 + square * (1.0 / 7.0 + square / 9.0)));
    exponent as f32 + s * series * (2.0 * std::f32::consts::LOG2_E)
}

/// 2 to a power; beyond -126 to 126 the nearest of these counts.
#[inline(always)]
fn exp2(power: f32) -> f32 {
    // Adding it leaves the nearest integer in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    let power = power.clamp(-126.0, 126.0);
    let rounded = power + ROUND;
    let rest = (power - (rounded - ROUND)) * std::f32::consts::LN_2;
    let scale = f32::from_bits(rounded.to_bits().wrapping_add(127) << 23);
    let high = 1.0 / 24.0 + rest * (1.0 / 120.0 + rest * (1.0 / 720.0 + rest / 5040.0));
    scale * (1.0 + rest * (1.0 + rest * (0.5 + rest * (1.0 / 6.0 + rest * high))))
}

/// A function from `I` to `O` values for a group of pixels.
pub(super) trait Kernel<const I: usize, const O: usize>: Sync {
    /// Memory that is used again for every group.
    type Scratch;

    /// A thread's memory.
    fn scratch(&self) -> Self::Scratch;

    /// One group. Implementations are marked `#[inline(always)]`, or they would not be compiled for
    /// the processor at hand.
    fn run(&self, scratch: &mut Self::Scratch, inputs: [Lanes; I]) -> [Lanes; O];
}

/// Runs a kernel over planes of one length, in parallel if there are threads.
pub(super) fn run<const I: usize, const O: usize>(
    kernel: &impl Kernel<I, O>,
    inputs: [&[f32]; I],
    outputs: [&mut [f32]; O],
) {
    let mut parts = outputs.map(|plane| plane.chunks_mut(BLOCK));
    let count = parts.iter().map(ExactSizeIterator::len).max().unwrap_or(0);
    let blocks: Vec<[&mut [f32]; O]> = (0..count)
        .map(|_| array::from_fn(|plane| parts[plane].next().unwrap_or_default()))
        .collect();
    #[cfg(not(target_family = "wasm"))]
    let arch = Arch::new();
    parallel::for_each(blocks, |at, outputs| {
        let inputs = inputs.map(|plane| &plane[at * BLOCK..plane.len().min((at + 1) * BLOCK)]);
        let block = Block {
            kernel,
            inputs,
            outputs,
        };
        #[cfg(not(target_family = "wasm"))]
        arch.dispatch(block);
        // A module of WebAssembly is compiled for one processor. `Arch` would add a version for relaxed SIMD, which not
        // every browser has, and LLVM then uses relaxed SIMD in all functions of the same unit, such as `Gloss::new`.
        #[cfg(target_family = "wasm")]
        block.with_simd(pulp::Scalar);
    });
}

/// A part of an image; compiled for each kind of processor.
struct Block<'a, K, const I: usize, const O: usize> {
    kernel: &'a K,
    inputs: [&'a [f32]; I],
    outputs: [&'a mut [f32]; O],
}

impl<K: Kernel<I, O>, const I: usize, const O: usize> WithSimd for Block<'_, K, I, O> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, _: S) {
        let mut scratch = self.kernel.scratch();
        let length = self.outputs.first().map_or(0, |plane| plane.len());
        let whole = length / WIDTH * WIDTH;
        // Loops instead of closures: a closure may be left as a call, without the vector instructions.
        for start in (0..whole).step_by(WIDTH) {
            let mut group = [Lanes::all(0.0); I];
            for (lanes, plane) in group.iter_mut().zip(&self.inputs) {
                lanes.0.copy_from_slice(&plane[start..start + WIDTH]);
            }
            let results = self.kernel.run(&mut scratch, group);
            for (lanes, plane) in results.iter().zip(&mut self.outputs) {
                plane[start..start + WIDTH].copy_from_slice(&lanes.0);
            }
        }
        if whole < length {
            // Places beyond the end are 0.
            let rest = length - whole;
            let mut group = [Lanes::all(0.0); I];
            for (lanes, plane) in group.iter_mut().zip(&self.inputs) {
                lanes.0[..rest].copy_from_slice(&plane[whole..]);
            }
            let results = self.kernel.run(&mut scratch, group);
            for (lanes, plane) in results.iter().zip(&mut self.outputs) {
                plane[whole..].copy_from_slice(&lanes.0[..rest]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Shifted;

    impl Kernel<2, 1> for Shifted {
        type Scratch = ();

        fn scratch(&self) {}

        #[inline(always)]
        fn run(&self, (): &mut (), [a, b]: [Lanes; 2]) -> [Lanes; 1] {
            [a * Lanes::splat(2.0) + b]
        }
    }

    #[test]
    fn every_pixel_is_reached_whatever_the_length() {
        for length in [0, 1, WIDTH, WIDTH + 1, BLOCK - 1, BLOCK, 2 * BLOCK + 5] {
            let a: Vec<f32> = (0..length).map(|i| i as f32).collect();
            let b = vec![1.0; length];
            let mut out = vec![0.0; length];
            run(&Shifted, [&a, &b], [&mut out]);
            let all = out.iter().enumerate();
            assert!(
                all.into_iter().all(|(i, &v)| v == 2.0 * i as f32 + 1.0),
                "{length}"
            );
        }
    }

    #[test]
    fn powers_are_those_of_f64() {
        for base in [1e-6_f32, 0.01, 0.5, 0.7, 0.999, 1.0, 1.023, 2.0] {
            for exponent in [0.5_f32, 1.0, 5.0, 33.3, 200.0] {
                let expected = f64::from(base)
                    .powf(f64::from(exponent))
                    .min(2.0_f64.powi(126));
                for (sign, base) in [(1.0, base), (-1.0, -base)] {
                    let got = Lanes::all(base).signed_power(Lanes::all(exponent)).0[3];
                    let error = (f64::from(got) - sign * expected).abs();
                    assert!(error <= 1e-4 * expected + 1e-30, "{base}^{exponent}: {got}");
                }
            }
        }
        assert_eq!(Lanes::all(0.0).signed_power(Lanes::all(5.0)).0[0], 0.0);
    }
}
