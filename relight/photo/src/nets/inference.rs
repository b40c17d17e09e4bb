//! Running a network on the CPU: the ONNX file, made in memory, by tract.

use std::path::Path;

use super::codec::WeightPrecision;
use super::error::NetError;
use super::graph::Graph;
use super::onnx::{check_size, to_onnx};
use super::tract::TractPlan;
use super::weights::{Tensor, Weights};

/// A network ready to be run on single pictures of one size.
pub struct Inference {
    name: &'static str,
    shape: [usize; 4],
    plan: TractPlan,
}

impl std::fmt::Debug for Inference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Inference")
            .field("name", &self.name)
            .field("shape", &self.shape)
            .finish_non_exhaustive()
    }
}

impl Inference {
    /// Makes a network ready for pictures of `width` x `height` pixels.
    ///
    /// # Errors
    /// [`NetError::Run`], or what [`Weights::fitted_to`] answers.
    pub fn new(
        graph: &Graph,
        weights: &Weights,
        (width, height): (usize, usize),
    ) -> Result<Self, NetError> {
        check_size(graph, (width, height))?;
        let bytes = to_onnx(graph, weights, WeightPrecision::Single, &[])?;
        let shape = [1, graph.input_channels(), height, width];
        let plan = TractPlan::new(&bytes, None, shape, &[]).map_err(|fault| {
            NetError::Run(format!("tract could not prepare {}: {fault}", graph.name()))
        });
        Ok(Self {
            name: graph.name(),
            shape,
            plan: plan?,
        })
    }

    /// Makes the content of an ONNX file ready for one picture of `channels` channels, `width` x `height` pixels. Weights
    /// that it keeps in other files lie in the folder of `path`, or below. Further inputs, by their names, are the `given` numbers: the picture goes into the remaining input.
    ///
    /// # Errors
    /// [`NetError::File`], which names it as `path`, if it is not a network or cannot take such a picture.
    pub fn from_onnx(
        path: &Path,
        bytes: &[u8],
        channels: usize,
        (width, height): (usize, usize),
        given: &[(String, i64)],
    ) -> Result<Self, NetError> {
        let shape = [1, channels, height, width];
        let plan =
            TractPlan::new(bytes, path.parent(), shape, given).map_err(|fault| NetError::File {
                path: path.to_owned(),
                fault,
            });
        Ok(Self {
            name: "the network of the ONNX file",
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
        self.plan
            .run(input)
            .map_err(|fault| NetError::Run(format!("tract could not run {}: {fault}", self.name)))
    }
}
