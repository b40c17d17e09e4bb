//! The finest scale by a few patches: those that say most about a shift reach what the whole object does, as light that
//! moves pulls at all of it.
//!
//! A coarser scale tells where they are looked for. A shift is believed if as much of them agrees with the template as is
//! usual in the turn; otherwise the whole object is fitted.

use image::GrayImage;
use relit_data::statistics::upper_median;

use super::fit::Fit;
use super::region::Region;
use super::structure::{AROUND, Extractor, Gradients, Needs};
use super::template::{TILE, Template, TemplatePixel, information, keep_most_telling};

/// Patches, and pixels of them, that are kept: those that say most.
const MAX_PATCHES: usize = 30;
const MAX_PIXELS: usize = 1_000;
/// A shift further from where the patches are looked for, pixels, is not theirs to find.
const NEAR: f64 = 1.5;
/// Pixels around a patch in which its gradients are needed at such a shift, between pixels.
const BETWEEN: u32 = 3;
/// Pixels around a patch that are looked at.
const BORDER: u32 = BETWEEN + AROUND as u32;
const SIDE: u32 = TILE + 2 * BORDER;
/// Of the median part of the patches that agrees, the least with which a shift is believed.
const MIN_AGREEMENT: f64 = 0.8;

/// The patches of a template. They are put side by side in one picture, so that its rows are long.
#[derive(Debug)]
pub(super) struct Patches {
    /// The first pixel that is looked at of each, which may lie beyond the frame.
    starts: Vec<[isize; 2]>,
    /// In coordinates of the picture.
    template: Template,
    needs: Needs,
    min_agreement: f64,
}

/// The patches of a frame, and their gradients.
#[derive(Debug, Default)]
pub(super) struct PatchBuffers {
    luma: GrayImage,
    gradients: Gradients,
}

impl Patches {
    /// `None` if the template is hardly larger.
    pub(super) fn from_template(template: &Template) -> Option<Self> {
        if template.pixels.len() < 2 * MAX_PIXELS {
            return None;
        }
        let tile = |pixel: &TemplatePixel| [pixel.x / TILE, pixel.y / TILE];
        let tiles = template.pixels.chunk_by(|a, b| tile(a) == tile(b));
        let says = |tile: &[TemplatePixel]| tile.iter().map(information).sum::<f32>();
        let mut tiles: Vec<_> = tiles.map(|tile| (says(tile), tile)).collect();
        tiles.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let best = tiles.iter().take(MAX_PATCHES);
        let mut pixels: Vec<_> = best.flat_map(|(_, tile)| *tile).copied().collect();
        keep_most_telling(&mut pixels, MAX_PIXELS);
        let mut starts = Vec::new();
        for (left, patch) in (0..)
            .step_by(SIDE as usize)
            .zip(pixels.chunk_by_mut(|a, b| tile(a) == tile(b)))
        {
            let at = tile(patch.first()?);
            starts.push(at.map(|at| (at * TILE) as isize - BORDER as isize));
            for pixel in patch {
                pixel.x = left + pixel.x % TILE + BORDER;
                pixel.y = pixel.y % TILE + BORDER;
            }
        }
        let width = SIDE * starts.len() as u32;
        let rows = AROUND as u32..SIDE - AROUND as u32;
        let gradients = rows.flat_map(|y| [(0, y), (width - 1, y)]);
        Some(Self {
            template: Template {
                piece: pixels.len() / starts.len(),
                pixels,
            },
            starts,
            needs: Needs::from_gradients(Region::around(gradients, 0, (width, SIDE))),
            min_agreement: 0.0,
        })
    }

    /// Asks of frames what is usual in a turn, by the parts of the patches that agree in some of its frames. Whether in all
    /// of these enough do.
    pub(super) fn expect(&mut self, agreements: &[f64]) -> bool {
        let usual = upper_median(agreements.iter().copied()).unwrap_or_default();
        self.min_agreement = MIN_AGREEMENT * usual;
        agreements
            .iter()
            .all(|agrees| *agrees >= self.min_agreement)
    }

    /// The fit nearest to `start` and the part of the patches that agrees; `None` if it is not to be believed.
    pub(super) fn fit(
        &self,
        luma: &GrayImage,
        start: [f64; 2],
        still: f64,
        extractor: &mut Extractor,
        buffers: &mut PatchBuffers,
    ) -> Option<(Fit, f64)> {
        let near = start.map(f64::round);
        buffers.look_at(luma, &self.starts, near.map(|near| near as isize));
        let gradients = &mut buffers.gradients;
        extractor.gradients(&buffers.luma, &self.needs, gradients);
        let start = [0, 1].map(|axis| start[axis] - near[axis]);
        let fit = self.template.fit(gradients, start, NEAR, still)?;
        let agreement = self.template.agreement(gradients, fit.shift);
        let shift = [0, 1].map(|axis| fit.shift[axis] + near[axis]);
        (agreement >= self.min_agreement).then_some((Fit { shift, ..fit }, agreement))
    }
}

impl PatchBuffers {
    /// Takes the patches from a frame, moved by `near`; beyond the frame its nearest pixels are repeated.
    fn look_at(&mut self, luma: &GrayImage, starts: &[[isize; 2]], near: [isize; 2]) {
        let (width, height) = (luma.width() as usize, luma.height() as isize);
        let (side, all) = (SIDE as usize, SIDE * starts.len() as u32);
        if self.luma.width() != all {
            self.luma = GrayImage::new(all, SIDE);
        }
        let rows = self.luma.chunks_exact_mut(all as usize);
        for (y, row) in (0..).zip(rows) {
            for ([left, top], to) in starts.iter().zip(row.chunks_exact_mut(side)) {
                let from = (top + near[1] + y).clamp(0, height - 1) as usize * width;
                let from = luma.as_raw().get(from..from + width).unwrap_or_default();
                let left = left + near[0];
                let inside = usize::try_from(left).ok();
                if let Some(part) = inside.and_then(|left| from.get(left..left + side)) {
                    to.copy_from_slice(part);
                    continue;
                }
                for (x, to) in (left..).zip(to) {
                    *to = from[x.clamp(0, width as isize - 1) as usize];
                }
            }
        }
    }
}
