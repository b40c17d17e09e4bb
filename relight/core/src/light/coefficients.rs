//! Light as coefficients of spherical harmonics.

use std::path::PathBuf;
use std::str::FromStr;
use std::{fmt, io};

use super::Direction;
use super::basis::basis;

/// What is wrong with light.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LightError {
    /// The order is too high.
    #[error("spherical harmonics of order {0} were asked for, and {most} is the highest", most = Order::MAX)]
    Order(usize),
    /// There are not as many coefficients as an order has.
    #[error("{0} coefficients were given where 1, 4, 9, 16, ... make an order")]
    Count(usize),
    /// A line of coefficients does not have three numbers.
    #[error("line {line} of the coefficients has not three finite numbers (red, green, blue)")]
    Line {
        /// The line, from 1.
        line: usize,
    },
    /// A value is infinite or not a number.
    #[error("the light has a value that is infinite or not a number")]
    NotFinite,
    /// There are too few pixels for a fit.
    #[error("there are too few pixels for a fit of so many coefficients")]
    TooFewPixels,
    /// The panorama has no pixels.
    #[error("the panorama has no pixels")]
    Empty,
}

/// The highest band of an expansion in spherical harmonics, 0 to 64. Order 2, nine coefficients, is the
/// paper's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Order(u8);

impl Order {
    /// The highest order that can be asked for.
    pub const MAX: usize = 64;
    /// Nine coefficients.
    pub const TWO: Self = Self(2);
    /// The order that ends at [`Order::MAX`].
    pub const HIGHEST: Self = Self(Self::MAX as u8);

    /// The order with `highest` as its last band.
    ///
    /// # Errors
    /// Above [`Order::MAX`].
    pub fn new(highest: usize) -> Result<Self, LightError> {
        match u8::try_from(highest) {
            Ok(order) if highest <= Self::MAX => Ok(Self(order)),
            _ => Err(LightError::Order(highest)),
        }
    }

    /// The last band.
    #[must_use]
    pub const fn get(self) -> usize {
        self.0 as usize
    }

    /// How many coefficients there are: (order + 1)².
    #[must_use]
    pub const fn coefficients(self) -> usize {
        (self.get() + 1) * (self.get() + 1)
    }

    fn of_coefficients(count: usize) -> Result<Self, LightError> {
        let side = count.isqrt();
        if count == 0 || side * side != count {
            return Err(LightError::Count(count));
        }
        Self::new(side - 1)
    }
}

/// Light from far away, linear RGB radiance over the sphere, as coefficients of the real spherical
/// harmonics (see [`basis`]).
///
/// Its text form is that of the released data: one line a coefficient in order of their index, with
/// red, green and blue; nine lines for order 2. What is printed is read back bit for bit.
///
/// ```
/// use relight_core::light::{Direction, ShLight};
///
/// // Even light of radiance 1: only Y_0 = 0.2821 is needed.
/// let mut lines = vec!["3.5449077018110318 3.5449077018110318 3.5449077018110318"];
/// lines.extend(["0 0 0"; 8]);
/// let light: ShLight = lines.join("\n").parse()?;
/// assert!((light.radiance(Direction::UP)[0] - 1.0).abs() < 1e-12);
/// assert_eq!(light.to_string().parse::<ShLight>()?, light);
/// # Ok::<(), relight_core::light::LightError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ShLight {
    order: Order,
    coefficients: Vec<[f64; 3]>,
}

impl ShLight {
    /// The light of these coefficients, (l, m) at index `l (l + 1) + m`.
    ///
    /// # Errors
    /// Where their number is not that of an order, or one is not finite.
    pub fn new(coefficients: Vec<[f64; 3]>) -> Result<Self, LightError> {
        let order = Order::of_coefficients(coefficients.len())?;
        if coefficients.iter().flatten().all(|value| value.is_finite()) {
            Ok(Self {
                order,
                coefficients,
            })
        } else {
            Err(LightError::NotFinite)
        }
    }

    /// No light.
    #[must_use]
    pub fn dark(order: Order) -> Self {
        Self {
            order,
            coefficients: vec![[0.0; 3]; order.coefficients()],
        }
    }

    /// Even light of this radiance from everywhere.
    #[must_use]
    pub fn even(order: Order, radiance: [f64; 3]) -> Self {
        let mut light = Self::dark(order);
        let y0 = basis(Order(0), Direction::VIEWER)[0];
        light.coefficients[0] = radiance.map(|value| value / y0);
        light
    }

    /// The highest band.
    #[must_use]
    pub const fn order(&self) -> Order {
        self.order
    }

