//! The candidates for a selection, from the video's frames and the session's frame index.

use relit_data::session::{FrameEntry, FrameIndex};
use relit_video::FrameInfo;

use super::ExtractError;
use super::select::Candidate;

/// The frames that are not damaged as far as the container shows, with the driver's time stamps and
/// angles if the session has them.
///
/// Line n of the index is frame n of the video. If their numbers differ, frames are missing in one of
/// them: frames and lines are then matched by their time stamps, whose clocks differ by a constant,
/// and frames without a line are left out.
///
/// # Errors
/// [`ExtractError::Refused`] if the time stamps do not match either.
pub(super) fn timeline(
    frames: &[FrameInfo],
    index: Option<&FrameIndex>,
) -> Result<Vec<Candidate>, ExtractError> {
    let intact = || frames.iter().filter(|frame| !frame.damaged);
    let Some(index) = index else {
        let without_entry = |frame: &FrameInfo| candidate(frame, frame.t_us, None);
        return Ok(intact().map(without_entry).collect());
    };
    let entries = index.entries();
    let entry_of: Vec<Option<&FrameEntry>> = if entries.len() == frames.len() {
        entries.iter().map(Some).collect()
    } else {
        let mismatch = || {
            ExtractError::Refused(format!(
                "{} lines of frames.jsonl do not match the video's {} frames by time: give the video file itself to continue without angles",
                entries.len(),
                frames.len()
            ))
        };
        matched_by_time(frames, entries).ok_or_else(mismatch)?
    };
    let with_entry = |frame: &FrameInfo| {
        let entry = (*entry_of.get(usize::try_from(frame.number).ok()?)?)?;
        Some(candidate(frame, entry.t_us, entry.angle_deg))
    };
    Ok(intact().filter_map(with_entry).collect())
}

fn candidate(frame: &FrameInfo, t_us: i64, angle_deg: Option<f64>) -> Candidate {
    Candidate {
        frame: frame.number,
        t_us,
        angle_deg,
    }
}

/// The line of each frame; `None` if the clocks cannot be matched.
fn matched_by_time<'a>(
    frames: &[FrameInfo],
    entries: &'a [FrameEntry],
) -> Option<Vec<Option<&'a FrameEntry>>> {
    let (first, last) = (entries.first()?, entries.last()?);
    // The video's clock starts with the recording or with the first frame, or both end together.
    let offsets = [
        first.t_us,
        first.t_us.saturating_sub(frames.first()?.t_us),
        last.t_us.saturating_sub(frames.last()?.t_us),
    ];
    offsets
        .into_iter()
        .find_map(|offset| matched_with(frames, entries, offset))
}

/// The line of each frame, if the index's clock is `offset` microseconds ahead of the video's and
/// every line or every frame has a counterpart.
fn matched_with<'a>(
    frames: &[FrameInfo],
    entries: &'a [FrameEntry],
    offset: i64,
) -> Option<Vec<Option<&'a FrameEntry>>> {
    let mut steps: Vec<i64> = entries
        .windows(2)
        .map(|pair| pair[1].t_us.saturating_sub(pair[0].t_us))
        .collect();
    steps.sort_unstable();
    let half = steps.get(steps.len() / 2)? / 2;
    let mut at = 0;
    let mut pairs = 0;
    let found = frames.iter().map(|frame| {
        let expected = frame.t_us.saturating_add(offset);
        while entries
            .get(at)
            .is_some_and(|entry| entry.t_us < expected.saturating_sub(half))
        {
            at += 1;
        }
        let entry = entries
            .get(at)
            .filter(|entry| entry.t_us <= expected.saturating_add(half))?;
        at += 1;
        pairs += 1;
        Some(entry)
    });
    let found = found.collect();
    (pairs == frames.len().min(entries.len())).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(times: impl IntoIterator<Item = i64>) -> Vec<FrameInfo> {
        let numbered = (0..).zip(times);
        numbered
            .map(|(number, t_us)| FrameInfo {
                number,
                t_us,
                damaged: false,
            })
            .collect()
    }

    /// An index of ten lines whose clock began long ago, with some jitter.
    fn index() -> FrameIndex {
        let mut index = FrameIndex::default();
        for n in 0..10 {
            let t_us = 5_000_000 + 33_333 * n as i64 + [0, 900, -700][n as usize % 3];
            let angle_deg = Some(n as f64);
            index
                .push(FrameEntry {
                    n,
                    sequence: n,
                    t_us,
                    angle_deg,
                })
                .unwrap();
        }
        index
    }

    fn angles(frames: &[FrameInfo]) -> Vec<(u64, f64)> {
        let candidates = timeline(frames, Some(&index())).unwrap();
        candidates
            .iter()
            .map(|c| (c.frame, c.angle_deg.unwrap()))
            .collect()
    }

    #[test]
    fn as_many_lines_as_frames_are_matched_by_position() {
        let found = angles(&frames((0..10).map(|n| n * 1_000_000)));
        assert_eq!(found[9], (9, 9.0));
    }

    #[test]
    fn a_frame_missing_in_the_middle_shifts_no_angle() {
        let found = angles(&frames((0..10).filter(|&n| n != 4).map(|n| n * 33_333)));
        assert_eq!(
            (found[3], found[4], found[8]),
            ((3, 3.0), (4, 5.0), (8, 9.0))
        );
    }

    #[test]
    fn frames_missing_at_either_end_shift_no_angle() {
        let tail = angles(&frames((0..7).map(|n| n * 33_333)));
        assert_eq!((tail.len(), tail[6]), (7, (6, 6.0)));
        let head = angles(&frames((3..10).map(|n| n * 33_333)));
        assert_eq!((head.len(), head[0]), (7, (0, 3.0)));
    }

    #[test]
    fn frames_beyond_the_index_are_left_out() {
        let found = angles(&frames((0..12).map(|n| n * 33_333)));
        assert_eq!(found.len(), 10);
    }

    #[test]
    fn clocks_that_cannot_be_matched_are_refused() {
        let fast = frames((0..8).map(|n| n * 20_000));
        let refused = timeline(&fast, Some(&index())).unwrap_err().to_string();
        assert!(refused.contains("10") && refused.contains('8'), "{refused}");
    }
}
