//! GrabCut: colour models of both sides and minimum cuts take turns, coarse to fine.

mod geodesic;
pub(crate) mod gmm;
pub(crate) mod grab_cut;
pub(crate) mod lab;
pub(crate) mod max_flow;
pub(crate) mod pyramid;
