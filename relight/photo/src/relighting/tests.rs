//! Objects relit by a network that is not trained: these tests are about what holds for any decomposition.

use super::{
    DiscLamp, InsertError, LightSource, MaterialChange, ObjectGloss, RelightableObject,
    exposure_between,
};
use crate::decompose::{DecomposeError, DecomposeOptions, Decomposer, SpecularGate};
use crate::nets::{Weights, decomposer};
use relight_core::captured_object::CapturedObject;
use relight_core::image::{ColourSpace, Extent, Linear, Planes, Rgb, Srgb};
use relight_core::light::{Direction, Normals, Rotation};
use relight_core::render::Surface;

const EXTENT: Extent = Extent::new(90, 70);

fn untrained() -> Decomposer {
    Decomposer::with_side(&Weights::initial(&decomposer(), 3), 32).unwrap()
}

fn is_object(x: usize, y: usize) -> bool {
    (x as f64 - 45.0).hypot(y as f64 - 36.0) < 26.0
}

fn mask() -> Planes<1> {
    Planes::from_fn(EXTENT, |x, y| [f32::from(u8::from(is_object(x, y)))])
}

/// A ball with fine texture, a dark and a saturated place, before a bright background.
fn photo() -> Rgb<Linear> {
    Rgb::new(Planes::from_fn(EXTENT, |x, y| {
        if !is_object(x, y) {
            return [0.2, 0.7, 0.4];
        }
        let texture = [0.8, 1.1][(x / 2 + y / 3) % 2];
        match (x, y) {
            (40..44, 40..44) => [0.0; 3],
            (50..58, 20..28) => [1.0; 3],
            _ => [0.3, 0.2, 0.1].map(|v| v * texture * (0.3 + x as f32 / 60.0)),
        }
    }))
}

fn relightable(specular: SpecularGate) -> RelightableObject {
    let options = DecomposeOptions {
        specular,
        ..DecomposeOptions::default()
    };
    RelightableObject::new(&photo(), &mask(), None, &untrained(), &options).unwrap()
}

fn most_apart(a: &Rgb<Linear>, b: &Rgb<Linear>) -> f32 {
    let pairs = a.planes().planes().into_iter().zip(b.planes().planes());
    let pixels = pairs.flat_map(|(a, b)| a.iter().zip(b));
    let shown = |v: &f32| Srgb::from_linear(v.clamp(0.0, 1.0));
    pixels
        .map(|(a, b)| (shown(a) - shown(b)).abs())
        .fold(0.0, f32::max)
}

#[test]
fn the_own_light_gives_the_photograph_back() {
    for specular in [SpecularGate::Off, SpecularGate::On] {
        let relightable = relightable(specular);
        let light = LightSource::Coefficients(relightable.light.clone())
            .light()
            .unwrap();
        let light = light
            .clone()
            .tinted([f64::from(exposure_between(&relightable.light, &light)); 3]);
        let same = relightable
            .relit(&light, &MaterialChange::default())
            .unwrap();
        let shown = relightable.in_place(&photo(), &same);
        let apart = most_apart(&shown, &photo());
        assert!(apart < 0.5 / 255.0, "{apart}");
    }
}

#[test]
fn other_light_changes_the_object_and_nothing_else() {
    let relightable = relightable(SpecularGate::Off);
    let lamp = LightSource::Lamp(DiscLamp {
        azimuth: 270.0,
        ..DiscLamp::default()
    });
    let relit = relightable
        .relit(&lamp.light().unwrap(), &MaterialChange::default())
        .unwrap();
    let shown = relightable.in_place(&photo(), &relit);
    assert!(most_apart(&shown, &photo()) > 0.1);
    let alpha = &relightable.matte.alpha;
    let [left, top] = relightable.place;
    for y in 0..EXTENT.height {
        for x in 0..EXTENT.width {
            let inside = x.checked_sub(left).zip(y.checked_sub(top));
            let covered = inside
                .filter(|&(x, y)| x < alpha.extent().width && y < alpha.extent().height)
                .is_some_and(|(x, y)| alpha.pixel(x, y)[0] > 0.0);
            if !covered {
                assert_eq!(shown.planes().pixel(x, y), photo().planes().pixel(x, y));
            }
        }
    }
}

#[test]
fn light_that_turns_once_changes_the_picture_smoothly_and_ends_where_it_began() {
    let relightable = relightable(SpecularGate::On);
    let light = LightSource::Lamp(DiscLamp::default()).light().unwrap();
    let frame = |part: f64| {
        let turn = Rotation::about(Direction::UP, part * std::f64::consts::TAU);
        let relit = relightable
            .relit(&light.rotated(&turn), &MaterialChange::default())
            .unwrap();
        Rgb::<Linear>::new(relit)
    };
    let frames: Vec<Rgb<Linear>> = (0..=60).map(|at| frame(f64::from(at) / 60.0)).collect();
    assert!(most_apart(&frames[0], &frames[60]) < 1e-4);
    for pair in frames.windows(2) {
        assert!(most_apart(&pair[0], &pair[1]) < 0.2);
    }
}

