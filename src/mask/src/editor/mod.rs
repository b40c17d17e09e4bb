//! The editor: a page in the browser on which a person draws the hints, sees the mask at once and over the
//! whole turn, and accepts it.
//!
//! The page keeps what was drawn, with its history, and sends all of it with every request: the server
//! has no state but caches. It serves one person on one recording, and is over when the mask is accepted
//! or discarded. [`edit`] serves it by itself, behind a random token; another server can serve a [`MaskEditor`] as well.

mod api;
mod session;

use std::net::SocketAddr;
use std::path::Path;
use std::sync::{Arc, PoisonError};

use axum::Router;
use axum::extract::FromRef;
use axum::middleware::from_fn_with_state;
use axum::routing::get;
use relit_data::session::Notice;
use relit_web::{AccessPolicy, Announcement, IndexPage, Shutdown, Token, guard, index, serve_page};
use tokio::sync::Semaphore;

use super::making::Prepared;
use super::{MaskFiles, MaskOutput, MaskRequest, MaskingError};
use api::App;
use session::EditorSession;

/// Frames decoded, and masks cut, at once.
const AT_ONCE: usize = 2;

/// The editor of one recording's mask, for a server to show.
pub struct MaskEditor {
    recording: String,
    files: MaskFiles,
    notices: Vec<Notice>,
    app: App,
}

impl MaskEditor {
    /// The editor's page, to be served at the root of its [`router`](Self::router).
    pub const PAGE: IndexPage = api::INDEX;

    /// Opens the recording at `input`, a session folder or a video file. The request says what is drawn at the
    /// beginning, and may be empty. relit's engine cuts, whichever the request names. The files are those of
    /// [`make_mask`](super::make_mask), and none is written before the mask is accepted.
    ///
    /// # Errors
    /// [`MaskingError::Session`] without a recording, or what is wrong with it.
    pub fn open(
        input: &Path,
        output: Option<MaskFiles>,
        request: &MaskRequest,
    ) -> Result<Self, MaskingError> {
        let Prepared {
            recording,
            video,
            files,
            request,
            notices,
            ..
        } = Prepared::new(input, output, request)?;
        let request = request.into_owned();
        let session = EditorSession::new(&recording, video, files.clone(), request)?;
        Ok(Self {
            recording: recording.id,
            files,
            notices,
            app: App {
                session: Arc::new(session),
                over: Shutdown::new(),
                accepted: Arc::default(),
                permits: Arc::new(Semaphore::new(AT_ONCE)),
            },
        })
    }

    /// All that is served but the page. Who gets in is for the server to say.
    pub fn router(&self) -> Router {
        api::router(self.app.clone())
    }

    /// Whether a request is under way.
    pub fn is_working(&self) -> bool {
        self.app.permits.available_permits() < AT_ONCE
    }

    /// Whether the mask was accepted or discarded.
    pub fn is_over(&self) -> bool {
        self.app.over.is_cancelled()
    }

    /// The mask that was written, once it was accepted.
    pub fn accepted(&self) -> Option<MaskOutput> {
        let accepted = self.app.accepted.lock();
        let record = accepted.unwrap_or_else(PoisonError::into_inner).clone()?;
        Some(MaskOutput {
            recording: self.recording.clone(),
            files: self.files.clone(),
            record,
            notices: self.notices.clone(),
        })
    }
}

impl Drop for MaskEditor {
    /// What is being cut then is not written.
    fn drop(&mut self) {
        self.app.over.cancel();
    }
}

/// Who gets in, and what is shown first.
#[derive(Clone, FromRef)]
struct Entrance {
    policy: Arc<AccessPolicy>,
    index: IndexPage,
}

/// Serves the editor at `address`, whose port may be 0 for any free one, until a person accepts a mask or discards it.
/// `announce` is called once, when a browser can connect. The result is `None` if it was discarded.
///
/// # Errors
/// As [`MaskEditor::open`], and [`MaskingError::Serve`].
pub fn edit(
    input: &Path,
    output: Option<MaskFiles>,
    request: &MaskRequest,
    address: SocketAddr,
    announce: impl FnOnce(&Announcement),
) -> Result<Option<MaskOutput>, MaskingError> {
    let editor = MaskEditor::open(input, output, request)?;
    let failed = |source| MaskingError::Serve { address, source };
    let token = Some(Token::random().map_err(failed)?);
    let router = |policy: Arc<AccessPolicy>| {
        let entrance = Entrance {
            policy: policy.clone(),
            index: MaskEditor::PAGE,
        };
        let page = Router::new().route("/", get(index)).with_state(entrance);
        page.merge(editor.router())
            .layer(from_fn_with_state(policy, guard))
    };
    let (names, paths) = (Vec::new(), api::page_paths());
    let over = &editor.app.over;
    serve_page(address, token, names, &paths, router, announce, over).map_err(failed)?;
    Ok(editor.accepted())
}
