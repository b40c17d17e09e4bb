//! A whole turn into normals, albedo and the environment light.
//!
//! Camera and object ride on one table, so for the object the environment light rotates about the table's axis by an
//! angle that is known. [`read_curves`] reduces a turn to one curve over that angle for each pixel and channel. The network of
//! turns estimates normals and albedo. A measured light moves the normals to where the curves fit better; else one linear fit
//! finds the light. [`solve_turn`] does either, from a shard, and [`TurnFiles`] writes the results.
//!
//! | module | concern |
//! | --- | --- |
//! | `model` | what a pixel shows: `frame` (the camera over the table), `harmonics` (the curve as a Fourier series), `lighting` (light along a direction), `shading` (diffuse, metal) |
//! | `observe` | what the frames show: `reading`, `curves`, `conditioning`; `film` and `probe` for a ball in the video |
//! | `network` | `input`, `predict`: normals and albedo by the network of turns |
//! | `fit` | `by_network`: normals (`known_light`), light (`environment`) and albedo (`photo_albedo`) of a turn; `probe_light`, `probe_check`: the light by a ball |
//! | `report` | `files`, `sheet`, `movie`, `object`: what is written; `warnings`: what a user should know |
//!
//! `solving` puts them together. A folder knows those above it in this table. Each module has its parameters as constants, with
//! unit and source: *derived*, *measured*, *by convention*, *numerical* (a guard on which results hardly depend), or *by hand*
//! (no sweep is recorded).

mod error;
mod fit;
mod model;
mod network;
mod observe;
mod report;
mod solving;

#[cfg(test)]
mod tests;

pub use error::TurnError;
pub use fit::environment::fit_turn_light;
pub use fit::given_light::read_given_light;
pub use fit::probe_light::ProbeLight;
pub use fit::solution::TurnSolution;
pub use model::frame::{Elevation, FactSource, TableFrame};
pub use model::material::MaterialKind;
pub use network::input::{NetworkTurn, network_input};
pub use network::limits as input_limits;
pub use network::predict::TurnNetwork;
pub use observe::curves::TurnCurves;
pub use observe::probe::ProbeBall;
pub use observe::probe_place::ProbePlace;
pub use observe::reading::{ReadTurn, TableRotation, read_curves};
pub use observe::verdict::TurnVerdict;
pub use report::files::TurnFiles;
pub use solving::{SolvedTurn, TurnLight, TurnNetworks, TurnOptions, solve_turn};
