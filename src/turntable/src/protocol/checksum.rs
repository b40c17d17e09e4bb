//! Checked lines: `<text>*<crc>`, where `<crc>` is CRC-16/CCITT-FALSE of the text (in the
//! catalogues CRC-16/IBM-3740) as four upper-case hexadecimal digits.

use crc::{CRC_16_IBM_3740, Crc};

const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// A line's checksum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ChecksumResult<'a> {
    /// The checksum is correct; the text before it.
    Good(&'a str),
    /// The checksum is wrong.
    Bad,
    /// The line has no checksum.
    Open,
}

/// `text` with its checksum.
pub(super) fn with_checksum(text: &str) -> String {
    format!("{text}*{:04X}", CRC.checksum(text.as_bytes()))
}

/// Checks and removes a line's checksum.
pub(super) fn check_checksum(line: &str) -> ChecksumResult<'_> {
    // Grbl's relatives write stars of their own, as in `[NVS STORAGE:*FLASH 4K]`.
    let Some((text, digits)) = line
        .rsplit_once('*')
        .filter(|(_, digits)| is_checksum(digits))
    else {
        return ChecksumResult::Open;
    };
    if u16::from_str_radix(digits, 16) == Ok(CRC.checksum(text.as_bytes())) {
        ChecksumResult::Good(text)
    } else {
        ChecksumResult::Bad
    }
}

fn is_checksum(digits: &str) -> bool {
    digits.len() == 4 && digits.bytes().all(is_digit)
}

fn is_digit(byte: u8) -> bool {
    byte.is_ascii_digit() || (b'A'..=b'F').contains(&byte)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_published_one() {
        assert_eq!(with_checksum("123456789"), "123456789*29B1");
        assert_eq!(
            check_checksum("123456789*29B1"),
            ChecksumResult::Good("123456789")
        );
    }

    #[test]
    fn any_flipped_bit_is_detected() {
        let sealed = with_checksum("ok N17");
        for bit in 0..sealed.len() * 8 {
            let mut bytes = sealed.clone().into_bytes();
            bytes[bit / 8] ^= 1 << (bit % 8);
            let damaged = String::from_utf8_lossy(&bytes);
            assert!(
                !matches!(check_checksum(&damaged), ChecksumResult::Good(_)),
                "{damaged}"
            );
        }
    }

    #[test]
    fn a_line_without_head_or_tail_is_not_taken_for_whole() {
        let sealed = with_checksum("<Run|MPos:12.345,0.000,0.000|FS:432,0|T:1>");
        for cut in 1..sealed.len() {
            assert!(!matches!(
                check_checksum(&sealed[cut..]),
                ChecksumResult::Good(_)
            ));
            assert!(!matches!(
                check_checksum(&sealed[..cut]),
                ChecksumResult::Good(_)
            ));
        }
    }
}
