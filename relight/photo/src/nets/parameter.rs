//! A parameter that a graph needs: name, shape and purpose, without numbers.

/// What a parameter is for, and so how it begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The weight of a convolution or of a fully connected layer.
    Weight,
    /// An offset.
    Bias,
    /// A normalisation's factor.
    Gain,
}

/// A parameter that a graph needs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parameter {
    /// Its name, as in a PyTorch state dict.
    pub name: String,
    /// Its shape; a weight's first number is the outputs.
    pub shape: Vec<usize>,
    /// What it is for.
    pub role: Role,
}

impl Parameter {
    /// How many numbers it has.
    #[must_use]
    pub fn count(&self) -> usize {
        self.shape.iter().product()
    }

    /// Inputs that go into one output.
    #[must_use]
    pub fn fan_in(&self) -> usize {
        self.shape.iter().skip(1).product()
    }
}
