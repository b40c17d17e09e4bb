//! Weights that an ONNX file keeps in other files: exporters write large networks so. They are put into its bytes, which any
//! engine can then read without the others.

use prost::Message;
use tract_onnx::pb::tensor_proto::DataLocation;
use tract_onnx::pb::{GraphProto, ModelProto, NodeProto, TensorProto};

/// Most bytes that a file may have with its weights: no protobuf message may be longer.
const MAX_BYTES: usize = i32::MAX as usize;

/// Part of another file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExternalPart {
    /// The file's name, relative to the ONNX file's folder, as it is written.
    pub location: String,
    /// Where it begins, bytes.
    pub offset: u64,
    /// How long it is, bytes.
    pub length: u64,
}

/// The bytes of an ONNX file with the values of all its tensors: `read` gives those that stand in other files. `None` if all
/// stand in it already.
///
/// # Errors
/// A sentence: it is damaged, or what `read` answers.
pub fn with_external_weights(
    onnx: &[u8],
    mut read: impl FnMut(&ExternalPart) -> Result<Vec<u8>, String>,
) -> Result<Option<Vec<u8>>, String> {
    let mut model = ModelProto::decode(onnx).map_err(|fault| fault.to_string())?;
    let mut outside = Vec::new();
    if let Some(graph) = &mut model.graph {
        tensors_of_graph(graph, &mut outside);
    }
    for function in &mut model.functions {
        tensors_of_nodes(&mut function.node, &mut outside);
    }
    outside.retain(|tensor| tensor.data_location() == DataLocation::External);
    if outside.is_empty() {
        return Ok(None);
    }
    let mut whole = onnx.len();
    for tensor in outside {
        let part = part_of(tensor)?;
        let length = usize::try_from(part.length).ok();
        whole = length
            .and_then(|length| whole.checked_add(length))
            .filter(|&whole| whole <= MAX_BYTES)
            .ok_or_else(|| format!("with its weights it is longer than {MAX_BYTES} bytes"))?;
        let values = read(&part)?;
        let found = values.len();
        if length != Some(found) {
            return Err(format!("{found} bytes of {} were read", part.length));
        }
        tensor.raw_data = values;
        tensor.external_data.clear();
        tensor.data_location = None;
    }
    Ok(Some(model.encode_to_vec()))
}

fn tensors_of_graph<'a>(graph: &'a mut GraphProto, found: &mut Vec<&'a mut TensorProto>) {
    found.extend(&mut graph.initializer);
    tensors_of_nodes(&mut graph.node, found);
}

/// Those of the nodes' attributes: graphs in them have nodes of their own.
fn tensors_of_nodes<'a>(nodes: &'a mut [NodeProto], found: &mut Vec<&'a mut TensorProto>) {
    for attribute in nodes.iter_mut().flat_map(|node| &mut node.attribute) {
        found.extend(&mut attribute.t);
        found.extend(&mut attribute.tensors);
        for graph in attribute.g.iter_mut().chain(&mut attribute.graphs) {
            tensors_of_graph(graph, found);
        }
    }
}

/// Where the values of a tensor stand.
fn part_of(tensor: &TensorProto) -> Result<ExternalPart, String> {
    let wrong = |what: &str| format!("its tensor {:?} {what}", tensor.name);
    let entry = |key: &str| tensor.external_data.iter().find(|entry| entry.key == key);
    let number = |key: &str| match entry(key) {
        Some(entry) => match entry.value.trim().parse::<u64>() {
            Ok(number) => Ok(Some(number)),
            Err(_) => Err(wrong(&format!("has the {key} {:?}", entry.value))),
        },
        None => Ok(None),
    };
    let location = entry("location").ok_or_else(|| wrong("names no file"))?;
    let (expected, given) = (bytes_of(tensor), number("length")?);
    if let (Some(expected), Some(given)) = (expected, given)
        && expected != given
    {
        return Err(wrong(&format!(
            "has {given} bytes; its shape needs {expected}"
        )));
    }
    let length = given.or(expected);
    let length = length.ok_or_else(|| wrong("has an unknown shape or type"))?;
    Ok(ExternalPart {
        location: location.value.clone(),
        offset: number("offset")?.unwrap_or(0),
        length,
    })
}

