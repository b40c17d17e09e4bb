//! Primaries and white, and the matrix that turns light in them into Rec. 709, whose primaries sRGB has.

/// A matrix whose rows give red, green and blue of Rec. 709.
pub(crate) type Matrix = [[f32; 3]; 3];
type Exact = [[f64; 3]; 3];

/// How far a matrix may be from one that changes nothing: half a level of 8 bits.
const NOTHING: f64 = 2e-3;
/// Bradford's cone responses.
const BRADFORD: Exact = [
    [0.8951, 0.2664, -0.1614],
    [-0.7502, 1.7135, 0.0367],
    [0.0389, -0.0685, 1.0296],
];
const D65: [f64; 2] = [0.3127, 0.3290];
/// Illuminant C.
const C: [f64; 2] = [0.310, 0.316];
const EQUAL_ENERGY: [f64; 2] = [1.0 / 3.0, 1.0 / 3.0];

/// The chromaticities x and y of three primaries and white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Primaries {
    pub(crate) red: [f64; 2],
    pub(crate) green: [f64; 2],
    pub(crate) blue: [f64; 2],
    pub(crate) white: [f64; 2],
}

impl Primaries {
    pub(crate) const REC709: Self = Self::new([0.64, 0.33], [0.30, 0.60], [0.15, 0.06], D65);
    pub(crate) const REC2020: Self = Self::new([0.708, 0.292], [0.170, 0.797], [0.131, 0.046], D65);
    pub(crate) const DISPLAY_P3: Self =
        Self::new([0.680, 0.320], [0.265, 0.690], [0.150, 0.060], D65);
    pub(crate) const ADOBE_RGB: Self = Self::new([0.64, 0.33], [0.21, 0.71], [0.15, 0.06], D65);
    /// CIE XYZ itself.
    pub(crate) const XYZ: Self = Self::new([1.0, 0.0], [0.0, 1.0], [0.0, 0.0], EQUAL_ENERGY);

    pub(crate) const fn new(
        red: [f64; 2],
        green: [f64; 2],
        blue: [f64; 2],
        white: [f64; 2],
    ) -> Self {
        Self {
            red,
            green,
            blue,
            white,
        }
    }

    /// Name and primaries of a number of ITU-T H.273 (table 2); none of one that says nothing or is not known.
    pub(crate) const fn from_code(code: u32) -> Option<(&'static str, Self)> {
        let (name, [red, green, blue], white) = match code {
            1 => return Some(("BT.709", Self::REC709)),
            4 => ("BT.470 M", [[0.67, 0.33], [0.21, 0.71], [0.14, 0.08]], C),
            5 => (
                "BT.601 (625 lines)",
                [[0.64, 0.33], [0.29, 0.60], [0.15, 0.06]],
                D65,
            ),
            6 | 7 => (
                "BT.601 (525 lines)",
                [[0.630, 0.340], [0.310, 0.595], [0.155, 0.070]],
                D65,
            ),
            8 => ("film", [[0.681, 0.319], [0.243, 0.692], [0.145, 0.049]], C),
            9 => return Some(("BT.2020", Self::REC2020)),
            10 => return Some(("XYZ", Self::XYZ)),
            11 => {
                let Self {
                    red, green, blue, ..
                } = Self::DISPLAY_P3;
                ("DCI-P3", [red, green, blue], [0.314, 0.351])
            }
            12 => return Some(("Display P3", Self::DISPLAY_P3)),
            22 => (
                "EBU 3213",
                [[0.630, 0.340], [0.295, 0.605], [0.155, 0.077]],
                D65,
            ),
            _ => return None,
        };
        Some((name, Self::new(red, green, blue, white)))
    }

    /// The eight numbers in the order of files.
    pub(crate) const fn from_numbers(n: [f64; 8]) -> Self {
        Self::new([n[0], n[1]], [n[2], n[3]], [n[4], n[5]], [n[6], n[7]])
    }

    /// The matrix to Rec. 709, whose white these become; none for primaries that are not possible.
    pub(crate) fn to_rec709(self) -> Option<Exact> {
        let own = multiply(&adaptation(self.white)?, &self.to_xyz()?);
        Some(multiply(&inverse(&Self::REC709.to_xyz()?)?, &own))
    }

    /// From these primaries to CIE XYZ, with white at a luminance of 1 (SMPTE RP 177).
    pub(crate) fn to_xyz(self) -> Option<Exact> {
        let columns = [self.red, self.green, self.blue].map(|[x, y]| [x, y, 1.0 - x - y]);
        let rows = std::array::from_fn(|row| columns.map(|column| column[row]));
        let scales = apply(&inverse(&rows)?, white_xyz(self.white)?);
        Some(rows.map(|row| std::array::from_fn(|at| row[at] * scales[at])))
    }
}

