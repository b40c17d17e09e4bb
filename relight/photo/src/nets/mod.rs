//! Networks described once as data, from which the model that is trained, the ONNX file and the list
//! of parameters are made; their weights in files; and their inference.
//!
//! [`paper`] has the paper's four networks with the released shapes and parameter names, and
//! [`decomposer`] and [`turn_network`] ours. [`Weights`] reads safetensors,
//! [`to_onnx`] writes what any engine runs, and [`Inference`] runs it here.
//! Knows tensors only, not pictures, colour or light.
//!
//! ```
//! use relight_photo::nets::{Inference, Weights, decomposer};
//!
//! let graph = decomposer();
//! let weights = Weights::initial(&graph, 1);
//! let net = Inference::new(&graph, &weights, (32, 32))?;
//! let maps = net.run(&vec![0.5; 7 * 32 * 32])?;
//! assert_eq!(maps[0].shape(), [1, 9, 32, 32]);
//! # Ok::<(), relight_photo::nets::NetError>(())
//! ```

mod codec;
mod decomposer;
mod error;
#[cfg(feature = "files")]
mod files;
mod graph;
mod inference;
mod onnx;
pub mod paper;
mod turn_network;
mod weights;

pub use codec::WeightPrecision;
pub use decomposer::{
    INPUTS, LIGHT_OUTPUTS, LIGHT_PARAMETERS, OUTPUTS, decomposer, decomposer_of,
    decomposer_with_light,
};
pub use error::NetError;
pub use graph::{EPSILON, Graph, Node, Operation, Output, Parameter, Role, Value};
pub use inference::Inference;
pub use onnx::{INPUT, check_size, to_onnx};
pub use turn_network::{ALBEDO_OUTPUTS, LOG_MEANS, TURN_INPUTS, TURN_OUTPUTS, turn_network};
pub use weights::{Tensor, Weights};
