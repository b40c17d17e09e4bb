//! The page's server: it serves the files of a folder and accepts no uploads. `relit-web` decides who gets in: on
//! loopback everybody, elsewhere whoever has the token.
//!
//! | file | concern |
//! | --- | --- |
//! | `files` | the files of the page, read from a folder |
//! | `routes` | the files as answers |

mod files;
mod routes;

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use relit_web::{Announcement, Shutdown, Token, serve_page as serve};

pub use files::{PageFault, PageFiles};

/// The address is refused, or the system has no randomness or no threads.
#[derive(Debug, thiserror::Error)]
#[error("the page cannot be served at {address}: give another address with --listen")]
pub struct PageServerError {
    /// The address.
    pub address: SocketAddr,
    /// What the system answers.
    pub source: std::io::Error,
}

/// Serves the page until `shutdown` is cancelled, at an address whose port may be 0 for any free one, to browsers that have the
/// token. Where there is none, and others than this machine can reach the address, it is random. `names` are those by which
/// the server is known, beside its addresses. `announce` is called once, when a browser can connect.
///
/// # Errors
/// If the address cannot be listened on.
pub fn serve_page(
    files: PageFiles,
    address: SocketAddr,
    token: Option<Token>,
    names: Vec<String>,
    announce: impl FnOnce(&Announcement),
    shutdown: &Shutdown,
) -> Result<(), PageServerError> {
    let router = |policy| routes::router(files, policy);
    serve(
        address,
        token,
        names,
        routes::OPEN_PATHS,
        router,
        announce,
        shutdown,
    )
    .map_err(|source| PageServerError { address, source })
}

/// The folder of the page that was built or installed with a program: `share/relight/page` next to the folder of programs, or
/// `page` next to the folder of a build.
///
/// # Errors
/// [`PageFault::NoPage`] if neither is there.
pub fn installed_page(program: &Path) -> Result<PathBuf, PageFault> {
    let above = program.parent().and_then(Path::parent);
    let above = above.unwrap_or_else(|| Path::new("/"));
    let mut places = vec![above.join("share/relight/page"), above.join("page")];
    match places.iter().position(|place| place.is_dir()) {
        Some(at) => Ok(places.swap_remove(at)),
        None => Err(PageFault::NoPage { places }),
    }
}
