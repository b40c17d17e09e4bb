//! sRGB values to light and back (IEC 61966-2-1), both 0 to 1.

/// The light of an sRGB value.
///
/// ```
/// use relit_data::srgb::{from_linear, to_linear};
///
/// assert!((to_linear(0.5) - 0.214_041).abs() < 1e-6);
/// assert!((from_linear(to_linear(0.02)) - 0.02).abs() < 1e-6);
/// ```
pub fn to_linear(value: f64) -> f64 {
    if value <= 0.040_45 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

/// The sRGB value of light.
pub fn from_linear(light: f64) -> f64 {
    if light <= 0.003_130_8 {
        12.92 * light
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    }
}

/// [`to_linear`] in single precision; negative values are mirrored.
pub fn to_linear_f32(value: f32) -> f32 {
    let size = value.abs();
    let light = if size <= 0.04045 {
        size / 12.92
    } else {
        ((size + 0.055) / 1.055).powf(2.4)
    };
    light.copysign(value)
}

/// [`from_linear`] in single precision; negative light is mirrored.
pub fn from_linear_f32(light: f32) -> f32 {
    let size = light.abs();
    let value = if size <= 0.003_130_8 {
        size * 12.92
    } else {
        1.055 * size.powf(1.0 / 2.4) - 0.055
    };
    value.copysign(light)
}
