//! Weights that an ONNX file keeps in other files: exporters write large networks so. They are put into its bytes, which any
//! engine can then read without the others.
//!
//! A file is gone through on the level of protobuf's fields, so that nothing in it is lost that is not known here: all fields
//! are copied as they are, but tensors whose values stand elsewhere. Field numbers are those of `onnx.proto3` (ONNX 1.17).

use prost::Message;
use prost::encoding::{WireType, decode_key, decode_varint, encode_key, encode_varint};

/// Most bytes that a file may have with its weights: no protobuf message may be longer.
const MOST_BYTES: usize = i32::MAX as usize;
/// Deepest nesting of messages that is followed: a graph in a node's attribute has nodes of its own.
const DEEPEST: usize = 100;

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

/// Why the weights of an ONNX file cannot be put into it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExternalFault<E> {
    /// It is damaged, or what it says of other files is.
    #[error("{0}")]
    Damaged(String),
    /// A part of another file could not be read.
    #[error(transparent)]
    Part(E),
}

/// Messages that may hold tensors, by what they are.
#[derive(Clone, Copy)]
enum Kind {
    Model,
    Graph,
    Node,
    Attribute,
    Function,
    SparseTensor,
    Tensor,
}

impl Kind {
    /// What a field of such a message holds, where that may hold tensors.
    fn of_field(self, field: u32) -> Option<Self> {
        Some(match (self, field) {
            (Self::Model, 7) | (Self::Attribute, 6 | 11) => Self::Graph,
            (Self::Model, 25) => Self::Function,
            (Self::Graph, 1) | (Self::Function, 7) => Self::Node,
            (Self::Node, 5) | (Self::Function, 11) => Self::Attribute,
            (Self::Graph, 15) | (Self::Attribute, 22 | 23) => Self::SparseTensor,
            (Self::Graph, 5) | (Self::Attribute, 5 | 10) | (Self::SparseTensor, 1 | 2) => {
                Self::Tensor
            }
            _ => return None,
        })
    }
}

/// The bytes of an ONNX file with the values of all its tensors: `read` gives those that stand in other files. None where all
/// stand in it already.
///
/// # Errors
/// [`ExternalFault`].
pub fn with_external_weights<E>(
    onnx: &[u8],
    mut read: impl FnMut(&ExternalPart) -> Result<Vec<u8>, E>,
) -> Result<Option<Vec<u8>>, ExternalFault<E>> {
    let mut merged = Merged {
        read: &mut read,
        length: onnx.len(),
    };
    merged.message(Kind::Model, onnx, 0)
}

/// The name of the first other file in which an ONNX file's weights stand, if any do.
pub(super) fn first_location(onnx: &[u8]) -> Option<String> {
    match with_external_weights(onnx, |part| Err(part.location.clone())) {
        Err(ExternalFault::Part(location)) => Some(location),
        _ => None,
    }
}

struct Merged<'a, E> {
    read: &'a mut dyn FnMut(&ExternalPart) -> Result<Vec<u8>, E>,
    /// Of the whole file with what was read.
    length: usize,
}

impl<E> Merged<'_, E> {
    /// The message with the values of its tensors; none where they all stand in it.
    fn message(
        &mut self,
        kind: Kind,
        bytes: &[u8],
        depth: usize,
    ) -> Result<Option<Vec<u8>>, ExternalFault<E>> {
        if depth > DEEPEST {
            return Err(damaged("it is nested too deep"));
        }
        if matches!(kind, Kind::Tensor) {
            return self.tensor(bytes);
        }
        let mut changed: Option<Vec<u8>> = None;
        let mut fields = Fields { rest: bytes };
        let mut at = 0;
        while let Some(field) = fields.next().map_err(damaged)? {
            let inner = match (field.content, kind.of_field(field.number)) {
                (Some(content), Some(inner)) => self.message(inner, content, depth + 1)?,
                _ => None,
            };
            match inner {
                Some(inner) => {
                    let whole = changed.get_or_insert_with(|| bytes[..at].to_owned());
                    append(whole, field.number, &inner);
                }
                None => {
                    if let Some(whole) = &mut changed {
                        whole.extend_from_slice(field.bytes);
                    }
                }
            }
            at += field.bytes.len();
        }
        Ok(changed)
    }

    fn tensor(&mut self, bytes: &[u8]) -> Result<Option<Vec<u8>>, ExternalFault<E>> {
        let tensor = Tensor::decode(bytes).map_err(|fault| damaged(fault.to_string()))?;
        if tensor.data_location != EXTERNAL {
            return Ok(None);
        }
        let part = tensor.part().map_err(damaged)?;
        let length = usize::try_from(part.length).ok();
        let whole = length.and_then(|length| self.length.checked_add(length));
        let whole = whole.filter(|&whole| whole <= MOST_BYTES);
        self.length = whole.ok_or_else(|| {
            damaged(format!(
                "with its weights it is longer than {MOST_BYTES} bytes"
            ))
        })?;
        let values = (self.read)(&part).map_err(ExternalFault::Part)?;
        let found = values.len();
        if length != Some(found) {
            return Err(damaged(format!(
                "{found} bytes of {} were read",
                part.length
            )));
        }
        let mut whole = Vec::with_capacity(bytes.len() + values.len());
        let mut fields = Fields { rest: bytes };
        while let Some(field) = fields.next().map_err(damaged)? {
            if !matches!(field.number, RAW_DATA | EXTERNAL_DATA | DATA_LOCATION) {
                whole.extend_from_slice(field.bytes);
            }
        }
        append(&mut whole, RAW_DATA, &values);
        Ok(Some(whole))
    }
}

