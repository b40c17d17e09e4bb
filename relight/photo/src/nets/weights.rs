//! The numbers of a network: named tensors, checked against the graph that they are for.

use std::collections::BTreeMap;

use super::error::NetError;
use super::graph::{Graph, Parameter, Role};

/// Numbers with a shape, in row-major order.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensor {
    shape: Vec<usize>,
    values: Vec<f32>,
}

impl Tensor {
    /// A tensor of these values; `None` if their number does not match the shape.
    pub fn new(shape: Vec<usize>, values: Vec<f32>) -> Option<Self> {
        let count = shape
            .iter()
            .try_fold(1_usize, |count, &side| count.checked_mul(side))?;
        (count == values.len()).then_some(Self { shape, values })
    }

    /// Its shape.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Its values, row-major.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The values themselves.
    pub fn into_values(self) -> Vec<f32> {
        self.values
    }
}

/// Named tensors: a state dict.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Weights {
    tensors: BTreeMap<String, Tensor>,
}

impl FromIterator<(String, Tensor)> for Weights {
    fn from_iter<I: IntoIterator<Item = (String, Tensor)>>(tensors: I) -> Self {
        Self {
            tensors: tensors.into_iter().collect(),
        }
    }
}

impl IntoIterator for Weights {
    type Item = (String, Tensor);
    type IntoIter = std::collections::btree_map::IntoIter<String, Tensor>;

    fn into_iter(self) -> Self::IntoIter {
        self.tensors.into_iter()
    }
}

impl Weights {
    /// The tensor of this name.
    pub fn get(&self, name: &str) -> Option<&Tensor> {
        self.tensors.get(name)
    }

    /// All tensors by name, sorted.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Tensor)> {
        self.tensors
            .iter()
            .map(|(name, tensor)| (name.as_str(), tensor))
    }

    /// The tensors whose names begin with `prefix`, without it: one network of several in a file.
    pub fn under(&self, prefix: &str) -> Self {
        self.tensors
            .iter()
            .filter_map(|(name, tensor)| {
                Some((name.strip_prefix(prefix)?.to_owned(), tensor.clone()))
            })
            .collect()
    }

    /// The same with `prefix` before all names: one network of several in a file.
    pub fn prefixed(self, prefix: &str) -> Self {
        let tensors = self.tensors.into_iter();
        tensors
            .map(|(name, tensor)| (format!("{prefix}{name}"), tensor))
            .collect()
    }

    /// The weights of a graph out of these, whatever wraps their names: PyTorch puts `module.`
    /// before every name of a network that ran on several devices.
    ///
    /// # Errors
    /// If they do not, with the parameter's name.
    pub fn fitted_to(&self, graph: &Graph) -> Result<Self, NetError> {
        let all_wrapped = self.tensors.keys().all(|name| name.starts_with("module."));
        let mut given = if all_wrapped {
            self.under("module.").tensors
        } else {
            self.tensors.clone()
        };
        let mut tensors = BTreeMap::new();
        for parameter in graph.parameters() {
            let name = parameter.name;
            let tensor = given
                .remove(&name)
                .ok_or_else(|| NetError::missing(graph.name(), &name))?;
            if tensor.shape != parameter.shape {
                return Err(NetError::Other(format!(
                    "{name} is of shape {:?} where {} needs {:?}: are they another network's weights?",
                    tensor.shape,
                    graph.name(),
                    parameter.shape
                )));
            }
            if !tensor.values.iter().all(|value| value.is_finite()) {
                return Err(NetError::Other(format!(
                    "{name} holds a value that is not a finite number: the training that made it failed"
                )));
            }
            tensors.insert(name, tensor);
        }
        match given.into_keys().next() {
            Some(name) => Err(NetError::Other(format!(
                "the weights hold {name}, which {} does not have: are they another network's?",
                graph.name()
            ))),
            None => Ok(Self { tensors }),
        }
    }

    /// Weights to begin training with: those of layers normal with variance `2 / fan_in` (He et al.
    /// 2015, for layers before a ReLU), gains 1, offsets 0. The same seed gives the same weights.
    pub fn initial(graph: &Graph, seed: u64) -> Self {
        let parameters = graph.parameters().into_iter().enumerate();
        let tensor = |(at, parameter): (usize, Parameter)| {
            let count = parameter.count();
            let values = match parameter.role {
                Role::Gain => vec![1.0; count],
                Role::Bias => vec![0.0; count],
                Role::Weight => {
                    let spread = (2.0 / parameter.fan_in() as f64).sqrt();
                    normal_numbers(seed, at as u64, count, spread)
                }
            };
            let Parameter { name, shape, .. } = parameter;
            (name, Tensor { shape, values })
        };
        parameters.map(tensor).collect()
    }
}

