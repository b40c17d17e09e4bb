//! The part of a frame that is looked at: its crop, and some pixels around it.

use image::RgbaImage;

/// A rectangle of a picture whose pixels are four bytes: red, green, blue, and one that does not count.
#[derive(Debug, Clone, Copy)]
pub struct CropView<'a> {
    picture: &'a RgbaImage,
    left: u32,
    top: u32,
    width: u32,
    height: u32,
}

impl<'a> CropView<'a> {
    /// The whole picture.
    pub fn whole(picture: &'a RgbaImage) -> Self {
        let (width, height) = picture.dimensions();
        Self {
            picture,
            left: 0,
            top: 0,
            width,
            height,
        }
    }

    /// The picture without `by` pixels on each side; empty if nothing remains.
    pub fn within(picture: &'a RgbaImage, by: u32) -> Self {
        let (width, height) = picture.dimensions();
        Self {
            picture,
            left: by,
            top: by,
            width: width.saturating_sub(by.saturating_mul(2)),
            height: height.saturating_sub(by.saturating_mul(2)),
        }
    }

    /// The same rectangle further right and down; `None` if the picture has no `apron` pixels around it.
    #[must_use]
    pub fn moved(self, [dx, dy]: [i32; 2], apron: u32) -> Option<Self> {
        let moved = Self {
            left: self.left.checked_add_signed(dx)?,
            top: self.top.checked_add_signed(dy)?,
            ..self
        };
        let (width, height) = self.picture.dimensions();
        let fits = |start: u32, extent: u32, whole: u32| {
            start >= apron
                && u64::from(start) + u64::from(extent) + u64::from(apron) <= u64::from(whole)
        };
        (fits(moved.left, moved.width, width) && fits(moved.top, moved.height, height))
            .then_some(moved)
    }

    /// Width and height, pixels.
    pub fn dimensions(self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// The bytes of row `y`, which may lie up to `apron` rows outside, with as many pixels on both sides; empty
    /// if the picture does not have them.
    pub(super) fn row(self, y: i64, apron: u32) -> &'a [u8] {
        let bytes = |pixels: i64| usize::try_from(4 * pixels).ok();
        let at = |picture: &'a RgbaImage| {
            let left = i64::from(self.left) - i64::from(apron);
            let row = i64::from(self.top) + y;
            let extent = i64::from(self.width) + 2 * i64::from(apron);
            let start = bytes(row * i64::from(picture.width()) + left)?;
            let inside = left >= 0 && row >= 0 && left + extent <= i64::from(picture.width());
            let row = picture.as_raw().get(start..start + bytes(extent)?)?;
            inside.then_some(row)
        };
        at(self.picture).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use image::Rgba;

    use super::*;

    fn picture() -> RgbaImage {
        RgbaImage::from_fn(9, 8, |x, y| Rgba([x as u8, y as u8, 0, 255]))
    }

    #[test]
    fn a_moved_view_shows_the_pixels_there() {
        let picture = picture();
        let view = CropView::within(&picture, 3);
        assert_eq!(view.dimensions(), (3, 2));
        assert_eq!(view.row(0, 0)[..2], [3, 3]);
        let moved = view.moved([1, -1], 2).unwrap();
        assert_eq!(moved.row(1, 0)[..2], [4, 3]);
        assert_eq!(moved.row(-2, 2)[..2], [2, 0]);
        assert_eq!(moved.row(-2, 2).len(), 4 * 7);
        assert_eq!(moved.row(1, 0).len(), 4 * 3);
    }

    #[test]
    fn what_the_picture_does_not_have_is_not_shown() {
        let picture = picture();
        let view = CropView::within(&picture, 3);
        assert!(view.moved([2, 0], 2).is_none());
        assert!(view.moved([-4, 0], 0).is_none());
        assert!(view.row(5, 0).is_empty());
        assert!(view.row(0, 4).is_empty());
        assert_eq!(CropView::within(&picture, 5).dimensions(), (0, 0));
        assert_eq!(CropView::whole(&picture).row(7, 0).len(), 36);
    }
}
