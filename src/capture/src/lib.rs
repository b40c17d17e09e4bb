//! The rig: the capture of a turn, the service around it, and its page.
//!
//! | module | purpose |
//! | --- | --- |
//! | [`state`] | what the rig is doing, for everybody who watches it |
//! | [`preview`] | the camera's newest frame as a JPEG |
//! | [`capture`] | one recorded turn, from the checks before it to the session folder |
//! | [`command`] | what a page, a terminal or a script may ask of a rig |
//! | [`serve`] | HTTP: the API and the page for the phone, for any [`command::Rig`] |
//! | [`processing`] | masks, checks and extractions of sessions, by other programs, while the rig rests |
//! | [`daemon`] | the rig between captures: it owns camera and turntable, and runs captures on request |
//!
//! `capture` brings [`relit_camera`] and [`relit_turntable`] together, which do not know each other. `serve` knows
//! `command` and `state` only; `daemon` knows `capture` and is the `Rig` that `serve` controls. Sessions are written
//! by [`relit_data::session`], videos by [`relit_video`]. Nothing here knows masks or data sets.

pub mod capture;
pub mod command;
pub mod daemon;
pub mod preview;
pub mod processing;
pub mod serve;
pub mod state;
