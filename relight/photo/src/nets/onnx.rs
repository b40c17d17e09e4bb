//! A network as an ONNX file: the graph in ONNX's operators for one size of picture, with its
//! weights.
//!
//! Only what [`Graph`] can hold is written, in IR version 8 and operator set 13. Normalisation of groups is written as
//! instance normalisation of a reshaped tensor, since operator set 13 has no other.

use prost::Message;
use tract_onnx::pb::attribute_proto::AttributeType;
use tract_onnx::pb::tensor_proto::DataType;
use tract_onnx::pb::tensor_shape_proto::{Dimension, dimension};
use tract_onnx::pb::type_proto::{Tensor, Value};
use tract_onnx::pb::{
    AttributeProto, GraphProto, ModelProto, NodeProto, OperatorSetIdProto, TensorProto,
    TensorShapeProto, TypeProto, ValueInfoProto,
};

use super::error::NetError;
use super::graph::{EPSILON, Graph, Node, Operation};
use super::weights::Weights;

/// Name of the network's input in a file.
pub const INPUT: &str = "input";

const IR_VERSION: i64 = 8;
const OPERATOR_SET: i64 = 13;

/// The graph with its weights as the bytes of an ONNX file, for a batch of `batch` pictures of
/// `width` x `height` pixels.
///
/// # Errors
/// [`NetError::Run`], or what [`Weights::fitted_to`] answers.
pub fn to_onnx(
    graph: &Graph,
    weights: &Weights,
    batch: usize,
    (width, height): (usize, usize),
) -> Result<Vec<u8>, NetError> {
    check_size(graph, (width, height))?;
    let weights = weights.fitted_to(graph)?;
    let mut writer = Writer {
        batch,
        size: (width, height),
        nodes: Vec::new(),
        tensors: weights
            .iter()
            .map(|(name, tensor)| float_tensor(name, tensor.shape(), tensor.values()))
            .collect(),
    };
    for (at, node) in graph.nodes().iter().enumerate().skip(1) {
        writer.write(graph, at, node);
    }
    let outputs = graph.outputs().iter().map(|output| {
        let node = graph.node(output.value);
        let shape = writer.shape(node);
        let name = name_of(output.value.index());
        let identity = operator("Identity", vec![name], output.name.to_owned());
        (identity, value_info(output.name, &shape))
    });
    let (identities, outputs): (Vec<_>, Vec<_>) = outputs.unzip();
    writer.nodes.extend(identities);
    let input = writer.shape(&graph.nodes()[0]);
    let model = ModelProto {
        ir_version: IR_VERSION,
        producer_name: "relight".to_owned(),
        producer_version: env!("CARGO_PKG_VERSION").to_owned(),
        graph: Some(GraphProto {
            node: writer.nodes,
            name: graph.name().to_owned(),
            initializer: writer.tensors,
            input: vec![value_info(INPUT, &input)],
            output: outputs,
            ..GraphProto::default()
        }),
        opset_import: vec![OperatorSetIdProto {
            domain: String::new(),
            version: OPERATOR_SET,
        }],
        ..ModelProto::default()
    };
    Ok(model.encode_to_vec())
}

/// Whether the network can take pictures of this size.
///
/// # Errors
/// [`NetError::Run`].
pub fn check_size(graph: &Graph, (width, height): (usize, usize)) -> Result<(), NetError> {
    let multiple = graph.multiple();
    let divides = width.is_multiple_of(multiple) && height.is_multiple_of(multiple);
    let needs = match graph.fixed_side() {
        Some(side) if (width, height) != (side, side) => format!("it needs {side} x {side}"),
        _ if !divides || width.min(height) == 0 => {
            format!("width and height have to be multiples of {multiple}")
        }
        _ => return Ok(()),
    };
    Err(NetError::Run(format!(
        "{} cannot take a picture of {width} x {height} pixels: {needs}",
        graph.name()
    )))
}

/// Collects the nodes and tensors of a file.
struct Writer {
    batch: usize,
    size: (usize, usize),
    nodes: Vec<NodeProto>,
    tensors: Vec<TensorProto>,
}

impl Writer {
    fn shape(&self, node: &Node) -> Vec<usize> {
        match node.scale {
            Some(scale) => {
                let (width, height) = self.size;
                vec![self.batch, node.channels, height / scale, width / scale]
            }
            None => vec![self.batch, node.channels],
        }
    }

    fn push(&mut self, node: NodeProto, attribute: Vec<AttributeProto>) {
        self.nodes.push(NodeProto { attribute, ..node });
    }

