//! What the manifest tells of a take.

use super::take::{Verdict, frames};
use super::trace::Witness;
use relit_data::session::{Fault, SessionWriter};

/// Most faults of one kind that the manifest lists.
const MOST_LISTED: usize = 40;

impl Verdict {
    /// What the manifest tells, in order of kind and place.
    pub(super) fn faults(
        &self,
        session: &SessionWriter,
        places: &[Option<usize>],
        left_out: &[usize],
        moved: &[String],
    ) -> Vec<Fault> {
        let entries = session.index().entries();
        let number = |place: usize| places.iter().position(|&at| at >= Some(place));
        let last = entries.last().map_or(0, |entry| entry.t_us);
        let at = |place: usize, what: String| {
            let entry = number(place).and_then(|n| entries.get(n));
            Fault {
                t_us: entry.map_or(last, |entry| entry.t_us),
                what,
            }
        };
        let place_of = |place: usize| number(place).unwrap_or(entries.len());
        let lead = places.iter().take_while(|place| place.is_none()).count();
        let mut faults = Vec::new();
        if lead > 0 && !entries.is_empty() {
            let what = format!(
                "{} before the turn are in the video, as its frames build on them",
                frames(lead as u64)
            );
            faults.push(at(0, what));
        }
        listed(
            &mut faults,
            last,
            self.count.missing.iter().map(|missing| {
                let (n, seen) = (place_of(missing.before), seen_by(missing.seen_by));
                at(
                    missing.before,
                    format!("{} missing before frame {n}, {seen}", frames(missing.count)),
                )
            }),
        );
        listed(
            &mut faults,
            last,
            self.overrun.iter().map(|&place| {
                at(
                    place,
                    format!(
                        "the disk was too slow: a frame was dropped before frame {}",
                        place_of(place)
                    ),
                )
            }),
        );
        listed(&mut faults, last, left_out.iter().map(|&place| {
            at(place, format!("a frame before frame {} could not be recorded: it was empty, or no key frame came before it", place_of(place)))
        }));
        listed(
            &mut faults,
            last,
            self.damaged.iter().map(|damaged| {
                at(
                    damaged.delivered,
                    format!(
                        "frame {} is damaged: {}",
                        place_of(damaged.delivered),
                        damaged.fault
                    ),
                )
            }),
        );
        listed(
            &mut faults,
            last,
            self.count.doubts.iter().map(|doubt| Fault {
                t_us: last,
                what: doubt.to_string(),
            }),
        );
        listed(
            &mut faults,
            last,
            moved.iter().map(|moved| Fault {
                t_us: last,
                what: moved.clone(),
            }),
        );
        faults
    }
}

/// Adds faults of one kind, the first of them if they are many.
fn listed(faults: &mut Vec<Fault>, t_us: i64, kind: impl ExactSizeIterator<Item = Fault>) {
    let more = kind.len().saturating_sub(MOST_LISTED);
    faults.extend(kind.take(MOST_LISTED));
    if more > 0 {
        let what = format!("and {more} more of this kind");
        faults.push(Fault { t_us, what });
    }
}

fn seen_by(witness: Witness) -> &'static str {
    match witness {
        Witness::Both => "by the driver's counter and the time stamps",
        Witness::Counter => "by the driver's counter",
        Witness::Time => "by the time stamps",
        Witness::TimeAgainstCounter => "by the time stamps, though the driver did not count them",
    }
}
