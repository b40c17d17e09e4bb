//! The protocols of the paper's tables, run over a folder of predictions or over a baseline.
//!
//! | protocol | truth | asks for | measures |
//! | --- | --- | --- | --- |
//! | [`evaluate_intrinsic`] | albedo and shading | both | SMSE, LMSE by each [`Convention`](relight_core::metrics::Convention) |
//! | [`evaluate_normals`] | normals | normals | MSE, DSSIM, angles |
//! | [`evaluate_light`] | normals and shading | light as coefficients | MSE, SMSE, SSIM of the shading that it makes |
//! | [`evaluate_highlights`] | image, highlight | highlight | MSE, DSSIM of the highlight and of the rest |
//! | [`evaluate_turns`] | turns with normals, albedo, light | nothing: it runs `turn` | angles, albedo, what is expected beside what is |
//! | [`evaluate_relighting`] | an object's maps, images under many lights | maps, or images | MSE, DSSIM |
//!
//! Each line of a [`ScoreTable`] states what was compared and how: numbers under one name differ by a
//! factor of two and more between conventions, and published tables rarely state theirs. What
//! cannot be read or measured is an error that names the image; no image is left out.
//!
//! ```no_run
//! use std::path::Path;
//!
//! use relight_core::light::NormalsFrame;
//! use relight_eval::{IntrinsicInput, Predictions, evaluate_intrinsic};
//! use relight_core::reader::{TruthLayout, TruthSet};
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let set = TruthSet::open(Path::new("mit-intrinsic"), TruthLayout::Mit)?;
//!     let found = [Predictions::new("out/net".into(), NormalsFrame::YUp)];
//!     let table = evaluate_intrinsic(&set, "all", IntrinsicInput::Diffuse, &found, &|_| {})?;
//!     println!("{table}");
//!     Ok(())
//! }
//! ```

mod error;
mod highlights;
mod intrinsic;
mod light;
mod normals;
mod predictions;
mod relighting;
mod run;
mod scores;
mod turns;

pub use error::EvalError;
pub use highlights::evaluate_highlights;
pub use intrinsic::{IntrinsicInput, evaluate_intrinsic};
pub use light::evaluate_light;
pub use normals::evaluate_normals;
pub use predictions::Predictions;
pub use relighting::{
    RelightMethod, RelightingRecipe, RelightingSet, evaluate_relighting, make_relighting,
};
pub use run::EvalProgress;
pub use scores::{ImageScores, MaskRule, Measured, ScoreLine, ScoreTable};
pub use turns::evaluate_turns;
