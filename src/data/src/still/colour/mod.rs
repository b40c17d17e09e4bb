//! What the numbers of a picture stand for, and their conversion to light in Rec. 709, whose primaries sRGB has.

mod from_file;
mod icc;
mod png_chunks;

use std::fmt;
use std::sync::Arc;

use moxcms::TransformF32Executor;

use super::ColourError;
use crate::colour::primaries::significant;
pub(super) use crate::colour::primaries::{Matrix, Primaries};
use crate::srgb::{from_linear_f32, to_linear_f32};

/// Pixels that are converted at a time.
const CHUNK: usize = 4096;
/// Entries of a curve's table less one: every value of 8 and 16 bits is one of them.
const LAST_ENTRY: usize = 65535;

/// What the numbers of a picture, 0 to 1, stand for.
#[derive(Clone)]
pub struct Colour(Model);

#[derive(Clone)]
enum Model {
    /// A curve, and then a matrix to Rec. 709.
    Shaper {
        curves: Curves,
        matrix: Option<Matrix>,
    },
    /// A profile's table, to sRGB.
    Table(Arc<TransformF32Executor>),
}

/// The curves of red, green and blue.
#[derive(Clone)]
enum Curves {
    Same(Curve),
    Each([Curve; 3]),
}

/// How one number becomes light.
#[derive(Clone)]
enum Curve {
    Linear,
    Srgb,
    Power(f32),
    Table(Arc<[f32]>),
}

impl Colour {
    /// sRGB, which a file has that says nothing.
    pub const SRGB: Self = Self(Model::Shaper {
        curves: Curves::Same(Curve::Srgb),
        matrix: None,
    });
    /// The power 2.2.
    pub const GAMMA22: Self = Self(Model::Shaper {
        curves: Curves::Same(Curve::Power(2.2)),
        matrix: None,
    });
    /// Light in Rec. 709.
    pub const LINEAR: Self = Self(Model::Shaper {
        curves: Curves::Same(Curve::Linear),
        matrix: None,
    });

    fn new(curve: Curve, matrix: Option<Matrix>) -> Self {
        Self(Model::Shaper {
            curves: Curves::Same(curve),
            matrix,
        })
    }

    /// Light in other primaries.
    pub(crate) fn light(matrix: Option<Matrix>) -> Self {
        Self::new(Curve::Linear, matrix)
    }

    /// Whether the numbers are sRGB's.
    pub const fn is_srgb(&self) -> bool {
        matches!(self.curve_alone(), Some(Curve::Srgb))
    }

    /// Whether the numbers are light in Rec. 709.
    pub const fn is_linear(&self) -> bool {
        matches!(self.curve_alone(), Some(Curve::Linear))
    }

    const fn curve_alone(&self) -> Option<&Curve> {
        match &self.0 {
            Model::Shaper {
                curves: Curves::Same(curve),
                matrix: None,
            } => Some(curve),
            _ => None,
        }
    }

    /// Turns red, green and blue, which have the same length, into light. What lies outside of Rec. 709 is clipped, as a
    /// screen clips it; see [`Self::to_open_light`].
    pub fn to_light(&self, planes: [&mut [f32]; 3]) {
        self.convert(planes, true);
    }

    /// The same for numbers that have no upper bound.
    pub fn to_open_light(&self, planes: [&mut [f32]; 3]) {
        self.convert(planes, false);
    }

    /// Turns pixels of red, green and blue in 8 bits into sRGB.
    pub fn to_srgb8(&self, pixels: &mut [u8]) {
        if self.is_srgb() {
            return;
        }
        for chunk in pixels.chunks_mut(3 * CHUNK) {
            let count = chunk.len() / 3;
            let mut planes: [Vec<f32>; 3] = std::array::from_fn(|channel| {
                let values = chunk.chunks_exact(3).map(|pixel| pixel[channel]);
                values.map(|value| f32::from(value) / 255.0).collect()
            });
            let [red, green, blue] = &mut planes;
            self.to_light([red, green, blue]);
            for at in 0..count {
                for (channel, plane) in planes.iter().enumerate() {
                    let level = from_linear_f32(plane[at]).clamp(0.0, 1.0) * 255.0;
                    chunk[3 * at + channel] = level.round() as u8;
                }
            }
        }
    }

