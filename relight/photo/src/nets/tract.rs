//! Networks by tract, in pure Rust.

use std::path::Path;
use std::sync::Arc;

use tract_onnx::prelude::{
    DatumExt, Framework, InferenceModelExt, IntoRunnable, TValue, TVec, Tensor as TractTensor,
    TractError, TractResult, TypedRunnableModel,
};
use tract_onnx::tract_core::plan::eval;

use super::weights::Tensor;

/// A network in tract.
pub(super) struct TractPlan {
    shape: [usize; 4],
    /// The value of each input; `None` for the picture.
    inputs: Vec<Option<TractTensor>>,
    plan: Arc<TypedRunnableModel>,
}

impl TractPlan {
    /// Prepares the content of an ONNX file. `folder` is where weights lie that it keeps in other files.
    pub(super) fn new(
        onnx: &[u8],
        folder: Option<&Path>,
        shape: [usize; 4],
        given: &[(String, i64)],
    ) -> Result<Self, String> {
        let plan =
            Self::prepared(onnx, folder, shape, given).map_err(|fault| format!("{fault:#}"))?;
        if plan.inputs.contains(&None) {
            Ok(plan)
        } else {
            Err("it has no input for a picture".to_owned())
        }
    }

    fn prepared(
        mut onnx: &[u8],
        folder: Option<&Path>,
        shape: [usize; 4],
        given: &[(String, i64)],
    ) -> TractResult<Self> {
        let reader = tract_onnx::onnx();
        let file = reader.proto_model_for_read(&mut onnx)?;
        let parsed = reader.parse(&file, folder.and_then(Path::to_str))?;
        if !parsed.unresolved_inputs.is_empty() {
            let names = parsed.unresolved_inputs.join(", ");
            return Err(TractError::msg(format!("nothing answers {names}")));
        }
        let mut model = parsed.model;
        let mut inputs = Vec::new();
        for at in 0..model.input_outlets()?.len() {
            let node = model.input_outlets()?[at].node;
            let name = &model.node(node).name;
            let number = given.iter().find(|(given, _)| given == name);
            let number = number.map(|(_, number)| TractTensor::from(*number));
            // A number that is known now may decide the sizes of what follows.
            let fact = match &number {
                Some(number) => number.clone().into(),
                None => f32::fact(shape).into(),
            };
            model.set_input_fact(at, fact)?;
            inputs.push(number);
        }
        let plan = model.into_optimized()?.into_runnable()?;
        Ok(Self {
            shape,
            inputs,
            plan,
        })
    }

    /// The outputs for an input of the shape it was made ready for, or tract's own words.
    pub(super) fn run(&self, input: &[f32]) -> Result<Vec<Tensor>, String> {
        let failed = |fault: &dyn std::fmt::Display| format!("{fault:#}");
        let input = TractTensor::from_shape(&self.shape, input).map_err(|fault| failed(&fault))?;
        let picture = TValue::from(input);
        let value = |given: &Option<TractTensor>| match given {
            Some(number) => TValue::from(number.clone()),
            None => picture.clone(),
        };
        let outputs = self.outputs(self.inputs.iter().map(value).collect());
        outputs
            .map_err(|fault| failed(&fault))?
            .iter()
            .map(|output| {
                let view = output.to_plain_array_view::<f32>();
                let view = view.map_err(|fault| failed(&fault))?;
                let tensor = Tensor::new(view.shape().to_vec(), view.iter().copied().collect());
                tensor.ok_or_else(|| "an output has no shape".to_owned())
            })
            .collect()
    }

    fn outputs(&self, inputs: TVec<TValue>) -> TractResult<TVec<TValue>> {
        let mut state = self.plan.spawn()?;
        with_threads(|| {
            state.run_plan_with_eval(inputs, |context, state, node, inputs| {
                let outputs = eval(context, state, node, inputs);
                clear_upper_halves();
                outputs
            })
        })
    }
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
