//! Materials of Wavefront files: their colour, its picture, and how sharp the highlight is. Everything else is ignored, also if
//! it is damaged: programs write many things there.

use glam::{Affine2, Vec2, Vec3};

use super::material::DULL;
use super::text::{keyword, statements, without_comment};

/// A material as the file has it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MtlMaterial {
    pub(super) name: String,
    /// Linear red, green and blue.
    pub(super) colour: Option<Vec3>,
    pub(super) picture: Option<MtlPicture>,
    specular: Vec3,
    exponent: Option<f32>,
}

/// A picture as a material names it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MtlPicture {
    /// The name of its file.
    pub(super) name: String,
    /// From texture coordinates to places of the picture, where they differ.
    pub(super) placed: Option<Affine2>,
}

impl MtlMaterial {
    /// From the exponent of Blinn and Phong's highlight to roughness, as a highlight is made of roughness; dull without one.
    pub(super) fn roughness(&self) -> f32 {
        match self.exponent {
            Some(exponent) if self.specular != Vec3::ZERO => {
                (2.0 / (exponent.max(0.0) + 2.0)).powf(0.25)
            }
            _ => DULL,
        }
    }
}

/// The materials of a file, in their order.
pub(super) fn materials(text: &str) -> Vec<MtlMaterial> {
    let mut all: Vec<MtlMaterial> = Vec::new();
    for (_, statement) in statements(text) {
        let (key, rest) = keyword(&statement);
        if key.eq_ignore_ascii_case("newmtl") {
            all.push(MtlMaterial {
                name: rest.to_owned(),
                colour: None,
                picture: None,
                specular: Vec3::ZERO,
                exponent: None,
            });
        }
        let Some(material) = all.last_mut() else {
            continue;
        };
        match key.to_ascii_lowercase().as_str() {
            "kd" => material.colour = colour(rest),
            "ks" => material.specular = colour(rest).unwrap_or_default(),
            "ns" => material.exponent = numbers(rest).and_then(|all| all.first().copied()),
            "map_kd" => material.picture = picture(rest),
            _ => {}
        }
    }
    all
}

/// Finite numbers; `None` if something else stands among them.
fn numbers(text: &str) -> Option<Vec<f32>> {
    let words = without_comment(text).split_whitespace();
    let number = |word: &str| word.parse().ok().filter(|number: &f32| number.is_finite());
    words.map(number).collect()
}

/// Three numbers, or one for all three.
fn colour(text: &str) -> Option<Vec3> {
    let colour = match *numbers(text)? {
        [grey] => Vec3::splat(grey),
        [red, green, blue, ..] => Vec3::new(red, green, blue),
        _ => return None,
    };
    (colour.min_element() >= 0.0).then_some(colour)
}

/// The name behind `-o 0 0 0` and the like, without quotes.
fn picture(text: &str) -> Option<MtlPicture> {
    let (mut scale, mut offset) = (Vec2::ONE, Vec2::ZERO);
    let mut rest = text;
    while let Some((option, most)) = option(rest) {
        rest = rest[option.len()..].trim_start();
        let mut values = Vec::new();
        while let Some((word, behind)) = rest.split_once(char::is_whitespace) {
            let number = word.parse().map_or(f32::NAN, |number: f32| number);
            // Numbers that are left out are not taken from the name.
            if values.len() == most || (takes_numbers(option) && number.is_nan()) {
                break;
            }
            values.push(number);
            rest = behind.trim_start();
        }
        let pair = |plain: Vec2| {
            let number = |at: usize| values.get(at).copied().filter(|n: &f32| n.is_finite());
            Vec2::new(number(0).unwrap_or(plain.x), number(1).unwrap_or(plain.y))
        };
        match option {
            "-s" => scale = pair(Vec2::ONE),
            "-o" => offset = pair(Vec2::ZERO),
            _ => {}
        }
    }
    let placed = Affine2::from_scale_angle_translation(scale, 0.0, offset);
    let name = rest.trim_matches('"').trim();
    (!name.is_empty()).then(|| MtlPicture {
        name: name.to_owned(),
        placed: (placed != Affine2::IDENTITY).then_some(placed),
    })
}

