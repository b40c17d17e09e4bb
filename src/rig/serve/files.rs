//! What was recorded as files, whole or a part of them: a session's video, a session, all sessions of
//! a day.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use http_range_header::parse_range_header;
use serde::Deserialize;

use super::archive::Archive;
use super::library::Library;
use super::permits::{Permits, Work, permit};
use relit_web::{Failure, QueryParams};

const TAR: &str = "application/x-tar";
const NO_RANGE: &str = "there is one range at a time, and it has to begin inside the file";

/// The video file
///
/// As the camera's stream was written, for download. Takes one `Range` of bytes, with `If-Range`.
pub(super) async fn video(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Failure> {
    let name = attachment(&id, "mkv");
    send(&permits, &name, "video/x-matroska", &headers, move || {
        let file = library.video_file(&id)?;
        Archive::of_file(&file.path).map_err(unread)
    })
    .await
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
    send(&permits, &name, TAR, headers, move || {
        let folder = library.ended(&id)?;
        Archive::of(&[(id, folder)]).map_err(unread)
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
    send(&permits, &name, TAR, &headers, move || {
        Archive::of(&library.of_day(&day)?).map_err(unread)
    })
    .await
}

fn unread(error: std::io::Error) -> Failure {
    Failure::broken(format!("the session cannot be read: {error}"))
}

/// Sends what a client wants of an archive.
async fn send(
    permits: &Permits,
    name: &str,
    kind: &str,
    headers: &HeaderMap,
    archive: impl FnOnce() -> Result<Archive, Failure> + Send + 'static,
) -> Result<Response, Failure> {
    let permit = permit(&permits.downloads, "downloads")?;
    let archive = permits.run(Work::Listing, archive).await?;
    let (length, version) = (archive.len(), archive.version());
    let Some((status, from, bytes)) = part_of(headers, &version, length) else {
        let range = [(header::CONTENT_RANGE, format!("bytes */{length}"))];
        let failure = Failure::new(StatusCode::RANGE_NOT_SATISFIABLE, NO_RANGE);
        return Ok((range, failure).into_response());
    };
    let pieces = archive.read(from, bytes).inspect(move |_| {
        // The permit is given back with the last piece.
        let _held = &permit;
    });
    let mut answer = Response::builder()
        .status(status)
        .header(header::CONTENT_TYPE, kind)
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

/// Status, first byte and number of bytes of what a client wants; `None` where that is not there.
fn part_of(headers: &HeaderMap, version: &str, length: u64) -> Option<(StatusCode, u64, u64)> {
    let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
    let is_same = text(header::IF_RANGE).is_none_or(|known| known == version);
    let Some(range) = text(header::RANGE).filter(|_| is_same) else {
        return Some((StatusCode::OK, 0, length));
    };
    let ranges = parse_range_header(range).and_then(|ranges| ranges.validate(length));
    match ranges.ok()?.as_slice() {
        [range] => {
            let (from, last) = range.clone().into_inner();
            Some((StatusCode::PARTIAL_CONTENT, from, last - from + 1))
        }
        _ => None,
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
