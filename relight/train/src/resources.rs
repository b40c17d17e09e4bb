//! What the machine gives a run.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use tch::Device;

/// Where and with how many threads.
#[derive(Debug, Clone)]
pub struct Resources {
    /// Where networks are computed.
    pub device: Device,
    /// Data-loader workers: threads that compose samples.
    pub workers: usize,
    /// Set to end a run early, also while its first samples are being composed.
    pub stop: Arc<AtomicBool>,
}
