//! Decimal numbers in fixed point: text to millionths, and division with rounding.
//!
//! Floating point would cost the chip kilobytes. Knows nobody.

/// Reads a number such as `-12.5` from the start of `text`: its value in millionths, and the rest
/// of the text. Digits after the sixth decimal are dropped.
///
/// `None` where no digit stands, or with more than nine digits before the point.
pub fn parse(text: &[u8]) -> Option<(i64, &[u8])> {
    let (negative, mut rest) = match text.split_first() {
        Some((b'-', rest)) => (true, rest),
        Some((b'+', rest)) => (false, rest),
        _ => (false, text),
    };
    let mut value = 0_i64;
    let mut any = false;
    let mut decimals = None;
    while let Some((&byte, after)) = rest.split_first() {
        match (byte, decimals) {
            (b'0'..=b'9', None | Some(0..6)) => {
                value = value * 10 + i64::from(byte - b'0');
                decimals = decimals.map(|count| count + 1);
                any = true;
            }
            (b'0'..=b'9', Some(_)) => {}
            (b'.', None) => decimals = Some(0),
            _ => break,
        }
        if decimals.is_none() && value > 999_999_999 {
            return None;
        }
        rest = after;
    }
    for _ in decimals.unwrap_or(0)..6 {
        value *= 10;
    }
    any.then_some((if negative { -value } else { value }, rest))
}

/// `dividend / divisor` to the nearest, halves away from zero. Divisors are positive; zero as
/// divisor gives zero.
pub fn divide_rounded(dividend: i64, divisor: i64) -> i64 {
    let half = divisor / 2;
    let shifted = if dividend < 0 {
        dividend.saturating_sub(half)
    } else {
        dividend.saturating_add(half)
    };
    shifted.checked_div(divisor).unwrap_or(0)
}

/// Millionths to thousandths, to the nearest.
///
/// `None` where the result is beyond an `i32`.
pub fn to_thousandths(millionths: i64) -> Option<i32> {
    i32::try_from(divide_rounded(millionths, 1000)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_to_millionths_and_end_where_they_end() {
        let cases: [(&str, i64, &str); 8] = [
            ("12.5X", 12_500_000, "X"),
            ("-0.001", -1000, ""),
            ("+7", 7_000_000, ""),
            (".25", 250_000, ""),
            ("3.", 3_000_000, ""),
            ("1.2.3", 1_200_000, ".3"),
            ("0.12345678G", 123_456, "G"),
            ("999999999", 999_999_999_000_000, ""),
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
    fn division_rounds_halves_away_from_zero() {
        assert_eq!(divide_rounded(15, 10), 2);
        assert_eq!(divide_rounded(14, 10), 1);
        assert_eq!(divide_rounded(-15, 10), -2);
        assert_eq!(divide_rounded(-14, 10), -1);
        assert_eq!(divide_rounded(7, 0), 0);
        assert_eq!(divide_rounded(i64::MAX, 1), i64::MAX);
    }

    #[test]
    fn thousandths_that_do_not_fit_are_told() {
        assert_eq!(to_thousandths(2_147_483_647_000), Some(i32::MAX));
        assert_eq!(to_thousandths(2_147_483_648_000), None);
        assert_eq!(to_thousandths(-1500), Some(-2));
    }
}