    fn write(&mut self, graph: &Graph, at: usize, node: &Node) {
        let inputs: Vec<String> = node
            .inputs
            .iter()
            .map(|value| name_of(value.index()))
            .collect();
        let output = name_of(at);
        let plain = |kind| operator(kind, inputs.clone(), output.clone());
        match &node.operation {
            Operation::Input => {}
            Operation::Convolution {
                name,
                kernel,
                stride,
            } => {
                let (kernel, stride) = (*kernel as i64, *stride as i64);
                let attributes = vec![
                    integers("kernel_shape", vec![kernel; 2]),
                    integers("pads", vec![kernel / 2; 4]),
                    integers("strides", vec![stride; 2]),
                ];
                self.push(with_parameters(plain("Conv"), name), attributes);
            }
            Operation::GroupNorm { name, groups } => {
                self.write_norm(node, &inputs[0], &output, name.as_deref(), *groups);
            }
            Operation::Relu => self.nodes.push(plain("Relu")),
            Operation::Tanh => self.nodes.push(plain("Tanh")),
            Operation::Add => self.nodes.push(plain("Add")),
            Operation::Concatenate => {
                self.push(plain("Concat"), vec![integer("axis", 1)]);
            }
            Operation::Upsample { align_corners } => {
                self.write_upsample(&inputs[0], &output, *align_corners);
            }
            Operation::PixelUnshuffle { factor } => {
                self.write_unshuffle(node, &inputs[0], &output, *factor);
            }
            Operation::PixelShuffle { factor } => {
                let of = graph.node(node.inputs[0]);
                self.write_shuffle(node, of, &inputs[0], &output, *factor);
            }
            Operation::MeanPool => self.write_pool("GlobalAveragePool", node, &inputs[0], &output),
            Operation::MaxPool => self.write_pool("GlobalMaxPool", node, &inputs[0], &output),
            Operation::Flatten { .. } => {
                self.push(plain("Flatten"), vec![integer("axis", 1)]);
            }
            Operation::Linear { name } => {
                let proto = with_parameters(plain("Gemm"), name);
                self.push(proto, vec![integer("transB", 1)]);
            }
        }
    }

    fn write_norm(
        &mut self,
        node: &Node,
        input: &str,
        output: &str,
        name: Option<&str>,
        groups: usize,
    ) {
        let shape = self.shape(node);
        let pixels = shape[1] / groups * shape[2] * shape[3];
        let grouped = self.reshape(
            input,
            &format!("{output}.grouped"),
            &[shape[0], groups, pixels],
        );
        let ones = self.constant(&format!("{output}.one"), &[groups], &vec![1.0; groups]);
        let zeros = self.constant(&format!("{output}.zero"), &[groups], &vec![0.0; groups]);
        let normal = format!("{output}.normal");
        let proto = operator(
            "InstanceNormalization",
            vec![grouped, ones, zeros],
            normal.clone(),
        );
        let epsilon = AttributeProto {
            f: EPSILON,
            ..attribute("epsilon", AttributeType::Float)
        };
        self.push(proto, vec![epsilon]);
        let Some(name) = name else {
            self.reshape(&normal, output, &shape);
            return;
        };
        let back = self.reshape(&normal, &format!("{output}.back"), &shape);
        let column = [1, shape[1], 1, 1];
        let gain = self.reshape(
            &format!("{name}.weight"),
            &format!("{output}.gain"),
            &column,
        );
        let offset = self.reshape(
            &format!("{name}.bias"),
            &format!("{output}.offset"),
            &column,
        );
        let scaled = format!("{output}.scaled");
        self.nodes
            .push(operator("Mul", vec![back, gain], scaled.clone()));
        self.nodes
            .push(operator("Add", vec![scaled, offset], output.to_owned()));
    }

    fn write_upsample(&mut self, input: &str, output: &str, align_corners: bool) {
        let scales = self.constant(&format!("{output}.scales"), &[4], &[1.0, 1.0, 2.0, 2.0]);
        let corners = if align_corners {
            "align_corners"
        } else {
            "half_pixel"
        };
        let inputs = vec![input.to_owned(), String::new(), scales];
        let attributes = vec![
            text("mode", "linear"),
            text("coordinate_transformation_mode", corners),
        ];
        self.push(operator("Resize", inputs, output.to_owned()), attributes);
    }

    fn write_unshuffle(&mut self, node: &Node, input: &str, output: &str, factor: usize) {
        let shape = self.shape(node);
        let [batch, channels, height, width] = [shape[0], shape[1], shape[2], shape[3]];
        let blocks = [
            batch,
            channels / (factor * factor),
            height,
            factor,
            width,
            factor,
        ];
        let split = self.reshape(input, &format!("{output}.blocks"), &blocks);
        let turned = self.transpose(&split, &format!("{output}.turned"), &[0, 1, 3, 5, 2, 4]);
        self.reshape(&turned, output, &shape);
    }

