//! sRGB to CIE L*a*b* (D65), by tables: the colours that the models compare.

use relit_data::srgb::to_linear_f32;

/// Entries of the table of the cube root: its linear part near 0 spans 36 of them.
const ROOTS: usize = 4096;

/// From 8-bit sRGB to L*a*b*: L in 0..=100, a and b in about -128..=128.
#[derive(Debug)]
pub(crate) struct LabTable {
    linear: [f32; 256],
    root: Vec<f32>,
}

impl LabTable {
    pub(crate) fn new() -> Self {
        let linear = std::array::from_fn(|level| to_linear_f32(level as f32 / 255.0));
        let root = (0..=ROOTS + 1).map(|step| {
            let value = step as f32 / ROOTS as f32;
            if value > 216.0 / 24389.0 {
                value.cbrt()
            } else {
                (24389.0 / 27.0 * value + 16.0) / 116.0
            }
        });
        Self {
            linear,
            root: root.collect(),
        }
    }

    pub(crate) fn lab(&self, rgb: [u8; 3]) -> [f32; 3] {
        let [r, g, b] = rgb.map(|level| self.linear[usize::from(level)]);
        // The rows of the sRGB matrix, divided by the white point.
        let x = self.root(0.433_953 * r + 0.376_219 * g + 0.189_828 * b);
        let y = self.root(0.212_671 * r + 0.715_160 * g + 0.072_169 * b);
        let z = self.root(0.017_758 * r + 0.109_477 * g + 0.872_766 * b);
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// The function f of the definition, interpolated; `value` in 0..=1.
    fn root(&self, value: f32) -> f32 {
        let position = value.clamp(0.0, 1.0) * ROOTS as f32;
        let step = position as usize;
        let (low, high) = (self.root[step], self.root[step + 1]);
        low + (high - low) * (position - step as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colours_have_their_coordinates() {
        let table = LabTable::new();
        let known = [
            ([0, 0, 0], [0.0, 0.0, 0.0]),
            ([255, 255, 255], [100.0, 0.0, 0.0]),
            ([255, 0, 0], [53.24, 80.09, 67.20]),
            ([0, 128, 0], [46.23, -51.70, 49.90]),
        ];
        for (rgb, wanted) in known {
            let found = table.lab(rgb);
            for (found, wanted) in found.iter().zip(wanted) {
                assert!((found - wanted).abs() < 0.6, "{rgb:?}: {found} {wanted}");
            }
        }
    }
}