fn damaged<E>(what: impl Into<String>) -> ExternalFault<E> {
    ExternalFault::Damaged(what.into())
}

/// Adds a field of bytes.
fn append(message: &mut Vec<u8>, number: u32, content: &[u8]) {
    encode_key(number, WireType::LengthDelimited, message);
    encode_varint(content.len() as u64, message);
    message.extend_from_slice(content);
}

/// The fields of a message, one after the other.
struct Fields<'a> {
    rest: &'a [u8],
}

struct Field<'a> {
    number: u32,
    /// All of it.
    bytes: &'a [u8],
    /// What it holds, of fields of bytes.
    content: Option<&'a [u8]>,
}

impl<'a> Fields<'a> {
    fn next(&mut self) -> Result<Option<Field<'a>>, String> {
        let start = self.rest;
        if start.is_empty() {
            return Ok(None);
        }
        let told = |fault: prost::DecodeError| fault.to_string();
        let mut rest = start;
        let (number, kind) = decode_key(&mut rest).map_err(told)?;
        let mut content = None;
        let skipped = match kind {
            WireType::Varint => decode_varint(&mut rest).map(|_| 0).map_err(told)?,
            WireType::SixtyFourBit => 8,
            WireType::ThirtyTwoBit => 4,
            WireType::LengthDelimited => {
                let length = decode_varint(&mut rest).map_err(told)?;
                let length = usize::try_from(length).unwrap_or(usize::MAX);
                content = rest.get(..length);
                length
            }
            WireType::StartGroup | WireType::EndGroup => {
                return Err("it holds groups, which ONNX does not have".to_owned());
            }
        };
        self.rest = rest.get(skipped..).ok_or("it is cut off")?;
        let length = start.len() - self.rest.len();
        Ok(Some(Field {
            number,
            bytes: &start[..length],
            content,
        }))
    }
}

const RAW_DATA: u32 = 9;
const EXTERNAL_DATA: u32 = 13;
const DATA_LOCATION: u32 = 14;
/// `TensorProto.DataLocation`.
const EXTERNAL: i32 = 1;

/// What of a tensor says where its values stand.
#[derive(Message)]
struct Tensor {
    #[prost(int64, repeated, tag = "1")]
    dims: Vec<i64>,
    #[prost(int32, tag = "2")]
    data_type: i32,
    #[prost(string, tag = "8")]
    name: String,
    #[prost(message, repeated, tag = "13")]
    external_data: Vec<Entry>,
    #[prost(int32, tag = "14")]
    data_location: i32,
}

#[derive(Message)]
struct Entry {
    #[prost(string, tag = "1")]
    key: String,
    #[prost(string, tag = "2")]
    value: String,
}

impl Tensor {
    /// Where its values stand.
    fn part(&self) -> Result<ExternalPart, String> {
        let wrong = |what: &str| format!("its tensor {:?} {what}", self.name);
        let entry = |key: &str| self.external_data.iter().find(|entry| entry.key == key);
        let number = |key: &str| match entry(key) {
            Some(entry) => match entry.value.trim().parse::<u64>() {
                Ok(number) => Ok(Some(number)),
                Err(_) => Err(wrong(&format!("has the {key} {:?}", entry.value))),
            },
            None => Ok(None),
        };
        let location = entry("location").ok_or_else(|| wrong("names no file"))?;
        let (expected, given) = (self.bytes(), number("length")?);
        if let (Some(expected), Some(given)) = (expected, given)
            && expected != given
        {
            return Err(wrong(&format!(
                "has {given} bytes where its shape has {expected}"
            )));
        }
        let length = given.or(expected);
        let length = length.ok_or_else(|| wrong("has a shape or type that is not known"))?;
        Ok(ExternalPart {
            location: location.value.clone(),
            offset: number("offset")?.unwrap_or(0),
            length,
        })
    }

