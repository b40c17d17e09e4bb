//! What a stored picture marks as the object.

use std::path::Path;

use relit_data::mask::MaskPicture;

use super::codec::sides;
use super::{ImageError, Planes, StoredImage};

impl StoredImage {
    /// The mask that the picture shows, 1 on the object and 0 elsewhere, and a note on it for a person. Errors name it as `path`.
    ///
    /// # Errors
    /// [`ImageError::NotAMask`].
    pub fn object_mask(&self, path: &Path) -> Result<(Planes<1>, Option<String>), ImageError> {
        let extent = self.planes.extent();
        let [width, height] = sides(extent);
        let alpha = self.alpha.as_ref().map(|alpha| alpha.plane(0));
        let picture = MaskPicture::of_planes((width, height), self.planes.planes(), alpha);
        let object = picture.object().map_err(|fault| ImageError::NotAMask {
            path: path.to_owned(),
            fault,
        })?;
        let values = object
            .inside
            .iter()
            .map(|&inside| f32::from(u8::from(inside)));
        let mask = Planes::from_planes(extent, [values.collect()])?;
        Ok((mask, object.note(width)))
    }
}
