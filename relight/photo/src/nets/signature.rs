//! The inputs and outputs of a network in an ONNX file, without its weights.

use prost::Message;
use tract_onnx::pb::tensor_proto::DataType;
use tract_onnx::pb::tensor_shape_proto::{Dimension, dimension};
use tract_onnx::pb::{ModelProto, ValueInfoProto, type_proto};

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
    pub element: DataType,
    /// Its sides; `None` if a side is not fixed, and no sides if it is one number or the file does not state them.
    pub sides: Vec<Option<usize>>,
}

impl OnnxSignature {
    /// The signature in the content of a file; `None` if it is not an ONNX file.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let graph = ModelProto::decode(bytes).ok()?.graph?;
        let is_weight =
            |value: &ValueInfoProto| graph.initializer.iter().any(|w| w.name == value.name);
        let inputs = graph.input.iter().filter(|value| !is_weight(value));
        Some(Self {
            inputs: inputs.map(OnnxValue::from_proto).collect(),
            outputs: graph.output.iter().map(OnnxValue::from_proto).collect(),
        })
    }

    /// The input of this name.
    pub fn input(&self, name: &str) -> Option<&OnnxValue> {
        self.inputs.iter().find(|value| value.name == name)
    }

    /// The place of the output of this name.
    pub fn output(&self, name: &str) -> Option<usize> {
        self.outputs.iter().position(|value| value.name == name)
    }
}

impl OnnxValue {
    fn from_proto(value: &ValueInfoProto) -> Self {
        let kind = value.r#type.as_ref().and_then(|kind| kind.value.as_ref());
        let tensor = kind.map(|type_proto::Value::TensorType(tensor)| tensor);
        let shape = tensor.and_then(|tensor| tensor.shape.as_ref());
        let side = |side: &Dimension| match side.value {
            Some(dimension::Value::DimValue(side)) if side > 0 => usize::try_from(side).ok(),
            _ => None,
        };
        Self {
            name: value.name.clone(),
            element: tensor.map_or(DataType::Undefined, type_proto::Tensor::elem_type),
            sides: shape.map_or_else(Vec::new, |shape| shape.dim.iter().map(side).collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{WeightPrecision, Weights, decomposer_with_heads, to_onnx};
    use super::*;

    #[test]
    fn our_own_files_say_what_they_take_and_answer() {
        let graph = decomposer_with_heads();
        let weights = Weights::initial(&graph, 1);
        let bytes = to_onnx(&graph, &weights, WeightPrecision::Half, &[]).unwrap();
        let found = OnnxSignature::read(&bytes).unwrap();
        let names = |of: &[OnnxValue]| of.iter().map(|v| v.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&found.inputs), ["input"]);
        assert_eq!(names(&found.outputs), ["maps", "paint", "light"]);
        assert_eq!(found.inputs[0].sides, [None, Some(7), None, None]);
        assert_eq!(found.inputs[0].element, DataType::Float);
        assert_eq!(found.output("paint"), Some(1));
        assert!(found.input("image").is_none());
    }

    #[test]
    fn what_is_no_network_has_no_signature() {
        assert_eq!(OnnxSignature::read(b"not a network"), None);
        assert_eq!(OnnxSignature::read(b""), None);
    }
}