/// A matrix to Rec. 709; `None` if it changes nothing.
pub(crate) fn significant(matrix: Exact) -> Option<Matrix> {
    let changes = (0..3).any(|row| {
        (0..3).any(|column| {
            let same = f64::from(u8::from(row == column));
            (matrix[row][column] - same).abs() > NOTHING
        })
    });
    changes.then(|| matrix.map(|row| row.map(|value| value as f32)))
}

/// What makes a white D65, by Bradford's cone responses.
fn adaptation(white: [f64; 2]) -> Option<Exact> {
    let cones = |white| Some(apply(&BRADFORD, white_xyz(white)?));
    let (from, to) = (cones(white)?, cones(D65)?);
    let scaled: Exact =
        std::array::from_fn(|row| BRADFORD[row].map(|value| value * to[row] / from[row]));
    let adapted = multiply(&inverse(&BRADFORD)?, &scaled);
    let is_finite = adapted.iter().flatten().all(|value| value.is_finite());
    is_finite.then_some(adapted)
}

fn white_xyz([x, y]: [f64; 2]) -> Option<[f64; 3]> {
    let is_possible = x.is_finite() && y > 1e-3 && x > 0.0 && x + y < 1.0;
    is_possible.then(|| [x / y, 1.0, (1.0 - x - y) / y])
}

fn apply(matrix: &Exact, vector: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row.iter().zip(vector).map(|(m, v)| m * v).sum())
}

pub(crate) fn multiply(a: &Exact, b: &Exact) -> Exact {
    a.map(|row| std::array::from_fn(|column| (0..3).map(|k| row[k] * b[k][column]).sum()))
}

/// None if the matrix is singular, or a number is not finite.
pub(crate) fn inverse(m: &Exact) -> Option<Exact> {
    let minor = |row: usize, column: usize| {
        let (r, c) = (
            [(row + 1) % 3, (row + 2) % 3],
            [(column + 1) % 3, (column + 2) % 3],
        );
        m[r[0]][c[0]] * m[r[1]][c[1]] - m[r[0]][c[1]] * m[r[1]][c[0]]
    };
    let determinant: f64 = (0..3).map(|column| m[0][column] * minor(0, column)).sum();
    let is_regular = determinant.is_finite() && determinant.abs() > 1e-6;
    is_regular.then(|| {
        std::array::from_fn(|row| std::array::from_fn(|column| minor(column, row) / determinant))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(primaries: Primaries, rgb: [f64; 3]) -> [f64; 3] {
        apply(&primaries.to_rec709().unwrap(), rgb)
    }

    fn of_code(code: u32) -> Primaries {
        Primaries::from_code(code).unwrap().1
    }

    fn is_near(a: [f64; 3], b: [f64; 3], by: f64) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= by)
    }

    #[test]
    fn the_matrices_are_those_of_the_literature() {
        // BT.2087, annex 1, rounded to four digits.
        for (rgb, published) in [
            ([1.0, 0.0, 0.0], [1.6605, -0.1246, -0.0182]),
            ([0.0, 1.0, 0.0], [-0.5876, 1.1329, -0.1006]),
            ([0.0, 0.0, 1.0], [-0.0728, -0.0083, 1.1187]),
        ] {
            let found = light(of_code(9), rgb);
            assert!(is_near(found, published, 2e-4), "{found:?}");
        }
        // SMPTE EG 432.
        let red = light(of_code(12), [1.0, 0.0, 0.0]);
        assert!(is_near(red, [1.2249, -0.0420, -0.0197], 2e-4), "{red:?}");
        // ACEScg to linear sRGB with Bradford.
        let ap1 =
            Primaries::from_numbers([0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767]);
        let red = light(ap1, [1.0, 0.0, 0.0]);
        assert!(is_near(red, [1.70505, -0.13026, -0.02400], 2e-4), "{red:?}");
    }

    #[test]
    fn white_stays_white() {
        for primaries in [4, 5, 6, 8, 9, 10, 11, 12, 22].map(of_code) {
            assert!(is_near(light(primaries, [1.0; 3]), [1.0; 3], 1e-9));
        }
    }

    #[test]
    fn what_would_change_nothing_is_no_matrix() {
        let rounded = Primaries {
            white: [0.312_71, 0.329_02],
            ..Primaries::REC709
        };
        for primaries in [Primaries::REC709, rounded] {
            assert_eq!(significant(primaries.to_rec709().unwrap()), None);
        }
    }

    #[test]
    fn impossible_primaries_have_no_matrix() {
        let flat = Primaries {
            green: [0.64, 0.33],
            ..Primaries::REC709
        };
        let dark = Primaries {
            white: [0.0, 0.0],
            ..Primaries::REC709
        };
        let odd = Primaries {
            red: [f64::NAN, 0.3],
            ..Primaries::REC709
        };
        for primaries in [flat, dark, odd] {
            assert_eq!(primaries.to_rec709(), None);
        }
    }
}
