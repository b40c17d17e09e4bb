//! relit: from one turn of a relighting turntable to 1500 masked frames in training shards.
pub mod console;
pub mod extract;
pub mod masking;
