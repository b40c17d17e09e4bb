//! Running a network on the CPU, with nothing installed: the ONNX file, made in memory, by tract.

use std::path::Path;

use tract_onnx::prelude::{
    DatumExt, Framework, InferenceModelExt, IntoRunnable, TValue, Tensor as TractTensor,
    TypedRunnableModel, tvec,
};

use super::error::NetError;
use super::graph::Graph;
use super::onnx::to_onnx;
use super::weights::{Tensor, Weights};

const ENGINE: &str = "tract";

/// A network ready to be run on single pictures of one size.
pub struct Inference {
    name: &'static str,
    shape: [usize; 4],
    plan: std::sync::Arc<TypedRunnableModel>,
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
    /// [`NetError::PictureSize`], what [`Weights::fitted_to`] answers, or [`NetError::Engine`].
    pub fn new(
        graph: &Graph,
        weights: &Weights,
        (width, height): (usize, usize),
    ) -> Result<Self, NetError> {
        let bytes = to_onnx(graph, weights, 1, (width, height))?;
        let plan = tract_onnx::onnx()
            .model_for_read(&mut bytes.as_slice())
            .and_then(|model| model.into_optimized()?.into_runnable());
        Ok(Self {
            name: graph.name(),
            shape: [1, graph.input_channels(), height, width],
            plan: plan.map_err(|fault| engine(graph.name(), "prepare", &fault))?,
        })
    }

    /// Reads an ONNX file with one input, and makes it ready for one picture of `channels` channels,
    /// `width` x `height` pixels.
    ///
    /// # Errors
    /// [`NetError::Io`], or [`NetError::Onnx`] where it is no network or cannot take such a picture.
    pub fn read_onnx(
        path: &Path,
        channels: usize,
        (width, height): (usize, usize),
    ) -> Result<Self, NetError> {
        let bytes = std::fs::read(path).map_err(|source| NetError::Io {
            path: path.to_owned(),
            doing: "read",
            source,
        })?;
        let shape = [1, channels, height, width];
        let plan = tract_onnx::onnx()
            .model_for_read(&mut bytes.as_slice())
            .and_then(|model| model.with_input_fact(0, f32::fact(shape).into()))
            .and_then(|model| model.into_optimized()?.into_runnable());
        Ok(Self {
            name: "the network of the ONNX file",
            shape,
            plan: plan.map_err(|fault| NetError::Onnx {
                path: path.to_owned(),
                fault: format!("{fault:#}"),
            })?,
        })
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
        let failed = |fault: &dyn std::fmt::Display| engine(self.name, "run", fault);
        let input = TractTensor::from_shape(&self.shape, input).map_err(|fault| failed(&fault))?;
        let outputs = self
            .plan
            .run(tvec!(TValue::from(input)))
            .map_err(|fault| failed(&fault))?;
        outputs
            .iter()
            .map(|output| {
                let view = output
                    .to_plain_array_view::<f32>()
                    .map_err(|fault| failed(&fault))?;
                let tensor = Tensor::new(view.shape().to_vec(), view.iter().copied().collect());
                tensor.ok_or_else(|| failed(&"an output has no shape"))
            })
            .collect()
    }
}

fn engine(net: &'static str, doing: &'static str, fault: &dyn std::fmt::Display) -> NetError {
    NetError::Engine {
        engine: ENGINE,
        doing,
        net,
        fault: format!("{fault:#}"),
    }
}
