//! What relit leaves on disk, and nothing that makes it: sessions as a capture records them, shards
//! of masked frames with their statistics, and the page that reports on one.
pub mod causes;
pub mod durable;
pub mod geometry;
pub mod naming;
pub mod report;
pub mod session;
pub mod shard;
