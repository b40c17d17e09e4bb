//! How long something took: by the page's clock in a browser, where the library has none, and by the system's elsewhere.

/// A moment.
pub(crate) struct Moment {
    #[cfg(not(target_arch = "wasm32"))]
    at: std::time::Instant,
    #[cfg(target_arch = "wasm32")]
    at: f64,
}

#[cfg(not(target_arch = "wasm32"))]
impl Moment {
    pub(crate) fn now() -> Self {
        Self {
            at: std::time::Instant::now(),
        }
    }

    /// Seconds since then.
    pub(crate) fn seconds(&self) -> f64 {
        self.at.elapsed().as_secs_f64()
    }
}

#[cfg(target_arch = "wasm32")]
impl Moment {
    pub(crate) fn now() -> Self {
        Self {
            at: crate::browser::milliseconds(),
        }
    }

    /// Seconds since then.
    pub(crate) fn seconds(&self) -> f64 {
        (crate::browser::milliseconds() - self.at) / 1000.0
    }
}
