//! A session's video as a file, whole or a part of it (RFC 9110, section 14).

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::sync::Arc;
use std::time::UNIX_EPOCH;

use axum::body::{Body, Bytes};
use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderName, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::stream;
use tokio::sync::OwnedSemaphorePermit;
use tokio::task::spawn_blocking;

use super::answer::{Failure, Problem};
use super::library::Stamp;
use super::server::{Server, Work, place};

/// Bytes that are read at a time.
const PIECE: u64 = 128 * 1024;

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
    State(server): State<Arc<Server>>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Failure> {
    let place = place(&server.places.downloads, "downloads")?;
    let name = id.clone();
    let opened = server.block_on(Work::Listing, move |server| {
        let footage = server.library.footage(&id)?;
        let file = File::open(&footage.path).map_err(|error| {
            Failure::broken(format!("the video of {id} cannot be read: {error}"))
        })?;
        Ok((file, footage.stamp))
    });
    let (file, stamp) = opened.await?;
    let tag = entity_tag(stamp);
    let range = Range::asked(&headers, stamp.0, &tag);
    let common = [
        (header::CONTENT_TYPE, "video/x-matroska".to_owned()),
        (header::ACCEPT_RANGES, "bytes".to_owned()),
        (header::ETAG, tag),
        (header::CONTENT_DISPOSITION, attachment(&name)),
    ];
    Ok(range.answer(file, stamp.0, common, place))
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

    /// The bytes, with the headers that tell which they are.
    fn answer(
        self,
        file: File,
        size: u64,
        common: [(HeaderName, String); 4],
        place: OwnedSemaphorePermit,
    ) -> Response {
        let (first, length) = match self {
            Self::All => (0, size),
            Self::Part { first, length } => (first, length),
            Self::Beyond => {
                let error = format!("the range lies beyond the end: the file has {size} bytes");
                let failure = Failure::new(StatusCode::RANGE_NOT_SATISFIABLE, error);
                let told = [(header::CONTENT_RANGE, format!("bytes */{size}"))];
                return (told, failure).into_response();
            }
        };
        let download = Download {
            file: Arc::new(file),
            at: first,
            left: length,
            _place: place,
        };
        let body = Body::from_stream(stream::try_unfold(download, Download::piece));
        let sized = [(header::CONTENT_LENGTH, length.to_string())];
        if self == Self::All {
            return (common, sized, body).into_response();
        }
        let last = first + length - 1;
        let told = [(
            header::CONTENT_RANGE,
            format!("bytes {first}-{last}/{size}"),
        )];
        (StatusCode::PARTIAL_CONTENT, common, sized, told, body).into_response()
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

struct Download {
    file: Arc<File>,
    at: u64,
    left: u64,
    _place: OwnedSemaphorePermit,
}

impl Download {
    /// The next piece, read on a thread that may block.
    async fn piece(mut self) -> io::Result<Option<(Bytes, Self)>> {
        if self.left == 0 {
            return Ok(None);
        }
        let (file, at, wanted) = (self.file.clone(), self.at, self.left.min(PIECE));
        let read = spawn_blocking(move || {
            let mut file: &File = &file;
            file.seek(SeekFrom::Start(at))?;
            let mut piece = vec![0; wanted as usize];
            file.read_exact(&mut piece)?;
            Ok::<_, io::Error>(piece)
        });
        let piece = read.await.map_err(io::Error::other)??;
        self.at += wanted;
        self.left -= wanted;
        Ok(Some((piece.into(), self)))
    }
}

/// Changes with the file.
fn entity_tag((size, modified): Stamp) -> String {
    let since = modified.and_then(|time| time.duration_since(UNIX_EPOCH).ok());
    format!("\"{size:x}-{:x}\"", since.unwrap_or_default().as_micros())
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
