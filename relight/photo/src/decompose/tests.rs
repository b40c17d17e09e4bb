//! The decomposer as a whole, on networks that are not trained and on stubs.

use super::network_output::{MapNetwork, NetworkOutput, predict, to_maps};
use super::*;
use crate::nets::{INPUTS, LIGHT_PARAMETERS, OUTPUTS, Weights, decomposer, decomposer_with_light};
use relight_core::image::{ColourSpace, Extent, Planes, Rgb, Srgb};
use relight_core::light::Normals;

/// Answers pixel by pixel, from the encoded values of the pixel.
fn pixel_net(
    side: usize,
    pixel: impl Fn([f32; INPUTS]) -> [f32; OUTPUTS] + Send + Sync + 'static,
) -> MapNetwork {
    let predict = move |encoded: &[f32]| {
        let pixels = side * side;
        assert_eq!(encoded.len(), INPUTS * pixels);
        let mut maps = vec![0.0; OUTPUTS * pixels];
        for at in 0..pixels {
            let input = std::array::from_fn(|channel| encoded[channel * pixels + at]);
            for (channel, value) in pixel(input).into_iter().enumerate() {
                maps[channel * pixels + at] = value;
            }
        }
        Ok(NetworkOutput { maps, light: None })
    };
    let predict = Box::new(predict);
    MapNetwork { side, predict }
}

/// Normals that lean by the colour, the albedo is the colour, the shading the luminance.
fn by_colour(input: [f32; INPUTS]) -> [f32; OUTPUTS] {
    let [red, green, blue, _, _, of_red, of_green] = input;
    [of_red, of_green, 1.0, red, green, blue, 0.0, 0.0, 50.0]
}

fn smooth(extent: Extent) -> Planes<3> {
    Planes::from_fn(extent, |x, y| {
        let (x, y) = (x as f32 / 31.0, y as f32 / 47.0);
        let light = 0.3 + 0.1 * x.sin() + 0.1 * (x + y).cos();
        [light, light * (0.6 + 0.2 * y.sin()), 0.5 * light]
    })
}

fn disc(extent: Extent, radius: f32) -> Planes<1> {
    let middle = [extent.width as f32 / 2.0, extent.height as f32 / 2.0];
    Planes::from_fn(extent, |x, y| {
        let distance = (x as f32 + 0.5 - middle[0]).hypot(y as f32 + 0.5 - middle[1]);
        [f32::from(u8::from(distance < radius))]
    })
}

fn untrained() -> Decomposer {
    Decomposer::with_side(&Weights::initial(&decomposer(), 5), 64).unwrap()
}

