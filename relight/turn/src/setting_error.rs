//! A setting that cannot be.

/// A value beyond what may be given.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{what} is {value}: it has to be {allowed}")]
pub struct SettingError {
    /// Which setting.
    pub what: &'static str,
    /// What was given.
    pub value: f64,
    /// What may be given.
    pub allowed: &'static str,
}
