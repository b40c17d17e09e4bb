//! A script that sets up object, light and camera in Blender, from files beside it.

/// The script: it imports `glb`, lights it by the panorama `light` or by even light, and looks at it without perspective.
///
/// Names are those of files beside the script. The number beside the panorama is what its values are multiplied with.
/// `aspect` is the picture's width over its height.
#[must_use]
pub fn script(glb: &str, light: Option<(&str, f64)>, aspect: f64) -> String {
    let quoted = |name: &str| serde_json::Value::from(name).to_string();
    let strength = light.map_or(1.0, |(_, strength)| strength);
    let light = light.map_or_else(|| "None".to_owned(), |(name, _)| quoted(name));
    let [width, height] = if aspect >= 1.0 {
        [1024.0, 1024.0 / aspect]
    } else {
        [1024.0 * aspect, 1024.0]
    };
    TEMPLATE
        .replace("@GLB@", &quoted(glb))
        .replace("@LIGHT@", &light)
        .replace("@STRENGTH@", &strength.to_string())
        .replace("@WIDTH@", &format!("{width:.0}"))
        .replace("@HEIGHT@", &format!("{height:.0}"))
}

/// The script without its names.
const TEMPLATE: &str = include_str!("scene.py");
