//! A captured object in one file, ready to be lit: `object.relit`.
//!
//! A [`CapturedObject`] is the maps of an object as it was seen from one side: how far each pixel is covered, normals,
//! albedo, gloss if it has any, and the confidence in each normal. The module knows nothing of where they come
//! from, nor of what is done with them.
//!
//! The file is a ZIP archive whose entries are stored without compression, so that any program can open it:
//!
//! | entry | content |
//! | --- | --- |
//! | `asset.json` | schema `relight.asset/1`, name, width and height, and the value `white` that the largest number of a map stands for |
//! | `alpha.png` | 16-bit grey: the part of the pixel that the object covers |
//! | `normal.png` | 16 bits, (n + 1) / 2, x to the right, y up, z to the viewer; black outside the object |
//! | `albedo.png` | 16 bits, linear, over `white.albedo`: the object's own colour, also in pixels that it covers in part |
//! | `specular.png`, `smoothness.png` | s_p, 16 bits, linear, over `white.specular`; α, 16-bit grey, over `white.smoothness`. Both or neither exist |
//! | `confidence.png` | 16-bit grey: 0 to 1 |
//!
//! Readers ignore entries and fields that they do not know. A change that an older reader would misunderstand raises
//! the number in the schema.

mod manifest;
mod object;
mod read;
mod write;

#[cfg(test)]
mod tests;

pub use manifest::CAPTURED_OBJECT_SCHEMA;
pub use object::CapturedObject;
