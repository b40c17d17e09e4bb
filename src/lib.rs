//! relit: from one turn of a relighting turntable to 1500 masked frames in training shards.
//!
//! Camera and object ride together on a black electric turntable. One turn of 360 degrees in
//! 50 s, filmed at 30 frames/s, is 1500 frames in which the object stands still while light and
//! background change (Yi, Zhu and Xu, *Weakly-supervised Single-view Image Relighting*,
//! CVPR 2023). This crate is the part of the toolkit that turns such a recording into data:
//!
//! ```text
//! session folder or video file -> mask.png -> 1500 masked frames with statistics -> shard -> verify
//! ```
//!
//! # The map
//!
//! | room | what it is for | knows |
//! | --- | --- | --- |
//! | [`clock`] | microseconds of the monotonic clock | nobody |
//! | [`geometry`] | pixel rectangles | nobody |
//! | [`durable`] | files that appear whole or not at all | nobody |
//! | [`naming`] | which names a session may have | nobody |
//! | [`session`] | what a capture leaves on disk: manifest and frame index | `naming`, `durable` |
//! | [`turntable`] | the table: Grbl over a serial line, turns, angles over time | `clock` |
//! | [`simulator`] | a table without hardware: the firmware's core on a pseudoterminal | `clock` |
//! | [`video`] | FFmpeg: a video file to frames with numbers and time stamps, and a camera's stream to a file | `geometry` |
//! | [`camera`] | cameras: V4L2, nokhwa, and recordings replayed as one | `clock`, `session`, `video` |
//! | [`shard`] | the data set on disk: samples, records, tables; write, read, verify | `geometry`, `durable`, `naming` |
//! | [`report`] | the HTML page that shows one extracted session | `shard` |
//! | [`mask`] | seeds, GrabCut, clean-up of the mask | `session`, `video`, `geometry`, `durable` |
//! | [`extract`] | select, crop, measure, scale, write: the pipeline | `session`, `video`, `shard`, `report`, `geometry` |
//! | [`capture`] | drives table and camera through a turn and leaves a session | all above but `mask`, `extract`, `report`, `shard` |
//!
//! Data flows one way, and nothing knows what stands below it in this table. The programs in
//! `src/bin` parse arguments, call one function here and report. The library itself never prints,
//! never exits and never reads the environment; errors are typed, one `Error` a room.

pub mod camera;
pub mod capture;
pub mod clock;
pub mod durable;
pub mod extract;
pub mod geometry;
pub mod mask;
pub mod naming;
pub mod report;
pub mod session;
pub mod shard;
pub mod simulator;
pub mod turntable;
pub mod video;