    fn convert(&self, [red, green, blue]: [&mut [f32]; 3], is_bounded: bool) {
        match &self.0 {
            Model::Shaper { curves, matrix } => {
                for (channel, plane) in [&mut *red, &mut *green, &mut *blue].into_iter().enumerate()
                {
                    curves.of(channel).apply(plane);
                }
                if let Some(matrix) = matrix {
                    for ((r, g), b) in red.iter_mut().zip(green).zip(blue) {
                        let pixel = [*r, *g, *b];
                        // What is negative already has been made so on purpose.
                        let least = if pixel.iter().all(|value| *value >= 0.0) {
                            0.0
                        } else {
                            f32::MIN
                        };
                        let most = if is_bounded { 1.0 } else { f32::MAX };
                        [*r, *g, *b] = matrix.map(|row| {
                            let value = row[0] * pixel[0] + row[1] * pixel[1] + row[2] * pixel[2];
                            value.clamp(least, most)
                        });
                    }
                }
            }
            Model::Table(table) => through_table(table.as_ref(), [red, green, blue]),
        }
    }
}

/// The matrix to Rec. 709, whose white that of these primaries becomes; `None` if nothing would change.
pub(super) fn to_rec709(primaries: Primaries) -> Result<Option<Matrix>, ColourError> {
    let impossible = || {
        let pairs = [
            primaries.red,
            primaries.green,
            primaries.blue,
            primaries.white,
        ];
        let pairs = pairs.map(|[x, y]| format!("{x:.4} {y:.4}")).join(", ");
        ColourError(format!("states primaries that are not possible ({pairs})"))
    };
    primaries
        .to_rec709()
        .map(significant)
        .ok_or_else(impossible)
}

impl fmt::Debug for Colour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match &self.0 {
            _ if self.is_srgb() => "sRGB",
            _ if self.is_linear() => "linear",
            Model::Shaper { .. } => "curves and a matrix",
            Model::Table(_) => "a table",
        })
    }
}

fn through_table(table: &TransformF32Executor, [red, green, blue]: [&mut [f32]; 3]) {
    let chunks = red
        .chunks_mut(CHUNK)
        .zip(green.chunks_mut(CHUNK))
        .zip(blue.chunks_mut(CHUNK));
    for ((red, green), blue) in chunks {
        let mut pixels = Vec::with_capacity(3 * red.len());
        for ((r, g), b) in red.iter().zip(&*green).zip(&*blue) {
            pixels.extend([r, g, b].map(|value| value.clamp(0.0, 1.0)));
        }
        let mut converted = vec![0.0; pixels.len()];
        // It refuses but lengths that differ.
        if table.transform(&pixels, &mut converted).is_err() {
            continue;
        }
        let places = red.iter_mut().zip(green).zip(blue);
        for (((r, g), b), srgb) in places.zip(converted.chunks_exact(3)) {
            [*r, *g, *b] = [0, 1, 2].map(|channel| to_linear_f32(srgb[channel].clamp(0.0, 1.0)));
        }
    }
}

impl Curves {
    fn of(&self, channel: usize) -> &Curve {
        match self {
            Self::Same(curve) => curve,
            Self::Each(curves) => &curves[channel],
        }
    }
}

impl Curve {
    fn apply(&self, plane: &mut [f32]) {
        match self {
            Self::Linear => {}
            Self::Srgb => plane
                .iter_mut()
                .for_each(|value| *value = to_linear_f32(*value)),
            Self::Power(power) => {
                for value in plane {
                    *value = value.abs().powf(*power).copysign(*value);
                }
            }
            Self::Table(table) => plane
                .iter_mut()
                .for_each(|value| *value = looked_up(table, *value)),
        }
    }

    /// The curve of these values at [`LAST_ENTRY`] even steps.
    fn from_table(at: impl Fn(f32) -> f32) -> Self {
        let values = (0..=LAST_ENTRY).map(|entry| at(entry as f32 / LAST_ENTRY as f32));
        Self::Table(values.collect())
    }
}

fn looked_up(table: &[f32], value: f32) -> f32 {
    let place = value.clamp(0.0, 1.0) * LAST_ENTRY as f32;
    let entry = place as usize;
    let (low, high) = (
        table[entry.min(LAST_ENTRY)],
        table[(entry + 1).min(LAST_ENTRY)],
    );
    low + (high - low) * (place - entry as f32)
}
