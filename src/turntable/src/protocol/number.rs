//! Numbers as Grbl writes them: digits, perhaps a sign and a point, no exponent.

/// Longest accepted number: more digits are noise.
pub(super) const MAX_LENGTH: usize = 16;

/// A decimal number such as `-12.345`.
pub(super) fn decimal(text: &str) -> Option<f64> {
    let digits = text.strip_prefix('-').unwrap_or(text);
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, "0"));
    let usable = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    if text.len() > MAX_LENGTH || !usable(whole) || !usable(fraction) {
        return None;
    }
    text.parse().ok()
}

/// A whole number without sign.
pub(super) fn whole(text: &str) -> Option<u32> {
    let usable = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    usable.then(|| text.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_plain_digits_are_numbers() {
        assert_eq!(decimal("-12.345"), Some(-12.345));
        assert_eq!(decimal("0"), Some(0.0));
        for text in [
            "", "-", ".5", "5.", "1e3", "inf", "NaN", "+1", "1 ", "--1", "0x1",
        ] {
            assert_eq!(decimal(text), None, "{text:?}");
        }
        assert_eq!(whole("4294967295"), Some(u32::MAX));
        for text in ["4294967296", "-1", "", "1.0", "+1"] {
            assert_eq!(whole(text), None, "{text:?}");
        }
    }
}
