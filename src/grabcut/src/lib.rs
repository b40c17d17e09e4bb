//! Which pixels of an image are the object: hints from a person or what a turn shows, GrabCut, clean-up.
//!
//! Camera and object ride on the same turntable, so one mask fits all frames of a turn. [`segment`]
//! makes it from one image and hints, [`segment_with`] also from what the frames of a whole turn show
//! ([`TurnFrames`]), with or without hints. [`preview`] shows it for a person to check; [`MaskCheck`] holds a mask
//! against a turn.
//!
//! Everything is computed from images and bytes in memory: the crate knows no files, videos or threads, links
//! no native library, and also runs in a browser.
//!
//! # Cut an object out by a rectangle
//!
//! ```
//! use image::{Rgb, RgbImage};
//! use relit_data::geometry::Rect;
//! use relit_grabcut::{Hints, SegmentSettings, segment};
//!
//! // A yellow disc of radius 18 on a dark ground. From a file: image::open(path)?.into_rgb8()
//! let inside = |x: u32, y: u32| (f64::from(x) - 48.0).hypot(f64::from(y) - 32.0) <= 18.0;
//! let image = RgbImage::from_fn(96, 64, |x, y| {
//!     Rgb(if inside(x, y) { [220, 180, 40] } else { [20, (x % 7) as u8, 60] })
//! });
//!
//! // The object lies inside the rectangle; what is outside is background.
//! let hints = Hints::from(Rect::new(24, 8, 50, 48));
//! let mask = segment(&image, &hints, &SegmentSettings::default())?;
//!
//! assert_eq!(mask.image.get_pixel(48, 32).0, [255]);
//! assert_eq!(mask.image.get_pixel(10, 10).0, [0]);
//! assert_eq!(mask.statistics.bounding_box, Rect::new(30, 14, 37, 37));
//! assert!(mask.warnings.is_empty());
//! # Ok::<(), relit_grabcut::MaskError>(())
//! ```
//!
//! Before a plain background no hint is needed: [`segment_on_plain`].
//!
//! # How it decides
//!
//! With a rectangle, pixels outside are background; seeds overrule that. A small network says which object the hints
//! mean. The cut begins with its answer, which is evidence, too. With seeds alone, the colours of the marked pixels decide
//! first, and what is connected with them. Colour models of both sides and minimum cuts take turns, and at each larger
//! size a band along the edge is decided again.
//!
//! With a turn, another network says which pixels show object, table or room. A pixel's colour is its average over the
//! frames, how much it changes counts too, and neighbours that change together belong together.
//!
//! Of the result the largest 8-connected component is kept, and those that have three tenths of its area.
//! Small holes are filled, except those in which seeds mark background.

mod beyond;
mod bitmap;
mod by_hints;
mod check;
mod cleanup;
mod cut;
mod error;
mod expected_overlap;
mod hints;
mod outline;
mod plain;
mod preview;
mod segment;
mod settings;
mod turn;
mod unet;
mod warning;

pub use check::fit::{DoubtfulRegion, MaskCheck, ShapeCheck};
pub use cut::grab_cut::ITERATIONS;
pub use cut::pyramid::half_image;
pub use error::MaskError;
pub use hints::marks::{Hints, Mark, Seeds};
pub use hints::strokes::{Brush, Stroke, Strokes};
pub use outline::outline;
pub use plain::{PlainCut, segment_on_plain};
pub use preview::{grey_png, preview, rgb_png};
pub use segment::{Mask, MaskStatistics, check_hints, clean_cut, segment, segment_with};
pub use settings::{Effort, MAX_PIXELS, MIN_SIDE, SegmentSettings};
pub use turn::statistics::{MIN_TURN_FRAMES, TURN_FRAMES, TurnFrames, TurnStatistics};
