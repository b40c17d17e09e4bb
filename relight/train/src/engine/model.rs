//! A network on tensors: its graph, computed node by node, with gradients.

use std::collections::BTreeMap;

use tch::{Device, Kind, Tensor, no_grad};

use crate::error::TrainError;
use crate::settings::ComputePrecision;
use relight_photo::nets::{EPSILON, Graph, Node, Operation, Weights, check_size};

/// A network that can be trained.
#[derive(Debug)]
pub struct Model {
    graph: Graph,
    parameters: BTreeMap<String, Tensor>,
    device: Device,
    precision: ComputePrecision,
}

impl Model {
    /// A network with these weights on a device.
    ///
    /// # Errors
    /// What [`Weights::fitted_to`] answers, or [`TrainError::Torch`].
    pub fn new(
        graph: Graph,
        weights: &Weights,
        device: Device,
        precision: ComputePrecision,
    ) -> Result<Self, TrainError> {
        let mut parameters = BTreeMap::new();
        for (name, tensor) in weights.fitted_to(&graph)?.iter() {
            let shape: Vec<i64> = tensor.shape().iter().map(|&side| side as i64).collect();
            let tensor = Tensor::f_from_slice(tensor.values())?
                .f_reshape(shape)?
                .f_to_device(device)?
                .f_to_kind(precision.kind())?;
            let tensor = channels_last(&tensor)?.f_set_requires_grad(true)?;
            parameters.insert(name.to_owned(), tensor);
        }
        Ok(Self {
            graph,
            parameters,
            device,
            precision,
        })
    }

    /// What it computes.
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// Its parameters by name, sorted. They share their numbers with the network's.
    pub fn parameters(&self) -> &BTreeMap<String, Tensor> {
        &self.parameters
    }

    /// In which precision its layers are computed.
    pub fn precision(&self) -> ComputePrecision {
        self.precision
    }

    /// Whether gradients are wanted of its parameters: no for a network that another is trained on.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn set_trainable(&mut self, trainable: bool) -> Result<(), TrainError> {
        for parameter in self.parameters.values_mut() {
            *parameter = parameter.f_set_requires_grad(trainable)?;
        }
        Ok(())
    }

    /// Adds 0 to the gradient of every parameter, so that all have one.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub(crate) fn add_zero_gradients(&self) -> Result<(), TrainError> {
        for parameter in self.parameters.values() {
            parameter.f_sum(None)?.f_mul_scalar(0.0)?.f_backward()?;
        }
        Ok(())
    }

    /// Moves its weights by a part of the way to those of the same network.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub(crate) fn approach(&mut self, other: &Self, part: f64) -> Result<(), TrainError> {
        no_grad(|| {
            for (own, other) in self.parameters.values_mut().zip(other.parameters.values()) {
                let _ = own.f_lerp_(other, part)?;
            }
            Ok(())
        })
    }

    /// Takes over weights.
    ///
    /// # Errors
    /// [`TrainError::Refused`] if they are another network's.
    pub fn load_state(&mut self, weights: &Weights) -> Result<(), TrainError> {
        copy_into(&mut self.parameters, weights)
    }

    /// A copy of its weights.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn weights(&self) -> Result<Weights, TrainError> {
        to_weights(&self.parameters)
    }

    /// The outputs for a batch of pictures (`batch x channels x height x width`), in the graph's order, of the
    /// precision's [`ComputePrecision::kind`].
    ///
    /// # Errors
    /// [`relight_photo::nets::NetError`] or [`TrainError::Torch`].
    pub fn forward(&self, input: &Tensor) -> Result<Vec<Tensor>, TrainError> {
        let size = input.size();
        if let &[_, _, height, width] = size.as_slice() {
            check_size(&self.graph, (width as usize, height as usize))?;
        }
        let mut values: Vec<Tensor> = Vec::with_capacity(self.graph.nodes().len());
        for node in self.graph.nodes() {
            let value = match node.operation {
                Operation::Input => self.begin(input)?,
                _ => {
                    let inputs = node.inputs.iter().map(|value| &values[value.index()]);
                    self.compute(node, &inputs.collect::<Vec<_>>())?
                }
            };
            values.push(value);
        }
        let outputs = self.graph.outputs().iter();
        outputs
            .map(|output| Ok(values[output.value.index()].f_to_kind(self.precision.kind())?))
            .collect()
    }

    fn begin(&self, input: &Tensor) -> Result<Tensor, TrainError> {
        let input = input.f_to_device(self.device)?;
        Ok(channels_last(&self.cast(&input)?)?)
    }

    fn cast(&self, tensor: &Tensor) -> Result<Tensor, tch::TchError> {
        tensor.f_to_kind(match self.precision {
            ComputePrecision::Single => Kind::Float,
            ComputePrecision::Mixed => Kind::BFloat16,
            ComputePrecision::Double => Kind::Double,
        })
    }

    /// The parameters `<name>.weight` and `<name>.bias`, in the precision of layers.
    fn layer(&self, name: &str) -> Result<(Tensor, Tensor), TrainError> {
        let part = |part: &str| {
            let name = format!("{name}.{part}");
            let parameter = self.parameters.get(&name);
            let missing = || relight_photo::nets::NetError::missing(self.graph.name(), &name);
            Ok::<_, TrainError>(self.cast(parameter.ok_or_else(missing)?)?)
        };
        Ok((part("weight")?, part("bias")?))
    }

    fn compute(&self, node: &Node, inputs: &[&Tensor]) -> Result<Tensor, TrainError> {
        let of = inputs[0];
        Ok(match &node.operation {
            Operation::Input => of.shallow_clone(),
            Operation::Convolution {
                name,
                kernel,
                stride,
            } => {
                let (weight, bias) = self.layer(name)?;
                let (padding, stride) = (*kernel as i64 / 2, *stride as i64);
                of.f_conv2d(&weight, Some(&bias), [stride; 2], [padding; 2], [1; 2], 1)?
            }
            Operation::GroupNorm { name, groups } => {
                let layer = name.as_ref().map(|name| self.layer(name)).transpose()?;
                let (weight, bias) = match &layer {
                    Some((weight, bias)) => (Some(weight), Some(bias)),
                    None => (None, None),
                };
                of.f_group_norm(*groups as i64, weight, bias, f64::from(EPSILON), false)?
            }
            Operation::Relu => of.f_relu()?,
            Operation::Tanh => of.f_tanh()?,
            Operation::Add => of.f_add(inputs[1])?,
            Operation::Concatenate => Tensor::f_cat(inputs, 1)?,
            Operation::Upsample { align_corners } => {
                let size = of.size();
                let twice = [2 * size[2], 2 * size[3]];
                of.f_upsample_bilinear2d(twice, *align_corners, None, None)?
            }
            Operation::PixelUnshuffle { factor } => of.f_pixel_unshuffle(*factor as i64)?,
            Operation::PixelShuffle { factor } => of.f_pixel_shuffle(*factor as i64)?,
            Operation::MeanPool => of.f_mean_dim([2_i64, 3].as_slice(), false, None)?,
            Operation::MaxPool => of.f_amax([2_i64, 3], false)?,
            Operation::Linear { name } => {
                let (weight, bias) = self.layer(name)?;
                of.f_linear(&weight, Some(&bias))?
            }
        })
    }
}