/// The option with which a text begins, and how many values may follow it.
fn option(text: &str) -> Option<(&'static str, usize)> {
    let word = text.split(char::is_whitespace).next()?;
    let mut options = OPTIONS.into_iter();
    options.find(|(name, _)| name.eq_ignore_ascii_case(word))
}

/// Whether the values of an option are numbers; else they are words.
fn takes_numbers(option: &str) -> bool {
    ["-bm", "-boost", "-mm", "-o", "-s", "-t", "-texres"].contains(&option)
}

/// The options of pictures.
const OPTIONS: [(&str, usize); 13] = [
    ("-blendu", 1),
    ("-blendv", 1),
    ("-bm", 1),
    ("-boost", 1),
    ("-cc", 1),
    ("-clamp", 1),
    ("-imfchan", 1),
    ("-mm", 2),
    ("-o", 3),
    ("-s", 3),
    ("-t", 3),
    ("-texres", 1),
    ("-type", 1),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_programs_write_is_read_and_what_they_should_not_is_left_out() {
        let text = "# caf\u{fffd}\nKd 1 1 1\nnewmtl a b\nillum x\nKd 0.5\nKs 1 1 1\nNs 30 # sharp\nmap_Kd -s 1 1 1 -clamp on \"a b.png\"\n\
             newmtl c\nKd spectral a.rfl\nKd\nNs nan\nmap_Kd\nnewmtl d\nKd 0.1 0.2 0.3 # grey\nNs 9\nmap_kd d.png\nnewmtl\nKd 1 -1 0\n";
        let all = materials(text);
        let names: Vec<&str> = all.iter().map(|one| one.name.as_str()).collect();
        assert_eq!(names, ["a b", "c", "d", ""]);
        let colours = [
            Some(Vec3::splat(0.5)),
            None,
            Some(Vec3::new(0.1, 0.2, 0.3)),
            None,
        ];
        let pictures = [Some("a b.png"), None, Some("d.png"), None];
        let roughness = [0.5, 1.0, 1.0, 1.0];
        for (at, one) in all.iter().enumerate() {
            assert_eq!(one.colour, colours[at]);
            let name = one.picture.as_ref().map(|picture| picture.name.as_str());
            assert_eq!(name, pictures[at]);
            assert!((one.roughness() - roughness[at]).abs() < 1e-6);
        }
    }

    #[test]
    fn options_of_pictures_are_told_from_names_that_look_like_them() {
        for (text, name) in [
            ("-bm 0.5 -mm 0 1 a.png", "a.png"),
            ("-o 1 a.png", "a.png"),
            ("-imfchan r -type sphere 2 b.png", "2 b.png"),
            ("-blendu off -cc on -texres 256\tc.png", "c.png"),
            ("-leaf.png", "-leaf.png"),
            ("1.png", "1.png"),
            ("maps\\d #2.png", "maps\\d #2.png"),
        ] {
            assert_eq!(picture(text).unwrap().name, name, "{text}");
        }
        for text in ["", "-clamp", "-clamp on", "-o 1 2", "\"\""] {
            // What is left is no name of a file, or none at all.
            let name = picture(text).map(|picture| picture.name);
            assert!(name.is_none_or(|name| !name.contains('.')), "{text}");
        }
    }

    #[test]
    fn a_picture_is_scaled_and_then_moved() {
        let placed = picture("-s 2 3 1 -o 0.5 0.25 a.png").unwrap().placed;
        let at = placed.unwrap().transform_point2(Vec2::ONE);
        assert_eq!(at, Vec2::new(2.5, 3.25));
        assert!(picture("-s 1 1 1 -o 0 0 0 a.png").unwrap().placed.is_none());
        let one = picture("-s 4 a.png").unwrap().placed.unwrap();
        assert_eq!(one.transform_point2(Vec2::ONE), Vec2::new(4.0, 1.0));
    }
}
