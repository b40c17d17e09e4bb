//! How long something took: by the page's clock in a browser, where the library has none, and by the system's elsewhere.

/// What the page's worker gives the engine.
#[cfg(target_arch = "wasm32")]
#[allow(unsafe_code, reason = "a function of the page")]
mod page {
    #[link(wasm_import_module = "env")]
    unsafe extern "C" {
        /// The page's clock, milliseconds.
        pub(super) safe fn relight_now() -> f64;
    }
}

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
            at: page::relight_now(),
        }
    }

    /// Seconds since then.
    pub(crate) fn seconds(&self) -> f64 {
        (page::relight_now() - self.at) / 1000.0
    }
}
