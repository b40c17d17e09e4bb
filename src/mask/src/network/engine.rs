//! Networks in tract: read, made ready, run.

use std::path::Path;
use std::sync::Arc;

use tract_onnx::pb::ModelProto;
use tract_onnx::prelude::{
    DatumType, Framework, InferenceFact, InferenceModel, InferenceModelExt, IntoRunnable, OutletId,
    TValue, TVec, Tensor, TractResult, TypedModel, TypedRunnableModel,
};
use tract_onnx::tract_core::internal::Node;
use tract_onnx::tract_hir::infer::Factoid;

use super::answer::Answer;
use super::guard::guarded;
use super::kind::{Input, Number, Signature};

/// A network that would need more memory at any time, with its weights, is refused, bytes.
const MAX_MEMORY: u64 = 8 << 30;

/// A file that was read.
#[derive(Debug)]
pub(super) struct File {
    model: InferenceModel,
    pub(super) signature: Signature,
    /// The names of the files that hold weights, as they are written.
    pub(super) weights: Vec<String>,
}

/// What an input gets.
#[derive(Debug, Clone)]
pub(super) enum Feed {
    /// Values of this shape, each time.
    Asked(Vec<usize>),
    /// Always the same.
    Fixed(Vec<usize>, Vec<f32>),
}

/// A network that is ready.
pub(super) struct Plan {
    inputs: Vec<(DatumType, Feed)>,
    plan: Arc<TypedRunnableModel>,
}

impl std::fmt::Debug for Plan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Plan").finish_non_exhaustive()
    }
}

impl File {
    pub(super) fn read(path: &Path) -> Result<Self, String> {
        guarded(|| {
            let onnx = tract_onnx::onnx();
            let proto = onnx.proto_model_for_path(path)?;
            let folder = path.parent().map(Path::to_string_lossy);
            let parsed = onnx.parse(&proto, folder.as_deref())?;
            Ok(Self {
                signature: signature(&parsed.model)?,
                model: parsed.model,
                weights: files_of_weights(&proto),
            })
        })
    }
}

impl Plan {
    /// Makes a network ready: what its inputs get, and which outputs are wanted.
    pub(super) fn new(file: &File, feeds: Vec<Feed>, outputs: &[usize]) -> Result<Self, String> {
        guarded(|| {
            let mut model = file.model.clone();
            let mut inputs = Vec::new();
            for (at, feed) in feeds.into_iter().enumerate() {
                let kind = model.input_fact(at)?.datum_type.concretize();
                let kind = kind.unwrap_or(DatumType::F32);
                let fact = match &feed {
                    Feed::Asked(shape) => InferenceFact::dt_shape(kind, shape.as_slice()),
                    Feed::Fixed(shape, values) => tensor(kind, shape, values)?.into(),
                };
                model.set_input_fact(at, fact)?;
                inputs.push((kind, feed));
            }
            let all = model.output_outlets()?.to_vec();
            let wanted: Vec<OutletId> = outputs.iter().map(|&at| all[at]).collect();
            model.select_output_outlets(&wanted)?;
            let typed = model.into_typed()?;
            check_memory(&typed)?;
            let plan = typed.into_optimized()?.into_runnable()?;
            Ok(Self { inputs, plan })
        })
    }

    /// The wanted answers to the values that are asked.
    pub(super) fn run(&self, asked: &[Vec<f32>]) -> Result<Vec<Answer>, String> {
        guarded(|| {
            let mut asked = asked.iter();
            let mut inputs = TVec::new();
            for (kind, feed) in &self.inputs {
                let value = match feed {
                    Feed::Asked(shape) => {
                        let values = asked.next().map(Vec::as_slice).unwrap_or_default();
                        tensor(*kind, shape, values)?
                    }
                    Feed::Fixed(shape, values) => tensor(*kind, shape, values)?,
                };
                inputs.push(TValue::from(value));
            }
            let outputs = self.plan.run(inputs)?;
            outputs.iter().map(answer).collect()
        })
    }
}

fn answer(output: &TValue) -> TractResult<Answer> {
    let output = output.cast_to::<f32>()?;
    let view = output.to_plain_array_view::<f32>()?;
    Ok(Answer {
        shape: view.shape().to_vec(),
        values: view.iter().copied().collect(),
    })
}

