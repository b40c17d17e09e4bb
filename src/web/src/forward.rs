//! Handing a request on to another server of this machine.

use std::io;
use std::net::SocketAddr;

use axum::body::Body;
use axum::http::{Request, Response};
use hyper::client::conn::http1;
use hyper_util::rt::TokioIo;
use tokio::net::TcpStream;

/// Asks the server at `address`, on its own connection, and gives back its answer.
///
/// # Errors
/// If it cannot be reached or does not speak HTTP.
pub async fn forward(address: SocketAddr, request: Request<Body>) -> io::Result<Response<Body>> {
    let stream = TcpStream::connect(address).await?;
    let (mut sender, connection) = http1::handshake(TokioIo::new(stream))
        .await
        .map_err(io::Error::other)?;
    // It ends with the answer, or with whoever asked.
    tokio::spawn(connection);
    let answer = sender.send_request(request).await;
    Ok(answer.map_err(io::Error::other)?.map(Body::new))
}
