//! The rig: cameras, the turntable, and the capture that drives both.
//!
//! | module | purpose |
//! | --- | --- |
//! | [`clock`] | the time that everything else uses |
//! | [`camera`] | cameras as sources of frames: V4L2, nokhwa, and recordings that are replayed |
//! | [`turntable`] | a client of Grbl 1.1 over a serial line |
//! | [`simulator`] | a turntable without hardware: the firmware's core on a simulated serial line |
//! | [`capture`] | one recorded turn, from the checks before it to the session folder |
//! | [`preview`] | the newest frame as a picture, for viewers |
//! | [`daemon`] | the rig between captures: it owns camera and turntable, and runs captures on request |
//! | [`state`] | what a rig is doing, as viewers see it |
//! | [`serve`] | HTTP: the API and the page for the phone |
//! | [`lockfile`] | one process per port, camera and folder, across accounts |
//!
//! `capture` knows `camera` and `turntable`, which do not know each other. `serve` knows `state` and the
//! trait [`serve::rig::Rig`]; `daemon` implements that trait on `capture`, and the two do not know each
//! other otherwise. Sessions are written by
//! [`relit_data::session`], videos by [`relit_video`]. Nothing here knows masks or data sets.

pub mod camera;
pub mod capture;
pub mod clock;
pub mod daemon;
pub mod lockfile;
pub mod preview;
pub mod serve;
pub mod simulator;
pub mod state;
pub mod turntable;
