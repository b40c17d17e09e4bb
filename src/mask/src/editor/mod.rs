//! The editor: a page in the browser on which a person draws the hints, sees the mask at once and over the
//! whole turn, and accepts it.
//!
//! The page keeps what was drawn, with its history, and sends all of it with every request: the server
//! has no state but caches. It serves one person on one recording, and ends when the mask is accepted
//! or discarded. Without the random token of its URL nothing is shown or done.

mod api;
mod session;

use std::net::SocketAddr;
use std::path::Path;
use std::sync::{Arc, PoisonError};

use relit_data::session::Recording;
use relit_video::Video;
use relit_web::{Announcement, Shutdown, Token, serve_page};
use tokio::sync::Semaphore;

use super::earlier::{check_same_input, with_strokes};
use super::files::{check_replaceable, make_folder};
use super::making::files_of;
use super::{MaskFiles, MaskOutput, MaskRecord, MaskRequest, MaskingError};
use api::{Accepted, App};
use session::EditorSession;

/// Frames decoded, and masks cut, at once.
const AT_ONCE: usize = 2;

/// Serves the editor at `address`, whose port may be 0 for any free one, for the recording at `input`, a session folder or a video file, until a person accepts a
/// mask or discards it. The request says what is drawn at the beginning, and may be empty. `announce` is called
/// once, when a browser can connect. relit's engine cuts, whichever the request names. The files are those of [`make_mask`](super::make_mask), and none is
/// written before the mask is accepted; the result is `None` if it was discarded.
///
/// # Errors
/// [`MaskingError::Session`] without a recording, [`MaskingError::Serve`], or what went wrong with it.
pub fn edit(
    input: &Path,
    output: Option<MaskFiles>,
    request: MaskRequest,
    address: SocketAddr,
    announce: impl FnOnce(&Announcement),
) -> Result<Option<MaskOutput>, MaskingError> {
    let recording = Recording::open(input)?;
    let files = files_of(&recording, output)?;
    let _made = make_folder(&files)?;
    check_replaceable(&files, request.force)?;
    let video = Video::open(&recording.video)?;
    if !request.force {
        check_same_input(&files, &recording, &video)?;
    }
    let (request, notice) = with_strokes(&request, &files, &video)?;
    let request = request.into_owned();
    let session = EditorSession::new(&recording, video, files.clone(), request)?;
    let record = serve(session, address, announce)?;
    Ok(record.map(|record| MaskOutput {
        recording: recording.id,
        files,
        record,
        notices: recording.notices.into_iter().chain(notice).collect(),
    }))
}

fn serve(
    session: EditorSession,
    address: SocketAddr,
    announce: impl FnOnce(&Announcement),
) -> Result<Option<MaskRecord>, MaskingError> {
    let failed = |source| MaskingError::Serve { address, source };
    let token = Some(Token::random().map_err(failed)?);
    let shutdown = Shutdown::new();
    let (session, accepted) = (Arc::new(session), Accepted::default());
    let router = |policy| {
        api::router(&App {
            session,
            policy,
            shutdown: shutdown.clone(),
            accepted: accepted.clone(),
            permits: Arc::new(Semaphore::new(AT_ONCE)),
            index: api::INDEX,
            limit: relit_web::SKETCH_LIMIT,
        })
    };
    let paths = api::page_paths();
    serve_page(
        address,
        token,
        Vec::new(),
        &paths,
        router,
        announce,
        &shutdown,
    )
    .map_err(failed)?;
    let accepted = accepted.lock();
    Ok(accepted.unwrap_or_else(PoisonError::into_inner).take())
}
