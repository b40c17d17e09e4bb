//! What a whole turn tells of an object without training: normals, albedo and the light of the room.
//!
//! Camera and object ride on one table, so for the object the light turns about the table's axis by an
//! angle that is known. [`read_curves`] brings a turn to one curve over that angle a pixel and channel,
//! [`solve_turn`] finds the normals, albedo and light that explain the curves, [`TurnMaps`] is what they
//! leave over, and [`TurnFiles`] writes all of it.
//!
//! | module | concern |
//! | --- | --- |
//! | `frame` | the camera over the table |
//! | `curves`, `read` | light over the table's angle, from a shard |
//! | `exposure` | steps of the exposure |
//! | `film`, `strip`, `probe` | what the video shows beside the object: the room, and a ball that measures its light |
//! | `placing` | whether the ball is where it is said to be |
//! | `light` | light of order 2 in the table's frame |
//! | `gloss` | what a shining surface shows of the room |
//! | `moments`, `search`, `robust` | the normal and albedo of one pixel |
//! | `start`, `prior` | normals to begin with |
//! | `room` | the light that explains all pixels |
//! | `joint` | light, gloss, normals and albedo at once |
//! | `solve` | light and normals of all pixels |
//! | `albedo` | albedo where a normal is hardly to be believed |
//! | `maps`, `verdict` | what is left over, and whether the room is fit for this |
//! | `shine` | the gloss of the whole object; the object as a file |
//! | `files`, `labels` | what is written |

mod albedo;
mod begin;
mod body;
mod curves;
mod error;
mod exposure;
mod files;
mod film;
mod frame;
mod gloss;
mod joint;
mod labels;
mod light;
mod maps;
mod moments;
mod placing;
mod prior;
mod probe;
mod read;
mod robust;
mod room;
mod search;
mod shine;
mod solve;
mod start;
mod strip;
mod verdict;

#[cfg(test)]
mod tests;

pub use body::{BodyFigure, BodyKind};
pub use curves::{CurveBuilder, TurnCurves};
pub use error::TurnError;
pub use exposure::ExposureStep;
pub use files::{TurnFigures, TurnFiles};
pub use film::{Filmed, film};
pub use frame::{Elevation, ElevationSource, TableFrame};
pub use labels::TurnLabels;
pub use light::TableLight;
pub use maps::TurnMaps;
pub use prior::{NormalsSource, prior_normals};
pub use probe::{Probe, ProbeBall, ProbeBuilder, ProbeLight, ProbePlace};
pub use read::{ReadTurn, TableSense, TurnOrigin, read_curves};
pub use room::fit_turn_light;
pub use solve::{SenseFigure, StartFigure, TurnOptions, TurnSolution, solve_turn};
pub use strip::{RoomStrip, StripBuilder, StripFigures};
pub use verdict::{Conditioning, RoomVerdict};
