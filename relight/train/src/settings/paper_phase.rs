//! The phases of the paper's training.

/// A phase of the paper's training.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PaperPhase {
    /// Spec-Net.
    Spec,
    /// Normal-Net's warm-up.
    Normal,
    /// Light-Net, with Normal-Net as it is.
    Light,
    /// Normal-Net, with Light-Net as it is.
    Joint,
    /// Specular reflectance and smoothness.
    Specular,
}

impl PaperPhase {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Spec => "spec",
            Self::Normal => "normal",
            Self::Light => "light",
            Self::Joint => "joint",
            Self::Specular => "specular",
        }
    }

    /// The learning rate where settings name none: the paper's, 1e-6 in both rounds of joint training (`light` and `joint`)
    /// and 1e-4 for what is trained apart.
    pub fn default_learning_rate(self) -> f64 {
        match self {
            Self::Light | Self::Joint => 1e-6,
            Self::Spec | Self::Normal | Self::Specular => 1e-4,
        }
    }

    /// Whether there are figures of how well it does on turns.
    pub fn validates_on_turns(self) -> bool {
        matches!(self, Self::Spec | Self::Light | Self::Joint)
    }

    /// Whether turns teach it anything.
    pub fn uses_turns(self) -> bool {
        self != Self::Normal
    }

    /// Whether it cannot do without turns.
    pub fn needs_turns(self) -> bool {
        matches!(self, Self::Light | Self::Joint | Self::Specular)
    }
}
