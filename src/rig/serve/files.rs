//! What was recorded as files, whole or a part of them: a session's video, a session, all sessions of
//! a day.

use std::path::{Path as FilePath, PathBuf};
use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Path, Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use http_range_header::parse_range_header;
use serde::Deserialize;
use tower_http::services::ServeFile;

use super::archive::Archive;
use super::library::Library;
use super::permits::{Permits, Work, permit};
use relit_web::{Failure, QueryParams};

const NO_RANGE: &str = "there is one range at a time, and it has to begin inside the file";

/// The video file
///
/// As the camera's stream was written, for download. Takes one `Range` of bytes, with `If-Range`.
pub(super) async fn video(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
    request: Request,
) -> Result<Response, Failure> {
    let permit = permit(&permits.downloads, "downloads")?;
    let name = attachment(&id, "mkv");
    let file = permits.run(Work::Listing, move || library.video_file(&id));
    let response = read(&file.await?.path, request).await?;
    let (mut parts, body) = response.into_parts();
    if parts.status == StatusCode::RANGE_NOT_SATISFIABLE {
        parts.headers.remove(header::CONTENT_LENGTH);
        return Ok((parts.headers, Failure::new(parts.status, NO_RANGE)).into_response());
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

/// A session
///
/// All its files as one tar file, under `<session>/`: unpacked it is a session that `relit-mask` and
/// `relit-extract` take. Takes one `Range` of bytes, with `If-Range`. The length is sent before: a
/// download that broke off is shorter.
pub(super) async fn session_tar(
    library: Arc<Library>,
    permits: Arc<Permits>,
    id: String,
    headers: &HeaderMap,
) -> Result<Response, Failure> {
    let name = attachment(&id, "tar");
    send_tar(&permits, &name, headers, move || {
        let folder = library.ended(&id)?;
        Ok(vec![(id, folder)])
    })
    .await
}

/// Which day.
#[derive(Debug, Deserialize)]
pub(super) struct Day {
    /// Its date, UTC, as session names begin.
    day: String,
}

/// All sessions of a day
///
/// As one tar file, without those that are being recorded. Takes one `Range` of bytes, with
/// `If-Range`.
pub(super) async fn day_tar(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    QueryParams(Day { day }): QueryParams<Day>,
    headers: HeaderMap,
) -> Result<Response, Failure> {
    let name = attachment(&day, "tar");
    send_tar(&permits, &name, &headers, move || library.of_day(&day)).await
}

/// Sends what a client wants of the tar file of these sessions.
async fn send_tar(
    permits: &Permits,
    name: &str,
    headers: &HeaderMap,
    sessions: impl FnOnce() -> Result<Vec<(String, PathBuf)>, Failure> + Send + 'static,
) -> Result<Response, Failure> {
    let permit = permit(&permits.downloads, "downloads")?;
    let archive = permits.run(Work::Listing, move || {
        let broken = |error| Failure::broken(format!("the session cannot be read: {error}"));
        Archive::of(&sessions()?).map_err(broken)
    });
    let archive = archive.await?;
    let (length, version) = (archive.len(), archive.version());
    let (status, from, bytes) = part_of(headers, &version, length)?;
    let pieces = archive.read(from, bytes).inspect(move |_| {
        // The permit is given back with the last piece.
        let _held = &permit;
    });
    let mut answer = Response::builder()
        .status(status)
        .header(header::CONTENT_TYPE, "application/x-tar")
        .header(header::CONTENT_LENGTH, bytes)
        .header(header::ACCEPT_RANGES, "bytes")
        .header(header::ETAG, version)
        .header(header::CONTENT_DISPOSITION, name);
    if status == StatusCode::PARTIAL_CONTENT {
        let range = format!("bytes {from}-{}/{length}", from + bytes - 1);
        answer = answer.header(header::CONTENT_RANGE, range);
    }
    let answer = answer.body(Body::from_stream(pieces));
    answer.map_err(|error| Failure::broken(format!("the answer cannot be made: {error}")))
}

/// Status, first byte and number of bytes of what a client wants.
fn part_of(
    headers: &HeaderMap,
    version: &str,
    length: u64,
) -> Result<(StatusCode, u64, u64), Failure> {
    let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
    let is_same = text(header::IF_RANGE).is_none_or(|known| known == version);
    let range = text(header::RANGE).filter(|_| is_same);
    let Some(range) = range else {
        return Ok((StatusCode::OK, 0, length));
    };
    let ranges = parse_range_header(range).and_then(|ranges| ranges.validate(length));
    match ranges.as_deref() {
        Ok([range]) => {
            let (from, last) = range.clone().into_inner();
            Ok((StatusCode::PARTIAL_CONTENT, from, last - from + 1))
        }
        _ => Err(Failure::new(StatusCode::RANGE_NOT_SATISFIABLE, NO_RANGE)),
    }
}

/// The mask
pub(super) async fn mask(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
) -> Result<Response, Failure> {
    let png = permits
        .run(Work::Listing, move || library.mask(&id))
        .await?;
    Ok(([(header::CONTENT_TYPE, "image/png")], png).into_response())
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
fn attachment(session: &str, ending: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_' | b'.');
    let name: String = session
        .bytes()
        .map(|byte| match plain(byte) {
            true => char::from(byte).to_string(),
            false => format!("%{byte:02X}"),
        })
        .collect();
    format!("attachment; filename*=UTF-8''{name}.{ending}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_any_script_stays_one_header_value() {
        let header = attachment("20261120T093015Z-Ölkanne", "mkv");
        assert!(
            header.ends_with("''20261120T093015Z-%C3%96lkanne.mkv"),
            "{header}"
        );
    }
}
