//! Converting H.264 from a file's form to a camera's byte stream.
//!
//! Files hold each unit behind its length, and the parameter sets apart (ISO/IEC 14496-15,
//! `avcC`). A camera sends start codes between units, and the parameter sets in the stream
//! (ITU-T H.264, annex B).

use super::nal;

const START_CODE: [u8; 4] = [0, 0, 0, 1];
const TYPE_SEQUENCE_SET: u8 = 7;

/// How a file's packets become a byte stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum ByteStream {
    /// They are one already.
    AsIs,
    /// They hold units behind lengths.
    FromLengths {
        /// Bytes of a length, 1 to 4.
        length_bytes: usize,
        /// The parameter sets, each behind a start code.
        parameter_sets: Vec<u8>,
    },
}

impl ByteStream {
    /// From the stream's extra data: an `avcC` record, which begins with 1, or parameter sets as
    /// a byte stream, or nothing. `None` for a record that ends early.
    pub(super) fn from_extra_data(extra: &[u8]) -> Option<Self> {
        if extra.first() != Some(&1) {
            return Some(Self::AsIs);
        }
        let length_bytes = usize::from(extra.get(4)? & 3) + 1;
        let mut parameter_sets = Vec::new();
        let sequence_sets = extra.get(5)? & 0x1f;
        let rest = take_sets(extra.get(6..)?, sequence_sets, &mut parameter_sets)?;
        let (&picture_sets, rest) = rest.split_first()?;
        take_sets(rest, picture_sets, &mut parameter_sets)?;
        Some(Self::FromLengths {
            length_bytes,
            parameter_sets,
        })
    }

    /// Whether a packet has a picture: of a file with lengths each has, unless it is damaged.
    pub(super) fn has_picture(&self, packet: &[u8]) -> bool {
        *self != Self::AsIs || nal::has_slice(packet)
    }

    /// A packet as a byte stream. Before a key frame stand the parameter sets, unless it brings
    /// its own. What does not fit its lengths is damaged, and kept as it is.
    pub(super) fn convert(&self, packet: &[u8], key: bool) -> Vec<u8> {
        let Self::FromLengths {
            length_bytes,
            parameter_sets,
        } = self
        else {
            return packet.to_vec();
        };
        let mut stream = Vec::with_capacity(packet.len() + parameter_sets.len() + 16);
        let first = packet.get(*length_bytes).map(|header| header & 0x1f);
        if key && first != Some(TYPE_SEQUENCE_SET) {
            stream.extend_from_slice(parameter_sets);
        }
        let mut rest = packet;
        while !rest.is_empty() {
            let unit = split_length(rest, *length_bytes);
            let (unit, after) = unit.unwrap_or((rest, &[]));
            stream.extend_from_slice(&START_CODE);
            stream.extend_from_slice(unit);
            rest = after;
        }
        stream
    }
}

fn take_sets<'a>(mut rest: &'a [u8], count: u8, sets: &mut Vec<u8>) -> Option<&'a [u8]> {
    for _ in 0..count {
        let (set, after) = split_length(rest, 2)?;
        sets.extend_from_slice(&START_CODE);
        sets.extend_from_slice(set);
        rest = after;
    }
    Some(rest)
}

/// The data after a big-endian length of so many bytes, and the rest.
fn split_length(data: &[u8], length_bytes: usize) -> Option<(&[u8], &[u8])> {
    let (length, rest) = data.split_at_checked(length_bytes)?;
    let length = length
        .iter()
        .fold(0, |sum, &byte| sum << 8 | usize::from(byte));
    rest.split_at_checked(length)
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    /// Version 1, lengths of 4 bytes, one sequence set [0x67, 1], one picture set [0x68].
    const RECORD: [u8; 14] = [1, 77, 0, 30, 0xff, 0xe1, 0, 2, 0x67, 1, 1, 0, 1, 0x68];

    #[test]
    fn lengths_become_start_codes_and_key_frames_bring_the_parameter_sets() {
        let stream = ByteStream::from_extra_data(&RECORD).unwrap();
        let packet = [0, 0, 0, 2, 0x65, 9, 0, 0, 0, 1, 0x06];
        let units = [0, 0, 0, 1, 0x65, 9, 0, 0, 0, 1, 0x06];
        assert_eq!(stream.convert(&packet, false), units);
        let sets = [0, 0, 0, 1, 0x67, 1, 0, 0, 0, 1, 0x68];
        assert_eq!(stream.convert(&packet, true), [&sets[..], &units].concat());
    }

    #[test]
    fn a_key_frame_with_its_own_parameter_sets_gets_no_others() {
        let stream = ByteStream::from_extra_data(&RECORD).unwrap();
        let packet = [0, 0, 0, 1, 0x67];
        assert_eq!(stream.convert(&packet, true), [0, 0, 0, 1, 0x67]);
    }

    #[test]
    fn a_byte_stream_stays_as_it_is() {
        for extra in [&[][..], &[0, 0, 0, 1, 0x67]] {
            let stream = ByteStream::from_extra_data(extra).unwrap();
            assert_eq!(stream.convert(&[0, 0, 1, 0x65], true), [0, 0, 1, 0x65]);
        }
    }

    #[test]
    fn a_record_that_ends_early_is_refused() {
        for end in 1..RECORD.len() {
            assert_eq!(ByteStream::from_extra_data(&RECORD[..end]), None, "{end}");
        }
    }

    proptest! {
        #[test]
        fn damaged_packets_lose_nothing(packet in vec(any::<u8>(), 0..200), key in any::<bool>()) {
            let stream = ByteStream::from_extra_data(&RECORD).unwrap();
            let converted = stream.convert(&packet, key);
            prop_assert!(packet.is_empty() || converted.len() >= packet.len());
        }
    }
}
