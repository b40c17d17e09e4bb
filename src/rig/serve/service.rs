//! Telling the service manager (systemd's `Type=notify`) of the start, of being alive and of the end.
//!
//! The protocol is sd_notify(3): lines of `NAME=value` in a datagram to a Unix socket.

use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::Duration;

use super::{Announcement, ServeError};

/// The service manager's socket, as it gives it to the programs that it starts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ServiceManager {
    /// What stands in `NOTIFY_SOCKET`: a path, or `@` and an abstract name.
    pub socket: String,
    /// What stands in `WATCHDOG_USEC`: the service is restarted if it keeps silent so long.
    pub watchdog: Option<Duration>,
}

impl ServiceManager {
    fn tell(&self, lines: &str) -> io::Result<()> {
        let address = match self.socket.strip_prefix('@') {
            Some(name) => SocketAddr::from_abstract_name(name)?,
            None => SocketAddr::from_pathname(&self.socket)?,
        };
        let socket = UnixDatagram::unbound()?;
        // A manager that does not read must not hold the server up.
        socket.set_nonblocking(true)?;
        socket.send_to_addr(lines.as_bytes(), &address)?;
        Ok(())
    }

    /// Says that the service lives.
    pub(super) fn tell_alive(&self) {
        // Where this fails the manager hears nothing and does what it is there for.
        let _ = self.tell("WATCHDOG=1\n");
    }

    /// Says that the service ends.
    pub(super) fn tell_stopping(&self) {
        // The end comes whether the manager hears of it or not.
        let _ = self.tell("STOPPING=1\n");
    }
}

/// Says that clients can connect.
pub(super) fn tell_ready(
    manager: Option<&ServiceManager>,
    announcement: &Announcement,
) -> Result<(), ServeError> {
    let Some(manager) = manager else {
        return Ok(());
    };
    let lines = format!("READY=1\nSTATUS=Serving on {}\n", announcement.address);
    manager.tell(&lines).map_err(|source| ServeError::Service {
        socket: manager.socket.clone(),
        source,
    })
}
