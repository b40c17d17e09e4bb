//! H.264 as cameras deliver it: NAL units behind start codes (ITU-T H.264, annex B).

/// The kinds of NAL unit that matter here (ITU-T H.264, table 7-1).
const SLICES: std::ops::RangeInclusive<u8> = 1..=IDR_SLICE;
const IDR_SLICE: u8 = 5;
const SEQUENCE_PARAMETERS: u8 = 7;
const PICTURE_PARAMETERS: u8 = 8;

/// True if the packet begins with a start code.
pub(super) fn is_annex_b(packet: &[u8]) -> bool {
    packet.starts_with(&[0, 0, 1]) || packet.starts_with(&[0, 0, 0, 1])
}

/// True if decoding of an H.264 stream with start codes can begin with this packet.
pub fn is_key(packet: &[u8]) -> bool {
    units(packet).any(|unit| kind(unit) == Some(IDR_SLICE))
}

/// True if the packet has any part of a picture.
pub(super) fn has_slice(packet: &[u8]) -> bool {
    units(packet).any(|unit| kind(unit).is_some_and(|kind| SLICES.contains(&kind)))
}

/// The parameter sets seen so far, which a decoder needs before the first picture.
#[derive(Debug, Default)]
pub(super) struct ParameterSets {
    sequence: Vec<u8>,
    picture: Vec<u8>,
}

impl ParameterSets {
    /// Collects those of the packet.
    pub(super) fn gather(&mut self, packet: &[u8]) {
        for unit in units(packet) {
            match kind(unit) {
                Some(SEQUENCE_PARAMETERS) => self.sequence = unit.to_vec(),
                Some(PICTURE_PARAMETERS) => self.picture = unit.to_vec(),
                _ => {}
            }
        }
    }

    /// Both sets behind start codes; `None` until both were seen.
    pub(super) fn extradata(&self) -> Option<Vec<u8>> {
        if self.sequence.is_empty() || self.picture.is_empty() {
            return None;
        }
        let start = [0, 0, 0, 1];
        Some([&start[..], &self.sequence, &start, &self.picture].concat())
    }
}

fn kind(unit: &[u8]) -> Option<u8> {
    unit.first().map(|byte| byte & 0x1F)
}

/// The units of a packet, without their start codes and the zeros behind them.
fn units(packet: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = next_start(packet).map(|(_, body)| &packet[body..]);
    std::iter::from_fn(move || {
        let unit = rest?;
        let (end, next) = match next_start(unit) {
            Some((end, body)) => (end, Some(&unit[body..])),
            None => (unit.len(), None),
        };
        rest = next;
        let zeros = unit[..end].iter().rev().take_while(|&&b| b == 0).count();
        Some(&unit[..end - zeros])
    })
}

/// Where the next start code begins and where it ends.
fn next_start(bytes: &[u8]) -> Option<(usize, usize)> {
    let at = bytes.windows(3).position(|window| window == [0, 0, 1])?;
    Some((at, at + 3))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SPS: [u8; 3] = [0x67, 0x42, 0x1F];
    const PPS: [u8; 3] = [0x68, 0xCE, 0x38];

    fn packet(units: &[&[u8]]) -> Vec<u8> {
        units
            .iter()
            .flat_map(|unit| [&[0, 0, 0, 1], *unit].concat())
            .collect()
    }

    #[test]
    fn a_packet_with_an_idr_slice_is_a_key_frame() {
        assert!(is_key(&packet(&[&SPS, &PPS, &[0x65, 1, 2]])));
        assert!(!is_key(&packet(&[&SPS, &PPS])));
        assert!(!has_slice(&packet(&[&SPS, &PPS])) && has_slice(&packet(&[&SPS, &[0x41, 9]])));
        assert!(!is_key(&packet(&[&[0x41, 0x65, 0x65]])));
        assert!(!is_key(b""));
    }

    #[test]
    fn parameter_sets_are_known_once_both_were_seen_also_in_two_packets() {
        let mut sets = ParameterSets::default();
        sets.gather(&packet(&[&SPS]));
        assert_eq!(sets.extradata(), None);
        sets.gather(&packet(&[&PPS, &[0x65, 9]]));
        assert_eq!(sets.extradata(), Some(packet(&[&SPS, &PPS])));
    }

    #[test]
    fn zeros_behind_a_unit_do_not_belong_to_it() {
        let padded = [&packet(&[&SPS])[..], &[0, 0], &packet(&[&PPS]), &[0, 0, 0]].concat();
        let found: Vec<_> = units(&padded).collect();
        assert_eq!(found, [&SPS[..], &PPS[..]]);
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(prop_oneof![Just(0_u8), Just(1), any::<u8>()], 0..64)) {
            let found: usize = units(&bytes).map(<[u8]>::len).sum();
            prop_assert!(found <= bytes.len());
            prop_assert!(!is_key(&bytes) || found > 0);
        }
    }
}
