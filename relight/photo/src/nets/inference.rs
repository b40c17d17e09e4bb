//! Running a network on the CPU: the ONNX file, made in memory, by an engine.

use std::path::Path;

use super::engine::{InferenceEngine, Plan};
use super::error::NetError;
use super::external::first_location;
use super::graph::Graph;
use super::onnx::to_onnx;
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
    /// [`NetError::Run`], or what [`Weights::fitted_to`] answers.
    pub fn new(graph: &Graph, weights: &Weights, size: (usize, usize)) -> Result<Self, NetError> {
        Self::with_engine(graph, weights, size, &InferenceEngine::default())
    }

    /// Makes a network ready for pictures of `width` x `height` pixels.
    ///
    /// # Errors
    /// [`NetError::Run`], or what [`Weights::fitted_to`] answers.
    pub fn with_engine(
        graph: &Graph,
        weights: &Weights,
        (width, height): (usize, usize),
        engine: &InferenceEngine,
    ) -> Result<Self, NetError> {
        let bytes = to_onnx(graph, weights, 1, (width, height))?;
        let shape = [1, graph.input_channels(), height, width];
        let plan = engine.prepare(&bytes, shape, &[]).map_err(|fault| {
            let (engine, net) = (engine.name(), graph.name());
            NetError::Run(format!("{engine} could not prepare {net}: {fault}"))
        });
        Ok(Self {
            name: graph.name(),
            engine: engine.name(),
            shape,
            plan: plan?,
        })
    }

    /// Makes the content of an ONNX file ready for one picture of `channels` channels, `width` x `height` pixels. Further
    /// inputs, by their names, are the `given` numbers: the picture goes into the input that is none of them.
    ///
    /// # Errors
    /// [`NetError::File`], which names it as `path`, where it is no network or cannot take such a picture.
    pub fn from_onnx(
        path: &Path,
        bytes: &[u8],
        channels: usize,
        (width, height): (usize, usize),
        given: &[(String, i64)],
        engine: &InferenceEngine,
    ) -> Result<Self, NetError> {
        let shape = [1, channels, height, width];
        let unusable = |fault| NetError::File {
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

    /// Runs it on one picture: channel by channel, row by row. The outputs come in the graph's order.
    ///
    /// # Errors
    /// [`NetError::Run`], also where the input is not as long as its shape.
    pub fn run(&self, input: &[f32]) -> Result<Vec<Tensor>, NetError> {
        let [_, channels, height, width] = self.shape;
        if input.len() != channels * height * width {
            return Err(NetError::Run(format!(
                "{} takes {channels} channels of {width} x {height} pixels, not {} numbers",
                self.name,
                input.len()
            )));
        }
        self.plan.run(input).map_err(|fault| {
            NetError::Run(format!(
                "{} could not run {}: {fault}",
                self.engine, self.name
            ))
        })
    }
}
