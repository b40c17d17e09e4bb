//! The rig: cameras, turntable, and the capture that drives both.
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
