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