impl Weights {
    /// The same without weights whose names begin with this: for a network with a head less.
    pub fn without(&self, prefix: &str) -> Self {
        let named = |name: &str| name.trim_start_matches("module.").starts_with(prefix);
        let others = self.iter().filter(|(name, _)| !named(name));
        others
            .map(|(name, tensor)| (name.to_owned(), tensor.clone()))
            .collect()
    }
}

/// Normal numbers of mean 0 by Box and Muller's transform.
fn normal_numbers(seed: u64, stream: u64, count: usize, spread: f64) -> Vec<f32> {
    let mut state = Random(seed.wrapping_add(stream.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    let mut values = Vec::with_capacity(count + 1);
    while values.len() < count {
        let radius = (-2.0 * (1.0 - state.next_unit()).ln()).sqrt() * spread;
        let angle = std::f64::consts::TAU * state.next_unit();
        values.push((radius * angle.cos()) as f32);
        values.push((radius * angle.sin()) as f32);
    }
    values.truncate(count);
    values
}

/// SplitMix64 (Steele, Lea and Flood, 2014): enough for numbers that only have to differ.
struct Random(u64);

impl Random {
    /// A number of [0, 1).
    fn next_unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::super::paper::normal_net;
    use super::*;

    #[test]
    fn initial_weights_fit_their_graph_and_follow_the_seed() {
        let graph = normal_net();
        let weights = Weights::initial(&graph, 7);
        assert_eq!(weights.fitted_to(&graph).unwrap(), weights);
        assert_eq!(Weights::initial(&graph, 7), weights);
        assert_ne!(Weights::initial(&graph, 8), weights);
        let middle = weights.get("mid.3.weight").unwrap();
        let mean_square =
            middle.values().iter().map(|v| v * v).sum::<f32>() / middle.values().len() as f32;
        assert!((mean_square * (256.0 * 9.0) / 2.0 - 1.0).abs() < 0.02);
    }

    #[test]
    fn names_of_several_devices_fit_too() {
        let graph = normal_net();
        let weights = Weights::initial(&graph, 7);
        let wrapped: Weights = weights
            .iter()
            .map(|(name, tensor)| (format!("module.{name}"), tensor.clone()))
            .collect();
        assert_eq!(wrapped.fitted_to(&graph).unwrap(), weights);
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let graph = normal_net();
        let fault = |weights: &Weights| weights.fitted_to(&graph).unwrap_err().to_string();
        let mut weights = Weights::initial(&graph, 7);
        weights.tensors.remove("mid.0.bias");
        assert!(fault(&weights).contains("mid.0.bias"));
        let mut bias = |values: Vec<f32>| {
            let tensor = Tensor::new(vec![values.len()], values).unwrap();
            weights.tensors.insert("mid.0.bias".to_owned(), tensor);
            fault(&weights)
        };
        assert!(bias(vec![0.0]).contains("[1]"));
        assert!(bias(vec![f32::NAN; 256]).contains("mid.0.bias"));
        let mut weights = Weights::initial(&graph, 7);
        let more = Tensor::new(vec![0], vec![]).unwrap();
        weights.tensors.insert("fc.weight".to_owned(), more);
        assert!(fault(&weights).contains("fc.weight"));
    }
}
