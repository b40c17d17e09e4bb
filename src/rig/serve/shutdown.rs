//! Asking the server to end, from any thread.

use std::sync::Arc;

use tokio::sync::watch;

/// Asks a server to end. Copies ask the same server.
#[derive(Debug, Clone)]
pub struct Shutdown {
    asked: Arc<watch::Sender<bool>>,
}

impl Default for Shutdown {
    fn default() -> Self {
        Self {
            asked: Arc::new(watch::Sender::new(false)),
        }
    }
}

impl Shutdown {
    /// Nothing is asked yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the server to end; it does so within a few seconds. Does not wait.
    pub fn request(&self) {
        self.asked.send_replace(true);
    }

    /// Ends once it was asked for.
    pub(super) async fn requested(&self) {
        // The sender lives as long as `self`: waiting cannot fail.
        let _ = self.asked.subscribe().wait_for(|&asked| asked).await;
    }
}