fn tensor(kind: DatumType, shape: &[usize], values: &[f32]) -> TractResult<Tensor> {
    let tensor = Tensor::from_shape(shape, values)?;
    Ok(tensor.cast_to_dt(kind)?.into_owned())
}

fn signature(model: &InferenceModel) -> TractResult<Signature> {
    let mut inputs = Vec::new();
    for (at, outlet) in model.input_outlets()?.iter().enumerate() {
        let fact = model.input_fact(at)?;
        let side = |side: Option<i64>| side.and_then(|side| usize::try_from(side).ok());
        let sides = fact.shape.dims().map(|dim| {
            let dim = dim.concretize();
            side(dim.and_then(|dim| dim.to_i64().ok()))
        });
        inputs.push(Input {
            name: model.node(outlet.node).name.clone(),
            number: match fact.datum_type.concretize() {
                Some(kind) if kind.is_float() => Number::Float,
                Some(kind) if kind.is_integer() => Number::Integer,
                _ => Number::Other,
            },
            sides: sides.collect(),
        });
    }
    let name = |outlet: &OutletId| {
        let label = model.outlet_label(*outlet);
        label.unwrap_or(&model.node(outlet.node).name).to_owned()
    };
    let outputs = model.output_outlets()?;
    Ok(Signature {
        inputs,
        ends_in_sigmoid: outputs
            .first()
            .is_some_and(|&outlet| ends_in_sigmoid(model, outlet)),
        outputs: outputs.iter().map(name).collect(),
    })
}

/// Whether a value comes out of a sigmoid, but for what changes its type or name.
fn ends_in_sigmoid(model: &InferenceModel, mut outlet: OutletId) -> bool {
    for _ in 0..model.nodes().len() {
        let node = model.node(outlet.node);
        let name = node.op.name().to_lowercase();
        if name.contains("sigmoid") {
            return true;
        }
        match node.inputs.first() {
            Some(&before) if name.contains("cast") || name.contains("identity") => outlet = before,
            _ => return false,
        }
    }
    false
}

fn files_of_weights(proto: &ModelProto) -> Vec<String> {
    let graph = proto.graph.as_ref();
    let nodes = graph.iter().flat_map(|graph| &graph.node);
    let attributes = nodes.flat_map(|node| &node.attribute);
    let tensors = graph.iter().flat_map(|graph| &graph.initializer);
    let tensors = tensors.chain(attributes.flat_map(|attribute| &attribute.t));
    let entries = tensors.flat_map(|tensor| &tensor.external_data);
    let places = entries.filter(|entry| entry.key == "location");
    let mut files: Vec<String> = places.map(|entry| entry.value.clone()).collect();
    files.sort();
    files.dedup();
    files
}

/// Refuses a network that needs too much memory, or whose sizes do not follow from its inputs.
fn check_memory(model: &TypedModel) -> TractResult<()> {
    type TypedNode = Node<tract_onnx::prelude::TypedFact, Box<dyn tract_onnx::prelude::TypedOp>>;
    let bytes = |node: &TypedNode| -> TractResult<u64> {
        let mut bytes = 0_u64;
        for output in &node.outputs {
            bytes = bytes.saturating_add(output.fact.mem_size().to_i64()?.unsigned_abs());
        }
        Ok(bytes)
    };
    let nodes = model.nodes().iter();
    let mut uses: Vec<usize> = nodes
        .map(|node| {
            node.outputs
                .iter()
                .map(|output| output.successors.len())
                .sum()
        })
        .collect();
    let mut live = 0_u64;
    for id in model.eval_order()? {
        let node = model.node(id);
        live = live.saturating_add(bytes(node)?);
        if live > MAX_MEMORY {
            return Err(std::io::Error::other(format!(
                "it needs more than {} GB of memory",
                MAX_MEMORY >> 30
            ))
            .into());
        }
        for input in &node.inputs {
            uses[input.node] = uses[input.node].saturating_sub(1);
            if uses[input.node] == 0 {
                live = live.saturating_sub(bytes(model.node(input.node))?);
            }
        }
    }
    Ok(())
}
