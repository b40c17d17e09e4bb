//! A network as an ONNX file: the graph in ONNX's operators for one size of picture, with its
//! weights.
//!
//! Only what [`Graph`] can hold is written. Messages are the part of `onnx.proto3` (ONNX 1.17, IR
//! version 8, operator set 13) that this needs, with the field numbers given there. Normalisation of groups is
//! written as instance normalisation of a reshaped tensor, since operator set 13 has no other.

use prost::Message;

use super::error::NetError;
use super::graph::{EPSILON, Graph, Node, Operation};
use super::weights::Weights;

/// Name of the network's input in a file.
pub const INPUT: &str = "input";

const IR_VERSION: i64 = 8;
const OPERATOR_SET: i64 = 13;
const FLOAT: i32 = 1;
const INT64: i32 = 7;

/// The graph with its weights as the bytes of an ONNX file, for a batch of `batch` pictures of
/// `width` x `height` pixels.
///
/// # Errors
/// [`NetError::PictureSize`], or what [`Weights::fitted_to`] answers.
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
            .map(|(name, tensor)| TensorProto::floats(name, tensor.shape(), tensor.values()))
            .collect(),
    };
    for (at, node) in graph.nodes().iter().enumerate().skip(1) {
        writer.write(graph, at, node);
    }
    let outputs = graph.outputs().iter().map(|output| {
        let node = graph.node(output.value);
        let shape = writer.shape(node);
        let name = name_of(output.value.index());
        let identity = NodeProto::new("Identity", vec![name], output.name.to_owned());
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
        }),
        opset_import: vec![OperatorSetId {
            domain: String::new(),
            version: OPERATOR_SET,
        }],
    };
    Ok(model.encode_to_vec())
}

/// Whether the network can take pictures of this size.
///
/// # Errors
/// [`NetError::PictureSize`].
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
    Err(NetError::PictureSize {
        net: graph.name(),
        width,
        height,
        needs,
    })
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

    fn write(&mut self, graph: &Graph, at: usize, node: &Node) {
        let inputs: Vec<String> = node
            .inputs
            .iter()
            .map(|value| name_of(value.index()))
            .collect();
        let output = name_of(at);
        let plain = |kind| NodeProto::new(kind, inputs.clone(), output.clone());
        match &node.operation {
            Operation::Input => {}
            Operation::Convolution {
                name,
                kernel,
                stride,
            } => {
                let (kernel, stride) = (*kernel as i64, *stride as i64);
                let mut proto = plain("Conv").with_parameters(name);
                proto.attribute = vec![
                    Attribute::integers("kernel_shape", vec![kernel; 2]),
                    Attribute::integers("pads", vec![kernel / 2; 4]),
                    Attribute::integers("strides", vec![stride; 2]),
                ];
                self.nodes.push(proto);
            }
            Operation::GroupNorm { name, groups } => {
                self.write_norm(node, &inputs[0], &output, name.as_deref(), *groups);
            }
            Operation::Relu => self.nodes.push(plain("Relu")),
            Operation::Tanh => self.nodes.push(plain("Tanh")),
            Operation::Add => self.nodes.push(plain("Add")),
            Operation::Concatenate => {
                let proto = plain("Concat").with(Attribute::integer("axis", 1));
                self.nodes.push(proto);
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
                let proto = plain("Flatten").with(Attribute::integer("axis", 1));
                self.nodes.push(proto);
            }
            Operation::Linear { name } => {
                let proto = plain("Gemm").with_parameters(name);
                self.nodes.push(proto.with(Attribute::integer("transB", 1)));
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
        let proto = NodeProto::new(
            "InstanceNormalization",
            vec![grouped, ones, zeros],
            normal.clone(),
        );
        self.nodes
            .push(proto.with(Attribute::float("epsilon", EPSILON)));
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
            .push(NodeProto::new("Mul", vec![back, gain], scaled.clone()));
        self.nodes.push(NodeProto::new(
            "Add",
            vec![scaled, offset],
            output.to_owned(),
        ));
    }

    fn write_upsample(&mut self, input: &str, output: &str, align_corners: bool) {
        let scales = self.constant(&format!("{output}.scales"), &[4], &[1.0, 1.0, 2.0, 2.0]);
        let corners = match align_corners {
            true => "align_corners",
            false => "half_pixel",
        };
        let inputs = vec![input.to_owned(), String::new(), scales];
        let proto = NodeProto::new("Resize", inputs, output.to_owned())
            .with(Attribute::text("mode", "linear"))
            .with(Attribute::text("coordinate_transformation_mode", corners));
        self.nodes.push(proto);
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
            .push(NodeProto::new(kind, vec![input.to_owned()], pooled.clone()));
        let shape = self.shape(node);
        self.reshape(&pooled, output, &shape);
    }

    fn reshape(&mut self, input: &str, output: &str, shape: &[usize]) -> String {
        let target = format!("{output}.shape");
        self.tensors.push(TensorProto::integers(&target, shape));
        let inputs = vec![input.to_owned(), target];
        self.nodes
            .push(NodeProto::new("Reshape", inputs, output.to_owned()));
        output.to_owned()
    }

    fn transpose(&mut self, input: &str, output: &str, order: &[i64]) -> String {
        let proto = NodeProto::new("Transpose", vec![input.to_owned()], output.to_owned());
        self.nodes
            .push(proto.with(Attribute::integers("perm", order.to_vec())));
        output.to_owned()
    }

    fn constant(&mut self, name: &str, shape: &[usize], values: &[f32]) -> String {
        self.tensors.push(TensorProto::floats(name, shape, values));
        name.to_owned()
    }
}

fn name_of(node: usize) -> String {
    match node {
        0 => INPUT.to_owned(),
        _ => format!("value{node}"),
    }
}

fn value_info(name: &str, shape: &[usize]) -> ValueInfo {
    let dimensions = shape.iter().map(|&side| Dimension { value: side as i64 });
    ValueInfo {
        name: name.to_owned(),
        kind: Some(TypeProto {
            tensor: Some(TensorType {
                element: FLOAT,
                shape: Some(Shape {
                    dimensions: dimensions.collect(),
                }),
            }),
        }),
    }
}

#[derive(Message)]
struct ModelProto {
    #[prost(int64, tag = "1")]
    ir_version: i64,
    #[prost(string, tag = "2")]
    producer_name: String,
    #[prost(string, tag = "3")]
    producer_version: String,
    #[prost(message, optional, tag = "7")]
    graph: Option<GraphProto>,
    #[prost(message, repeated, tag = "8")]
    opset_import: Vec<OperatorSetId>,
}

#[derive(Message)]
struct OperatorSetId {
    #[prost(string, tag = "1")]
    domain: String,
    #[prost(int64, tag = "2")]
    version: i64,
}

#[derive(Message)]
struct GraphProto {
    #[prost(message, repeated, tag = "1")]
    node: Vec<NodeProto>,
    #[prost(string, tag = "2")]
    name: String,
    #[prost(message, repeated, tag = "5")]
    initializer: Vec<TensorProto>,
    #[prost(message, repeated, tag = "11")]
    input: Vec<ValueInfo>,
    #[prost(message, repeated, tag = "12")]
    output: Vec<ValueInfo>,
}

#[derive(Message)]
struct NodeProto {
    #[prost(string, repeated, tag = "1")]
    input: Vec<String>,
    #[prost(string, repeated, tag = "2")]
    output: Vec<String>,
    #[prost(string, tag = "3")]
    name: String,
    #[prost(string, tag = "4")]
    op_type: String,
    #[prost(message, repeated, tag = "5")]
    attribute: Vec<Attribute>,
}

impl NodeProto {
    fn new(kind: &str, input: Vec<String>, output: String) -> Self {
        Self {
            input,
            name: output.clone(),
            output: vec![output],
            op_type: kind.to_owned(),
            attribute: Vec::new(),
        }
    }

    fn with(mut self, attribute: Attribute) -> Self {
        self.attribute.push(attribute);
        self
    }

    fn with_parameters(mut self, name: &str) -> Self {
        self.input.push(format!("{name}.weight"));
        self.input.push(format!("{name}.bias"));
        self
    }
}

/// The types of an attribute's value, as `AttributeProto.AttributeType` numbers them.
#[derive(Clone, Copy)]
enum AttributeType {
    Float = 1,
    Int = 2,
    String = 3,
    Ints = 7,
}

#[derive(Message)]
struct Attribute {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(float, tag = "2")]
    f: f32,
    #[prost(int64, tag = "3")]
    i: i64,
    #[prost(bytes = "vec", tag = "4")]
    s: Vec<u8>,
    #[prost(int64, repeated, tag = "8")]
    ints: Vec<i64>,
    #[prost(int32, tag = "20")]
    kind: i32,
}

