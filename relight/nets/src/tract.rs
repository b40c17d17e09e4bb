//! Networks by tract, in pure Rust.

use std::sync::Arc;

use tract_onnx::prelude::{
    DatumExt, Framework, InferenceModelExt, IntoRunnable, TValue, Tensor as TractTensor,
    TractResult, TypedRunnableModel,
};

use super::plan::{GivenNumber, Plan};
use super::weights::Tensor;

/// A network in tract.
pub(super) struct TractPlan {
    shape: [usize; 4],
    /// What goes into each input; none for the picture.
    inputs: Vec<Option<TractTensor>>,
    plan: Arc<TypedRunnableModel>,
}

impl TractPlan {
    pub(super) fn new(
        onnx: &[u8],
        shape: [usize; 4],
        given: &[GivenNumber],
    ) -> Result<Self, String> {
        let plan = Self::prepared(onnx, shape, given).map_err(|fault| format!("{fault:#}"))?;
        if plan.inputs.contains(&None) {
            Ok(plan)
        } else {
            Err("it takes no picture".to_owned())
        }
    }

    fn prepared(mut onnx: &[u8], shape: [usize; 4], given: &[GivenNumber]) -> TractResult<Self> {
        let mut model = tract_onnx::onnx().model_for_read(&mut onnx)?;
        let mut inputs = Vec::new();
        for at in 0..model.input_outlets()?.len() {
            let node = model.input_outlets()?[at].node;
            let name = &model.node(node).name;
            let number = given.iter().find(|given| given.name == *name);
            let number = number.map(|given| TractTensor::from(given.value));
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
}

impl Plan for TractPlan {
    fn run(&self, input: &[f32]) -> Result<Vec<Tensor>, String> {
        let failed = |fault: &dyn std::fmt::Display| format!("{fault:#}");
        let input = TractTensor::from_shape(&self.shape, input).map_err(|fault| failed(&fault))?;
        let picture = TValue::from(input);
        let value = |given: &Option<TractTensor>| match given {
            Some(number) => TValue::from(number.clone()),
            None => picture.clone(),
        };
        let outputs = self.plan.run(self.inputs.iter().map(value).collect());
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
