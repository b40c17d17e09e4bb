//! Where, for whom and within which limits the rig is served.

use std::fmt;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use relit_web::{ConnectionLimits, Token};

use crate::processing::Processing;

/// Where and for whom the rig is served.
#[derive(Debug)]
pub struct ServeOptions {
    /// The address to listen on; port 0 takes any free one.
    pub address: SocketAddr,
    /// What a client has to know. Where it is `None`, an address that other machines can reach gets a
    /// random one, and a loopback address none.
    pub token: Option<Token>,
    /// Names, without port, under which clients reach this machine besides its addresses, such as
    /// `rig.local`. The first one stands in the announced URL.
    pub names: Vec<String>,
    /// Called all the time while the server is alive.
    pub heartbeat: Option<Heartbeat>,
    /// What clients may take up.
    pub limits: ClientLimits,
    /// What makes masks and data sets of the sessions, where that is done here.
    pub processing: Option<Arc<Processing>>,
}

impl ServeOptions {
    /// Options for an address, and nothing else asked for.
    pub fn at(address: SocketAddr) -> Self {
        Self {
            address,
            token: None,
            names: Vec::new(),
            heartbeat: None,
            limits: ClientLimits::default(),
            processing: None,
        }
    }
}

/// How a supervisor, such as the service manager, learns that the server is alive.
pub struct Heartbeat {
    /// Time between two beats.
    pub period: Duration,
    /// Called while requests are worked on, the rig's state can be read, and the
    /// [rig runs](crate::command::Rig::is_running); dropped when that is over.
    pub beat: Box<dyn Fn() + Send + Sync>,
}

impl fmt::Debug for Heartbeat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut heartbeat = f.debug_struct("Heartbeat");
        heartbeat
            .field("period", &self.period)
            .finish_non_exhaustive()
    }
}

/// What all clients together may take up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClientLimits {
    /// Their connections, whatever is requested on them.
    pub connections: ConnectionLimits,
    /// Requests for the preview at once.
    pub viewers: usize,
    /// Subscribers to the events at once.
    pub subscribers: usize,
    /// Time in which a request's body has to come.
    pub body: Duration,
}

impl Default for ClientLimits {
    fn default() -> Self {
        Self {
            connections: ConnectionLimits::default(),
            viewers: 16,
            subscribers: 32,
            body: Duration::from_secs(10),
        }
    }
}
