//! Parts of the image that a cut left out although the object encloses them, or nearly does: they are object unless
//! they show the background or the table.

use super::bitmap::{Bitmap, Connectivity};
use super::turn::TurnField;

/// An opening to the outside of at most twice this share of the frame's width counts as closed.
const NECK: f64 = 0.012;
/// Beside a part is what lies within this share of the frame's width.
const BESIDE: f64 = 0.02;
/// The background is what lies further than this share of the width from the object.
const AWAY: f64 = 0.02;
/// A part is table, or like the rows' ends, from this share of its pixels on.
const MOSTLY: f64 = 0.5;
/// One looks through an opening whose outline is at least this share as strong as the object's.
const OPENING_OUTLINE: f32 = 0.5;

/// What is not in the object, and enclosed by it but for a narrow neck.
pub(super) fn enclosed(object: &Bitmap, width: usize) -> Bitmap {
    let neck = ((width as f64 * NECK).round() as usize).max(1);
    let closed = object.dilated(neck).inverted().dilated(neck).inverted();
    let closed = closed.map(|at, bit| bit || object.bits()[at]);
    let holes = holes(&closed);
    closed.map(|at, bit| (bit || holes.bits()[at]) && !object.bits()[at])
}

/// What is not in the object and does not reach the border.
pub(super) fn holes(object: &Bitmap) -> Bitmap {
    let ground = object.inverted();
    let components = ground.components(Connectivity::Four);
    let frame = object.map(|_, _| true).bounds();
    let inside: Vec<bool> = components
        .list
        .iter()
        .map(|component| {
            let bounds = component.bounds;
            bounds.x > 0
                && bounds.y > 0
                && bounds.right() < frame.right()
                && bounds.bottom() < frame.bottom()
        })
        .collect();
    ground.map(|at, _| components.at(at).is_some_and(|index| inside[index]))
}

impl TurnField {
    /// The object with the parts that it encloses and that show nothing else.
    pub(super) fn completed(&self, object: &Bitmap) -> Bitmap {
        let parts = enclosed(object, self.size.0);
        let components = parts.components(Connectivity::Four);
        let is_object: Vec<bool> = (0..components.list.len())
            .map(|index| {
                let part = parts.map(|at, _| components.at(at) == Some(index));
                self.is_background(&part, object) == Some(false)
            })
            .collect();
        object.map(|at, bit| bit || components.at(at).is_some_and(|index| is_object[index]))
    }

    /// Whether a part inside or beside the object shows the background or the table; none of a part without pixels.
    pub(super) fn is_background(&self, part: &Bitmap, object: &Bitmap) -> Option<bool> {
        if part.count() == 0 {
            return None;
        }
        let rest = object.map(|at, bit| bit && !part.bits()[at]);
        let ground = self.ground(part, object);
        let beside = self.beside(part, &rest);
        let moves = self.witness.moves(part, &beside, &ground);
        if moves == Some(true) {
            return Some(true);
        }
        // What lies before the table brightens with it, and a dark part of the object with the object.
        let surface = &self.table.surface;
        let as_dark = self
            .table
            .plain
            .map(|at, plain| plain || surface.bits()[at] || self.table.shadow.bits()[at]);
        let like_table = surface.count() > 0
            && self.share(part, &as_dark) > MOSTLY
            && self.witness.nearer(part, surface, &beside).unwrap_or(true);
        // What does not move is not the room, where the room moves.
        let like_room = moves.is_none()
            && self.share(part, &self.backdrop) > MOSTLY
            && !self.witness.together(part, &beside);
        if !like_table && !like_room {
            return Some(false);
        }
        let outline = self.boundary(object, &object.inverted()).unwrap_or(0.0);
        let own = self.boundary(part, &rest).unwrap_or(0.0);
        Some(own >= OPENING_OUTLINE * outline)
    }

    /// Whether a part outside the object shows that it belongs to it: it does not move, is neither room nor table,
    /// becomes brighter with the object, and its outline is stronger where it does not touch it.
    pub(super) fn belongs(&self, part: &Bitmap, object: &Bitmap) -> bool {
        let ground = self.ground(part, object);
        let beside = self.beside(part, object);
        let known = self.share(part, &self.backdrop) > MOSTLY
            || self.share(part, &self.table.surface) > MOSTLY;
        if known || self.witness.moves(part, &beside, &ground) != Some(false) {
            return false;
        }
        let outside = object.map(|at, bit| !bit && !part.bits()[at]);
        let (within, without) = (self.boundary(part, object), self.boundary(part, &outside));
        let joins = within.is_some_and(|within| within <= without.unwrap_or(f32::INFINITY));
        joins && self.witness.together(part, &beside)
    }

    /// The background away from the object, without the table: in the rows of a part, through which all of it passes
    /// that is seen there.
    fn ground(&self, part: &Bitmap, object: &Bitmap) -> Bitmap {
        let near = object.dilated(self.reach(AWAY));
        let table = self.table.surface.bits();
        let (width, bounds) = (self.size.0.max(1), part.bounds());
        let rows = i64::from(bounds.y)..bounds.bottom();
        near.map(|at, bit| {
            let in_rows = rows.contains(&((at / width) as i64));
            in_rows && !bit && !table[at] && !self.table.plain.bits()[at]
        })
    }

    /// The object beside a part, all of it where none is near.
    fn beside(&self, part: &Bitmap, object: &Bitmap) -> Bitmap {
        let near = part.dilated(self.reach(BESIDE));
        let beside = object.map(|at, bit| bit && near.bits()[at]);
        if beside.count() > 0 {
            beside
        } else {
            object.clone()
        }
    }

    fn reach(&self, share: f64) -> usize {
        ((self.size.0 as f64 * share).round() as usize).max(2)
    }

    fn share(&self, part: &Bitmap, of: &Bitmap) -> f64 {
        let both = part.map(|at, bit| bit && of.bits()[at]).count();
        both as f64 / part.count().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_narrow_neck_opens_is_enclosed_and_a_wide_bay_is_not() {
        let rows = [
            "....................",
            ".##################.",
            ".#.......##.......#.",
            ".#.......##.......#.",
            ".#.......##.......#.",
            ".####.#####.......#.",
            "....................",
        ];
        let object = Bitmap::drawn(&rows);
        let found = enclosed(&object, 20);
        assert!(found.bits()[3 * 20 + 4]);
        assert!(!found.bits()[3 * 20 + 13]);
    }
}
