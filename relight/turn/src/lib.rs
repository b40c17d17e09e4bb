//! Photometric stereo of a whole turn: normals, albedo and the environment light, without training.
//!
//! Camera and object ride on one table, so for the object the environment light rotates about the table's axis by an
//! angle that is known. [`read_curves`] brings a turn to one curve over that angle a pixel and channel. [`solve_turn`]
//! finds the normals, albedo and light that fit the curves. [`TurnMaps`] has their residuals, and [`TurnFiles`] writes
//! all of it.
//!
//! | module | concern |
//! | --- | --- |
//! | `model` | what a pixel shows: `frame` (the camera over the table), `harmonics` (the curve as a Fourier series), `lighting` (Lambertian), `gloss`, `metal`, `shading` (one of them) |
//! | `observe` | what the frames show: `reading`, `curves`, `exposure`, `conditioning`; `film`, `strip`, `rim` and `probe` for what the video has beside the object |
//! | `network` | `input`, `answer`: normals by the network of turns |
//! | `fit` | `search` and `normal_step` (one pixel), `joint`, `unknowns` and `schur` (all of them with the light), `initialisation`, `azimuth`, `prior`, `robust`, `albedo`, `confidence`, `solve`; `rotation` (which way the table turns) |
//! | `report` | `files`, `figures`, `maps`, `labels`, `object`: what is written; `warnings` and `destinations`: what a user should know after and before |
//!
//! A folder knows those above it in this table. Each module has its parameters in one struct, with unit and source:
//! *derived*, *measured*, *by convention*, *numerical* (a guard on which results hardly depend), or *by hand*, of which
//! no sweep is recorded.

mod error;
mod fit;
mod model;
mod network;
mod observe;
mod report;
mod setting_error;

#[cfg(test)]
mod test_turns;

pub use error::TurnError;
pub use fit::azimuth::{AzimuthEvidence, AzimuthFigures, AzimuthSource};
pub use fit::environment::fit_turn_light;
pub use fit::figures::{DirectionFigure, InitialisationFigure, MaterialFigure};
pub use fit::given_light::read_given_light;
pub use fit::options::{TurnOptions, TurnPrior};
pub use fit::prior::{NormalsSource, prior_albedo, prior_normals};
pub use fit::probe_light::ProbeLight;
pub use fit::solution::TurnSolution;
pub use fit::solve::solve_turn;
pub use model::frame::{Elevation, ElevationSource, TableFrame};
pub use model::lighting::TableLight;
pub use model::material::MaterialKind;
pub use network::answer::NetworkNormal;
pub use network::input::{NetworkTurn, PhaseHypothesis, network_input};
pub use network::predict::{HypothesisFigures, PhaseFigure, TurnNetwork, TurnPrediction};
pub use observe::conditioning::Conditioning;
pub use observe::curves::{CurveBuilder, TurnCurves};
pub use observe::exposure::ExposureStep;
pub use observe::film::{Filmed, film};
pub use observe::probe::{Probe, ProbeBall, ProbeBuilder};
pub use observe::probe_place::ProbePlace;
pub use observe::reading::{
    ReadTurn, RotationDirection, RotationSource, TableRotation, TurnOrigin, read_curves,
};
pub use observe::session::session_of;
pub use observe::strip::{PanoramaStrip, StripBuilder, StripFigures};
pub use observe::verdict::LightVerdict;
pub use report::destinations::{AssetDestination, DestinationError, Destinations};
pub use report::figures::TurnFigures;
pub use report::files::TurnFiles;
pub use report::labels::TurnLabels;
pub use report::maps::TurnMaps;
pub use report::warnings::TurnWarning;
pub use setting_error::SettingError;
