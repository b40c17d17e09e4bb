//! What of a crop is looked at to measure a shift: not all of it, as the pixels of the templates are known.

use std::ops::Range;

use image::GrayImage;

use super::brightness::{half, half_luma, luma};
use super::region::Region;
use super::structure::Needs;
use super::template::Template;
use crate::CropView;

/// Pixels around a place that are read to know its gradient between pixels.
const BETWEEN: usize = 3;

/// What is needed of the pictures in which one object is looked for.
#[derive(Debug, Default)]
pub(super) struct RequiredRegions {
    /// How often the crop is halved for the finest template.
    halvings: usize,
    /// Of the brightness, from the largest picture that is made to the smallest.
    lumas: Vec<Region>,
    /// Of each template's picture, from the finest on.
    pub(super) needs: Vec<Needs>,
}

impl RequiredRegions {
    /// Of templates, from the finest on, at shifts of up to `reach` pixels of the coarsest.
    pub(super) fn new(templates: &[Template], crop: (u32, u32), halvings: u32, reach: f64) -> Self {
        let halvings = halvings as usize;
        let larger = halvings.saturating_sub(1);
        let sizes = (halvings - larger..halvings + templates.len())
            .map(|by| (crop.0 >> by, crop.1 >> by))
            .collect::<Vec<_>>();
        let far = |scale: usize| (reach.ceil() as usize) << (templates.len() - 1 - scale);
        let needs: Vec<Needs> = templates
            .iter()
            .enumerate()
            .map(|(scale, template)| {
                let pixels = template.pixels.iter().map(|pixel| (pixel.x, pixel.y));
                let size = sizes.get(larger + scale).copied().unwrap_or_default();
                Needs::from_gradients(Region::around(pixels, far(scale) + BETWEEN, size))
            })
            .collect();
        let mut lumas: Vec<Region> = Vec::new();
        for (level, &size) in sizes.iter().enumerate().rev() {
            let own = level.checked_sub(larger).and_then(|scale| needs.get(scale));
            let smaller = lumas.last().map(|smaller| smaller.doubled(size));
            let both = match (own.map(|needs| &needs.luma), smaller) {
                (Some(own), Some(smaller)) => own.or(&smaller),
                (Some(own), None) => own.clone(),
                (None, smaller) => smaller.unwrap_or_default(),
            };
            lumas.push(both);
        }
        lumas.reverse();
        Self {
            halvings,
            lumas,
            needs,
        }
    }

    /// Notes the brightness of these rows of a crop, which come from the top to the bottom.
    pub(super) fn take_rows(
        &self,
        crop: CropView<'_>,
        rows: Range<usize>,
        levels: &mut Vec<GrayImage>,
    ) {
        levels.resize_with(self.lumas.len(), GrayImage::default);
        if let (Some(first), Some(needed)) = (levels.first_mut(), self.lumas.first()) {
            match self.halvings {
                0 => luma(crop, rows, needed, first),
                _ => half_luma(crop, rows, needed, first),
            }
        }
    }

    /// The brightness at each template's scale, from the finest on, once all rows of a crop were taken.
    pub(super) fn lumas_of_rows<'b>(&self, levels: &'b mut Vec<GrayImage>) -> &'b [GrayImage] {
        levels.resize_with(self.lumas.len(), GrayImage::default);
        self.halved(levels, 0)
    }

    /// The same of a picture that is as large as the finest template's.
    pub(super) fn lumas_of_sample<'b>(
        &self,
        sample: &GrayImage,
        levels: &'b mut Vec<GrayImage>,
    ) -> &'b [GrayImage] {
        levels.resize_with(self.lumas.len(), GrayImage::default);
        let at = self.larger();
        if let Some(finest) = levels.get_mut(at) {
            finest.clone_from(sample);
        }
        self.halved(levels, at)
    }

    /// Makes the pictures that are smaller than one.
    fn halved<'b>(&self, levels: &'b mut [GrayImage], from: usize) -> &'b [GrayImage] {
        for (at, needed) in self.lumas.iter().enumerate().skip(from + 1) {
            if let [.., larger, smaller] = &mut levels[..=at] {
                half(larger, needed, smaller);
            }
        }
        levels.get(self.larger()..).unwrap_or_default()
    }

    /// Pictures that are larger than the finest template's.
    fn larger(&self) -> usize {
        self.halvings.saturating_sub(1)
    }
}