fn most_apart(a: &[f32], b: &[f32]) -> f32 {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn everything_is_as_large_as_the_picture_finite_and_nothing_outside_the_mask() {
    let extent = Extent::new(90, 70);
    let mask = disc(extent, 30.0);
    let picture = Rgb::new(smooth(extent));
    let options = DecomposeOptions {
        specular: SpecularGate::On,
        ..DecomposeOptions::default()
    };
    let found = untrained().decompose(&picture, &mask, &options).unwrap();
    let [normals, albedo, diffuse] = [
        found.normals.planes(),
        found.albedo.planes(),
        found.diffuse.planes(),
    ];
    let colours = [normals, albedo, diffuse].map(Planes::planes);
    let greys = [found.shading.plane(0), found.highlight.plane(0)];
    for plane in colours.into_iter().flatten().chain(greys) {
        assert_eq!(plane.len(), extent.pixels());
        for (value, mask) in plane.iter().zip(mask.plane(0)) {
            assert!(value.is_finite());
            assert!(*mask == 1.0 || *value == 0.0);
        }
    }
    for at in (0..extent.pixels()).filter(|&at| mask.plane(0)[at] == 1.0) {
        let [s, h] = greys.map(|plane| plane[at]);
        let product = albedo.plane(1)[at] * s;
        assert!((product - diffuse.plane(1)[at]).abs() < 1e-4);
        assert!(h <= picture.planes().plane(2)[at]);
        let length: f32 = (0..3).map(|c| normals.plane(c)[at].powi(2)).sum();
        assert!((length - 1.0).abs() < 1e-3 && normals.plane(2)[at] > 0.0);
    }
    let mean = found.shading.plane(0).iter().sum::<f32>() / mask.plane(0).iter().sum::<f32>();
    assert!((mean - 1.0).abs() < 1e-3, "{mean}");
    assert!(found.residual > 0.0 && found.residual < 0.5);
}

#[test]
fn with_the_mirrored_pass_a_mirrored_picture_has_mirrored_layers() {
    let extent = Extent::new(64, 64);
    // Of an even width, so that the square around it lies in the middle.
    let (picture, mask) = (smooth(extent), disc(extent, 25.0));
    let options = DecomposeOptions::default();
    // At one scale: of two, only the coarse one is mirrored.
    let net = Decomposer::with_side(&Weights::initial(&decomposer(), 5), 32).unwrap();
    let found = net
        .decompose(&Rgb::new(picture.clone()), &mask, &options)
        .unwrap();
    let turned = Rgb::new(picture.mirrored());
    let turned = net.decompose(&turned, &mask.mirrored(), &options).unwrap();
    let back = turned.shading.mirrored();
    assert!(most_apart(back.plane(0), found.shading.plane(0)) < 1e-3);
    let back = turned.normals.planes().clone().mirrored();
    let x: Vec<f32> = back.plane(0).iter().map(|x| -x).collect();
    assert!(most_apart(&x, found.normals.planes().plane(0)) < 1e-3);
    assert!(most_apart(back.plane(1), found.normals.planes().plane(1)) < 1e-3);
}

#[test]
fn the_coarse_scale_decides_the_shape_and_the_fine_one_what_is_finer() {
    let extent = Extent::new(64, 64);
    let (picture, mask) = (smooth(extent), disc(extent, 30.0));
    // Stripes of 2 pixels in all answers of the fine scale; the coarse one leans to the left.
    let striped = |input: [f32; INPUTS]| {
        let stripe = input[0].signum() * 0.3;
        [0.5 + stripe, 0.2, 1.0, 0.0, 0.0, 0.0, 0.0, stripe, -50.0]
    };
    let leaning = |_: [f32; INPUTS]| [-0.5, 0.2, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -50.0];
    let fine = || pixel_net(64, striped);
    let coarse = pixel_net(32, leaning);
    let lines = Planes::from_fn(extent, |x, y| {
        let light = if (x / 2) % 2 == 0 { 0.9 } else { 0.05 };
        [light, light, light + picture.pixel(x, y)[0] * 0.01]
    });
    let lines = Rgb::new(lines);
    let options = DecomposeOptions {
        mirror: false,
        ..DecomposeOptions::default()
    };
    let one = Decomposer::from_nets(fine(), None);
    let both = Decomposer::from_nets(fine(), Some(coarse));
    let normals = |net: &Decomposer| net.decompose(&lines, &mask, &options).unwrap().normals;
    let (one, both) = (normals(&one), normals(&both));
    let mean_x = |of: &Normals| {
        let sum: f32 = of.planes().plane(0).iter().sum();
        sum / mask.plane(0).iter().sum::<f32>()
    };
    assert!(mean_x(&one) > 0.3 && mean_x(&both) < -0.3, "the shape");
    let step = |of: &Normals| {
        let x = |column| of.planes().pixel(column, 32)[0];
        (30..34)
            .map(|at| (x(at + 1) - x(at)).abs())
            .fold(0.0, f32::max)
    };
    assert!(
        step(&one) > 0.15 && step(&both) > 0.5 * step(&one),
        "what is finer"
    );
}

#[test]
fn the_gate_opens_where_more_than_five_percent_are_saturated() {
    let extent = Extent::new(40, 40);
    let mask = Planes::filled(extent, [1.0]);
    let net = Decomposer::from_nets(
        pixel_net(32, |input| {
            let mut output = by_colour(input);
            output[6] = 9.0;
            output
        }),
        None,
    );
    let white = |count: usize| {
        let at = |x: usize, y: usize| {
            if 40 * y + x < count {
                [1.0; 3]
            } else {
                [0.3, 0.4, 0.2]
            }
        };
        Rgb::new(Planes::from_fn(extent, at))
    };
    let decompose = |count, specular| {
        let options = DecomposeOptions {
            specular,
            ..DecomposeOptions::default()
        };
        net.decompose(&white(count), &mask, &options).unwrap()
    };
    let closed = decompose(80, SpecularGate::Auto);
    assert!(!closed.is_glossy && closed.gloss.is_none());
    assert_eq!(closed.saturated_fraction, 0.05);
    assert!(closed.highlight.plane(0).iter().all(|&h| h == 0.0));
    let open = decompose(81, SpecularGate::Auto);
    assert!(open.is_glossy);
    assert!(open.highlight.pixel(0, 0)[0] > 0.9);
    assert!(decompose(0, SpecularGate::On).is_glossy);
    assert!(!decompose(1600, SpecularGate::Off).is_glossy);
}

#[test]
fn light_that_is_nearly_white_in_eight_bits_is_saturated() {
    let value = |level: u8| Srgb::to_linear(f32::from(level) / 255.0);
    let from = DecomposeOptions::default().saturated_from;
    assert!(value(250) >= from && value(249) < from);
}

#[test]
fn what_lies_behind_the_object_does_not_matter() {
    let extent = Extent::new(80, 80);
    let mask = disc(extent, 30.0);
    let plain = smooth(extent);
    let noisy = Planes::from_fn(extent, |x, y| {
        if mask.pixel(x, y) == [1.0] {
            plain.pixel(x, y)
        } else {
            [7.0, f32::NAN, -1.0]
        }
    });
    let options = DecomposeOptions::default();
    let net = untrained();
    let a = net.decompose(&Rgb::new(plain), &mask, &options).unwrap();
    let b = net.decompose(&Rgb::new(noisy), &mask, &options).unwrap();
    assert_eq!(a, b);
}

#[test]
fn fields_and_maps_are_the_same_but_for_the_mask() {
    let extent = Extent::new(32, 32);
    let net = pixel_net(32, by_colour);
    let mask = disc(extent, 12.0);
    let found = predict(&net, &smooth(extent), &mask, false).unwrap().fields;
    let inside: Vec<bool> = mask.plane(0).iter().map(|&m| m > 0.5).collect();
    let maps = to_maps(found, &inside).unwrap();
    let encoded = NetworkInput::new(&smooth(extent), &mask);
    let decoded = encoded.decode(&(net.predict)(encoded.values()).unwrap().maps);
    assert!(most_apart(maps.shading.plane(0), decoded.shading.plane(0)) < 1e-5);
    assert!(most_apart(maps.albedo.plane(2), decoded.albedo.plane(2)) < 1e-5);
    let [a, b] = [maps.normals, decoded.normals].map(|n| n.planes().plane(0).to_vec());
    assert!(most_apart(&a, &b) < 1e-5);
}

#[test]
fn a_square_that_is_far_larger_than_the_photograph_takes_no_memory() {
    let net = Decomposer::from_nets(pixel_net(32, by_colour), None);
    let extent = Extent::new(8400, 1);
    let picture = Rgb::new(Planes::filled(extent, [0.5; 3]));
    let mask = Planes::filled(extent, [1.0]);
    let found = net
        .decompose(&picture, &mask, &DecomposeOptions::default())
        .unwrap();
    assert_eq!(found.region.side, 8736);
    assert!(found.residual < 0.5);
}

#[test]
fn a_mask_that_is_empty_or_of_another_size_is_refused() {
    let extent = Extent::new(64, 64);
    let net = Decomposer::from_nets(pixel_net(32, by_colour), None);
    let picture = Rgb::new(smooth(extent));
    let decompose = |mask: Planes<1>| {
        let found = net.decompose(&picture, &mask, &DecomposeOptions::default());
        found.unwrap_err()
    };
    let empty = decompose(Planes::filled(extent, [0.4]));
    assert!(matches!(empty, DecomposeError::EmptyMask), "{empty:?}");
    let other = decompose(Planes::filled(Extent::new(64, 63), [1.0]));
    assert!(matches!(other, DecomposeError::Photo(_)), "{other:?}");
    for size in ["64 x 63", "64 x 64"] {
        assert!(other.to_string().contains(size), "{other}");
    }
}

#[test]
fn what_the_head_says_of_the_light_does_not_move_what_relighting_begins_with() {
    let with = Weights::initial(&decomposer_with_light(), 1);
    let without = with.without(LIGHT_PARAMETERS);
    let extent = Extent::new(64, 64);
    let (picture, mask) = (Rgb::new(smooth(extent)), disc(extent, 25.0));
    let [with, without] = [with, without].map(|weights| {
        let net = Decomposer::with_side(&weights, 32).unwrap();
        net.decompose(&picture, &mask, &DecomposeOptions::default())
            .unwrap()
    });
    assert_eq!(with.shading_light, without.shading_light);
    assert_eq!(without.light, without.shading_light);
    assert_ne!(with.light, without.light);
}
