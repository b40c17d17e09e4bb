//! What computes a network: tract, which is always there, or with the feature `onnxruntime` a library that is loaded
//! where it is installed. Both are given the same ONNX file.

#[cfg(feature = "onnxruntime")]
use super::onnxruntime::OnnxRuntime;
use super::tract::TractPlan;
use super::weights::Tensor;

/// A network in an engine, ready to be run.
pub(super) trait Plan: Send + Sync {
    /// The outputs for an input of the shape it was made ready for, or the engine's own words.
    fn run(&self, input: &[f32]) -> Result<Vec<Tensor>, String>;
}

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

    /// Makes an ONNX file ready for inputs of a shape; its other inputs, by their names, are the given numbers.
    ///
    /// # Errors
    /// The engine's own words.
    pub(super) fn prepare(
        &self,
        onnx: &[u8],
        shape: [usize; 4],
        given: &[(String, i64)],
    ) -> Result<Box<dyn Plan>, String> {
        Ok(match self {
            Self::Tract => Box::new(TractPlan::new(onnx, shape, given)?),
            #[cfg(feature = "onnxruntime")]
            Self::OnnxRuntime(library) => Box::new(library.prepare(onnx, shape, given)?),
        })
    }
}