#[test]
fn a_tint_colours_and_gloss_adds_light() {
    let relightable = relightable(SpecularGate::Off);
    let light = LightSource::Lamp(DiscLamp {
        azimuth: 0.0,
        elevation: 0.0,
        ..DiscLamp::default()
    })
    .light()
    .unwrap();
    let relit = |change: &MaterialChange| relightable.relit(&light, change).unwrap();
    let plain = relit(&MaterialChange::default());
    let red = relit(&MaterialChange {
        tint: [1.0, 0.0, 0.0],
        gloss: None,
    });
    assert_eq!(red.plane(0), plain.plane(0));
    assert!(red.plane(1).iter().all(|&v| v == 0.0));
    let gloss = Some(ObjectGloss::from_part(0.4, 30.0));
    let glossy = relit(&MaterialChange {
        gloss,
        ..MaterialChange::default()
    });
    let sum = |image: &Planes<3>| image.plane(2).iter().sum::<f32>();
    assert!(sum(&glossy) > 1.1 * sum(&plain));
}

#[test]
fn pasted_edges_do_not_show_the_old_background() {
    let relightable = relightable(SpecularGate::Off);
    let black = Rgb::new(Planes::zeros(EXTENT));
    let own = relightable
        .relit(&relightable.light, &MaterialChange::default())
        .unwrap();
    let pasted = relightable.before(&black, &own);
    let planes = pasted.planes().planes();
    // The background is green, the object is not.
    let is_greenish = |at: usize| planes[1][at] > 1.3 * planes[0][at].max(0.02);
    assert!(!(0..EXTENT.pixels()).any(is_greenish));
}

#[test]
fn what_is_no_photograph_is_refused() {
    let refused = |photo: Rgb<Linear>, mask: Planes<1>| {
        let options = DecomposeOptions::default();
        RelightableObject::new(&photo, &mask, None, &untrained(), &options).unwrap_err()
    };
    let mut odd = photo();
    odd.planes_mut().set_pixel(7, 5, [0.1, f32::NAN, 0.1]);
    let odd = refused(odd, mask());
    assert!(odd.to_string().contains("column 7, row 5"), "{odd}");
    let empty = refused(photo(), Planes::zeros(EXTENT));
    assert!(
        matches!(empty, InsertError::Decompose(DecomposeError::EmptyMask)),
        "{empty:?}"
    );
    let other = refused(photo(), Planes::filled(Extent::new(70, 90), [1.0]));
    assert!(matches!(other, InsertError::Image(_)), "{other:?}");
    for size in ["70 x 90", "90 x 70"] {
        assert!(other.to_string().contains(size), "{other}");
    }
}

/// A captured ball of one colour.
fn captured_ball() -> CapturedObject {
    let normals = Normals::sphere(33);
    let extent = normals.extent();
    let alpha = Planes::from_fn(extent, |x, y| {
        let far = (x as f64 - 16.0).hypot(y as f64 - 16.0);
        [(16.5 - far).clamp(0.0, 1.0) as f32]
    });
    let albedo = Rgb::new(Planes::filled(extent, [0.6, 0.3, 0.1]));
    let surface = Surface::new(normals, albedo, None).unwrap();
    CapturedObject::new("ball", surface, alpha.clone(), alpha).unwrap()
}

#[test]
fn a_captured_object_has_the_colours_of_its_albedo_in_even_light_and_is_bright_where_a_lamp_is() {
    let relightable = RelightableObject::from_captured(&captured_ball()).unwrap();
    let none = MaterialChange::default();
    let even = relightable.relit(&relightable.light, &none).unwrap();
    for (found, wanted) in even.pixel(12, 20).into_iter().zip([0.6, 0.3, 0.1]) {
        assert!((found - wanted).abs() < 1e-3, "{found} {wanted}");
    }
    let lamp = LightSource::Lamp(DiscLamp {
        azimuth: 90.0,
        ..DiscLamp::default()
    });
    let light = lamp.light().unwrap();
    let scale = f64::from(exposure_between(&relightable.light, &light));
    let lit = relightable.relit(&light.tinted([scale; 3]), &none).unwrap();
    let (right, left) = (lit.pixel(28, 16)[0], lit.pixel(4, 16)[0]);
    assert!(right > 2.0 * left, "{right} {left}");
    // Where the light is strongest it is as bright as in even light.
    let brightest = lit.plane(0).iter().fold(0.0_f32, |a, &b| a.max(b));
    assert!((brightest - 0.6).abs() < 0.05, "{brightest}");
}

#[test]
fn a_captured_object_that_covers_nothing_is_refused() {
    let ball = captured_ball();
    let nothing = Planes::zeros(ball.extent());
    let empty =
        CapturedObject::new("none", ball.surface().clone(), nothing.clone(), nothing).unwrap();
    assert!(RelightableObject::from_captured(&empty).is_err());
}
