//! From how sure a network is of the object to marks for GrabCut.
//!
//! A network's map is much coarser than a frame, and its edge lies anywhere in a few of its cells. So only what is at
//! least a cell away from any doubt is marked.

use image::{DynamicImage, GrayImage, Luma};
use relit_data::geometry::Rect;
use relit_grabcut::{Mark, MaskError, Seeds};

use super::answer::SoftMap;
use super::picture::Placement;

/// A network that is nowhere as sure of the object found none. Where it is nowhere sure of the background, that is what
/// it is less sure of.
const FOUND_FROM: f32 = 0.5;
/// Of the most that it is sure of anywhere: from here on it is surely object, and up to there background.
const OBJECT_FROM: f32 = 0.9;
const BACKGROUND_TO: f32 = 0.1;
/// Half the width of the band that GrabCut decides, in pixels of the frame, and at least one cell of the map.
const BAND: f64 = 2.0;

const OBJECT: u8 = 255;
const UNKNOWN: u8 = 128;
const BACKGROUND: u8 = 0;

/// A map on the frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlacedMap<'a> {
    pub(super) map: &'a SoftMap,
    /// Where the network's picture comes from.
    pub(super) placement: Placement,
    /// Width and height of what the map covers of that picture.
    pub(super) covers: (usize, usize),
    /// The part of the frame that the network saw.
    pub(super) part: Rect,
}

impl PlacedMap<'_> {
    /// Cells in a pixel of the frame, across and down.
    fn density(&self) -> [f64; 2] {
        let [across, down] = self.placement.scale;
        let cells = [self.map.width as f64, self.map.height as f64];
        let covers = [self.covers.0 as f64, self.covers.1 as f64];
        [across * cells[0] / covers[0], down * cells[1] / covers[1]]
    }

    /// The marks of a frame of `size`, all background outside `rect`, and the given ones where there are some. `None` if
    /// no object was found.
    pub(super) fn marks(
        &self,
        (width, height): (u32, u32),
        rect: Option<Rect>,
        given: Option<&Seeds>,
    ) -> Result<Option<Seeds>, MaskError> {
        let density = self.density();
        let cells = |axis: usize, side: u32, all: usize| {
            ((f64::from(side) * density[axis]).ceil() as usize).clamp(1, all)
        };
        let columns = cells(0, self.part.w, self.map.width);
        let rows = cells(1, self.part.h, self.map.height);
        let Some(levels) = self.levels((columns, rows), rect) else {
            return Ok(None);
        };
        let level = |x: u32, y: u32| {
            let at = y as usize * width as usize + x as usize;
            match given.map(|seeds| seeds.marks()[at]) {
                Some(Mark::Object) => return OBJECT,
                Some(Mark::Background) => return BACKGROUND,
                _ => {}
            }
            let is_seen = self.part.contains(at, width);
            if !is_seen || rect.is_some_and(|rect| !rect.contains(at, width)) {
                return BACKGROUND;
            }
            let cell = |axis: usize, place: u32, begin: i32, cells: usize| {
                let from = f64::from(place) + 0.5 - f64::from(begin);
                ((from * density[axis]) as usize).min(cells - 1)
            };
            let column = cell(0, x, self.part.x, columns);
            levels[cell(1, y, self.part.y, rows) * columns + column]
        };
        let image = GrayImage::from_fn(width, height, |x, y| Luma([level(x, y)]));
        if image.as_raw().contains(&BACKGROUND) {
            Seeds::from_image(&DynamicImage::from(image)).map(Some)
        } else {
            Err(MaskError::Everything)
        }
    }

    /// What each cell of the part is; `None` without an object in the rectangle.
    fn levels(&self, (columns, rows): (usize, usize), rect: Option<Rect>) -> Option<Vec<u8>> {
        let [across, down] = self.density();
        let is_wanted = |column: usize, row: usize| {
            rect.is_none_or(|rect| {
                let x = f64::from(self.part.x) + (column as f64 + 0.5) / across;
                let y = f64::from(self.part.y) + (row as f64 + 0.5) / down;
                x >= f64::from(rect.x)
                    && y >= f64::from(rect.y)
                    && x < rect.right() as f64
                    && y < rect.bottom() as f64
            })
        };
        let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        let sure: Vec<f32> = places
            .map(|(column, row)| {
                let sure = self.map.values[row * self.map.width + column];
                if is_wanted(column, row) { sure } else { 0.0 }
            })
            .collect();
        let most = sure.iter().copied().fold(0.0, f32::max);
        if most < FOUND_FROM {
            return None;
        }
        let band = [across, down].map(|cells| (BAND * cells).ceil().max(1.0) as usize);
        let cells = |is_so: &dyn Fn(f32) -> bool| -> Vec<bool> {
            sure.iter().map(|&sure| is_so(sure / most)).collect()
        };
        let object = cells(&|sure| sure >= OBJECT_FROM);
        let mut background = cells(&|sure| sure <= BACKGROUND_TO);
        if !background.contains(&true) {
            background = cells(&|sure| sure < FOUND_FROM);
        }
        let object = shrunk(object, columns, band);
        let background = shrunk(background, columns, band);
        let levels = object.iter().zip(&background).map(|pair| match pair {
            (true, _) => OBJECT,
            (_, true) => BACKGROUND,
            _ => UNKNOWN,
        });
        Some(levels.collect())
    }
}

