//! Messages between the page and its engine: the number of parts and the length of each as little-endian 32-bit integers, then
//! the parts without gaps. By convention the first is JSON.

/// The most parts of a message.
const MAX_PARTS: usize = 256;
/// Bytes of an integer.
const WORD: usize = 4;

/// The bytes are not a message: they are too few or too many, or the number of parts is 0 or above the limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the message is damaged: it does not contain 1 to {MAX_PARTS} parts of the stated lengths")]
pub struct MessageFault;

/// The parts as one message.
///
/// ```
/// let message = relight_app::pack(&[b"{}", b"abc"]);
/// assert_eq!(relight_app::unpack(&message)?, [&b"{}"[..], b"abc"]);
/// # Ok::<(), relight_app::MessageFault>(())
/// ```
pub fn pack(parts: &[&[u8]]) -> Vec<u8> {
    let word = |number: usize| u32::try_from(number).unwrap_or(u32::MAX).to_le_bytes();
    let content: usize = parts.iter().map(|part| part.len()).sum();
    let mut message = Vec::with_capacity(WORD * (parts.len() + 1) + content);
    message.extend(word(parts.len()));
    for part in parts {
        message.extend(word(part.len()));
    }
    for part in parts {
        message.extend_from_slice(part);
    }
    message
}

/// The parts of a message.
///
/// # Errors
/// If the bytes are not a message.
pub fn unpack(message: &[u8]) -> Result<Vec<&[u8]>, MessageFault> {
    let (count, mut rest) = word(message)?;
    if !(1..=MAX_PARTS).contains(&count) {
        return Err(MessageFault);
    }
    let mut lengths = Vec::with_capacity(count);
    for _ in 0..count {
        let (length, after) = word(rest)?;
        lengths.push(length);
        rest = after;
    }
    let mut parts = Vec::with_capacity(count);
    for length in lengths {
        let (part, after) = rest.split_at_checked(length).ok_or(MessageFault)?;
        parts.push(part);
        rest = after;
    }
    if rest.is_empty() {
        Ok(parts)
    } else {
        Err(MessageFault)
    }
}

fn word(bytes: &[u8]) -> Result<(usize, &[u8]), MessageFault> {
    let (word, rest) = bytes.split_first_chunk().ok_or(MessageFault)?;
    Ok((u32::from_le_bytes(*word) as usize, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_packed_is_unpacked() {
        for parts in [
            &[&b""[..]][..],
            &[b"{}", b"", b"\x01\x02"],
            &[&b"a"[..]; 256],
        ] {
            assert_eq!(unpack(&pack(parts)).unwrap(), parts);
        }
    }

    #[test]
    fn bytes_that_are_no_message_are_refused_at_every_length() {
        let whole = pack(&[b"{}", b"abc"]);
        for length in 0..whole.len() {
            assert!(unpack(&whole[..length]).is_err(), "{length}");
        }
        let longer = [&whole[..], b"x"].concat();
        let lying = [1, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 1];
        for bytes in [&longer[..], &[0; 4], &[0xff; 64], &lying] {
            assert_eq!(unpack(bytes), Err(MessageFault));
        }
    }
}
