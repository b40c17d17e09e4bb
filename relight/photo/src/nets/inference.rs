//! Running a network on the CPU: the ONNX file, made in memory, by tract.

use std::sync::Arc;

use tract_onnx::prelude::{
    DatumExt, Framework, InferenceModelExt, IntoRunnable, TValue, TVec, Tensor as TractTensor,
    TractError, TractResult, TypedRunnableModel,
};
use tract_onnx::tract_core::plan::eval;

use super::codec::WeightPrecision;
use super::error::NetError;
use super::graph::Graph;
use super::onnx::{check_size, to_onnx};
use super::weights::{Tensor, Weights};

/// A network ready to be run on single pictures of one size.
pub struct Inference {
    name: &'static str,
    shape: [usize; 4],
    plan: Arc<TypedRunnableModel>,
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
    /// If the network cannot take such pictures, or what [`Weights::fitted_to`] answers.
    pub fn new(
        graph: &Graph,
        weights: &Weights,
        (width, height): (usize, usize),
    ) -> Result<Self, NetError> {
        check_size(graph, (width, height))?;
        let onnx = to_onnx(graph, weights, WeightPrecision::Single, &[])?;
        let (name, shape) = (graph.name(), [1, graph.input_channels(), height, width]);
        let plan = prepared(&onnx, shape).map_err(|fault| {
            NetError::Other(format!("tract could not prepare {name}: {fault:#}"))
        })?;
        Ok(Self { name, shape, plan })
    }

    /// Runs it on one picture: channel by channel, row by row. The outputs come in the graph's order.
    ///
    /// # Errors
    /// If the input is not as long as its shape, or the network fails.
    pub fn run(&self, input: &[f32]) -> Result<Vec<Tensor>, NetError> {
        let [_, channels, height, width] = self.shape;
        if input.len() != channels * height * width {
            return Err(NetError::Other(format!(
                "{} takes {channels} channels of {width} x {height} pixels, not {} numbers",
                self.name,
                input.len()
            )));
        }
        self.outputs(input).map_err(|fault| {
            NetError::Other(format!("tract could not run {}: {fault:#}", self.name))
        })
    }

    fn outputs(&self, input: &[f32]) -> TractResult<Vec<Tensor>> {
        let input = TValue::from(TractTensor::from_shape(&self.shape, input)?);
        let mut state = self.plan.spawn()?;
        let outputs: TVec<TValue> = with_threads(|| {
            state.run_plan_with_eval(
                [input].into_iter().collect(),
                |context, state, node, inputs| {
                    let outputs = eval(context, state, node, inputs);
                    clear_upper_halves();
                    outputs
                },
            )
        })?;
        let tensor = |output: &TValue| {
            let view = output.to_plain_array_view::<f32>()?;
            Tensor::new(view.shape().to_vec(), view.iter().copied().collect())
                .ok_or_else(|| TractError::msg("an output has no shape"))
        };
        outputs.iter().map(tensor).collect()
    }
}

/// Prepares the content of an ONNX file of one input.
fn prepared(mut onnx: &[u8], shape: [usize; 4]) -> TractResult<Arc<TypedRunnableModel>> {
    let model = tract_onnx::onnx().model_for_read(&mut onnx)?;
    let model = model.with_input_fact(0, f32::fact(shape).into())?;
    model.into_optimized()?.into_runnable()
}

/// Runs an inference, whose products are computed on all of rayon's threads where that is safe.
///
/// tract keeps its scratch memory borrowed in a thread-local while it waits for those threads. One of rayon's threads does
/// not only wait, it takes over other work meanwhile: the next inference, which would borrow the same memory again. So an
/// inference on one of rayon's threads computes alone, and only another thread, which sleeps while it waits, gets help.
#[cfg(feature = "threads")]
fn with_threads<R>(work: impl FnOnce() -> R) -> R {
    use tract_linalg::multithread::{Executor, multithread_tract_scope};
    if rayon::current_thread_index().is_some() {
        return multithread_tract_scope(Executor::SingleThread, work);
    }
    let found = multithread_tract_scope(Executor::RayonGlobal, work);
    // Each thread as soon as it has nothing else to do: until then what it takes over is slower.
    rayon::spawn_broadcast(|_| clear_upper_halves());
    found
}

#[cfg(not(feature = "threads"))]
fn with_threads<R>(work: impl FnOnce() -> R) -> R {
    work()
}

/// Marks the upper halves of this thread's vector registers as unused. tract's kernels for AVX leave them in use, and then
/// every instruction without AVX (the rest of tract and of this program) is up to twenty times slower on some
/// processors (Intel, "64 and IA-32 Architectures Optimization Reference Manual": mixing AVX code with SSE code).
#[cfg(target_arch = "x86_64")]
fn clear_upper_halves() {
    #[target_feature(enable = "avx")]
    fn clear() {
        std::arch::x86_64::_mm256_zeroupper();
    }
    if is_x86_feature_detected!("avx") {
        #[allow(
            unsafe_code,
            reason = "the processor has this instruction, and no code here uses its registers"
        )]
        // SAFETY: `clear` needs AVX, which is there.
        unsafe {
            clear();
        }
    }
}

/// No other processor has AVX in use.
#[cfg(not(target_arch = "x86_64"))]
fn clear_upper_halves() {}

#[cfg(test)]
mod tests {
    use super::super::decomposer_with_light;
    use super::*;

    #[test]
    fn one_file_of_half_precision_answers_pictures_of_any_size() {
        let graph = decomposer_with_light();
        let weights = Weights::initial(&graph, 5);
        let bytes = weights.to_safetensors(WeightPrecision::Half, None).unwrap();
        let weights = Weights::from_bytes(&bytes).unwrap();
        let facts = [("axes", "y up")];
        let file = to_onnx(&graph, &weights, WeightPrecision::Half, &facts).unwrap();
        assert!(file.len() < bytes.len() + 300_000, "{}", file.len());
        for (width, height) in [(64, 32), (96, 128)] {
            let own = Inference::new(&graph, &weights, (width, height)).unwrap();
            let plan = prepared(&file, own.shape).unwrap();
            let read = Inference { plan, ..own };
            let input: Vec<f32> = (0..graph.input_channels() * width * height)
                .map(|at| (at % 17) as f32 / 17.0)
                .collect();
            let own = Inference::new(&graph, &weights, (width, height)).unwrap();
            assert_eq!(read.run(&input).unwrap(), own.run(&input).unwrap());
        }
    }
}