/// What is so many cells away from everything else, or all of it if nothing is. Beyond the border there is nothing else.
fn shrunk(cells: Vec<bool>, columns: usize, [across, down]: [usize; 2]) -> Vec<bool> {
    let rows = cells.len() / columns.max(1);
    let around = |at: usize, by: usize, end: usize| at.saturating_sub(by)..(at + by + 1).min(end);
    let in_row = |at: usize| {
        let (column, row) = (at % columns, at / columns);
        let mut near = around(column, across, columns);
        near.all(|column| cells[row * columns + column])
    };
    let in_rows: Vec<bool> = (0..cells.len()).map(in_row).collect();
    let in_column = |at: usize| {
        let (column, row) = (at % columns, at / columns);
        let mut near = around(row, down, rows);
        near.all(|row| in_rows[row * columns + column])
    };
    let inside: Vec<bool> = (0..cells.len()).map(in_column).collect();
    if inside.contains(&true) {
        inside
    } else {
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A map of 10 x 10 cells, sure of a square of 4 x 4 in its middle, on a frame of 40 x 40.
    fn square(inside: f32, outside: f32) -> SoftMap {
        let is_inside = |at: usize| (3..7).contains(&(at % 10)) && (3..7).contains(&(at / 10));
        let value = |at| if is_inside(at) { inside } else { outside };
        SoftMap {
            width: 10,
            height: 10,
            values: (0..100).map(value).collect(),
        }
    }

    fn on_frame(map: &SoftMap) -> PlacedMap<'_> {
        PlacedMap {
            map,
            placement: Placement {
                origin: [0.0; 2],
                scale: [8.0; 2],
            },
            covers: (320, 320),
            part: Rect::new(0, 0, 40, 40),
        }
    }

    fn counted(seeds: &Seeds) -> [usize; 3] {
        [Mark::Object, Mark::Unknown, Mark::Background].map(|wanted| {
            let marks = seeds.marks().iter();
            marks.filter(|&&mark| mark == wanted).count()
        })
    }

    #[test]
    fn what_is_a_cell_away_from_the_edge_is_marked() {
        for (inside, outside) in [(1.0, 0.0), (0.6, 0.01)] {
            let map = square(inside, outside);
            let marks = on_frame(&map).marks((40, 40), None, None).unwrap().unwrap();
            // 2 x 2 and 6 x 6 cells of 16 pixels.
            assert_eq!(counted(&marks), [64, 512, 1024]);
        }
    }

    #[test]
    fn a_map_that_is_nowhere_sure_finds_nothing_and_one_that_is_everywhere_leaves_no_background() {
        let map = square(0.0, 0.0);
        assert!(matches!(
            on_frame(&map).marks((40, 40), None, None),
            Ok(None)
        ));
        let map = square(0.45, 0.1);
        assert!(matches!(
            on_frame(&map).marks((40, 40), None, None),
            Ok(None)
        ));
        let map = square(1.0, 1.0);
        let all = on_frame(&map).marks((40, 40), None, None);
        assert!(matches!(all, Err(MaskError::Everything)));
    }

    #[test]
    fn outside_the_rectangle_is_background_and_what_is_found_there_does_not_count() {
        let map = square(1.0, 0.0);
        let rect = Rect::new(0, 0, 24, 40);
        let marks = on_frame(&map).marks((40, 40), Some(rect), None);
        let marks = marks.unwrap().unwrap();
        let at = |x: usize, y: usize| marks.marks()[y * 40 + x];
        assert_eq!(at(26, 20), Mark::Background);
        assert_eq!(at(22, 20), Mark::Unknown);
        assert_eq!(at(18, 20), Mark::Object);
        let corner = Rect::new(0, 0, 8, 8);
        let nothing = on_frame(&map).marks((40, 40), Some(corner), None);
        assert!(matches!(nothing, Ok(None)));
    }

    #[test]
    fn marks_that_are_given_count_more_than_the_map() {
        let mut painted = GrayImage::from_pixel(40, 40, Luma([128]));
        painted.put_pixel(20, 20, Luma([0]));
        painted.put_pixel(1, 1, Luma([255]));
        let given = Seeds::from_image(&painted.into()).unwrap();
        let map = square(1.0, 0.0);
        let marks = on_frame(&map).marks((40, 40), None, Some(&given));
        let marks = marks.unwrap().unwrap();
        let at = |x: usize, y: usize| marks.marks()[y * 40 + x];
        assert_eq!([at(20, 20), at(21, 20)], [Mark::Background, Mark::Object]);
        assert_eq!([at(1, 1), at(2, 1)], [Mark::Object, Mark::Background]);
    }

    #[test]
    fn an_object_of_few_cells_is_still_marked() {
        let mut map = square(0.0, 0.0);
        map.values[55] = 1.0;
        let marks = on_frame(&map).marks((40, 40), None, None).unwrap().unwrap();
        assert_eq!(counted(&marks)[0], 16);
    }
}
