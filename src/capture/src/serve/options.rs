//! Where, for whom and within which limits the rig is served.

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
            limits: ClientLimits::default(),
            processing: None,
        }
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
