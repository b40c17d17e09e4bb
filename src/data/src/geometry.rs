//! Pixel rectangles. Knows nothing of images, files or masks.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// An axis-parallel rectangle of whole pixels, written `[x, y, w, h]` in JSON and `X,Y,W,H` on a
/// command line. x grows to the right, y downwards; (x, y) is the upper left pixel. A rectangle may
/// extend beyond the image it is used with (negative x or y).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(from = "(i32, i32, u32, u32)", into = "(i32, i32, u32, u32)")]
pub struct Rect {
    /// Left edge, pixels.
    pub x: i32,
    /// Upper edge, pixels.
    pub y: i32,
    /// Width, pixels.
    pub w: u32,
    /// Height, pixels.
    pub h: u32,
}

impl Rect {
    /// The rectangle with the given corner and size.
    pub const fn new(x: i32, y: i32, w: u32, h: u32) -> Self {
        Self { x, y, w, h }
    }

    /// The middle of an image: half its width and height, at least one pixel.
    pub fn middle_of(width: u32, height: u32) -> Self {
        let (w, h) = ((width / 2).max(1), (height / 2).max(1));
        let edge = |whole: u32, part: u32| {
            i32::try_from(whole.saturating_sub(part) / 2).unwrap_or(i32::MAX)
        };
        Self::new(edge(width, w), edge(height, h), w, h)
    }

    /// One past the right edge, in pixels.
    pub fn right(self) -> i64 {
        i64::from(self.x) + i64::from(self.w)
    }

    /// One past the lower edge, in pixels.
    pub fn bottom(self) -> i64 {
        i64::from(self.y) + i64::from(self.h)
    }

    /// With as many pixels more on each side.
    #[must_use]
    pub fn grown(self, by: u32) -> Self {
        Self::new(
            self.x.saturating_sub_unsigned(by),
            self.y.saturating_sub_unsigned(by),
            self.w.saturating_add(by.saturating_mul(2)),
            self.h.saturating_add(by.saturating_mul(2)),
        )
    }

    /// Whether a pixel is inside, by its number in row order of an image of this width.
    pub fn contains(self, pixel: usize, width: u32) -> bool {
        let (x, y) = (
            pixel as i64 % i64::from(width),
            pixel as i64 / i64::from(width),
        );
        (i64::from(self.x)..self.right()).contains(&x)
            && (i64::from(self.y)..self.bottom()).contains(&y)
    }

    /// The part that lies inside an image of `width` x `height`, if there is any.
    #[must_use]
    pub fn clipped_to(self, width: u32, height: u32) -> Option<Self> {
        let x0 = i64::from(self.x).max(0);
        let y0 = i64::from(self.y).max(0);
        let w = self.right().min(i64::from(width)) - x0;
        let h = self.bottom().min(i64::from(height)) - y0;
        if w <= 0 || h <= 0 {
            return None;
        }
        Some(Self {
            x: i32::try_from(x0).ok()?,
            y: i32::try_from(y0).ok()?,
            w: u32::try_from(w).ok()?,
            h: u32::try_from(h).ok()?,
        })
    }
}

impl From<(i32, i32, u32, u32)> for Rect {
    fn from((x, y, w, h): (i32, i32, u32, u32)) -> Self {
        Self { x, y, w, h }
    }
}

impl From<Rect> for (i32, i32, u32, u32) {
    fn from(r: Rect) -> Self {
        (r.x, r.y, r.w, r.h)
    }
}

impl fmt::Display for Rect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{},{},{}", self.x, self.y, self.w, self.h)
    }
}

impl FromStr for Rect {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!("{text:?} is not a rectangle: give X,Y,W,H in whole pixels, W and H at least 1")
        };
        let mut parts = text.split(',').map(str::trim);
        let mut next = || parts.next().ok_or_else(wrong);
        let (x, y, w, h) = (next()?, next()?, next()?, next()?);
        if parts.next().is_some() {
            return Err(wrong());
        }
        let rect = Self {
            x: x.parse().map_err(|_| wrong())?,
            y: y.parse().map_err(|_| wrong())?,
            w: w.parse().map_err(|_| wrong())?,
            h: h.parse().map_err(|_| wrong())?,
        };
        if rect.w == 0 || rect.h == 0 {
            return Err(wrong());
        }
        Ok(rect)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rectangle_is_read_from_the_command_line_and_back() {
        let rect: Rect = "10, -4,30,40".parse().unwrap();
        assert_eq!(rect, Rect::new(10, -4, 30, 40));
        assert_eq!(rect.to_string(), "10,-4,30,40");
    }

    #[test]
    fn the_middle_is_half_as_wide_and_high_and_never_empty() {
        assert_eq!(Rect::middle_of(640, 480), Rect::new(160, 120, 320, 240));
        assert_eq!(Rect::middle_of(1, 1), Rect::new(0, 0, 1, 1));
    }

    #[test]
    fn a_text_that_is_no_rectangle_is_refused() {
        for text in [
            "",
            "1,2,3",
            "1,2,3,4,5",
            "a,2,3,4",
            "1,2,-3,4",
            "1,2,0,4",
            "1,2,3,99999999999",
        ] {
            assert!(text.parse::<Rect>().is_err(), "{text}");
        }
    }

    #[test]
    fn clipping_keeps_what_lies_inside() {
        let image = |r: Rect| r.clipped_to(100, 50);
        assert_eq!(
            image(Rect::new(-5, -5, 10, 10)),
            Some(Rect::new(0, 0, 5, 5))
        );
        assert_eq!(
            image(Rect::new(90, 40, 100, 100)),
            Some(Rect::new(90, 40, 10, 10))
        );
        assert_eq!(image(Rect::new(100, 0, 5, 5)), None);
        assert_eq!(
            image(Rect::new(i32::MIN, 0, u32::MAX, 1)),
            Some(Rect::new(0, 0, 100, 1))
        );
    }
}
