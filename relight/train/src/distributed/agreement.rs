//! Whether all processes of a run train the same thing: a hash of each of the facts that have to be equal.

use std::collections::BTreeMap;

use crc::{CRC_64_XZ, Crc};
use tch::{Kind, Tensor};

use super::process_group::ProcessGroup;
use crate::error::TrainError;

const HASH: Crc<u64> = Crc::<u64>::new(&CRC_64_XZ);

/// A fact: its name in the plural, and its text.
pub(crate) type Fact = (&'static str, String);

/// Compares facts, which all processes have in the same order.
///
/// # Errors
/// [`TrainError::Refused`] in every process, [`TrainError::ProcessLost`].
pub(crate) fn agree(group: &ProcessGroup, facts: &[Fact]) -> Result<(), TrainError> {
    let (own, count) = (group.rank().index() as usize, facts.len());
    let mut hashes = vec![0.0; count * group.rank().world_size() as usize];
    for (hash, (_, text)) in hashes[own * count..].iter_mut().zip(facts) {
        // As many bits as an f64 holds exactly; the others add 0 to it.
        *hash = (HASH.checksum(text.as_bytes()) >> 11) as f64;
    }
    group.sum(&mut hashes)?;
    for (process, theirs) in (0_u32..).zip(hashes.chunks_exact(count.max(1))) {
        let differs = theirs.iter().zip(&hashes).position(|(a, b)| a != b);
        if let Some(fact) = differs {
            let what = facts[fact].0;
            return Err(TrainError::Refused(format!(
                "{what} of process {process} are not those of process 0: start all processes with the same program, command, \
                 files and shared run folder"
            )));
        }
    }
    Ok(())
}

/// A few numbers that identify parameters, independent of the number of threads.
///
/// # Errors
/// [`TrainError::Torch`].
pub(crate) fn fingerprint(parameters: &BTreeMap<String, Tensor>) -> Result<String, TrainError> {
    let sums = parameters.iter().map(|(name, parameter)| {
        let bits = match parameter.kind() {
            Kind::Double => Kind::Int64,
            _ => Kind::Int,
        };
        let bits = parameter.f_detach()?.f_view_dtype(bits)?;
        let sum = i64::try_from(bits.f_sum(Kind::Int64)?)?;
        Ok::<_, TrainError>(format!("{name} {sum}\n"))
    });
    sums.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters(values: &[f32]) -> BTreeMap<String, Tensor> {
        BTreeMap::from([("layer.weight".to_owned(), Tensor::from_slice(values))])
    }

    #[test]
    fn parameters_that_differ_in_one_bit_have_other_fingerprints() {
        let fingerprint = |values: &[f32]| fingerprint(&parameters(values)).unwrap();
        assert_eq!(fingerprint(&[1.0, 2.0]), fingerprint(&[1.0, 2.0]));
        let next = f32::from_bits(2.0_f32.to_bits() + 1);
        assert_ne!(fingerprint(&[1.0, 2.0]), fingerprint(&[1.0, next]));
    }
}
