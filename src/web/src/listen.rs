//! Taking connections: so many at once, each with its time limits.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use axum::{Extension, Router};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};
use tokio_io_timeout::TimeoutWriter;

/// Asks a server to end, from any thread. Copies ask the same server.
pub use tokio_util::sync::CancellationToken as Shutdown;

use crate::access::{AccessPolicy, LocalAddress};
use crate::address::Announcement;
use crate::token::Token;

/// Time that running requests get when the server ends.
const GRACE: Duration = Duration::from_secs(1);
/// Threads of a server that carry requests; work has its own.
const THREADS: usize = 2;
/// Header lines of a request.
const MAX_HEADERS: usize = 64;
/// Bytes of a request's head, and of an answer that wait to be sent beyond the piece at hand.
const BUFFER: usize = 64 * 1024;
/// Pause after the system refused a connection, mostly for want of file descriptors.
const PAUSE: Duration = Duration::from_millis(100);

/// What all connections together, and each of them, may take up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConnectionLimits {
    /// Connections at once; further ones wait to be accepted.
    pub connections: usize,
    /// Connections from one address at once; further ones are closed.
    pub per_address: usize,
    /// Time in which the first byte has to come after connecting.
    pub first_byte: Duration,
    /// Time in which a request's head has to come, and how long a connection may lie idle.
    pub head: Duration,
    /// Longest time in which a client takes not a single byte of an answer.
    pub stall: Duration,
}

impl Default for ConnectionLimits {
    fn default() -> Self {
        Self {
            connections: 256,
            per_address: 128,
            first_byte: Duration::from_secs(2),
            head: Duration::from_secs(10),
            stall: Duration::from_secs(20),
        }
    }
}

/// A page, and where and for whom it is served.
pub struct PageServer {
    /// The address; its port may be 0 for any free one.
    pub address: SocketAddr,
    /// What clients have to know. Without one, a random one is made if other machines can reach the address.
    pub token: Option<Token>,
    /// The names by which the machine is known.
    pub names: Vec<String>,
    /// Paths that need no token.
    pub open_paths: Vec<&'static str>,
    /// What connections may take up.
    pub limits: ConnectionLimits,
    /// Changes the server's threads from the usual ones.
    pub threads: fn(&mut tokio::runtime::Builder),
}

impl PageServer {
    /// Serves the page from its own threads until `shutdown` is cancelled. Requests carry a [`LocalAddress`]. `announce`
    /// is called once, on this thread and within the server's runtime, when a browser can connect.
    ///
    /// # Errors
    /// If the address cannot be listened on, or the system has no randomness or no threads.
    pub fn serve(
        self,
        router: impl FnOnce(Arc<AccessPolicy>) -> Router,
        announce: impl FnOnce(&Announcement),
        shutdown: &Shutdown,
    ) -> io::Result<()> {
        let listener = std::net::TcpListener::bind(self.address)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let token = match self.token {
            None if !address.ip().is_loopback() => Some(Token::random()?),
            given => given,
        };
        let announcement = Announcement::new(address, &self.names, token.as_ref());
        let policy = AccessPolicy::new(address.port(), token, self.names, self.open_paths);
        let router = router(Arc::new(policy));
        let mut runtime = tokio::runtime::Builder::new_multi_thread();
        runtime.worker_threads(THREADS).thread_name("relit-http");
        (self.threads)(&mut runtime);
        let runtime = runtime.enable_io().enable_time().build()?;
        let served = runtime.block_on(async {
            let listener = TcpListener::from_std(listener)?;
            announce(&announcement);
            run(listener, router, self.limits, shutdown).await;
            Ok(())
        });
        runtime.shutdown_timeout(GRACE);
        served
    }
}

