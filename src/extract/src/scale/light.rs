//! 8-bit sRGB values to light and back, as fast as frames need it.

use relit_data::srgb::from_linear;

/// From light to sRGB values.
#[derive(Debug)]
pub(super) struct Srgb(Box<[u8; 1 << 16]>);

impl Srgb {
    pub(super) fn new() -> Self {
        let value = |light: u16| 255.0 * from_linear(f64::from(light) / 65535.0);
        let mut values = Box::new([0; 1 << 16]);
        for (to, level) in values.iter_mut().zip(0..=u16::MAX) {
            *to = value(level).round() as u8;
        }
        Self(values)
    }

    /// The level of a light of 0..=1, to the nearest; brighter light has the highest, and negative the lowest. Additions
    /// round it down, because they become vector instructions, and a conversion does not.
    #[inline(always)]
    pub(super) fn level(light: f32) -> u16 {
        let level = 65535.0 * light + 0.5;
        let level = if level > 0.0 { level } else { 0.0 };
        let level = if level < 65535.0 { level } else { 65535.0 };
        let nearest = (level + WHOLE) - WHOLE;
        let above = if nearest > level { 1.0 } else { 0.0 };
        ((nearest - above) + WHOLE).to_bits() as u16
    }

    /// The value of a level.
    #[inline(always)]
    pub(super) fn value(&self, level: u16) -> u8 {
        self.0[usize::from(level)]
    }
}

/// The last bits of a sum with this are those of the whole number that was added.
const WHOLE: f32 = 8_388_608.0;

/// The curve's upper part as a polynomial, from the constant on: the best for the 245 values above 10. Its error
/// is less than 6e-6 of full light, a fiftieth of what the smallest step of an sRGB value is worth.
const CURVE: [f32; 7] = [
    0.000_914_602_4,
    0.033_138_737,
    0.511_446_83,
    0.717_031_66,
    -0.434_624_25,
    0.226_755_9,
    -0.054_668_847,
];

/// The light of an sRGB value of 0..=255, 0..=1. It has no table, so that loops over it become vector
/// instructions.
#[inline(always)]
pub(super) fn linear(value: u32) -> f32 {
    let x = value as f32 * (1.0 / 255.0);
    let [c0, c1, c2, c3, c4, c5, c6] = CURVE;
    let curve = (((((c6 * x + c5) * x + c4) * x + c3) * x + c2) * x + c1) * x + c0;
    if value <= 10 {
        x * (1.0 / 12.92)
    } else {
        curve
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_value_comes_back_and_its_light_is_right() {
        let srgb = Srgb::new();
        for value in 0..=255_u32 {
            let exact = relit_data::srgb::to_linear(f64::from(value) / 255.0);
            let light = linear(value);
            assert!((f64::from(light) - exact).abs() < 6e-6, "{value}: {light}");
            assert_eq!(u32::from(srgb.value(Srgb::level(light))), value);
        }
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0];
        let all = (-1000..1_200_000).map(|millionths| millionths as f32 / 1e6);
        for light in all.chain(odd) {
            let exact = (65535.0 * light + 0.5) as u16;
            assert_eq!(Srgb::level(light), exact, "{light}");
        }
        assert_eq!(
            (srgb.value(Srgb::level(2.0)), srgb.value(Srgb::level(-1.0))),
            (255, 0)
        );
    }
}
