//! A session's video as a file, whole or a part of it.

use std::path::Path as FilePath;
use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Path, Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use tower_http::services::ServeFile;

use super::failure::{Failure, Problem};
use super::library::Library;
use super::permits::{Permits, Work, permit};

/// The video file
///
/// As the camera's stream was written, for download. Takes one `Range` of bytes, with `If-Range`.
#[utoipa::path(
    get, path = "/api/v1/sessions/{id}/video", tag = "sessions",
    params(("id" = String, Path, description = "The session's name")),
    responses(
        (status = 200, description = "The file", content_type = "video/x-matroska"),
        (status = 206, description = "A part of it", content_type = "video/x-matroska"),
        (status = 401, body = Problem),
        (status = 404, description = "No such session", body = Problem),
        (status = 409, description = "Still being recorded", body = Problem),
        (status = 416, description = "The range lies beyond the end", body = Problem),
        (status = 503, description = "Too many downloads", body = Problem),
    )
)]
pub(super) async fn video(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
    request: Request,
) -> Result<Response, Failure> {
    let permit = permit(&permits.downloads, "downloads")?;
    let name = attachment(&id);
    let file = permits.run(Work::Listing, move || library.video_file(&id));
    let response = read(&file.await?.path, request).await?;
    let (mut parts, body) = response.into_parts();
    if parts.status == StatusCode::RANGE_NOT_SATISFIABLE {
        let error = "there is one range at a time, and it has to begin inside the file";
        parts.headers.remove(header::CONTENT_LENGTH);
        return Ok((parts.headers, Failure::new(parts.status, error)).into_response());
    }
    if let Ok(name) = HeaderValue::from_str(&name) {
        parts.headers.insert(header::CONTENT_DISPOSITION, name);
    }
    // The permit is given back with the last piece.
    let pieces = body.into_data_stream().inspect(move |_| {
        let _held = &permit;
    });
    Ok(Response::from_parts(parts, Body::from_stream(pieces)))
}

/// What a request wants of a file; all of it where the client has a part of an older one.
async fn read(path: &FilePath, request: Request) -> Result<Response, Failure> {
    let (mut parts, _) = request.into_parts();
    let known = parts.headers.remove(header::IF_RANGE);
    let mut response = try_read(path, Request::from_parts(parts.clone(), Body::empty())).await?;
    if known.is_some() && known.as_ref() != response.headers().get(header::ETAG) {
        parts.headers.remove(header::RANGE);
        response = try_read(path, Request::from_parts(parts, Body::empty())).await?;
    }
    Ok(response)
}

async fn try_read(path: &FilePath, request: Request) -> Result<Response, Failure> {
    let read = ServeFile::new(path).try_call(request).await;
    let read = read.map_err(|error| Failure::broken(format!("the video cannot be read: {error}")));
    Ok(read?.map(Body::new))
}

/// The name under which a browser saves the file (RFC 6266, RFC 8187).
fn attachment(session: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_' | b'.');
    let name: String = session
        .bytes()
        .map(|byte| match plain(byte) {
            true => char::from(byte).to_string(),
            false => format!("%{byte:02X}"),
        })
        .collect();
    format!("attachment; filename*=UTF-8''{name}.mkv")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_any_script_stays_one_header_value() {
        let header = attachment("20261120T093015Z-Ölkanne");
        assert!(
            header.ends_with("''20261120T093015Z-%C3%96lkanne.mkv"),
            "{header}"
        );
    }
}
