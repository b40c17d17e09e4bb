//! What the page asks of its engine, in a worker of the browser.
//!
//! A message is the number of its parts and the length of each as little-endian 32-bit integers, then the parts. The first
//! part is JSON, the others are pictures (RGBA, 8 bits, sRGB) and files. An answer `{"error": "..."}` is a sentence for
//! people, and has changed nothing.
//!
//! | `op` | with | answers |
//! | --- | --- | --- |
//! | `load` | the weights | |
//! | `open_photo`, `open_pixels` | `object`, `name`, a file; or `width`, `height` and pixels | size, whether it has a mask, the picture |
//! | `mask` | `object`, `rect`, `strokes`, `auto` (without `rect`: by the plain background) | the mask, its area, warnings |
//! | `decompose` | `object` | albedo, shading, normals, highlight |
//! | `background` | `kind`, `name`, a file | the size of a scene's picture, a thumbnail |
//! | `render` | `scene`, `longest`, `before` | a picture, where each object is, notes |
//! | `layers` | `scene`, `longest` | background, objects and shadows apart: of objects light times alpha, encoded as sRGB, and alpha; of shadows what the light is multiplied with |
//! | `save` | `scene`, `format` | a PNG or JPEG in full size |
//! | `export` | `scene` | an archive |
//! | `close` | `object` | |

use relit_grabcut::Stroke;
use serde::Deserialize;

use super::page_scene::PageScene;

/// A request; pictures and files come as further parts of its message.
#[derive(Debug, Deserialize)]
#[serde(tag = "op", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Request {
    /// The weights of the networks.
    Load,
    /// A photograph or a captured object, as its file.
    OpenPhoto { object: u32, name: String },
    /// A photograph that the browser has decoded.
    OpenPixels {
        object: u32,
        name: String,
        width: u32,
        height: u32,
    },
    /// The mask of a photograph by hints.
    Mask {
        object: u32,
        rect: Option<[i32; 4]>,
        /// Without a rectangle, the object is found by its plain background.
        #[serde(default)]
        auto: bool,
        #[serde(default)]
        strokes: Vec<Stroke>,
    },
    /// What a photograph is decomposed into.
    Decompose { object: u32 },
    /// Forgets an object.
    Close { object: u32 },
    /// What the objects are put into.
    Background(BackgroundRequest),
    /// A picture of the scene.
    Render {
        scene: PageScene,
        longest: u32,
        #[serde(default)]
        before: bool,
    },
    /// The same in parts that can be moved.
    Layers { scene: PageScene, longest: u32 },
    /// A picture of the scene in full size, as a file.
    Save {
        scene: PageScene,
        format: FileFormat,
    },
    /// The scene and all it needs in an archive.
    Export { scene: PageScene, name: String },
}

/// A background.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum BackgroundRequest {
    /// A photograph, as its file.
    Photo { name: String },
    /// A photograph that the browser has decoded.
    PhotoPixels {
        name: String,
        width: u32,
        height: u32,
    },
    /// A panorama, as its file.
    PanoramaFile { name: String },
}

/// How a picture is saved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum FileFormat {
    /// Without loss.
    Png,
    /// Smaller.
    Jpeg,
}