/// Serves a page with the usual limits and threads: [`PageServer::serve`].
///
/// # Errors
/// As there.
pub fn serve_page(
    address: SocketAddr,
    token: Option<Token>,
    names: Vec<String>,
    open_paths: &[&'static str],
    router: impl FnOnce(Arc<AccessPolicy>) -> Router,
    announce: impl FnOnce(&Announcement),
    shutdown: &Shutdown,
) -> io::Result<()> {
    let server = PageServer {
        address,
        token,
        names,
        open_paths: open_paths.to_vec(),
        limits: ConnectionLimits::default(),
        threads: |_| {},
    };
    server.serve(router, announce, shutdown)
}

/// Takes connections until `shutdown` is cancelled.
async fn run(listener: TcpListener, router: Router, limits: ConnectionLimits, shutdown: &Shutdown) {
    // Each connection holds a permit while it is open.
    let connections = Arc::new(Semaphore::new(limits.connections));
    let accepting = accept(listener, router, limits, &connections, shutdown);
    shutdown.run_until_cancelled(accepting).await;
    let all = u32::try_from(limits.connections).unwrap_or(u32::MAX);
    // Who is not ready by then is cut off.
    let _ = timeout(GRACE, connections.acquire_many(all)).await;
}

/// Connections by address: one client cannot take all of them.
#[derive(Debug, Default)]
struct Guests(Mutex<HashMap<IpAddr, usize>>);

/// One connection; ends with it.
struct Guest {
    guests: Arc<Guests>,
    address: IpAddr,
}

impl Guests {
    /// `None` where the address has so many connections already.
    fn admit(guests: &Arc<Self>, address: IpAddr, most: usize) -> Option<Guest> {
        let mut counts = guests.lock();
        let count = counts.entry(address).or_default();
        if *count >= most {
            return None;
        }
        *count += 1;
        drop(counts);
        Some(Guest {
            guests: Arc::clone(guests),
            address,
        })
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<IpAddr, usize>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Guest {
    fn drop(&mut self) {
        if let Entry::Occupied(mut count) = self.guests.lock().entry(self.address) {
            *count.get_mut() -= 1;
            if *count.get() == 0 {
                count.remove();
            }
        }
    }
}

async fn accept(
    listener: TcpListener,
    router: Router,
    limits: ConnectionLimits,
    connections: &Arc<Semaphore>,
    shutdown: &Shutdown,
) {
    let guests = Arc::new(Guests::default());
    loop {
        // Without a permit the next client waits in the system's queue.
        let Ok(permit) = connections.clone().acquire_owned().await else {
            return;
        };
        let Ok((socket, peer)) = listener.accept().await else {
            sleep(PAUSE).await;
            continue;
        };
        let address = peer.ip().to_canonical();
        let Some(guest) = Guests::admit(&guests, address, limits.per_address) else {
            continue;
        };
        let connection = converse(socket, router.clone(), limits, shutdown.clone());
        tokio::spawn(async move {
            connection.await;
            drop((guest, permit));
        });
    }
}

async fn converse(socket: TcpStream, router: Router, limits: ConnectionLimits, shutdown: Shutdown) {
    let Ok(local) = socket.local_addr() else {
        return;
    };
    let mut first = [0];
    let began = timeout(limits.first_byte, socket.peek(&mut first));
    if !matches!(shutdown.run_until_cancelled(began).await, Some(Ok(Ok(1)))) {
        return;
    }
    // Events are small and wanted at once. A socket that refuses is slower, not wrong.
    let _ = socket.set_nodelay(true);
    // A phone that lost its network would keep its permits for many minutes otherwise.
    let mut stream = TimeoutWriter::new(socket);
    stream.set_timeout(Some(limits.stall));
    let router = router.layer(Extension(LocalAddress(local.ip())));
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(limits.head)
        .max_headers(MAX_HEADERS)
        .max_buf_size(BUFFER)
        .serve_connection(
            TokioIo::new(Box::pin(stream)),
            TowerToHyperService::new(router),
        );
    tokio::pin!(connection);
    // What goes wrong on a connection is its client's trouble: it ends.
    if shutdown
        .run_until_cancelled(connection.as_mut())
        .await
        .is_none()
    {
        connection.as_mut().graceful_shutdown();
        let _ = connection.await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_address_has_so_many_connections_and_no_other_address_fewer_for_it() {
        let guests = Arc::new(Guests::default());
        let admit = |address: &str| Guests::admit(&guests, address.parse().unwrap(), 2);
        let first = admit("192.0.2.7");
        let second = admit("192.0.2.7");
        assert!(first.is_some() && second.is_some());
        assert!(admit("192.0.2.7").is_none());
        assert!(admit("192.0.2.8").is_some());
        drop(second);
        assert!(admit("192.0.2.7").is_some());
        drop(first);
        assert!(guests.lock().is_empty());
    }
}
