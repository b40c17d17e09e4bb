//! A network as data: operations in order of computation.
//!
//! The tensor model that is trained, the ONNX file and the list of parameters are all made from one
//! [`Graph`], so they cannot differ. Values have a number of channels and, where they are pictures,
//! a scale: the size of the input divided by their own.

/// What a parameter is for, and so how it begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The weight of a convolution or of a fully connected layer.
    Weight,
    /// An offset.
    Bias,
    /// A normalisation's factor.
    Gain,
}

/// A parameter that a graph needs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parameter {
    /// Its name, as in a PyTorch state dict.
    pub name: String,
    /// Its shape; a weight's first number is the outputs.
    pub shape: Vec<usize>,
    /// Its purpose.
    pub role: Role,
}

impl Parameter {
    /// How many numbers it has.
    pub fn count(&self) -> usize {
        self.shape.iter().product()
    }

    /// Inputs that go into one output.
    pub fn fan_in(&self) -> usize {
        self.shape.iter().skip(1).product()
    }
}

/// A value inside a graph: the output of one of its nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Value(usize);

impl Value {
    /// The number of the node that computes it, from 0.
    pub fn index(self) -> usize {
        self.0
    }
}

/// What a node computes. Pictures are `batch x channels x height x width`, vectors `batch x channels`.
#[derive(Debug, Clone, PartialEq)]
pub enum Operation {
    /// The network's input, a picture.
    Input,
    /// Convolution with bias; zero padding of `kernel / 2` on each side. Parameters
    /// `<name>.weight` (`outputs x inputs x kernel x kernel`) and `<name>.bias`.
    Convolution {
        /// Name of its parameters.
        name: String,
        /// Side of the square kernel, odd.
        kernel: usize,
        /// Step between outputs, pixels.
        stride: usize,
    },
    /// Normalisation over each group of channels and all pixels of one picture, epsilon
    /// [`EPSILON`]. With a name it has parameters `<name>.weight` and `<name>.bias`, one a channel.
    GroupNorm {
        /// Name of its parameters; `None` where it has none.
        name: Option<String>,
        /// Groups, which divide the channels: as many as channels is instance normalisation.
        groups: usize,
    },
    /// `max(x, 0)`.
    Relu,
    /// Hyperbolic tangent.
    Tanh,
    /// Sum of two values.
    Add,
    /// All channels of the inputs, in their order.
    Concatenate,
    /// Twice as wide and high, bilinear.
    Upsample {
        /// Whether the corner pixels' centres coincide (else the pictures' corners).
        align_corners: bool,
    },
    /// Blocks of `factor x factor` pixels become channels, `c * factor^2 + y * factor + x`.
    PixelUnshuffle {
        /// Side of a block.
        factor: usize,
    },
    /// The inverse of [`Operation::PixelUnshuffle`].
    PixelShuffle {
        /// Side of a block.
        factor: usize,
    },
    /// Mean over all pixels: a vector.
    MeanPool,
    /// Maximum over all pixels: a vector.
    MaxPool,
    /// Fully connected layer. Parameters `<name>.weight` (`outputs x inputs`) and `<name>.bias`.
    Linear {
        /// Name of its parameters.
        name: String,
    },
}

/// Added to the variance before a normalisation divides by its root, as PyTorch does by default.
pub const EPSILON: f32 = 1e-5;

/// One operation with its inputs and the shape of its output.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// What is computed.
    pub operation: Operation,
    /// From which values; all come before the node.
    pub inputs: Vec<Value>,
    /// Channels of the result.
    pub channels: usize,
    /// Input pixels along one pixel of the result; `None`: a vector.
    pub scale: Option<usize>,
}

/// A named result of a network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    /// Its name, as in an ONNX file.
    pub name: &'static str,
    /// Its value.
    pub value: Value,
}

/// A whole network.
#[derive(Debug, Clone, PartialEq)]
pub struct Graph {
    name: &'static str,
    nodes: Vec<Node>,
    outputs: Vec<Output>,
}

