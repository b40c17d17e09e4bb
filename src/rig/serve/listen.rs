//! Taking connections: so many at once, each with its time limits.

use std::time::Duration;

use axum::{Extension, Router};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{sleep, timeout};
use tokio_io_timeout::TimeoutWriter;

use super::access::Local;
use super::options::{ClientLimits, Shutdown};
use super::routes::{App, router};

/// Time that running requests get when the server ends.
pub(super) const GRACE: Duration = Duration::from_secs(1);
/// Header lines of a request.
const MOST_HEADERS: usize = 64;
/// Bytes of a request's head, and of an answer that wait to be sent beyond the piece at hand.
const BUFFER: usize = 64 * 1024;
/// Pause after the system refused a connection, mostly for want of file descriptors.
const PAUSE: Duration = Duration::from_millis(100);

/// Serves until the server is asked to end.
pub(super) async fn run(listener: TcpListener, app: &App) {
    let accepting = accept(listener, app);
    app.shutdown.run_until_cancelled(accepting).await;
    let all = u32::try_from(app.limits.connections).unwrap_or(u32::MAX);
    // Who is not ready by then is cut off.
    let _ = timeout(GRACE, app.permits.connections.acquire_many(all)).await;
}

async fn accept(listener: TcpListener, app: &App) {
    let router = router(app);
    loop {
        // Without a permit the next client waits in the system's queue.
        let Ok(permit) = app.permits.connections.clone().acquire_owned().await else {
            return;
        };
        let Ok((socket, _)) = listener.accept().await else {
            sleep(PAUSE).await;
            continue;
        };
        let connection = converse(socket, router.clone(), app.limits, app.shutdown.clone());
        tokio::spawn(async move {
            connection.await;
            drop(permit);
        });
    }
}

async fn converse(socket: TcpStream, router: Router, limits: ClientLimits, shutdown: Shutdown) {
    let Ok(local) = socket.local_addr() else {
        return;
    };
    // Events are small and wanted at once. A socket that refuses is slower, not wrong.
    let _ = socket.set_nodelay(true);
    // A phone that lost its network would keep its permits for many minutes otherwise.
    let mut stream = TimeoutWriter::new(socket);
    stream.set_timeout(Some(limits.stall));
    let router = router.layer(Extension(Local(local.ip())));
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(limits.head)
        .max_headers(MOST_HEADERS)
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
