//! Networks by tract, in pure Rust.

use std::sync::Arc;

use tract_onnx::prelude::{
    DatumExt, Framework, InferenceModelExt, IntoRunnable, TValue, Tensor as TractTensor,
    TypedRunnableModel, tvec,
};

use super::plan::Plan;
use super::weights::Tensor;

/// A network in tract.
pub(super) struct TractPlan {
    shape: [usize; 4],
    plan: Arc<TypedRunnableModel>,
}

impl TractPlan {
    pub(super) fn new(mut onnx: &[u8], shape: [usize; 4]) -> Result<Self, String> {
        let plan = tract_onnx::onnx()
            .model_for_read(&mut onnx)
            .and_then(|model| model.with_input_fact(0, f32::fact(shape).into()))
            .and_then(|model| model.into_optimized()?.into_runnable())
            .map_err(|fault| format!("{fault:#}"))?;
        Ok(Self { shape, plan })
    }
}

impl Plan for TractPlan {
    fn run(&self, input: &[f32]) -> Result<Vec<Tensor>, String> {
        let failed = |fault: &dyn std::fmt::Display| format!("{fault:#}");
        let input = TractTensor::from_shape(&self.shape, input).map_err(|fault| failed(&fault))?;
        let outputs = self.plan.run(tvec!(TValue::from(input)));
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
}
