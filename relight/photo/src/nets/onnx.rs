//! A network as an ONNX file: the graph in ONNX's operators for pictures of any size that it can take, with its weights.
//!
//! Only what [`Graph`] can hold is written, in IR version 8 and operator set 13. Normalisation of groups is written as
//! instance normalisation of a reshaped tensor, since operator set 13 has no other. Shapes name what they leave as it is (0)
//! and infer one side (-1), so that no number of a file depends on the picture.

use prost::Message;
use tract_onnx::pb::attribute_proto::AttributeType;
use tract_onnx::pb::tensor_proto::DataType;
use tract_onnx::pb::tensor_shape_proto::{Dimension, dimension};
use tract_onnx::pb::type_proto::{Tensor, Value};
use tract_onnx::pb::{
    AttributeProto, GraphProto, ModelProto, NodeProto, OperatorSetIdProto, StringStringEntryProto,
    TensorProto, TensorShapeProto, TypeProto, ValueInfoProto,
};

use super::codec::WeightPrecision;
use super::error::NetError;
use super::graph::{EPSILON, Graph, Node, Operation};
use super::weights::Weights;

/// Name of the network's input in a file.
pub const INPUT: &str = "input";

const IR_VERSION: i64 = 8;
const OPERATOR_SET: i64 = 13;
/// A side that a shape leaves as it is.
const SAME: i64 = 0;
/// The side that follows from the others.
const INFERRED: i64 = -1;

