//! Layers at the photograph's size, composed strip by strip: all maps of a large photograph at once would take gigabytes.

use std::ops::Range;

use super::compose::{ComposedLayers, LayerSums, ResidualSums, possible_highlight};
use super::crop::{Window, inside};
use super::decomposer::Decomposition;
use super::encoding::PredictedMaps;
use super::network_output::{Fields, to_maps};
use relight_core::image::{Extent, ImageError, Part, Planes};
use relight_core::light::Normals;
use relight_core::parallel;

/// Rows of a strip.
const ROWS: usize = 64;

/// Maps at the network's size that are brought to another one, a strip at a time.
pub(super) struct MapUpscaler {
    /// They go on beyond the mask.
    fields: Fields,
    /// Which part of the other size is wanted.
    part: Part,
}

impl MapUpscaler {
    /// Of fields that are known inside a mask, for a part of the square around the object.
    pub(super) fn new(fields: &Fields, mask: &Planes<1>, part: Part) -> Self {
        let known = inside(mask);
        let wanted = vec![true; known.len()];
        Self {
            fields: fields.clone().extended(&known, &wanted),
            part,
        }
    }

    /// The maps of some rows, 0 outside the mask. Of the fields only the rows that they are made of are looked at.
    fn maps(&self, rows: &Range<usize>, mask: &[bool]) -> Result<PredictedMaps, ImageError> {
        let (small, whole) = (self.fields.extent(), self.part.whole);
        let target = Part {
            whole,
            at: [self.part.at[0], self.part.at[1] + rows.start as i64],
            extent: Extent::new(self.part.extent.width, rows.len()),
        };
        let place = |row: i64| row as f64 * small.height as f64 / whole.height.max(1) as f64;
        let first = (place(target.at[1]) - 2.0).floor().max(0.0) as usize;
        let first = first.min(small.height);
        let behind = place(target.at[1] + rows.len() as i64) + 2.0;
        let behind = (behind.ceil().max(0.0) as usize).clamp(first, small.height);
        let source = Part {
            whole: small,
            at: [0, first as i64],
            extent: Extent::new(small.width, behind - first),
        };
        let fields = cut_rows(&self.fields, first..behind).resized_part(&source, &target);
        to_maps(fields, mask)
    }
}

fn cut_rows<const C: usize>(image: &Planes<C>, rows: Range<usize>) -> Planes<C> {
    let extent = Extent::new(image.extent().width, rows.len());
    image.cut([0, rows.start], extent)
}

/// What layers are made for.
pub(super) struct LayerPlan<'a> {
    /// The object's pixels, 0 outside the mask.
    pub(super) picture: &'a Planes<3>,
    pub(super) inside: &'a [bool],
    /// Where in the photograph these pixels are.
    pub(super) window: Window,
}

impl LayerPlan<'_> {
    /// Composes all strips: once for what is known of the whole picture only, and once more for the layers, which are put
    /// into black ones of the photograph's size.
    pub(super) fn compose(
        &self,
        maps: &MapUpscaler,
        found: &mut Decomposition,
    ) -> Result<(), ImageError> {
        let height = self.picture.extent().height;
        let strips: Vec<Range<usize>> = (0..height)
            .step_by(ROWS)
            .map(|first| first..(first + ROWS).min(height))
            .collect();
        let sums = parallel::map(strips.len(), |at| {
            let (picture, mask, maps) = self.strip(maps, &strips[at], found.is_glossy)?;
            Ok::<_, ImageError>(LayerSums::from_maps(&picture, mask, &maps))
        });
        let mut all = LayerSums::default();
        for sums in sums {
            all = all.and(sums?);
        }
        let mut normals = Planes::zeros(found.shading.extent());
        let mut residual = ResidualSums::default();
        // As many at once as there are threads: each waits in memory until it is put in its place.
        for some in strips.chunks(parallel::threads().max(1)) {
            let layers = parallel::map(some.len(), |at| {
                let (picture, mask, maps) = self.strip(maps, &some[at], found.is_glossy)?;
                Ok::<_, ImageError>(ComposedLayers::new(picture, mask, maps, &all))
            });
            for (rows, layers) in some.iter().zip(layers) {
                let layers = layers?;
                residual = residual.and(layers.residual);
                self.put(layers.normals.planes(), rows.start, &mut normals);
                self.put(&layers.albedo, rows.start, found.albedo.planes_mut());
                self.put(&layers.shading, rows.start, &mut found.shading);
                self.put(&layers.diffuse, rows.start, found.diffuse.planes_mut());
                if found.is_glossy {
                    self.put(&layers.highlight, rows.start, &mut found.highlight);
                }
            }
        }
        found.normals = Normals::new(normals);
        found.residual = residual.relative();
        Ok(())
    }

    /// Picture, mask and maps of some rows.
    fn strip(
        &self,
        maps: &MapUpscaler,
        rows: &Range<usize>,
        is_glossy: bool,
    ) -> Result<(Planes<3>, &[bool], PredictedMaps), ImageError> {
        let width = self.picture.extent().width;
        let mask = &self.inside[rows.start * width..rows.end * width];
        let picture = cut_rows(self.picture, rows.clone());
        let mut maps = maps.maps(rows, mask)?;
        maps.highlight = if is_glossy {
            possible_highlight(&picture, mask, maps.highlight)
        } else {
            Planes::zeros(picture.extent())
        };
        Ok((picture, mask, maps))
    }

    /// Puts a strip where it belongs in the photograph.
    fn put<const C: usize>(&self, strip: &Planes<C>, first: usize, to: &mut Planes<C>) {
        let (width, whole) = (strip.extent().width, to.extent().width);
        let [x, y] = self.window.at;
        for (to, from) in to.planes_mut().into_iter().zip(strip.planes()) {
            for (row, from) in from.chunks_exact(width).enumerate() {
                to[(y + first + row) * whole + x..][..width].copy_from_slice(from);
            }
        }
    }
}
