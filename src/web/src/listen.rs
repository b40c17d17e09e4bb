//! Taking connections: so many at once, each with its time limits.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
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

async fn accept(
    listener: TcpListener,
    router: Router,
    limits: ConnectionLimits,
    connections: &Arc<Semaphore>,
    shutdown: &Shutdown,
) {
    loop {
        // Without a permit the next client waits in the system's queue.
        let Ok(permit) = connections.clone().acquire_owned().await else {
            return;
        };
        let Ok((socket, _)) = listener.accept().await else {
            sleep(PAUSE).await;
            continue;
        };
        let connection = converse(socket, router.clone(), limits, shutdown.clone());
        tokio::spawn(async move {
            connection.await;
            drop(permit);
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
