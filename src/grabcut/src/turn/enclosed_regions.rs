//! Parts of the image that a cut left out although the object encloses them, or nearly does: they are object unless
//! they show the background or the table.

use super::statistics::TurnField;
use crate::bitmap::{Bitmap, Component, Connectivity};

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

/// An edge in a mask that is at least so strong is one.
const SURE_EDGE: f32 = 0.9;
/// And there is none where it is at most this share as strong.
const NO_EDGE: f32 = 0.7;
/// What moves as the background does is so clearly from here on, between the object's changes (0) and its (1).
const CLEARLY: f32 = 0.9;
/// An average brightness L that may be overexposed in places.
const NEARLY_WHITE: f32 = 95.0;

/// Smaller lost parts are not restored, as a share of the object, and parts that are at most twice so many pixels wide.
const LEAST_LOST: f64 = 0.002;
const LOST_WIDTH: usize = 1;
/// What the table's model and the rows' ends say at least of a lost part of a dark object, as a mean of its pixels.
const LIKE_LOST: f32 = -2.5;
/// The outline of a lost part is at least this share as strong as the object's.
const LOST_OUTLINE: f32 = 0.8;

/// What is not in the object, and enclosed by it but for a narrow neck.
pub(crate) fn enclosed(object: &Bitmap, width: usize) -> Bitmap {
    let neck = ((width as f64 * NECK).round() as usize).max(1);
    let closed = object.closed(neck);
    closed.or(&closed.holes()).minus(object)
}

impl TurnField {
    /// The object with the parts that it encloses and that show nothing else.
    pub(crate) fn completed(&self, object: &Bitmap) -> Bitmap {
        let is_object = |_: &Component, part: &dyn Fn() -> Bitmap| {
            self.is_background(&part(), object) == Some(false)
        };
        object.or(&enclosed(object, self.size.0).parts_where(Connectivity::Four, is_object))
    }

    /// A dark object with those parts of a cut without the table's model that are hardly like the table, and have an
    /// outline as strong as the object's: black legs are as dark as the table.
    pub(crate) fn restored(&self, object: &Bitmap, before: &Bitmap) -> Bitmap {
        let least = (object.count() as f64 * LEAST_LOST) as u64;
        let lost = before.minus(object).opened(LOST_WIDTH);
        object.or(&lost.parts_where(Connectivity::Four, |part, pixels| {
            part.area >= least && self.is_lost(&pixels(), object)
        }))
    }

    fn is_lost(&self, part: &Bitmap, object: &Bitmap) -> bool {
        let evidence = part.bits().iter().zip(&self.evidence);
        let evidence = evidence.filter(|(bit, _)| **bit);
        let evidence = evidence.map(|(_, evidence)| evidence).sum::<f32>() / part.count() as f32;
        let outline = self.boundary(part, &object.or(part).inverted());
        evidence >= LIKE_LOST
            && outline.is_some_and(|outline| outline >= LOST_OUTLINE * self.outline(object))
    }

    /// Whether a part inside or beside the object shows the background or the table; none of a part without pixels.
    pub(crate) fn is_background(&self, part: &Bitmap, object: &Bitmap) -> Option<bool> {
        if part.count() == 0 {
            return None;
        }
        let rest = object.minus(part);
        let beside = self.beside(part, &rest);
        let like_table = self.is_like_table(part, &beside);
        // Through one opening both the table and what is behind it may be seen.
        let above = self
            .seen_table
            .as_ref()
            .map(|table| part.minus(&table.like));
        let above = above.filter(|above| above.count() > 0 && !like_table);
        let above = above.as_ref().unwrap_or(part);
        let moves = self
            .temporal_evidence
            .moves(above, &beside, &self.ground(above, object));
        if moves == Some(true) {
            return Some(true);
        }
        let white = above.share_in(&self.white) > MOSTLY && beside.share_in(&self.white) < MOSTLY;
        // What does not move is not the room, where the room moves.
        let like_room = moves.is_none()
            && above.share_in(&self.backdrop) > MOSTLY
            && !self.temporal_evidence.together(above, &beside);
        if !like_table && !like_room && !white {
            return Some(false);
        }
        // What does not touch the rest has no outline to compare.
        let own = self.boundary(part, &rest);
        Some(own.is_none_or(|own| own >= OPENING_OUTLINE * self.outline(object)))
    }

    /// Whether a part behaves like the table over the turn.
    fn is_like_table(&self, part: &Bitmap, beside: &Bitmap) -> bool {
        if let Some(table) = &self.seen_table {
            return part.share_in(&table.like) > MOSTLY;
        }
        // What lies before the table brightens with it, and a dark part of the object with the object.
        let surface = &self.table.surface;
        let as_dark = self.table.plain.or(surface).or(&self.table.shadow);
        surface.count() > 0
            && part.share_in(&as_dark) > MOSTLY
            && self
                .temporal_evidence
                .nearer(part, surface, beside)
                .unwrap_or(true)
    }