    /// All coefficients, (l, m) at index `l (l + 1) + m`.
    #[must_use]
    pub fn coefficients(&self) -> &[[f64; 3]] {
        &self.coefficients
    }

    /// All coefficients, to write to.
    #[must_use]
    pub fn coefficients_mut(&mut self) -> &mut [[f64; 3]] {
        &mut self.coefficients
    }

    /// The radiance from a direction. A truncated expansion rings: it can be negative.
    #[must_use]
    pub fn radiance(&self, from: Direction) -> [f64; 3] {
        let values = basis(self.order, from);
        let mut sum = [0.0; 3];
        for (coefficient, value) in self.coefficients.iter().zip(values) {
            for (sum, c) in sum.iter_mut().zip(coefficient) {
                *sum += c * value;
            }
        }
        sum
    }

    /// The same light in another order: further bands are left out, or zero.
    #[must_use]
    pub fn with_order(&self, order: Order) -> Self {
        let mut coefficients = self.coefficients.clone();
        coefficients.resize(order.coefficients(), [0.0; 3]);
        Self {
            order,
            coefficients,
        }
    }

    /// The light in other colours: each coefficient times `tint`.
    #[must_use]
    pub fn tinted(mut self, tint: [f64; 3]) -> Self {
        for coefficient in &mut self.coefficients {
            for (value, tint) in coefficient.iter_mut().zip(tint) {
                *value *= tint;
            }
        }
        self
    }
}

/// Why a file of coefficients is not read or written.
#[derive(Debug, thiserror::Error)]
pub enum LightFileError {
    /// It cannot be read.
    #[error("{} cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
    /// It does not hold coefficients.
    #[error("{} holds no light", path.display())]
    Light {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: LightError,
    },
    /// It cannot be written.
    #[error("{} cannot be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
}

impl fmt::Display for ShLight {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for [red, green, blue] in &self.coefficients {
            writeln!(f, "{red:e} {green:e} {blue:e}")?;
        }
        Ok(())
    }
}

impl FromStr for ShLight {
    type Err = LightError;

    /// Reads one line a coefficient; numbers are parted by blanks or commas, empty lines and those
    /// that begin with # are passed over.
    fn from_str(text: &str) -> Result<Self, LightError> {
        let lines = text.lines().enumerate();
        let written = lines.filter(|(_, line)| {
            let line = line.trim();
            !line.is_empty() && !line.starts_with('#')
        });
        let coefficients: Result<Vec<_>, _> = written
            .map(|(at, line)| three_numbers(line).ok_or(LightError::Line { line: at + 1 }))
            .collect();
        Self::new(coefficients?)
    }
}

fn three_numbers(line: &str) -> Option<[f64; 3]> {
    let parts = line.split(|c: char| c.is_whitespace() || c == ',');
    let numbers: Result<Vec<f64>, _> = parts
        .filter(|part| !part.is_empty())
        .map(str::parse)
        .collect();
    let numbers: [f64; 3] = numbers.ok()?.try_into().ok()?;
    numbers.iter().all(|n| n.is_finite()).then_some(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_text_form_comes_back_bit_for_bit(
            values in prop::collection::vec(prop::array::uniform3(-1e30_f64..1e30), 9)
        ) {
            let light = ShLight::new(values).unwrap();
            prop_assert_eq!(light.to_string().lines().count(), 9);
            prop_assert_eq!(light.to_string().parse::<ShLight>().unwrap(), light);
        }
    }

    #[test]
    fn commas_comments_and_numpy_s_exponents_are_read() {
        let text = "# light\n1.0e+00, 2.000000000000000000e+00 ,3\n\n";
        let light: ShLight = text.parse().unwrap();
        assert_eq!(light.coefficients(), [[1.0, 2.0, 3.0]]);
    }

    #[test]
    fn wrong_text_names_its_line_or_the_count() {
        let text = "1 2 3\n1 2\n";
        assert_eq!(text.parse::<ShLight>(), Err(LightError::Line { line: 2 }));
        assert_eq!(
            "1 2 inf".parse::<ShLight>(),
            Err(LightError::Line { line: 1 })
        );
        assert_eq!(
            "1 2 3\n".repeat(8).parse::<ShLight>(),
            Err(LightError::Count(8))
        );
        assert_eq!("".parse::<ShLight>(), Err(LightError::Count(0)));
    }

    #[test]
    fn another_order_keeps_what_both_have() {
        let light = ShLight::even(Order::TWO, [1.0, 2.0, 3.0]);
        let higher = light.with_order(Order::new(5).unwrap());
        assert_eq!(higher.coefficients().len(), 36);
        assert_eq!(higher.with_order(Order::TWO), light);
    }
}
