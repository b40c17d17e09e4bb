//! What computes a network: tract, which is part of the program, or ONNX Runtime, a library that is loaded where it is
//! installed. Both are given the same ONNX file.

use super::onnxruntime::OnnxRuntime;
use super::tract::TractPlan;
use super::weights::Tensor;

/// What computes a network.
#[derive(Debug, Clone, Default)]
pub enum InferenceEngine {
    /// Pure Rust, always there.
    #[default]
    Tract,
    /// A library; faster.
    OnnxRuntime(OnnxRuntime),
}

/// A network in an engine, ready to be run.
pub(super) trait Plan: Send + Sync {
    /// The outputs for an input of the shape it was made ready for, or the engine's own words.
    fn run(&self, input: &[f32]) -> Result<Vec<Tensor>, String>;
}

impl InferenceEngine {
    /// Its name.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Tract => "tract",
            Self::OnnxRuntime(_) => "ONNX Runtime",
        }
    }

    /// Makes an ONNX file with one input ready for inputs of a shape.
    ///
    /// # Errors
    /// The engine's own words.
    pub(super) fn prepare(&self, onnx: &[u8], shape: [usize; 4]) -> Result<Box<dyn Plan>, String> {
        Ok(match self {
            Self::Tract => Box::new(TractPlan::new(onnx, shape)?),
            Self::OnnxRuntime(library) => Box::new(library.prepare(onnx, shape)?),
        })
    }
}