impl Attribute {
    fn named(name: &str, kind: AttributeType) -> Self {
        Self {
            name: name.to_owned(),
            kind: kind as i32,
            ..Self::default()
        }
    }

    fn float(name: &str, f: f32) -> Self {
        Self {
            f,
            ..Self::named(name, AttributeType::Float)
        }
    }

    fn integer(name: &str, i: i64) -> Self {
        Self {
            i,
            ..Self::named(name, AttributeType::Int)
        }
    }

    fn integers(name: &str, ints: Vec<i64>) -> Self {
        Self {
            ints,
            ..Self::named(name, AttributeType::Ints)
        }
    }

    fn text(name: &str, text: &str) -> Self {
        let s = text.as_bytes().to_vec();
        Self {
            s,
            ..Self::named(name, AttributeType::String)
        }
    }
}

#[derive(Message)]
struct TensorProto {
    #[prost(int64, repeated, tag = "1")]
    dims: Vec<i64>,
    #[prost(int32, tag = "2")]
    data_type: i32,
    #[prost(string, tag = "8")]
    name: String,
    #[prost(bytes = "vec", tag = "9")]
    raw_data: Vec<u8>,
}

impl TensorProto {
    fn floats(name: &str, shape: &[usize], values: &[f32]) -> Self {
        Self {
            dims: shape.iter().map(|&side| side as i64).collect(),
            data_type: FLOAT,
            name: name.to_owned(),
            raw_data: values
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect(),
        }
    }

    fn integers(name: &str, values: &[usize]) -> Self {
        let bytes = values
            .iter()
            .flat_map(|&value| (value as i64).to_le_bytes());
        Self {
            dims: vec![values.len() as i64],
            data_type: INT64,
            name: name.to_owned(),
            raw_data: bytes.collect(),
        }
    }
}

#[derive(Message)]
struct ValueInfo {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(message, optional, tag = "2")]
    kind: Option<TypeProto>,
}

#[derive(Message)]
struct TypeProto {
    #[prost(message, optional, tag = "1")]
    tensor: Option<TensorType>,
}

#[derive(Message)]
struct TensorType {
    #[prost(int32, tag = "1")]
    element: i32,
    #[prost(message, optional, tag = "2")]
    shape: Option<Shape>,
}

#[derive(Message)]
struct Shape {
    #[prost(message, repeated, tag = "1")]
    dimensions: Vec<Dimension>,
}

#[derive(Message)]
struct Dimension {
    #[prost(int64, tag = "1")]
    value: i64,
}
