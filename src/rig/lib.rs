//! The rig: cameras, the turntable, and the capture that drives both.
//!
//! | module | purpose |
//! | --- | --- |
//! | [`clock`] | the time and all waits, real or virtual |
//! | [`lockfile`] | locks on ports, cameras and folders, shared between accounts |
//! | [`camera`] | cameras as sources of frames: V4L2, nokhwa, and recordings that are replayed |
//! | [`turntable`] | a client of Grbl 1.1 over a serial line |
//! | [`simulator`] | a turntable without hardware: the firmware's core, simulated over time |
//! | [`state`] | what the rig is doing, for everybody who watches it |
//! | [`preview`] | the camera's newest frame as a JPEG |
//! | [`capture`] | one recorded turn, from the checks before it to the session folder |
//! | [`command`] | what a page, a terminal or a script may ask of a rig |
//! | [`serve`] | HTTP: the API and the page for the phone, for any [`command::Rig`] |
//! | [`processing`] | masks, checks and extractions of sessions, by other programs, while the rig rests |
//! | [`daemon`] | the rig between captures: it owns camera and turntable, and runs captures on request |
//!
//! `capture` brings `camera` and `turntable` together, which do not know each other. `serve` knows
//! `command` and `state` only; `daemon` knows `capture` and is the `Rig` that `serve` controls. Sessions are written
//! by [`relit_data::session`], videos by [`relit_video`]. Nothing here knows masks or data sets.

pub mod camera;
pub mod capture;
pub mod clock;
pub mod command;
pub mod daemon;
pub mod lockfile;
pub mod preview;
pub mod processing;
pub mod serve;
pub mod simulator;
pub mod state;
pub mod turntable;
