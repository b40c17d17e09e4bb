//! Light as coefficients of spherical harmonics.

use std::fmt;
use std::str::FromStr;

use super::basis::basis;
use super::{Direction, LightError, Order};

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
    /// If their number is not that of an order, or one is not finite.
    pub fn new(coefficients: Vec<[f64; 3]>) -> Result<Self, LightError> {
        let order = Order::from_coefficients(coefficients.len())?;
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
    pub fn dark(order: Order) -> Self {
        Self {
            order,
            coefficients: vec![[0.0; 3]; order.coefficients()],
        }
    }

    /// Even light of this radiance from everywhere.
    pub fn even(order: Order, radiance: [f64; 3]) -> Self {
        let mut light = Self::dark(order);
        let y0 = basis(Order::ZERO, Direction::VIEWER)[0];
        light.coefficients[0] = radiance.map(|value| value / y0);
        light
    }

    /// The highest band.
    pub const fn order(&self) -> Order {
        self.order
    }

    /// All coefficients, (l, m) at index `l (l + 1) + m`.
    pub fn coefficients(&self) -> &[[f64; 3]] {
        &self.coefficients
    }

    /// All coefficients, to write to.
    #[must_use]
    pub fn coefficients_mut(&mut self) -> &mut [[f64; 3]] {
        &mut self.coefficients
    }

    /// The radiance from a direction. A truncated expansion rings: it can be negative.
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
    pub fn with_order(&self, order: Order) -> Self {
        let mut coefficients = self.coefficients.clone();
        coefficients.resize(order.coefficients(), [0.0; 3]);
        Self {
            order,
            coefficients,
        }
    }

    /// Adds a part of another light.
    pub fn add(&mut self, other: &Self, part: [f64; 3]) {
        for (to, from) in self.coefficients.iter_mut().zip(&other.coefficients) {
            for ((to, from), part) in to.iter_mut().zip(from).zip(part) {
                *to += part * from;
            }
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

    /// Reads one line a coefficient; numbers are separated by blanks or commas, empty lines and those
    /// that begin with # are passed over.
    fn from_str(text: &str) -> Result<Self, LightError> {
        let lines = text.lines().enumerate();
        let written = lines.filter(|(_, line)| {
            let line = line.trim();
            !line.is_empty() && !line.starts_with('#')
        });
        let coefficients: Result<Vec<_>, _> = written
            .map(|(at, line)| {
                three_numbers(line).ok_or_else(|| {
                LightError::Coefficients(format!(
                    "line {} of the coefficients is not three finite numbers (red, green, blue)",
                    at + 1
                ))
            })
            })
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
        for (text, named) in [
            ("1 2 3\n1 2\n".to_owned(), "line 2"),
            ("1 2 inf".to_owned(), "line 1"),
            ("1 2 3\n".repeat(8), "8 coefficients"),
            (String::new(), "0 coefficients"),
        ] {
            let fault = text.parse::<ShLight>().unwrap_err().to_string();
            assert!(fault.contains(named), "{fault}");
        }
    }

    #[test]
    fn another_order_keeps_what_both_have() {
        let light = ShLight::even(Order::TWO, [1.0, 2.0, 3.0]);
        let higher = light.with_order(Order::new(5).unwrap());
        assert_eq!(higher.coefficients().len(), 36);
        assert_eq!(higher.with_order(Order::TWO), light);
    }
}
