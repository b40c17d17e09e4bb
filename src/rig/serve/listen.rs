//! Taking connections: so many at once, each with its time limits.

use std::sync::Arc;
use std::time::Duration;

use axum::Extension;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::OwnedSemaphorePermit;
use tokio::time::{sleep, timeout};

use super::gate::Local;
use super::server::Server;
use super::service::ServiceManager;
use super::stalling::Stalling;
use super::{GRACE, routes, watcher};

/// Header lines of a request.
const MOST_HEADERS: usize = 64;
/// Bytes of a request's head, and of an answer that wait to be sent beyond the piece at hand.
const BUFFER: usize = 64 * 1024;
/// Pause after the system refused a connection, mostly for want of file descriptors.
const PAUSE: Duration = Duration::from_millis(100);

/// Serves until the server is asked to end.
pub(super) async fn run(
    listener: TcpListener,
    server: Arc<Server>,
    service: Option<ServiceManager>,
) {
    let watching = tokio::spawn(watcher::run(server.clone(), service.clone()));
    tokio::select! {
        () = server.closing() => {}
        () = accept(listener, &server) => {}
    }
    if let Some(service) = &service {
        service.tell_stopping();
    }
    watching.abort();
    let all = u32::try_from(server.limits.connections).unwrap_or(u32::MAX);
    // Who is not ready by then is cut off.
    let _ = timeout(GRACE, server.places.connections.acquire_many(all)).await;
}

async fn accept(listener: TcpListener, server: &Arc<Server>) {
    loop {
        // Without a place the next client waits in the system's queue.
        let Ok(place) = server.places.connections.clone().acquire_owned().await else {
            return;
        };
        match listener.accept().await {
            Ok((socket, _)) => {
                tokio::spawn(converse(socket, server.clone(), place));
            }
            Err(_) => sleep(PAUSE).await,
        }
    }
}

async fn converse(socket: TcpStream, server: Arc<Server>, place: OwnedSemaphorePermit) {
    let Ok(local) = socket.local_addr() else {
        return;
    };
    // Events are small and wanted at once. A socket that refuses is slower, not wrong.
    let _ = socket.set_nodelay(true);
    let router = routes::router(&server).layer(Extension(Local(local.ip())));
    let stream = TokioIo::new(Stalling::new(socket, server.limits.stall));
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(server.limits.head)
        .max_headers(MOST_HEADERS)
        .max_buf_size(BUFFER)
        .serve_connection(stream, TowerToHyperService::new(router));
    tokio::pin!(connection);
    // What goes wrong on a connection is its client's trouble: it ends.
    tokio::select! {
        _ = connection.as_mut() => {}
        () = server.closing() => {
            connection.as_mut().graceful_shutdown();
            let _ = connection.await;
        }
    }
    drop(place);
}