    fn write_shuffle(&mut self, node: &Node, of: &Node, input: &str, output: &str, factor: usize) {
        let (shape, before) = (self.shape(node), self.shape(of));
        let blocks = [shape[0], shape[1], factor, factor, before[2], before[3]];
        let split = self.reshape(input, &format!("{output}.blocks"), &blocks);
        let turned = self.transpose(&split, &format!("{output}.turned"), &[0, 1, 4, 2, 5, 3]);
        self.reshape(&turned, output, &shape);
    }

    fn write_pool(&mut self, kind: &str, node: &Node, input: &str, output: &str) {
        let pooled = format!("{output}.pooled");
        self.nodes
            .push(operator(kind, vec![input.to_owned()], pooled.clone()));
        let shape = self.shape(node);
        self.reshape(&pooled, output, &shape);
    }

    fn reshape(&mut self, input: &str, output: &str, shape: &[usize]) -> String {
        let target = format!("{output}.shape");
        self.tensors.push(integer_tensor(&target, shape));
        let inputs = vec![input.to_owned(), target];
        self.nodes
            .push(operator("Reshape", inputs, output.to_owned()));
        output.to_owned()
    }

    fn transpose(&mut self, input: &str, output: &str, order: &[i64]) -> String {
        let proto = operator("Transpose", vec![input.to_owned()], output.to_owned());
        self.push(proto, vec![integers("perm", order.to_vec())]);
        output.to_owned()
    }

    fn constant(&mut self, name: &str, shape: &[usize], values: &[f32]) -> String {
        self.tensors.push(float_tensor(name, shape, values));
        name.to_owned()
    }
}

fn name_of(node: usize) -> String {
    match node {
        0 => INPUT.to_owned(),
        _ => format!("value{node}"),
    }
}

fn value_info(name: &str, shape: &[usize]) -> ValueInfoProto {
    let dimension = |&side: &usize| Dimension {
        value: Some(dimension::Value::DimValue(side as i64)),
        ..Dimension::default()
    };
    let tensor = Tensor {
        elem_type: DataType::Float as i32,
        shape: Some(TensorShapeProto {
            dim: shape.iter().map(dimension).collect(),
        }),
    };
    ValueInfoProto {
        name: name.to_owned(),
        r#type: Some(TypeProto {
            value: Some(Value::TensorType(tensor)),
            ..TypeProto::default()
        }),
        ..ValueInfoProto::default()
    }
}

/// The node with the parameters of a layer as further inputs.
fn with_parameters(mut node: NodeProto, layer: &str) -> NodeProto {
    node.input.push(format!("{layer}.weight"));
    node.input.push(format!("{layer}.bias"));
    node
}

fn operator(kind: &str, input: Vec<String>, output: String) -> NodeProto {
    NodeProto {
        input,
        name: output.clone(),
        output: vec![output],
        op_type: kind.to_owned(),
        ..NodeProto::default()
    }
}

fn attribute(name: &str, kind: AttributeType) -> AttributeProto {
    AttributeProto {
        name: name.to_owned(),
        r#type: kind as i32,
        ..AttributeProto::default()
    }
}

fn integer(name: &str, i: i64) -> AttributeProto {
    AttributeProto {
        i,
        ..attribute(name, AttributeType::Int)
    }
}

fn integers(name: &str, ints: Vec<i64>) -> AttributeProto {
    AttributeProto {
        ints,
        ..attribute(name, AttributeType::Ints)
    }
}

fn text(name: &str, text: &str) -> AttributeProto {
    AttributeProto {
        s: text.as_bytes().to_vec(),
        ..attribute(name, AttributeType::String)
    }
}

fn float_tensor(name: &str, shape: &[usize], values: &[f32]) -> TensorProto {
    TensorProto {
        dims: shape.iter().map(|&side| side as i64).collect(),
        data_type: DataType::Float as i32,
        name: name.to_owned(),
        raw_data: values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect(),
        ..TensorProto::default()
    }
}

fn integer_tensor(name: &str, values: &[usize]) -> TensorProto {
    let bytes = values
        .iter()
        .flat_map(|&value| (value as i64).to_le_bytes());
    TensorProto {
        dims: vec![values.len() as i64],
        data_type: DataType::Int64 as i32,
        name: name.to_owned(),
        raw_data: bytes.collect(),
        ..TensorProto::default()
    }
}
