//! The editor: a page in the browser on which a person draws the hints, sees the mask at once and over the
//! whole turn, and accepts it.
//!
//! The page keeps what was drawn, with its history, and sends all of it with every request: the server
//! has no state but caches. It serves one person on one recording, and ends when the mask is accepted
//! or the page is told to discard it. Without the random token of its URL nothing is shown or done.

mod api;
mod page;
mod session;

use std::net::{SocketAddr, TcpListener};
use std::path::Path;
use std::sync::Arc;

use relit_data::session::Recording;
use relit_video::Video;
use relit_web::{AccessPolicy, Announcement, ConnectionLimits, Shutdown, Token};
use tokio::sync::Semaphore;

use super::earlier::with_strokes;
use super::files::{check_replaceable, make_folder};
use super::making::files_of;
use super::{MaskFiles, MaskOutput, MaskRequest, MaskingError};
use api::App;
use session::EditorSession;

/// Threads that carry requests; cuts and frames have their own.
const THREADS: usize = 2;

/// Serves the editor at `address`, whose port may be 0 for any free one, for the recording at `input`, a session folder or a video file, until a person accepts a
/// mask or discards it. The request says what is drawn at the beginning, and may be empty. `announce` is called
/// once, when a browser can connect. relit's engine cuts, whichever the request names. The files are those of [`make_mask`](super::make_mask), and none is
/// written before the mask is accepted; the result is `None` if it was discarded.
///
/// # Errors
/// [`MaskingError::Session`] if there is no recording, [`MaskingError::Serve`], or [`MaskingError::Recording`]
/// around the cause.
pub fn edit(
    input: &Path,
    output: Option<MaskFiles>,
    request: MaskRequest,
    address: SocketAddr,
    announce: impl FnOnce(&Announcement),
) -> Result<Option<MaskOutput>, MaskingError> {
    let recording = Recording::open(input)?;
    let of_recording = |source| MaskingError::Recording {
        recording: recording.id.clone(),
        source: Box::new(source),
    };
    let files = files_of(&recording, output)?;
    let _made = make_folder(&files).map_err(of_recording)?;
    check_replaceable(&files, request.force, request.settings.alpha).map_err(of_recording)?;
    let video = Video::open(&recording.video).map_err(|error| of_recording(error.into()))?;
    let (request, notice) = with_strokes(&request, &files, &video).map_err(of_recording)?;
    let request = request.into_owned();
    let session = EditorSession::new(&recording, video, files.clone(), request);
    let session = session.map_err(of_recording)?;
    let app = serve(session, address, announce)?;
    let record = app.accepted();
    Ok(record.map(|record| MaskOutput {
        recording: recording.id,
        files,
        record,
        notices: recording.notices.into_iter().chain(notice).collect(),
    }))
}

fn serve(
    session: EditorSession,
    asked: SocketAddr,
    announce: impl FnOnce(&Announcement),
) -> Result<App, MaskingError> {
    let failed = |source| MaskingError::Serve {
        address: asked,
        source,
    };
    let listener = TcpListener::bind(asked).map_err(failed)?;
    listener.set_nonblocking(true).map_err(failed)?;
    let address = listener.local_addr().map_err(failed)?;
    let token = Token::random().map_err(failed)?;
    let announcement = Announcement::new(address, &[], Some(&token));
    let policy = AccessPolicy::new(address.port(), Some(token), Vec::new(), page::paths());
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(THREADS)
        .thread_name("relit-http")
        .enable_io()
        .enable_time()
        .build()
        .map_err(failed)?;
    let shutdown = Shutdown::new();
    let app = App::new(Arc::new(session), Arc::new(policy), shutdown.clone());
    let served = runtime.block_on(async {
        let listener = tokio::net::TcpListener::from_std(listener).map_err(failed)?;
        announce(&announcement);
        let limits = ConnectionLimits::default();
        let connections = Arc::new(Semaphore::new(limits.connections));
        relit_web::run(listener, api::router(&app), limits, &connections, &shutdown).await;
        Ok(())
    });
    runtime.shutdown_timeout(relit_web::GRACE);
    served.map(|()| app)
}
