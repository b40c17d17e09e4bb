//! A session's video as a file, whole or a part of it (RFC 9110, section 14).

use std::io::SeekFrom;
use std::sync::Arc;
use std::time::UNIX_EPOCH;

use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use tokio::fs::File;
use tokio::io::{AsyncReadExt, AsyncSeekExt};
use tokio::sync::OwnedSemaphorePermit;
use tokio_util::io::ReaderStream;

use super::failure::{Failure, Problem};
use super::library::{FileVersion, Library};
use super::permits::{Permits, Work, permit};

/// Bytes that are read at a time.
const PIECE: usize = 128 * 1024;

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
    headers: HeaderMap,
) -> Result<Response, Failure> {
    let permit = permit(&permits.downloads, "downloads")?;
    let common = [
        (header::CONTENT_TYPE, "video/x-matroska".to_owned()),
        (header::ACCEPT_RANGES, "bytes".to_owned()),
        (header::CONTENT_DISPOSITION, attachment(&id)),
    ];
    let unreadable = format!("the video of {id} cannot be read");
    let unreadable = |error| Failure::broken(format!("{unreadable}: {error}"));
    let found = permits.run(Work::Listing, move || library.video_file(&id));
    let found = found.await?;
    let file = File::open(&found.path).await.map_err(unreadable)?;
    let size = found.version.bytes;
    let tag = entity_tag(found.version);
    let range = Range::asked(&headers, size, &tag);
    let (first, length) = match range {
        Range::All => (0, size),
        Range::Part { first, length } => (first, length),
        Range::Beyond => {
            let error = format!("the range lies beyond the end: the file has {size} bytes");
            let failure = Failure::new(StatusCode::RANGE_NOT_SATISFIABLE, error);
            let sized = [(header::CONTENT_RANGE, format!("bytes */{size}"))];
            return Ok((sized, failure).into_response());
        }
    };
    let body = download(file, first, length, permit).await;
    let body = body.map_err(unreadable)?;
    let common = (
        common,
        [
            (header::ETAG, tag),
            (header::CONTENT_LENGTH, length.to_string()),
        ],
    );
    if range == Range::All {
        return Ok((common.0, common.1, body).into_response());
    }
    let part = format!("bytes {first}-{}/{size}", first + length - 1);
    let part = [(header::CONTENT_RANGE, part)];
    Ok((StatusCode::PARTIAL_CONTENT, common.0, common.1, part, body).into_response())
}

/// `length` bytes of a file from `first` on; the permit is given back with them.
async fn download(
    mut file: File,
    first: u64,
    length: u64,
    permit: OwnedSemaphorePermit,
) -> std::io::Result<Body> {
    file.seek(SeekFrom::Start(first)).await?;
    let pieces = ReaderStream::with_capacity(file.take(length), PIECE);
    Ok(Body::from_stream(pieces.inspect(move |_| {
        let _held = &permit;
    })))
}

/// Which bytes of a file are asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Range {
    All,
    /// `length` is at least 1 and the part lies inside the file.
    Part {
        first: u64,
        length: u64,
    },
    Beyond,
}

impl Range {
    /// What a request wants of a file of `size` bytes whose entity tag is `tag`.
    fn asked(headers: &HeaderMap, size: u64, tag: &str) -> Self {
        let mut conditions = headers.get_all(header::IF_RANGE).iter();
        let range = headers
            .get(header::RANGE)
            .and_then(|range| range.to_str().ok());
        match range {
            Some(range) if conditions.all(|of| of.as_bytes() == tag.as_bytes()) => {
                Self::read(range, size)
            }
            _ => Self::All,
        }
    }

    /// Of a `Range` header, for a file of `size` bytes. What is no single range of bytes is passed over,
    /// as the standard has it.
    fn read(text: &str, size: u64) -> Self {
        let range = text.trim().strip_prefix("bytes=");
        let Some((first, last)) = range.and_then(|range| range.split_once('-')) else {
            return Self::All;
        };
        let (first, last) = match (first.trim().parse::<u64>(), last.trim().parse::<u64>()) {
            (Ok(first), Ok(last)) if first <= last => (first, last),
            (Ok(first), Err(_)) if last.trim().is_empty() => (first, u64::MAX),
            (Err(_), Ok(0)) if first.trim().is_empty() => return Self::Beyond,
            (Err(_), Ok(count)) if first.trim().is_empty() => {
                (size.saturating_sub(count), u64::MAX)
            }
            _ => return Self::All,
        };
        if first >= size {
            return Self::Beyond;
        }
        let length = last.min(size - 1) - first + 1;
        Self::Part { first, length }
    }
}

/// Changes with the file.
fn entity_tag(FileVersion { bytes, modified }: FileVersion) -> String {
    let since = modified.and_then(|time| time.duration_since(UNIX_EPOCH).ok());
    format!("\"{bytes:x}-{:x}\"", since.unwrap_or_default().as_micros())
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
    fn ranges_are_read_as_the_standard_has_them() {
        let part = |first, length| Range::Part { first, length };
        for (text, wanted) in [
            ("bytes=0-9", part(0, 10)),
            ("bytes=90-", part(90, 10)),
            ("bytes=-10", part(90, 10)),
            ("bytes=-1000", part(0, 100)),
            ("bytes=99-1000", part(99, 1)),
            ("bytes=100-", Range::Beyond),
            ("bytes=-0", Range::Beyond),
            ("bytes=9-8", Range::All),
            ("bytes=0-1,3-4", Range::All),
            ("bytes=x-y", Range::All),
            ("bytes=99999999999999999999-", Range::All),
            ("lines=0-1", Range::All),
        ] {
            assert_eq!(Range::read(text, 100), wanted, "{text}");
        }
        assert_eq!(Range::read("bytes=0-", 0), Range::Beyond);
    }

    #[test]
    fn a_name_of_any_script_stays_one_header_value() {
        let header = attachment("20261120T093015Z-Ölkanne");
        assert!(
            header.ends_with("''20261120T093015Z-%C3%96lkanne.mkv"),
            "{header}"
        );
    }
}
