//! What goes into and comes out of a network in an ONNX file, without its weights.

use prost::Message;

/// Type of 32-bit floating point numbers, as `TensorProto.DataType` numbers it.
const FLOAT: i32 = 1;
/// Type of 64-bit whole numbers.
const INT64: i32 = 7;

/// Inputs and outputs of a network in an ONNX file, in its order.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct OnnxSignature {
    /// What it takes; weights are not among them.
    pub inputs: Vec<OnnxValue>,
    /// What it answers.
    pub outputs: Vec<OnnxValue>,
}

/// An input or output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OnnxValue {
    /// Its name.
    pub name: String,
    /// What its numbers are.
    pub element: OnnxElement,
    /// Its sides; none where a side is not fixed, and no sides where it is one number or the file does not say.
    pub sides: Vec<Option<usize>>,
}

/// What numbers are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OnnxElement {
    /// Floating point, 32 bits.
    Float,
    /// Whole, 64 bits.
    Integer,
    /// Something else.
    Other,
}

impl OnnxSignature {
    /// The signature in the content of a file; none where it is no ONNX file.
    #[must_use]
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let graph = Model::decode(bytes).ok()?.graph?;
        let is_weight = |value: &Value| graph.initializer.iter().any(|w| w.name == value.name);
        let inputs = graph.input.iter().filter(|value| !is_weight(value));
        Some(Self {
            inputs: inputs.map(OnnxValue::of).collect(),
            outputs: graph.output.iter().map(OnnxValue::of).collect(),
        })
    }

    /// The input of this name.
    #[must_use]
    pub fn input(&self, name: &str) -> Option<&OnnxValue> {
        self.inputs.iter().find(|value| value.name == name)
    }

    /// The place of the output of this name.
    #[must_use]
    pub fn output(&self, name: &str) -> Option<usize> {
        self.outputs.iter().position(|value| value.name == name)
    }
}

impl OnnxValue {
    fn of(value: &Value) -> Self {
        let tensor = value.kind.as_ref().and_then(|kind| kind.tensor.as_ref());
        let shape = tensor.and_then(|tensor| tensor.shape.as_ref());
        let side = |side: &Side| usize::try_from(side.value).ok().filter(|&side| side > 0);
        Self {
            name: value.name.clone(),
            element: match tensor.map(|tensor| tensor.element) {
                Some(FLOAT) => OnnxElement::Float,
                Some(INT64) => OnnxElement::Integer,
                _ => OnnxElement::Other,
            },
            sides: shape.map_or_else(Vec::new, |shape| shape.sides.iter().map(side).collect()),
        }
    }
}

// The part of `onnx.proto3` that this needs, with the field numbers given there. Fields that are not named here, weights
// above all, are skipped.

#[derive(Message)]
struct Model {
    #[prost(message, optional, tag = "7")]
    graph: Option<Graph>,
}

#[derive(Message)]
struct Graph {
    #[prost(message, repeated, tag = "5")]
    initializer: Vec<Named>,
    #[prost(message, repeated, tag = "11")]
    input: Vec<Value>,
    #[prost(message, repeated, tag = "12")]
    output: Vec<Value>,
}

#[derive(Message)]
struct Named {
    #[prost(string, tag = "8")]
    name: String,
}

#[derive(Message)]
struct Value {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(message, optional, tag = "2")]
    kind: Option<Kind>,
}

#[derive(Message)]
struct Kind {
    #[prost(message, optional, tag = "1")]
    tensor: Option<TensorKind>,
}

#[derive(Message)]
struct TensorKind {
    #[prost(int32, tag = "1")]
    element: i32,
    #[prost(message, optional, tag = "2")]
    shape: Option<Sides>,
}

#[derive(Message)]
struct Sides {
    #[prost(message, repeated, tag = "1")]
    sides: Vec<Side>,
}

#[derive(Message)]
struct Side {
    #[prost(int64, tag = "1")]
    value: i64,
}

#[cfg(test)]
mod tests {
    use super::super::{Weights, decomposer_with_heads, to_onnx};
    use super::*;

    #[test]
    fn our_own_files_say_what_they_take_and_answer() {
        let graph = decomposer_with_heads();
        let bytes = to_onnx(&graph, &Weights::initial(&graph, 1), 1, (64, 32)).unwrap();
        let found = OnnxSignature::read(&bytes).unwrap();
        let names = |of: &[OnnxValue]| of.iter().map(|v| v.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&found.inputs), ["input"]);
        assert_eq!(names(&found.outputs), ["maps", "paint", "light"]);
        assert_eq!(found.inputs[0].sides, [1, 7, 32, 64].map(Some));
        assert_eq!(found.inputs[0].element, OnnxElement::Float);
        assert_eq!(found.output("paint"), Some(1));
        assert!(found.input("image").is_none());
    }

    #[test]
    fn what_is_no_network_has_no_signature() {
        assert_eq!(OnnxSignature::read(b"not a network"), None);
        assert_eq!(OnnxSignature::read(b""), None);
    }
}