    /// How many bytes its values have; none where its shape is none, or its type is not known.
    fn bytes(&self) -> Option<u64> {
        let count = self.dims.iter().try_fold(1_u64, |count, &side| {
            count.checked_mul(u64::try_from(side).ok()?)
        })?;
        // As `TensorProto.DataType` numbers them.
        let bits: u64 = match self.data_type {
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Inference, InferenceEngine, Weights, decomposer, to_onnx};
    use std::convert::Infallible;
    use std::path::Path;

    const SIZE: (usize, usize) = (32, 32);

    /// The same file with the raw values of its tensors moved into other bytes.
    fn moved(kind: Kind, bytes: &[u8], others: &mut Vec<u8>) -> Vec<u8> {
        let mut whole = Vec::new();
        let mut fields = Fields { rest: bytes };
        while let Some(field) = fields.next().unwrap() {
            match (field.content, kind.of_field(field.number)) {
                (Some(content), Some(inner)) => {
                    append(&mut whole, field.number, &moved(inner, content, others));
                }
                (Some(values), None)
                    if matches!(kind, Kind::Tensor) && field.number == RAW_DATA =>
                {
                    for (key, value) in [
                        ("location", "weights.bin".to_owned()),
                        ("offset", others.len().to_string()),
                        ("length", values.len().to_string()),
                    ] {
                        let entry = Entry {
                            key: key.to_owned(),
                            value,
                        };
                        append(&mut whole, EXTERNAL_DATA, &entry.encode_to_vec());
                    }
                    encode_key(DATA_LOCATION, WireType::Varint, &mut whole);
                    encode_varint(EXTERNAL as u64, &mut whole);
                    others.extend_from_slice(values);
                }
                _ => whole.extend_from_slice(field.bytes),
            }
        }
        whole
    }

    fn network() -> Vec<u8> {
        let graph = decomposer();
        to_onnx(&graph, &Weights::initial(&graph, 1), 1, SIZE).unwrap()
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
        let outside = moved(Kind::Model, &plain, &mut others);
        assert!(outside.len() < plain.len() / 4);
        let merged = with_external_weights(&outside, |part| {
            assert_eq!(part.location, "weights.bin");
            Ok::<_, Infallible>(range(&others, part).unwrap())
        });
        // Raw values are the last field of a tensor as it is written here.
        assert_eq!(merged.unwrap().unwrap(), plain);
        assert_eq!(first_location(&outside).as_deref(), Some("weights.bin"));
    }

    #[test]
    fn a_file_with_its_own_weights_stays_as_it_is() {
        let read = |_: &ExternalPart| -> Result<Vec<u8>, Infallible> { unreachable!() };
        assert!(with_external_weights(&network(), read).unwrap().is_none());
        assert_eq!(first_location(&network()), None);
        assert_eq!(first_location(b"not a network"), None);
    }

    #[test]
    fn content_that_needs_another_file_is_refused_by_its_name() {
        let outside = moved(Kind::Model, &network(), &mut Vec::new());
        let engine = InferenceEngine::default();
        let error = Inference::from_onnx(Path::new("a.onnx"), &outside, 7, SIZE, &engine);
        let error = error.unwrap_err().to_string();
        assert!(
            error.contains("a.onnx") && error.contains("weights.bin"),
            "{error}"
        );
    }

    fn tensor(entries: &[(&str, &str)]) -> Vec<u8> {
        let entry = |(key, value): &(&str, &str)| Entry {
            key: (*key).to_owned(),
            value: (*value).to_owned(),
        };
        let tensor = Tensor {
            dims: vec![2, 3],
            data_type: 1,
            name: "w".to_owned(),
            external_data: entries.iter().map(entry).collect(),
            data_location: EXTERNAL,
        };
        let mut graph = Vec::new();
        append(&mut graph, 5, &tensor.encode_to_vec());
        let mut model = Vec::new();
        append(&mut model, 7, &graph);
        model
    }

    #[test]
    fn what_is_left_out_follows_from_the_shape_and_what_contradicts_it_is_damaged() {
        let part =
            |entries: &[(&str, &str)]| match with_external_weights(&tensor(entries), |part| {
                Err(part.clone())
            }) {
                Err(ExternalFault::Part(part)) => Some(part),
                Err(ExternalFault::Damaged(_)) => None,
                Ok(_) => panic!("a part is needed"),
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
        let short = with_external_weights(&tensor(&[location]), |_| Ok::<_, Infallible>(vec![0]));
        assert!(matches!(short, Err(ExternalFault::Damaged(_))));
    }

    #[test]
    fn damage_anywhere_ends_nothing() {
        let outside = moved(Kind::Model, &network(), &mut Vec::new());
        for at in (0..outside.len()).step_by(97) {
            let mut damaged = outside.clone();
            damaged[at] ^= 0x5a;
            let _ = with_external_weights(&damaged, |_| Err::<Vec<u8>, _>(()));
            let _ = with_external_weights(&outside[..at], |_| Err::<Vec<u8>, _>(()));
        }
    }
}
