use relight_core::image::Extent;

use crate::TurnError;
use crate::observe::curves::CurveBuilder;

#[test]
fn turns_without_frames_or_angles_are_refused_by_what_is_wrong() {
    let extent = Extent::new(4, 4);
    let empty = CurveBuilder::new(extent, &[0.0; 16]);
    assert!(matches!(empty, Err(TurnError::Refused(_))));
    let builder = || CurveBuilder::new(extent, &[1.0; 16]).unwrap();
    let grey = [0.3; 16];
    let mut few = builder();
    for k in 0..100 {
        few.push(f64::from(k % 4), extent, [&grey; 3]).unwrap();
    }
    let refused = few.finish().unwrap_err();
    assert!(matches!(refused, TurnError::Refused(_)), "{refused:?}");
    assert!(refused.to_string().contains("1 different"), "{refused}");
    let other = builder().push(0.0, Extent::new(8, 2), [&grey; 3]);
    assert!(matches!(other, Err(TurnError::Refused(_))));
    let mut lost = builder();
    lost.push(f64::NAN, extent, [&grey; 3]).unwrap();
    lost.push(f64::INFINITY, extent, [&grey; 3]).unwrap();
    let refused = lost.finish().unwrap_err();
    assert!(matches!(refused, TurnError::Refused(_)), "{refused:?}");
    assert!(refused.to_string().contains("0 different"), "{refused}");
}