    /// Whether a part of a mask that seems to be background is so clearly that the mask may be called wrong. In a room
    /// in which nothing moves, only the table is clear, and what is overexposed.
    pub(crate) fn is_clearly_background(&self, part: &Bitmap, mask: &Bitmap, moves: bool) -> bool {
        let beside = self.beside(part, &mask.minus(part));
        if self.is_like_table(part, &beside) {
            return self.shows_table(part, mask);
        }
        let above = self
            .seen_table
            .as_ref()
            .map(|table| part.minus(&table.like));
        let above = above.as_ref().unwrap_or(part);
        if above.share_in(&self.white) > MOSTLY {
            // A white object may be overexposed as well.
            return self.mean_light(&beside) < NEARLY_WHITE;
        }
        let ground = self.ground(above, mask);
        let towards = self
            .temporal_evidence
            .towards_ground(above, &beside, &ground);
        moves && towards.is_some_and(|towards| towards >= CLEARLY)
    }

    /// Whether the table is seen in a part of a mask that is like it by the model: it is as bright as the unshaded
    /// table, and an edge between it and the rest of the mask persists over the turn. A dark part of the object may look
    /// like the table, but has other edges.
    fn shows_table(&self, part: &Bitmap, mask: &Bitmap) -> bool {
        let edge = self.boundary(part, &mask.minus(part));
        self.seen_table.as_ref().is_some_and(|table| {
            edge.is_none_or(|edge| edge >= SURE_EDGE)
                && part.and(&table.like).share_in(&table.as_bright) > MOSTLY
        })
    }

    /// Whether the edge of a part of a mask with the rest of the mask persists over the turn, and the one where the mask
    /// ends does not.
    pub(crate) fn ends_without_edge(&self, part: &Bitmap, mask: &Bitmap) -> bool {
        let within = self.boundary(part, &mask.minus(part));
        let ends = self.boundary(part, &mask.inverted());
        within
            .zip(ends)
            .is_some_and(|(within, ends)| ends < NO_EDGE * within)
    }

    /// The average brightness L of a part.
    fn mean_light(&self, part: &Bitmap) -> f32 {
        let light = self.light();
        let pixels = part.bits().iter().zip(&light).filter(|(bit, _)| **bit);
        pixels.map(|(_, light)| light).sum::<f32>() / part.count().max(1) as f32
    }

    /// Whether a part outside the object, neither room nor table, shows that it belongs to it: nothing separates them; or
    /// it does not move, becomes brighter with the object, and its outline is stronger where it does not touch
    /// it. In a room in which nothing moves, only the edge counts.
    pub(crate) fn belongs(&self, part: &Bitmap, object: &Bitmap, moves: bool) -> bool {
        if part.share_in(&self.backdrop) > MOSTLY || part.share_in(&self.table.surface) > MOSTLY {
            return false;
        }
        let edge = self.boundary(part, object);
        if edge.is_some_and(|edge| edge < NO_EDGE * self.outline(object)) {
            return true;
        }
        let ground = self.ground(part, object);
        let beside = self.beside(part, object);
        let stands = self.temporal_evidence.moves(part, &beside, &ground) == Some(false);
        if !moves || !stands {
            return false;
        }
        let outside = object.or(part).inverted();
        let without = self.boundary(part, &outside).unwrap_or(f32::INFINITY);
        let joins = edge.is_some_and(|edge| edge <= without);
        joins && self.temporal_evidence.together(part, &beside)
    }

    /// The background away from the object, without the table: in the rows of a part, through which all of it passes
    /// that is seen there.
    fn ground(&self, part: &Bitmap, object: &Bitmap) -> Bitmap {
        let near = object.dilated(self.reach(AWAY));
        let table = self.table.surface.or(&self.table.plain);
        let (width, bounds) = (self.size.0.max(1), part.bounds());
        let rows = i64::from(bounds.y)..bounds.bottom();
        let away = near.or(&table).inverted();
        away.map(|at, bit| bit && rows.contains(&((at / width) as i64)))
    }

    /// The object beside a part, all of it where none is near.
    fn beside(&self, part: &Bitmap, object: &Bitmap) -> Bitmap {
        let beside = object.and(&part.dilated(self.reach(BESIDE)));
        if beside.count() > 0 {
            beside
        } else {
            object.clone()
        }
    }

    fn reach(&self, share: f64) -> usize {
        ((self.size.0 as f64 * share).round() as usize).max(2)
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
