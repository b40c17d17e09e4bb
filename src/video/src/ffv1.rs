//! The checksums of FFV1. FFmpeg replaces a slice whose checksum is wrong by that of the previous
//! frame, and reports it in its log only.
//!
//! RFC 9043, sections 4.8 and 4.9: a packet is a row of slices, each followed by its size (3 bytes)
//! and, where the stream has error checking, a status byte and a CRC (4 bytes) over all of it.

use crc::{Algorithm, Crc};

/// Size, status and CRC.
const FOOTER: usize = 8;

/// Whether the checksums of all slices of a packet are right; `None` if the
/// packet is not a row of slices with checksums.
pub(super) fn slices_are_whole(packet: &[u8]) -> Option<bool> {
    let mut rest = packet;
    let mut whole = true;
    while !rest.is_empty() {
        let footer = rest.len().checked_sub(FOOTER)?;
        let size = rest[footer..footer + 3]
            .iter()
            .fold(0, |size, &byte| size << 8 | usize::from(byte));
        let begin = footer.checked_sub(size)?;
        whole &= CRC.checksum(&rest[begin..]) == 0;
        rest = &rest[..begin];
    }
    (!packet.is_empty()).then_some(whole)
}

/// The CRC of RFC 9043, 4.9.3: it is 0 over data followed by their own CRC.
const CRC: Crc<u32> = Crc::<u32>::new(&Algorithm {
    width: 32,
    poly: 0x04C1_1DB7,
    init: 0,
    refin: false,
    refout: false,
    xorout: 0,
    check: 0x89A1_897F,
    residue: 0,
});

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn slice(data: &[u8]) -> Vec<u8> {
        let mut slice = [data, &(data.len() as u32).to_be_bytes()[1..], &[0]].concat();
        slice.extend(CRC.checksum(&slice).to_be_bytes());
        slice
    }

    #[test]
    fn the_checksum_is_that_of_the_standard() {
        assert_eq!(CRC.checksum(b"123456789"), CRC.algorithm.check);
    }

    proptest! {
        #[test]
        fn any_flipped_bit_is_found(
            data in prop::collection::vec(prop::collection::vec(any::<u8>(), 1..40), 1..4),
            at in any::<prop::sample::Index>(), bit in 0..8,
        ) {
            let mut packet: Vec<u8> = data.iter().flat_map(|data| slice(data)).collect();
            prop_assert_eq!(slices_are_whole(&packet), Some(true));
            let at = at.index(packet.len());
            packet[at] ^= 1_u8 << bit;
            prop_assert_ne!(slices_are_whole(&packet), Some(true));
        }

        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..64)) {
            slices_are_whole(&bytes);
        }
    }
}