/// How many bytes the values of a tensor have; `None` if its shape or type is not known.
fn bytes_of(tensor: &TensorProto) -> Option<u64> {
    let count = tensor.dims.iter().try_fold(1_u64, |count, &side| {
        count.checked_mul(u64::try_from(side).ok()?)
    })?;
    // As `TensorProto.DataType` numbers them.
    let bits: u64 = match tensor.data_type {
        21..=23 => 4,
        25 | 26 => 2,
        2 | 3 | 9 | 17..=20 | 24 => 8,
        4 | 5 | 10 | 16 => 16,
        1 | 6 | 12 => 32,
        7 | 11 | 13 | 14 => 64,
        15 => 128,
        _ => return None,
    };
    Some(count.checked_mul(bits)?.div_ceil(8))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nets::{WeightPrecision, Weights, decomposer, to_onnx};
    use tract_onnx::pb::StringStringEntryProto as Entry;

    /// The same file with the raw values of its tensors moved into other bytes.
    fn moved(bytes: &[u8], others: &mut Vec<u8>) -> Vec<u8> {
        let mut model = ModelProto::decode(bytes).unwrap();
        let mut tensors = Vec::new();
        tensors_of_graph(model.graph.as_mut().unwrap(), &mut tensors);
        for tensor in tensors {
            let values = std::mem::take(&mut tensor.raw_data);
            let entries = [
                ("location", "weights.bin".to_owned()),
                ("offset", others.len().to_string()),
                ("length", values.len().to_string()),
            ];
            let entry = |(key, value): (&str, String)| Entry {
                key: key.to_owned(),
                value,
            };
            tensor.external_data = entries.map(entry).to_vec();
            tensor.data_location = Some(DataLocation::External as i32);
            others.extend_from_slice(&values);
        }
        model.encode_to_vec()
    }

    fn network() -> Vec<u8> {
        let graph = decomposer();
        let weights = Weights::initial(&graph, 1);
        to_onnx(&graph, &weights, WeightPrecision::Single, &[]).unwrap()
    }

    fn range(others: &[u8], part: &ExternalPart) -> Option<Vec<u8>> {
        let start = usize::try_from(part.offset).ok()?;
        let length = usize::try_from(part.length).ok()?;
        Some(others.get(start..start.checked_add(length)?)?.to_vec())
    }

    #[test]
    fn weights_elsewhere_are_put_where_they_stand_in_a_file_that_has_its_own() {
        let plain = network();
        let mut others = Vec::new();
        let outside = moved(&plain, &mut others);
        assert!(outside.len() < plain.len() / 4);
        let merged = with_external_weights(&outside, |part| {
            assert_eq!(part.location, "weights.bin");
            Ok(range(&others, part).unwrap())
        });
        assert_eq!(merged.unwrap().unwrap(), plain);
    }

    #[test]
    fn a_file_with_its_own_weights_stays_as_it_is() {
        let read = |_: &ExternalPart| unreachable!();
        assert!(with_external_weights(&network(), read).unwrap().is_none());
    }

    fn tensor(entries: &[(&str, &str)]) -> Vec<u8> {
        let entry = |(key, value): &(&str, &str)| Entry {
            key: (*key).to_owned(),
            value: (*value).to_owned(),
        };
        let tensor = TensorProto {
            dims: vec![2, 3],
            data_type: 1,
            name: "w".to_owned(),
            external_data: entries.iter().map(entry).collect(),
            data_location: Some(DataLocation::External as i32),
            ..TensorProto::default()
        };
        let graph = GraphProto {
            initializer: vec![tensor],
            ..GraphProto::default()
        };
        let model = ModelProto {
            graph: Some(graph),
            ..ModelProto::default()
        };
        model.encode_to_vec()
    }

    #[test]
    fn what_is_left_out_follows_from_the_shape_and_what_contradicts_it_is_damaged() {
        let part = |entries: &[(&str, &str)]| {
            let mut found = None;
            let merged = with_external_weights(&tensor(entries), |part| {
                found = Some(part.clone());
                Err("a part is needed".to_owned())
            });
            assert!(merged.is_err());
            found
        };
        let location = ("location", "a/b.bin");
        let found = part(&[location]).unwrap();
        assert_eq!((found.offset, found.length), (0, 24));
        let found = part(&[("offset", "4096"), location, ("length", "24")]).unwrap();
        assert_eq!((found.offset, found.location.as_str()), (4096, "a/b.bin"));
        for wrong in [
            &[("length", "24")][..],
            &[location, ("length", "25")],
            &[location, ("length", "-1")],
            &[location, ("offset", "a")],
        ] {
            assert_eq!(part(wrong), None, "{wrong:?}");
        }
        let short = with_external_weights(&tensor(&[location]), |_| Ok(vec![0]));
        let fault = short.unwrap_err();
        assert!(fault.contains("1 bytes") && fault.contains("24"), "{fault}");
    }

    #[test]
    fn damage_anywhere_ends_nothing() {
        let outside = moved(&network(), &mut Vec::new());
        for at in (0..outside.len()).step_by(97) {
            let mut damaged = outside.clone();
            damaged[at] ^= 0x5a;
            let _ = with_external_weights(&damaged, |_| Err(String::new()));
            let _ = with_external_weights(&outside[..at], |_| Err(String::new()));
        }
    }
}
