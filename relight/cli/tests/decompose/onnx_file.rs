//! ONNX files of a few nodes, in the signatures of networks that others publish.

/// A node: what it does, what goes in, what comes out, and its attributes as they are written.
pub(crate) struct OnnxNode {
    pub(crate) kind: &'static str,
    pub(crate) input: &'static str,
    pub(crate) output: &'static str,
    pub(crate) attributes: Vec<Vec<u8>>,
}

/// An input or output: its name, the type of its numbers (1: 32-bit, 7: whole), and its sides, 0 where they are open.
pub(crate) struct OnnxPort {
    pub(crate) name: &'static str,
    pub(crate) element: u64,
    pub(crate) sides: Vec<u64>,
}

/// The bytes of a file of operator set 13.
pub(crate) fn onnx_file(nodes: &[OnnxNode], inputs: &[OnnxPort], outputs: &[OnnxPort]) -> Vec<u8> {
    let mut graph = Vec::new();
    for node in nodes {
        let mut bytes = Vec::new();
        message(&mut bytes, 1, node.input.as_bytes());
        message(&mut bytes, 2, node.output.as_bytes());
        message(&mut bytes, 4, node.kind.as_bytes());
        for attribute in &node.attributes {
            message(&mut bytes, 5, attribute);
        }
        message(&mut graph, 1, &bytes);
    }
    message(&mut graph, 2, b"test");
    for (field, ports) in [(11, inputs), (12, outputs)] {
        for port in ports {
            message(&mut graph, field, &of_port(port));
        }
    }
    let mut model = Vec::new();
    number(&mut model, 1, 8);
    message(&mut model, 7, &graph);
    let mut operators = Vec::new();
    number(&mut operators, 2, 13);
    message(&mut model, 8, &operators);
    model
}

/// An attribute that is one whole number.
pub(crate) fn integer(name: &str, value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    message(&mut bytes, 1, name.as_bytes());
    number(&mut bytes, 3, value);
    number(&mut bytes, 20, 2);
    bytes
}

/// An attribute that is a list of whole numbers.
pub(crate) fn integers(name: &str, values: &[u64]) -> Vec<u8> {
    let mut bytes = Vec::new();
    message(&mut bytes, 1, name.as_bytes());
    for &value in values {
        number(&mut bytes, 8, value);
    }
    number(&mut bytes, 20, 7);
    bytes
}

fn of_port(port: &OnnxPort) -> Vec<u8> {
    let mut shape = Vec::new();
    for (at, &side) in port.sides.iter().enumerate() {
        let mut bytes = Vec::new();
        if side > 0 {
            number(&mut bytes, 1, side);
        } else {
            message(&mut bytes, 2, format!("side{at}").as_bytes());
        }
        message(&mut shape, 1, &bytes);
    }
    let mut tensor = Vec::new();
    number(&mut tensor, 1, port.element);
    message(&mut tensor, 2, &shape);
    let mut kind = Vec::new();
    message(&mut kind, 1, &tensor);
    let mut value = Vec::new();
    message(&mut value, 1, port.name.as_bytes());
    message(&mut value, 2, &kind);
    value
}

fn message(to: &mut Vec<u8>, field: u64, bytes: &[u8]) {
    varint(to, field << 3 | 2);
    varint(to, bytes.len() as u64);
    to.extend(bytes);
}

fn number(to: &mut Vec<u8>, field: u64, value: u64) {
    varint(to, field << 3);
    varint(to, value);
}

fn varint(to: &mut Vec<u8>, mut value: u64) {
    while value > 0x7f {
        to.push(value as u8 | 0x80);
        value >>= 7;
    }
    to.push(value as u8);
}
