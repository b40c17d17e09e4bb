//! The mask of a recording: reads one frame, or frames of the whole turn, and writes three files.
//!
//! `NAME.png` is the mask, `NAME.json` its record, `NAME-preview.png` the image for checking it, and on
//! request `NAME-alpha.png` (`alpha.png` beside `mask.png`) its soft form. An
//! existing mask is replaced only if its record has its hash, because then it can be made again.
//!
//! [`make_mask`] makes a mask from hints that are known; [`edit`] lets a person draw them in a browser;
//! [`check_mask`] holds a mask against all frames.
//!
//! This module brings frames and folders to `relit-mask`. It knows nothing of data sets and the rig.

mod bench;
mod checking;
mod editor;
mod error;
mod files;
mod making;
mod request;
mod sampling;

pub use bench::{BenchImage, BenchRow, Prompt, bench_image, bench_images};
pub use checking::{
    CheckOutput, DriftCheck, FrameDrift, MaskReport, Verdict, check_mask, mask_doubts,
};
pub use editor::edit;
pub use error::MaskingError;
pub use files::MaskFiles;
pub use making::{MaskOutput, make_mask};
pub use request::MaskRequest;
