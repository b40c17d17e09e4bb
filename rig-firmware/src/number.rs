//! Decimal numbers in fixed point: text to whole and fraction, and division with rounding.
//!
//! Floating point would cost the chip kilobytes, and numbers of 64 bits more than half as much.
//! Knows no other module.

/// A decimal number of up to nine digits before the point and six behind it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Decimal {
    negative: bool,
    /// Up to 999 999 999.
    whole: u32,
    /// Below 1 000 000.
    millionths: u32,
}

impl Decimal {
    /// Below zero.
    pub(crate) fn is_negative(self) -> bool {
        self.negative
    }

    /// Nothing stands behind the point.
    pub(crate) fn is_whole(self) -> bool {
        self.millionths == 0
    }

    /// What stands before the point, without the sign.
    pub(crate) fn whole(self) -> u32 {
        self.whole
    }

    /// Thousandths, to the nearest, halves away from zero.
    ///
    /// `None` where the result is beyond an `i32`.
    pub(crate) fn thousandths(self) -> Option<i32> {
        if self.whole > 2_147_483 {
            return None;
        }
        let fraction = (self.millionths + 500) / 1000;
        let magnitude = i32::try_from(self.whole * 1000 + fraction).ok()?;
        Some(if self.negative { -magnitude } else { magnitude })
    }

    /// Seconds to microseconds; `None` for less than none or more than 4293 s.
    pub(crate) fn micros(self) -> Option<u32> {
        let fits = !self.negative && self.whole < 4294;
        fits.then(|| self.whole * 1_000_000 + self.millionths)
    }
}

/// Reads a number such as `-12.5` from the start of `text`, and returns the rest of the text. Digits
/// after the sixth decimal are dropped.
///
/// `None` where no digit stands, or with more than nine digits before the point.
pub(crate) fn parse(text: &[u8]) -> Option<(Decimal, &[u8])> {
    let (negative, mut rest) = match text.split_first() {
        Some((b'-', rest)) => (true, rest),
        Some((b'+', rest)) => (false, rest),
        _ => (false, text),
    };
    let (mut whole, mut millionths) = (0_u32, 0_u32);
    let mut any = false;
    // What the next decimal counts, once the point has come.
    let mut unit = None;
    while let Some((&byte, after)) = rest.split_first() {
        match (byte, unit) {
            (b'0'..=b'9', None) => {
                any = true;
                if whole > 99_999_999 {
                    return None;
                }
                whole = whole * 10 + u32::from(byte - b'0');
            }
            (b'0'..=b'9', Some(counts)) => {
                any = true;
                millionths += u32::from(byte - b'0') * counts;
                unit = Some(counts / 10);
            }
            (b'.', None) => unit = Some(100_000_u32),
            _ => break,
        }
        rest = after;
    }
    let number = Decimal {
        negative: negative && (whole, millionths) != (0, 0),
        whole,
        millionths,
    };
    any.then_some((number, rest))
}

/// Reads a number of at most `most` digits (nine at most) and nothing else, and returns the rest.
///
/// `None` where no digit stands, or more.
pub(crate) fn digits(text: &[u8], most: u8) -> Option<(u32, &[u8])> {
    let (mut value, mut count, mut rest) = (0, 0, text);
    while let Some((&byte @ b'0'..=b'9', after)) = rest.split_first() {
        if count == most {
            return None;
        }
        count += 1;
        value = value * 10 + u32::from(byte - b'0');
        rest = after;
    }
    (count > 0).then_some((value, rest))
}

/// `value * times / divisor` to the nearest, halves away from zero.
///
/// `None` where the result is beyond an `i32`, and for zero as divisor.
pub(crate) fn scaled(value: i32, times: u32, divisor: u32) -> Option<i32> {
    let product = u64::from(value.unsigned_abs()) * u64::from(times) + u64::from(divisor / 2);
    let magnitude = product.checked_div(u64::from(divisor))?;
    let magnitude = i32::try_from(magnitude).ok()?;
    Some(if value < 0 { -magnitude } else { magnitude })
}

/// The end of what an `i32` can tell, on the side of `value`.
pub(crate) fn end_towards(value: i32) -> i32 {
    if value < 0 { i32::MIN } else { i32::MAX }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(negative: bool, whole: u32, millionths: u32) -> Decimal {
        Decimal {
            negative,
            whole,
            millionths,
        }
    }

    fn read(text: &str) -> Decimal {
        parse(text.as_bytes()).unwrap().0
    }

    #[test]
    fn numbers_are_read_to_millionths_and_end_where_they_end() {
        let cases = [
            ("12.5X", number(false, 12, 500_000), "X"),
            ("-0.001", number(true, 0, 1000), ""),
            ("+7", number(false, 7, 0), ""),
            ("-0", number(false, 0, 0), ""),
            (".25", number(false, 0, 250_000), ""),
            ("3.", number(false, 3, 0), ""),
            ("1.2.3", number(false, 1, 200_000), ".3"),
            ("0.12345678G", number(false, 0, 123_456), "G"),
            ("999999999", number(false, 999_999_999, 0), ""),
        ];
        for (text, value, rest) in cases {
            let got = parse(text.as_bytes());
            assert_eq!(got, Some((value, rest.as_bytes())), "{text}");
        }
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for text in ["", "-", ".", "-.", "X1", "+-1", "1000000000", " 1"] {
            assert_eq!(parse(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn digits_are_counted() {
        assert_eq!(digits(b"110=5", 3), Some((110, &b"=5"[..])));
        assert_eq!(digits(b"007", 3), Some((7, &b""[..])));
        assert_eq!(digits(b"1234", 3), None);
        assert_eq!(digits(b"x", 3), None);
        assert_eq!(digits(b"999999999", 9), Some((999_999_999, &b""[..])));
    }

    #[test]
    fn scaling_rounds_halves_away_from_zero_and_tells_what_does_not_fit() {
        assert_eq!(scaled(3, 5, 10), Some(2));
        assert_eq!(scaled(14, 1, 10), Some(1));
        assert_eq!(scaled(-15, 1, 10), Some(-2));
        assert_eq!(scaled(-14, 1, 10), Some(-1));
        assert_eq!(scaled(7, 1, 0), None);
        assert_eq!(scaled(i32::MIN, u32::MAX, u32::MAX), None);
        assert_eq!(scaled(i32::MAX, u32::MAX, u32::MAX), Some(i32::MAX));
        assert_eq!(scaled(-2, u32::MAX, 1), None);
    }

    #[test]
    fn scaled_numbers_round_halves_away_from_zero_and_have_to_fit() {
        assert_eq!(read("-0.0015").thousandths(), Some(-2));
        assert_eq!(read("0.0014").thousandths(), Some(1));
        assert_eq!(read("2147483.647").thousandths(), Some(i32::MAX));
        assert_eq!(read("2147483.648").thousandths(), None);
        assert_eq!(read("0.5").micros(), Some(500_000));
        assert_eq!(read("4293.999999").micros(), Some(4_293_999_999));
        assert_eq!(read("4295").micros(), None);
        assert_eq!(read("-1").micros(), None);
    }
}
