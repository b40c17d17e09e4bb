//! Measures of how far an estimated image is from the ground truth.
//!
//! It works on plain planes of `f32`, one a channel, row by row from the top: those of
//! [`Planes`](crate::image::Planes) or the slices of an array of channels x rows x columns. It knows
//! nothing of files, data sets, protocols and colour spaces: whoever calls brings both images into
//! the space in which they are to be compared.
//!
//! | measure | function | formula from |
//! | --- | --- | --- |
//! | MSE, scale-invariant MSE (SMSE) | [`Comparison::mse`] | Grosse et al. 2009, "Ground truth dataset and baseline evaluations for intrinsic image algorithms" |
//! | local MSE (LMSE) | [`Comparison::lmse`] | the same |
//! | SMSE and LMSE by convention | [`intrinsic_error`] | the same; [`Convention`] |
//! | SSIM, DSSIM | [`Comparison::ssim`] | Wang et al. 2004, "Image quality assessment: from error visibility to structural similarity" |
//! | angle between normals | [`angular_error`] | |
//!
//! A failed measurement is a [`MetricError`] with the reason. Sums are kept in `f64`.
//!
//! ```
//! use relight_core::image::Extent;
//! use relight_core::metrics::{Comparison, ScaleFit};
//!
//! let truth: &[f32] = &[0.1, 0.2, 0.3, 0.4];
//! let half: &[f32] = &[0.05, 0.1, 0.15, 0.2];
//! let pair = Comparison::new(Extent::new(2, 2), &[truth], &[half], &[true; 4])?;
//! assert!(pair.mse(ScaleFit::None) > 0.01);
//! assert!(pair.mse(ScaleFit::Image) < 1e-12);
//! # Ok::<(), relight_core::metrics::MetricError>(())
//! ```

mod angular;
mod comparison;
mod error;
mod intrinsic;
mod scaled;
mod structural;

pub use angular::{AngularError, angle, angular_error};
pub use comparison::Comparison;
pub use error::MetricError;
pub use intrinsic::{Convention, IntrinsicError, intrinsic_error};
pub use scaled::{ScaleFit, Windows};
pub use structural::{SSIM_WINDOW, dssim};
