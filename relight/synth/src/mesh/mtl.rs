//! Materials of Wavefront files: their colour, its picture, and how sharp the highlight is. All else in them is left out, also
//! where it is damaged: programs write many things there. `tobj` ends the program at a colour of one number, which is a grey.

use glam::Vec3;

use super::material::DULL;

/// A material as the file has it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MtlMaterial {
    pub(super) name: String,
    /// Linear red, green and blue.
    pub(super) colour: Option<Vec3>,
    /// The name of the picture's file.
    pub(super) picture: Option<String>,
    specular: Vec3,
    exponent: Option<f32>,
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
    for line in text.lines() {
        let line = line.trim();
        let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
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
            "ns" => material.exponent = rest.parse().ok().filter(|number: &f32| number.is_finite()),
            "map_kd" => {
                material.picture = Some(without_options(rest)).filter(|name| !name.is_empty())
            }
            _ => {}
        }
    }
    all
}

/// Three numbers, or one for all three.
fn colour(text: &str) -> Option<Vec3> {
    let numbers: Option<Vec<f32>> = text
        .split_whitespace()
        .map(|number| number.parse().ok())
        .collect();
    let colour = match *numbers?.as_slice() {
        [grey] => Vec3::splat(grey),
        [red, green, blue, ..] => Vec3::new(red, green, blue),
        _ => return None,
    };
    (colour.is_finite() && colour.min_element() >= 0.0).then_some(colour)
}

/// The name behind `-o 0 0 0` and the like, without quotes.
fn without_options(text: &str) -> String {
    let mut rest = text;
    while rest.starts_with('-') {
        let (_, behind) = rest.split_once(char::is_whitespace).unwrap_or(("", ""));
        rest = behind.trim_start();
        while let Some((value, behind)) = rest.split_once(char::is_whitespace)
            && (value.parse::<f32>().is_ok() || matches!(value, "on" | "off"))
        {
            rest = behind.trim_start();
        }
    }
    rest.trim_matches('"').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_programs_write_is_read_and_what_they_should_not_is_left_out() {
        let text = "# caf\u{fffd}\nKd 1 1 1\nnewmtl a b\nillum x\nKd 0.5\nKs 1 1 1\nNs 30\nmap_Kd -s 1 1 1 -clamp on \"a b.png\"\n\
             newmtl c\nKd spectral a.rfl\nKd\nNs nan\nmap_Kd\nnewmtl d\nKd 0.1 0.2 0.3\nNs 9\nmap_kd d.png\nnewmtl\nKd 1 -1 0\n";
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
            assert_eq!(one.picture.as_deref(), pictures[at]);
            assert!((one.roughness() - roughness[at]).abs() < 1e-6);
        }
    }
}
