//! The app of relight: its engine, which runs in a browser, and the server that hands the page out.
//!
//! | module | concern |
//! | --- | --- |
//! | `message` | requests and replies as bytes: several parts, the first of them JSON |
//! | `studio` | the engine: photographs, masks, scenes and what is asked of them |
//! | `browser` | the engine's functions that the page's worker calls |
#![cfg_attr(feature = "server", doc = "| [`server`] | serves the page |")]
//!
//! It knows the libraries of photographs, light and masks, and no terminal.
//!
//! ```
//! use relight_app::{Studio, pack, unpack};
//!
//! let mut studio = Studio::new();
//! let reply = studio.answer(&pack(&[br#"{"op": "close", "object": 1}"#]));
//! assert_eq!(unpack(&reply).unwrap(), [b"{}"]);
//! ```

#[cfg(target_arch = "wasm32")]
mod browser;
mod message;
#[cfg(feature = "server")]
pub mod server;
mod studio;

pub use message::{MessageFault, pack, unpack};
pub use studio::Studio;