/// The graph with its weights as the bytes of an ONNX file. In half precision weights are kept so, and computed with as 32 bits.
/// `facts` are the metadata of the file.
///
/// # Errors
/// What [`Weights::fitted_to`] answers, or if half precision cannot hold a weight.
pub fn to_onnx(
    graph: &Graph,
    weights: &Weights,
    precision: WeightPrecision,
    facts: &[(&str, &str)],
) -> Result<Vec<u8>, NetError> {
    let weights = weights.fitted_to(graph)?;
    weights.check_range(precision)?;
    let mut writer = Writer::default();
    for (name, tensor) in weights.iter() {
        writer.write_weight(name, tensor.shape(), tensor.values(), precision);
    }
    for (at, node) in graph.nodes().iter().enumerate().skip(1) {
        writer.write(graph, at, node);
    }
    let outputs = graph.outputs().iter().map(|output| {
        let node = graph.node(output.value);
        let name = name_of(output.value.index());
        let identity = operator("Identity", vec![name], output.name.to_owned());
        (identity, value_info(output.name, &sides(node)))
    });
    let (identities, outputs): (Vec<_>, Vec<_>) = outputs.unzip();
    writer.nodes.extend(identities);
    let input = sides(&graph.nodes()[0]);
    let fact = |&(key, value): &(&str, &str)| StringStringEntryProto {
        key: key.to_owned(),
        value: value.to_owned(),
    };
    let model = ModelProto {
        ir_version: IR_VERSION,
        producer_name: "relight".to_owned(),
        producer_version: env!("CARGO_PKG_VERSION").to_owned(),
        metadata_props: facts.iter().map(fact).collect(),
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
/// If it cannot.
pub fn check_size(graph: &Graph, (width, height): (usize, usize)) -> Result<(), NetError> {
    let multiple = graph.multiple();
    let divides = width.is_multiple_of(multiple) && height.is_multiple_of(multiple);
    if divides && width.min(height) > 0 {
        return Ok(());
    }
    Err(NetError::Other(format!(
        "{} cannot take a picture of {width} x {height} pixels: width and height have to be multiples of {multiple}",
        graph.name()
    )))
}

/// The sides of a node's value: how many, or the name of what may differ.
fn sides(node: &Node) -> Vec<dimension::Value> {
    let known = |side: usize| dimension::Value::DimValue(side as i64);
    let open = |name: &str| dimension::Value::DimParam(name.to_owned());
    let mut sides = vec![open("batch"), known(node.channels)];
    if let Some(scale) = node.scale {
        sides.extend(["height", "width"].map(|name| match scale {
            1 => open(name),
            _ => open(&format!("{name}/{scale}")),
        }));
    }
    sides
}

/// Collects the nodes and tensors of a file.
#[derive(Default)]
struct Writer {
    nodes: Vec<NodeProto>,
    tensors: Vec<TensorProto>,
}

impl Writer {
    fn write_weight(
        &mut self,
        name: &str,
        shape: &[usize],
        values: &[f32],
        precision: WeightPrecision,
    ) {
        if precision == WeightPrecision::Single {
            self.tensors.push(float_tensor(name, shape, values));
            return;
        }
        let half = format!("{name}.half");
        let bytes = values
            .iter()
            .flat_map(|&value| half::f16::from_f32(value).to_le_bytes());
        self.tensors.push(TensorProto {
            data_type: DataType::Float16 as i32,
            raw_data: bytes.collect(),
            ..float_tensor(&half, shape, &[])
        });
        let cast = operator("Cast", vec![half], name.to_owned());
        self.push(cast, vec![integer("to", DataType::Float as i64)]);
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
                let groups = (node.channels, *groups);
                self.write_norm(&inputs[0], &output, name.as_deref(), groups);
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
                let channels = graph.node(node.inputs[0]).channels;
                self.write_unshuffle(&inputs[0], &output, channels, *factor);
            }
            Operation::PixelShuffle { factor } => {
                let attributes = vec![integer("blocksize", *factor as i64), text("mode", "CRD")];
                self.push(plain("DepthToSpace"), attributes);
            }
            Operation::MeanPool => self.write_pool("GlobalAveragePool", &inputs[0], &output),
            Operation::MaxPool => self.write_pool("GlobalMaxPool", &inputs[0], &output),
            Operation::Linear { name } => {
                let proto = with_parameters(plain("Gemm"), name);
                self.push(proto, vec![integer("transB", 1)]);
            }
        }
    }

    fn write_norm(
        &mut self,
        input: &str,
        output: &str,
        name: Option<&str>,
        (channels, groups): (usize, usize),
    ) {
        let grouped = [SAME, groups as i64, INFERRED, SAME];
        let grouped = self.reshape(input, &format!("{output}.grouped"), &grouped);
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
        let back = [SAME, channels as i64, INFERRED, SAME];
        let Some(name) = name else {
            self.reshape(&normal, output, &back);
            return;
        };
        let back = self.reshape(&normal, &format!("{output}.back"), &back);
        let column = [1, channels as i64, 1, 1];
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

    /// A convolution that takes each pixel of a block into a channel of its own.
    fn write_unshuffle(&mut self, input: &str, output: &str, channels: usize, factor: usize) {
        let block = factor * factor;
        let taps = channels * block;
        let mut kernel = vec![0.0; taps * taps];
        for tap in 0..taps {
            // Output channel, then input channel and place in the block.
            kernel[tap * taps + tap] = 1.0;
        }
        let shape = [taps, channels, factor, factor];
        let kernel = self.constant(&format!("{output}.kernel"), &shape, &kernel);
        let side = factor as i64;
        let attributes = vec![
            integers("kernel_shape", vec![side; 2]),
            integers("strides", vec![side; 2]),
        ];
        let inputs = vec![input.to_owned(), kernel];
        self.push(operator("Conv", inputs, output.to_owned()), attributes);
    }

    fn write_pool(&mut self, kind: &str, input: &str, output: &str) {
        let pooled = format!("{output}.pooled");
        self.nodes
            .push(operator(kind, vec![input.to_owned()], pooled.clone()));
        let flat = operator("Flatten", vec![pooled], output.to_owned());
        self.push(flat, vec![integer("axis", 1)]);
    }

    fn reshape(&mut self, input: &str, output: &str, shape: &[i64]) -> String {
        let target = format!("{output}.shape");
        self.tensors.push(integer_tensor(&target, shape));
        let inputs = vec![input.to_owned(), target];
        self.nodes
            .push(operator("Reshape", inputs, output.to_owned()));
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

fn value_info(name: &str, sides: &[dimension::Value]) -> ValueInfoProto {
    let dimension = |side: &dimension::Value| Dimension {
        value: Some(side.clone()),
        ..Dimension::default()
    };
    let tensor = Tensor {
        elem_type: DataType::Float as i32,
        shape: Some(TensorShapeProto {
            dim: sides.iter().map(dimension).collect(),
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

fn integer_tensor(name: &str, values: &[i64]) -> TensorProto {
    let bytes = values.iter().flat_map(|value| value.to_le_bytes());
    TensorProto {
        dims: vec![values.len() as i64],
        data_type: DataType::Int64 as i32,
        name: name.to_owned(),
        raw_data: bytes.collect(),
        ..TensorProto::default()
    }
}
