//! Running a network on the CPU: the ONNX file, made in memory, by an engine.

use std::path::Path;

use super::engine::InferenceEngine;
use super::error::NetError;
use super::external::first_location;
use super::graph::Graph;
use super::onnx::to_onnx;
use super::plan::{GivenNumber, Plan};
use super::weights::{Tensor, Weights};

/// A network ready to be run on single pictures of one size.
pub struct Inference {
    name: &'static str,
    engine: &'static str,
    shape: [usize; 4],
    plan: Box<dyn Plan>,
}

impl std::fmt::Debug for Inference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Inference")
            .field("name", &self.name)
            .field("engine", &self.engine)
            .field("shape", &self.shape)
            .finish_non_exhaustive()
    }
}

impl Inference {
    /// Makes a network ready for pictures of `width` x `height` pixels, by tract.
    ///
    /// # Errors
    /// [`NetError::PictureSize`], what [`Weights::fitted_to`] answers, or [`NetError::Engine`].
    pub fn new(graph: &Graph, weights: &Weights, size: (usize, usize)) -> Result<Self, NetError> {
        Self::with_engine(graph, weights, size, &InferenceEngine::default())
    }

    /// Makes a network ready for pictures of `width` x `height` pixels.
    ///
    /// # Errors
    /// [`NetError::PictureSize`], what [`Weights::fitted_to`] answers, or [`NetError::Engine`].
    pub fn with_engine(
        graph: &Graph,
        weights: &Weights,
        (width, height): (usize, usize),
        engine: &InferenceEngine,
    ) -> Result<Self, NetError> {
        let bytes = to_onnx(graph, weights, 1, (width, height))?;
        let shape = [1, graph.input_channels(), height, width];
        let plan = engine
            .prepare(&bytes, shape, &[])
            .map_err(|fault| NetError::Engine {
                engine: engine.name(),
                doing: "prepare",
                net: graph.name(),
                fault,
            });
        Ok(Self {
            name: graph.name(),
            engine: engine.name(),
            shape,
            plan: plan?,
        })
    }

    /// The same for a file whose further inputs are numbers that stay the same: the picture goes into the input that is
    /// none of them.
    ///
    /// # Errors
    /// As [`Self::from_onnx`].
    pub fn from_onnx_with(
        path: &Path,
        bytes: &[u8],
        channels: usize,
        (width, height): (usize, usize),
        given: &[GivenNumber],
        engine: &InferenceEngine,
    ) -> Result<Self, NetError> {
        let shape = [1, channels, height, width];
        let unusable = |fault| NetError::Onnx {
            path: path.to_owned(),
            fault,
        };
        if let Some(location) = first_location(bytes) {
            return Err(unusable(format!(
                "its weights stand in another file, {location:?}: save it as one file"
            )));
        }
        let plan = engine.prepare(bytes, shape, given).map_err(unusable);
        Ok(Self {
            name: "the network of the ONNX file",
            engine: engine.name(),
            shape,
            plan: plan?,
        })
    }

    /// Makes the content of an ONNX file with one input ready for one picture of `channels` channels,
    /// `width` x `height` pixels.
    ///
    /// # Errors
    /// [`NetError::Onnx`], which names it as `path`, where it is no network or cannot take such a picture.
    pub fn from_onnx(
        path: &Path,
        bytes: &[u8],
        channels: usize,
        size: (usize, usize),
        engine: &InferenceEngine,
    ) -> Result<Self, NetError> {
        Self::from_onnx_with(path, bytes, channels, size, &[], engine)
    }

    /// Runs it on one picture: channel by channel, row by row. The outputs come in the graph's order.
    ///
    /// # Errors
    /// [`NetError::PictureSize`] where the input is not as long as its shape, or [`NetError::Engine`].
    pub fn run(&self, input: &[f32]) -> Result<Vec<Tensor>, NetError> {
        let [_, channels, height, width] = self.shape;
        if input.len() != channels * height * width {
            return Err(NetError::PictureSize {
                net: self.name,
                width,
                height,
                needs: format!(
                    "{channels} channels of that size, not {} numbers",
                    input.len()
                ),
            });
        }
        self.plan.run(input).map_err(|fault| NetError::Engine {
            engine: self.engine,
            doing: "run",
            net: self.name,
            fault,
        })
    }
}