impl Graph {
    /// A network with one input picture, and that input.
    pub fn new(name: &'static str, channels: usize) -> (Self, Value) {
        let input = Node {
            operation: Operation::Input,
            inputs: Vec::new(),
            channels,
            scale: Some(1),
        };
        let graph = Self {
            name,
            nodes: vec![input],
            outputs: Vec::new(),
        };
        (graph, Value(0))
    }

    /// The network's name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The operations, in an order in which they can be computed; the first is the input.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The node that computes a value of this graph.
    pub fn node(&self, value: Value) -> &Node {
        &self.nodes[value.0]
    }

    /// The results.
    pub fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    /// Channels of the input.
    pub fn input_channels(&self) -> usize {
        self.nodes[0].channels
    }

    /// Width and height of an input have to be multiples of this, pixels.
    pub fn multiple(&self) -> usize {
        let scales = self.nodes.iter().filter_map(|node| node.scale);
        scales.max().unwrap_or(1)
    }

    /// Every parameter, in the order of the nodes.
    pub fn parameters(&self) -> Vec<Parameter> {
        self.nodes
            .iter()
            .flat_map(|node| self.parameters_of(node))
            .collect()
    }

    fn parameters_of(&self, node: &Node) -> Vec<Parameter> {
        let inputs = node
            .inputs
            .first()
            .map_or(0, |&value| self.node(value).channels);
        match &node.operation {
            Operation::Convolution { name, kernel, .. } => {
                let shape = vec![node.channels, inputs, *kernel, *kernel];
                layer(name, shape, Role::Weight, Role::Bias)
            }
            Operation::Linear { name } => {
                layer(name, vec![node.channels, inputs], Role::Weight, Role::Bias)
            }
            Operation::GroupNorm {
                name: Some(name), ..
            } => layer(name, vec![node.channels], Role::Gain, Role::Bias),
            _ => Vec::new(),
        }
    }

    fn push(
        &mut self,
        operation: Operation,
        inputs: Vec<Value>,
        channels: usize,
        scale: Option<usize>,
    ) -> Value {
        self.nodes.push(Node {
            operation,
            inputs,
            channels,
            scale,
        });
        Value(self.nodes.len() - 1)
    }

    fn like(&mut self, operation: Operation, of: Value) -> Value {
        let Node {
            channels, scale, ..
        } = *self.node(of);
        self.push(operation, vec![of], channels, scale)
    }

    /// A convolution of 3 x 3 pixels.
    pub fn convolution(&mut self, name: String, of: Value, outputs: usize, stride: usize) -> Value {
        let scale = self.node(of).scale.map(|scale| scale * stride);
        let operation = Operation::Convolution {
            name,
            kernel: 3,
            stride,
        };
        self.push(operation, vec![of], outputs, scale)
    }

    /// A convolution of single pixels.
    pub fn pointwise(&mut self, name: String, of: Value, outputs: usize) -> Value {
        let scale = self.node(of).scale;
        let operation = Operation::Convolution {
            name,
            kernel: 1,
            stride: 1,
        };
        self.push(operation, vec![of], outputs, scale)
    }

    /// Normalisation of each channel of each picture, without parameters.
    pub fn instance_norm(&mut self, of: Value) -> Value {
        let groups = self.node(of).channels;
        self.like(Operation::GroupNorm { name: None, groups }, of)
    }

    /// Normalisation of groups of `size` channels, with a gain and an offset a channel.
    pub fn group_norm(&mut self, name: String, of: Value, size: usize) -> Value {
        let groups = (self.node(of).channels / size).max(1);
        let name = Some(name);
        self.like(Operation::GroupNorm { name, groups }, of)
    }

    /// `max(x, 0)`.
    pub fn relu(&mut self, of: Value) -> Value {
        self.like(Operation::Relu, of)
    }

