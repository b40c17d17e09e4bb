//! Single-view relighting of the objects that a turntable rig records: light, render layers,
//! data and measures. It reads what `relit-extract` writes and knows nothing else of the toolkit.

pub mod nets;