/// The same tensor with the channels of a pixel beside each other in memory, where it is a picture or a kernel:
/// convolutions and normalisations of groups take less time on it (1.15 times on one core), and what follows
/// keeps that order.
fn channels_last(tensor: &Tensor) -> Result<Tensor, tch::TchError> {
    if tensor.dim() != 4 {
        return Ok(tensor.shallow_clone());
    }
    tensor
        .f_permute([0, 2, 3, 1])?
        .f_contiguous()?
        .f_permute([0, 3, 1, 2])
}

/// Copies saved numbers into tensors of the same names and shapes.
///
/// # Errors
/// [`TrainError::Refused`] if one is missing or has another shape.
pub(crate) fn copy_into(
    tensors: &mut BTreeMap<String, Tensor>,
    saved: &Weights,
) -> Result<(), TrainError> {
    no_grad(|| {
        for (name, tensor) in tensors {
            let missing = || TrainError::no_memory(name);
            let saved = saved.get(name).ok_or_else(missing)?;
            let shape: Vec<i64> = saved.shape().iter().map(|&side| side as i64).collect();
            if shape != tensor.size() {
                return Err(missing());
            }
            let saved = Tensor::f_from_slice(saved.values())?.f_reshape(shape)?;
            tensor.f_copy_(&saved)?;
        }
        Ok(())
    })
}

/// Tensors of any device as weights, which have 32 bits.
///
/// # Errors
/// [`TrainError::Torch`].
pub(crate) fn to_weights(tensors: &BTreeMap<String, Tensor>) -> Result<Weights, TrainError> {
    let weights = tensors.iter().filter_map(|(name, tensor)| {
        let flat = tensor.f_detach().and_then(|tensor| {
            tensor
                .f_to_device(Device::Cpu)?
                .f_to_kind(Kind::Float)?
                .f_contiguous()?
                .f_reshape([-1])
        });
        let values = flat.and_then(|flat| {
            let mut values = vec![0.0_f32; flat.numel()];
            let count = values.len();
            flat.f_copy_data(&mut values, count)?;
            Ok(values)
        });
        match values {
            Ok(values) => {
                let shape = tensor.size().iter().map(|&side| side as usize).collect();
                let tensor = relight_photo::nets::Tensor::new(shape, values)?;
                Some(Ok((name.clone(), tensor)))
            }
            Err(error) => Some(Err(TrainError::from(error))),
        }
    });
    weights.collect()
}
