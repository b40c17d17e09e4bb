//! A scene's description: whatever the text is, it is refused, or all its numbers are in their ranges and its lamp is one.

#![no_main]
#![allow(clippy::expect_used, reason = "a fuzz target reports by a panic")]

use libfuzzer_sys::fuzz_target;
use relight_photo::compositing::SceneDescription;

fuzz_target!(|text: &str| {
    let Ok(scene) = SceneDescription::parse(text) else {
        return;
    };
    scene.check().expect("what was accepted is in order");
    let lamp = scene
        .light
        .lamp()
        .expect("what was accepted has a lamp or none");
    assert!(lamp.is_none_or(|lamp| lamp.colour.iter().all(|c| c.is_finite() && *c >= 0.0)));
    for object in &scene.objects {
        let placement = object.placement();
        assert!(placement.at.iter().all(|place| place.is_finite()) && placement.height > 0.0);
        let gloss = object.change().gloss;
        assert!(gloss.is_none_or(|gloss| gloss.reflectance.iter().all(|s| s.is_finite())));
    }
});
