//! State dicts that PyTorch saved: a zip archive of one pickle and the raw bytes of the tensors.
//!
//! A pickle is a program. This reader knows the few instructions that a dict of tensors needs, builds
//! plain data from them, imports and calls nothing, and stops at limits; anything else is an error.

mod machine;

use std::io::{Cursor, Read};

use zip::ZipArchive;

use super::weights::{Tensor, Weights};
use machine::{Item, Machine, Storage, TensorParts};

/// Largest pickle, bytes; a state dict of a thousand tensors has 100 kB.
const MOST_PICKLE: u64 = 64 << 20;
/// Largest storage of one tensor, bytes.
const MOST_STORAGE: u64 = 2 << 30;
/// Most tensors.
const MOST_TENSORS: usize = 100_000;
/// Most numbers of all tensors together: 2 GiB at single precision, four times the released Light-Net.
const MOST_NUMBERS: usize = 1 << 29;
/// Numbers that tensors may have beyond one for each byte of the file. A stored number takes two bytes at least, so
/// each may belong to two tensors.
const SHARED_NUMBERS: usize = 1 << 16;
/// How deep a state dict may lie in other dicts.
const DEEPEST: usize = 4;

/// Reads the archive `bytes`. Of nested dicts (`{"state_dict": {...}, "epoch": 3}`) the first that
/// holds tensors is taken.
///
/// # Errors
/// A sentence that says what is wrong.
pub(super) fn read_state_dict(bytes: &[u8]) -> Result<Weights, String> {
    let mut archive = ZipArchive::new(Cursor::new(bytes))
        .map_err(|error| format!("it is no zip archive ({error})"))?;
    let names: Vec<String> = archive
        .file_names()
        .filter_map(|name| Some(name.ok()?.into_owned()))
        .collect();
    let pickle_name = names
        .iter()
        .find(|name| name.ends_with("/data.pkl") || *name == "data.pkl")
        .ok_or("the archive holds no data.pkl: was it saved by torch.save?")?;
    let folder = pickle_name.trim_end_matches("data.pkl").to_owned();
    if names.iter().any(|name| name.contains("/code/")) {
        return Err("it is a TorchScript program: save the state_dict() alone".to_owned());
    }
    let pickle = read_entry(&mut archive, pickle_name, MOST_PICKLE)?;
    let objects = Machine::run(&pickle)?;
    let parts = find_tensors(&objects, objects.root(), 0)
        .ok_or("no dict of tensors was found in it: save the state_dict() alone")?;
    if parts.len() > MOST_TENSORS {
        return Err(format!("{} tensors are too many", parts.len()));
    }
    check_total(&parts, bytes.len())?;
    let mut weights = Vec::with_capacity(parts.len());
    for (name, parts) in parts {
        let entry = format!("{folder}data/{}", parts.storage.key);
        let data = read_entry(&mut archive, &entry, MOST_STORAGE)?;
        let tensor = gather(&parts, &data).map_err(|fault| format!("{name}: {fault}"))?;
        weights.push((name, tensor));
    }
    Ok(weights.into_iter().collect())
}

fn read_entry(
    archive: &mut ZipArchive<Cursor<&[u8]>>,
    name: &str,
    most: u64,
) -> Result<Vec<u8>, String> {
    let entry = archive
        .by_name(name)
        .map_err(|error| format!("the archive's {name} cannot be read ({error})"))?;
    let mut data = Vec::new();
    entry
        .take(most + 1)
        .read_to_end(&mut data)
        .map_err(|error| format!("the archive's {name} cannot be read ({error})"))?;
    if data.len() as u64 > most {
        return Err(format!("the archive's {name} is larger than {most} bytes"));
    }
    Ok(data)
}

/// The named tensors of the first dict that has any.
fn find_tensors(
    objects: &machine::Objects,
    at: machine::Id,
    depth: usize,
) -> Option<Vec<(String, TensorParts)>> {
    let Item::Dict(entries) = objects.item(at) else {
        return None;
    };
    let tensors: Vec<_> = entries
        .iter()
        .filter_map(
            |&(key, value)| match (objects.item(key), objects.item(value)) {
                (Item::Text(name), Item::Tensor(parts)) => Some((name.clone(), parts.clone())),
                _ => None,
            },
        )
        .collect();
    if !tensors.is_empty() {
        return Some(tensors);
    }
    if depth >= DEEPEST {
        return None;
    }
    entries
        .iter()
        .find_map(|&(_, value)| find_tensors(objects, value, depth + 1))
}