    /// Hyperbolic tangent.
    pub fn tanh(&mut self, of: Value) -> Value {
        self.like(Operation::Tanh, of)
    }

    /// The sum of two values of one shape.
    pub fn add(&mut self, a: Value, b: Value) -> Value {
        let Node {
            channels, scale, ..
        } = *self.node(a);
        self.push(Operation::Add, vec![a, b], channels, scale)
    }

    /// The channels of `a`, then those of `b`.
    pub fn concatenate(&mut self, a: Value, b: Value) -> Value {
        let channels = self.node(a).channels + self.node(b).channels;
        let scale = self.node(a).scale;
        self.push(Operation::Concatenate, vec![a, b], channels, scale)
    }

    /// Twice as wide and high.
    pub fn upsample(&mut self, of: Value, align_corners: bool) -> Value {
        let Node {
            channels, scale, ..
        } = *self.node(of);
        let scale = scale.map(|scale| scale / 2);
        self.push(
            Operation::Upsample { align_corners },
            vec![of],
            channels,
            scale,
        )
    }

    /// Blocks of pixels to channels.
    pub fn pixel_unshuffle(&mut self, of: Value, factor: usize) -> Value {
        let channels = self.node(of).channels * factor * factor;
        let scale = self.node(of).scale.map(|scale| scale * factor);
        self.push(
            Operation::PixelUnshuffle { factor },
            vec![of],
            channels,
            scale,
        )
    }

    /// Channels to blocks of pixels.
    pub fn pixel_shuffle(&mut self, of: Value, factor: usize) -> Value {
        let channels = self.node(of).channels / (factor * factor);
        let scale = self.node(of).scale.map(|scale| scale / factor);
        self.push(
            Operation::PixelShuffle { factor },
            vec![of],
            channels,
            scale,
        )
    }

    /// The mean of each channel.
    pub fn mean_pool(&mut self, of: Value) -> Value {
        let channels = self.node(of).channels;
        self.push(Operation::MeanPool, vec![of], channels, None)
    }

    /// The maximum of each channel.
    pub fn max_pool(&mut self, of: Value) -> Value {
        let channels = self.node(of).channels;
        self.push(Operation::MaxPool, vec![of], channels, None)
    }

    /// A fully connected layer.
    pub fn linear(&mut self, name: String, of: Value, outputs: usize) -> Value {
        self.push(Operation::Linear { name }, vec![of], outputs, None)
    }

    /// Names a value as a result.
    pub fn output(&mut self, name: &'static str, value: Value) {
        self.outputs.push(Output { name, value });
    }
}

/// Layers whose normalisation has groups of `group` channels.
pub(super) struct GroupedLayers {
    pub(super) group: usize,
}

impl GroupedLayers {
    /// Convolution, normalisation of groups, ReLU.
    pub(super) fn layer(
        &self,
        net: &mut Graph,
        name: &str,
        of: Value,
        outputs: usize,
        stride: usize,
    ) -> Value {
        let value = net.convolution(format!("{name}.conv"), of, outputs, stride);
        let value = net.group_norm(format!("{name}.norm"), value, self.group);
        net.relu(value)
    }

    /// Two layers whose result is added to their input.
    pub(super) fn residual(&self, net: &mut Graph, name: &str, of: Value) -> Value {
        let channels = net.node(of).channels;
        let value = self.layer(net, &format!("{name}.0"), of, channels, 1);
        let value = net.convolution(format!("{name}.1.conv"), value, channels, 1);
        let value = net.group_norm(format!("{name}.1.norm"), value, self.group);
        let sum = net.add(of, value);
        net.relu(sum)
    }
}

fn layer(name: &str, shape: Vec<usize>, weight: Role, bias: Role) -> Vec<Parameter> {
    let outputs = shape[0];
    vec![
        Parameter {
            name: format!("{name}.weight"),
            shape,
            role: weight,
        },
        Parameter {
            name: format!("{name}.bias"),
            shape: vec![outputs],
            role: bias,
        },
    ]
}
