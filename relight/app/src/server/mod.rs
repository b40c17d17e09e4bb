//! The page's server: it hands out the files of a folder, and takes nothing. Who gets in is decided by `relit-web`: on
//! loopback everybody, elsewhere whoever has the token.
//!
//! | file | concern |
//! | --- | --- |
//! | `files` | the files of the page, read from a folder and written to another |
//! | `routes` | the files as answers |

mod files;
mod routes;

use std::net::{SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use relit_web::{AccessPolicy, Announcement, ConnectionLimits, Shutdown, Token};
use tokio::sync::Semaphore;

pub use files::{PageFault, PageFiles, PageSize};

/// Threads that carry requests: files are in memory.
const THREADS: usize = 2;

/// Where and for whom the page is served.
#[derive(Debug, Clone)]
pub struct PageServerOptions {
    /// The address; its port may be 0 for any free one.
    pub address: SocketAddr,
    /// What lets a browser in. Where there is none, and others than this machine can reach the address, it is random.
    pub token: Option<Token>,
    /// Names by which the server is known, beside its addresses.
    pub names: Vec<String>,
}

/// Why the page cannot be served.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PageServerError {
    /// The system refuses the address.
    #[error("{address} cannot be listened on: give another by --listen")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the system answers.
        source: std::io::Error,
    },
    /// The system has no randomness or no threads.
    #[error("the server cannot be started")]
    Start(#[source] std::io::Error),
}

/// Serves the page until `shutdown` is cancelled. `announce` is called once, when a browser can connect.
///
/// # Errors
/// Where the address cannot be listened on.
pub fn serve_page(
    files: PageFiles,
    options: PageServerOptions,
    announce: impl FnOnce(&Announcement),
    shutdown: &Shutdown,
) -> Result<(), PageServerError> {
    let listen = |source| PageServerError::Listen {
        address: options.address,
        source,
    };
    let listener = TcpListener::bind(options.address).map_err(listen)?;
    listener.set_nonblocking(true).map_err(listen)?;
    let address = listener.local_addr().map_err(listen)?;
    let token = match options.token {
        None if !address.ip().is_loopback() => {
            Some(Token::random().map_err(PageServerError::Start)?)
        }
        given => given,
    };
    let announcement = Announcement::new(address, &options.names, token.as_ref());
    let policy = AccessPolicy::new(address.port(), token, options.names, routes::open_paths());
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(THREADS)
        .thread_name("relight-http")
        .enable_io()
        .enable_time()
        .build()
        .map_err(PageServerError::Start)?;
    let router = routes::router(Arc::new(files), Arc::new(policy));
    runtime.block_on(async {
        let listener =
            tokio::net::TcpListener::from_std(listener).map_err(PageServerError::Start)?;
        announce(&announcement);
        let limits = ConnectionLimits::default();
        let connections = Arc::new(Semaphore::new(limits.connections));
        relit_web::run(listener, router, limits, &connections, shutdown).await;
        Ok(())
    })
}

/// The folder of the page that was built or installed with a program: `share/relight/page` next to the folder of programs, or
/// `page` next to the folder of a build.
///
/// # Errors
/// [`PageFault::NotInstalled`] where neither is there.
pub fn installed_page(program: &Path) -> Result<PathBuf, PageFault> {
    let above = program.parent().and_then(Path::parent);
    let above = above.unwrap_or_else(|| Path::new("/"));
    let mut places = vec![above.join("share/relight/page"), above.join("page")];
    match places.iter().position(|place| place.is_dir()) {
        Some(at) => Ok(places.swap_remove(at)),
        None => Err(PageFault::NotInstalled { places }),
    }
}
