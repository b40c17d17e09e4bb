//! What computes a network: tract, which is always there, or with the feature `onnxruntime` a library that is loaded
//! where it is installed. Both are given the same ONNX file.

#[cfg(feature = "onnxruntime")]
use super::onnxruntime::OnnxRuntime;
use super::plan::{GivenNumber, Plan};
use super::tract::TractPlan;

/// What computes a network.
#[derive(Debug, Clone, Default)]
pub enum InferenceEngine {
    /// Pure Rust, always there.
    #[default]
    Tract,
    /// A library; faster.
    #[cfg(feature = "onnxruntime")]
    OnnxRuntime(OnnxRuntime),
}

impl InferenceEngine {
    /// Its name.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Tract => "tract",
            #[cfg(feature = "onnxruntime")]
            Self::OnnxRuntime(_) => "ONNX Runtime",
        }
    }

    /// Makes an ONNX file ready for inputs of a shape; its other inputs are the given numbers.
    ///
    /// # Errors
    /// The engine's own words.
    pub(super) fn prepare(
        &self,
        onnx: &[u8],
        shape: [usize; 4],
        given: &[GivenNumber],
    ) -> Result<Box<dyn Plan>, String> {
        Ok(match self {
            Self::Tract => Box::new(TractPlan::new(onnx, shape, given)?),
            #[cfg(feature = "onnxruntime")]
            Self::OnnxRuntime(library) => Box::new(library.prepare(onnx, shape, given)?),
        })
    }
}
