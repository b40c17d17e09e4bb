//! What each loss of the network of photographs counts: `[loss]`.

/// What each loss counts.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DecomposeLossCoefficients {
    /// Scale-invariant errors of shading and albedo.
    pub whole: f64,
    /// Scale-invariant error of the picture over the shading, against albedo, in parts of the others.
    pub quotient: f64,
    /// The same errors in windows.
    pub windows: f64,
    /// Steps from pixel to pixel of log shading and log albedo.
    pub gradient: f64,
    /// Distance of the normals.
    pub normals: f64,
    /// Mean error of the highlights.
    pub highlight: f64,
    /// Energy of the highlights' error, as a part of their energy.
    pub highlight_energy: f64,
    /// Cross entropy of what is paint of a pixel's darkness.
    pub paint: f64,
    /// Distance of the light.
    pub light: f64,
}

impl Default for DecomposeLossCoefficients {
    fn default() -> Self {
        Self {
            whole: 1.0,
            quotient: 0.5,
            windows: 0.5,
            gradient: 0.2,
            normals: 1.0,
            highlight: 1.0,
            highlight_energy: 0.2,
            paint: 0.1,
            light: 0.1,
        }
    }
}
