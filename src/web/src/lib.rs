//! What the pages of the programs share: who gets in, how much clients may take up, and answers in words
//! to what cannot be served.
//!
//! A [`PageServer`] makes an [`AccessPolicy`], by which [`guard`] protects the routes.
//! [`index`] lets a browser in that comes with the [`Token`] in its URL; the [`Announcement`] holds that
//! URL. The crate knows nothing of what is served: neither the rig nor masks; [`SKETCH`] are the scripts and the style
//! by which pages let a person draw.

mod access;
mod address;
mod failure;
mod listen;
mod listen_address;
mod page;
mod request_body;
mod token;

pub use access::{AccessPolicy, LocalAddress, guard};
pub use address::Announcement;
pub use failure::Failure;
pub use listen::{ConnectionLimits, PageServer, Shutdown, serve_page};
pub use listen_address::ListenAddress;
pub use page::{IndexPage, PageAsset, SCRIPT, SKETCH, STYLE, TokenQuery, asset, index};
pub use request_body::{BodyLimit, JsonBody, QueryParams, SKETCH_LIMIT};
pub use token::Token;
