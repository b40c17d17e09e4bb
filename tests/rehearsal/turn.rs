//! Takes that come out well.

use relit::capture::state::Verdict;
use relit::session::Status;

use crate::support::{Rehearsal, SHORT, TURN};

/// Checks a whole take: 1500 frames, none lost, each with its angle.
fn check_whole(rig: &mut Rehearsal, lead: bool) {
    let take = rig.capture(false).unwrap();
    assert_eq!(take.reason.as_deref().filter(|_| !lead), None);
    assert_ne!(take.verdict, Verdict::Aborted, "{take:?}");
    assert_eq!((take.frames, take.dropped), (1500, 0));
    let session = rig.session(&take);
    assert_eq!(session.manifest.as_ref().unwrap().status, Status::Complete);
    let frames = session.frames.as_ref().unwrap();
    let simulator = rig.equipment.simulator().unwrap();
    let of_turn = &frames.entries()[frames.entries().len() - 1500..];
    let mut errors: Vec<f64> = of_turn
        .iter()
        .map(|entry| (entry.angle_deg.unwrap() - simulator.angle_at(entry.t_us)).abs())
        .collect();
    errors.sort_by(f64::total_cmp);
    eprintln!(
        "angle errors: median {:.4}, p99 {:.4}, most {:.4}",
        errors[750], errors[1484], errors[1499]
    );
    assert!(
        errors[1484] <= 0.05,
        "p99 of the angles' errors: {}",
        errors[1484]
    );
    let turned = of_turn[1499].angle_deg.unwrap() - of_turn[0].angle_deg.unwrap();
    assert!((turned.abs() - 359.76).abs() < 0.05, "{turned}");
    assert!(rig.table_stands());
}

#[test]
fn a_turn_is_1500_frames_with_the_angles_that_the_table_had() {
    check_whole(&mut Rehearsal::new(SHORT, "", "sim:?speed=20"), false);
}

#[test]
fn a_turn_of_a_camera_whose_frames_build_on_each_other_is_whole_too() {
    check_whole(&mut Rehearsal::new(TURN, "", "sim:?speed=20"), true);
}