/// Whether tensors that describe the same storage again and again are few enough for a file of `bytes`.
fn check_total(parts: &[(String, TensorParts)], bytes: usize) -> Result<(), String> {
    let most = MOST_NUMBERS.min(bytes.saturating_add(SHARED_NUMBERS));
    let counts = parts.iter().map(|(_, parts)| {
        let sides = parts.shape.iter();
        sides.fold(1_usize, |count, &side| count.saturating_mul(side))
    });
    let total = counts.fold(0_usize, usize::saturating_add);
    if total > most {
        return Err(format!(
            "its tensors hold {total} numbers together, and a file of {bytes} bytes may hold {most}"
        ));
    }
    Ok(())
}

/// A tensor's numbers in row-major order, wherever they lie in its storage.
fn gather(parts: &TensorParts, data: &[u8]) -> Result<Tensor, String> {
    let TensorParts {
        storage: Storage { kind, .. },
        offset,
        shape,
        strides,
    } = parts;
    if shape.len() != strides.len() {
        return Err("its shape and its strides do not fit each other".to_owned());
    }
    let count = shape
        .iter()
        .try_fold(1_usize, |count, &side| count.checked_mul(side))
        .filter(|&count| count <= data.len())
        .ok_or("its storage is too short for its shape")?;
    let mut values = Vec::with_capacity(count);
    let mut index = vec![0_usize; shape.len()];
    for _ in 0..count {
        let steps = index
            .iter()
            .zip(strides)
            .map(|(at, stride)| at.checked_mul(*stride));
        let at = steps
            .chain([Some(*offset)])
            .try_fold(0_usize, |sum, step| sum.checked_add(step?));
        let value = at.and_then(|at| kind.number(data, at));
        values.push(value.ok_or("its storage is too short for its shape")?);
        for (at, &side) in index.iter_mut().zip(shape).rev() {
            *at += 1;
            if *at < side {
                break;
            }
            *at = 0;
        }
    }
    Tensor::new(shape.clone(), values).ok_or_else(|| "its shape is impossible".to_owned())
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    use super::*;

    /// Numbers of the one storage.
    const STORED: u32 = 50_000;

    /// A state dict of so many tensors, each of which is the same storage.
    fn sharing(tensors: u8) -> Vec<u8> {
        let text = |text: &str| [&[0x8c, text.len() as u8], text.as_bytes()].concat();
        let global = |path: &str| [b"c", path.as_bytes(), b"\n"].concat();
        let count = [&b"J"[..], &STORED.to_le_bytes()].concat();
        let mut pickle = b"\x80\x02}(".to_vec();
        for at in 0..tensors {
            let tensor: [&[u8]; 16] = [
                &text(&format!("{at}.weight")),
                &global("torch._utils\n_rebuild_tensor_v2"),
                b"((",
                &text("storage"),
                &global("torch\nFloatStorage"),
                &text("0"),
                &text("cpu"),
                &count,
                // Storage, then offset 0.
                b"tQ",
                b"K\x00",
                &count,
                b"\x85",
                b"K\x01",
                b"\x85",
                b"t",
                b"R",
            ];
            pickle.extend(tensor.concat());
        }
        pickle.extend(b"u.");
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        let stored =
            SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
        archive.start_file("net/data.pkl", stored).unwrap();
        archive.write_all(&pickle).unwrap();
        archive.start_file("net/data/0", stored).unwrap();
        archive.write_all(&vec![0; 4 * STORED as usize]).unwrap();
        archive.finish().unwrap().into_inner()
    }

    #[test]
    fn tensors_may_share_a_storage_but_not_multiply_the_file() {
        let weights = read_state_dict(&sharing(2)).unwrap();
        assert_eq!(weights.iter().count(), 2);
        let text = read_state_dict(&sharing(24)).unwrap_err();
        assert!(text.contains("its tensors hold 1200000 numbers"), "{text}");
    }
}
