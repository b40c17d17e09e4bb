//! Where the data sets of scenes and scanned objects keep their files: ARAP and Stanford-ORB.

use std::path::{Path, PathBuf};

use super::entry::{Entry, Part, Role, name_of};
use crate::reader::OpenError;
use crate::reader::listing::listed;

/// What pictures are, in the order in which they are looked for.
const PICTURES: [&str; 5] = ["exr", "hdr", "png", "jpg", "jpeg"];
/// How the names of files end that are no pictures of a scene.
const DERIVED: [&str; 5] = ["_albedo", "_shading", "_normal", "_depth", "_mask"];

/// The pictures of one folder that have an albedo.
pub(super) fn arap(root: &Path) -> Result<Vec<Entry>, OpenError> {
    let pictures = listed(root, is_picture)?;
    Ok(pictures.iter().filter_map(|path| of_scene(path)).collect())
}

fn is_picture(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let is_known = extension.is_some_and(|e| PICTURES.contains(&e.as_str()));
    is_known && path.is_file() && !DERIVED.iter().any(|end| stem(path).ends_with(end))
}

fn of_scene(picture: &Path) -> Option<Entry> {
    let name = stem(picture);
    let scene = without_light(&name);
    let beside = |part: &str| -> Option<PathBuf> {
        let of = |name: &str| existing(&picture.with_file_name(format!("{name}_{part}")));
        of(&name).or_else(|| of(scene))
    };
    let albedo = beside("albedo")?;
    let mut parts = vec![
        part(Role::Image, picture.to_owned()),
        part(Role::Albedo, albedo),
    ];
    let more = [(Role::Shading, "shading"), (Role::Mask, "mask")];
    parts.extend(
        more.into_iter()
            .filter_map(|(role, name)| Some(part(role, beside(name)?))),
    );
    Some(Entry { name, parts })
}

/// The name of the scene of a picture of one of its lights.
fn without_light(name: &str) -> &str {
    let number = |(_, number): &(&str, &str)| {
        !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())
    };
    let parts = name.rsplit_once("_light").filter(number);
    parts.map_or(name, |(scene, _)| scene)
}

/// The test pictures of all scenes that have ground truth, those with high dynamic range where they are there.
pub(super) fn orb(root: &Path) -> Result<Vec<Entry>, OpenError> {
    let pictures = ["blender_HDR", "blender_LDR"].map(|name| root.join(name));
    let folder = pictures.iter().find(|folder| folder.is_dir());
    let Some(folder) = folder else {
        return Ok(Vec::new());
    };
    let mut entries = Vec::new();
    for scene in listed(folder, Path::is_dir)? {
        let name = name_of(&scene);
        let truth = root.join("ground_truth").join(&name);
        if !truth.is_dir() {
            continue;
        }
        for picture in listed(&scene.join("test"), is_picture)? {
            let view = stem(&picture);
            let mask = format!("test_mask/{view}.png");
            let masks = pictures
                .each_ref()
                .map(|folder| folder.join(&name).join(&mask));
            let mask = masks
                .iter()
                .find(|path| path.is_file())
                .unwrap_or(&masks[0]);
            let mut parts = vec![
                part(Role::Image, picture.clone()),
                part(Role::Mask, mask.clone()),
            ];
            for (role, folder) in [
                (Role::Normals, "surface_normal"),
                (Role::Albedo, "pseudo_gt_albedo"),
            ] {
                let found = existing(&truth.join(folder).join(&view));
                parts.extend(found.map(|path| part(role, path)));
            }
            entries.push(Entry {
                name: format!("{name}/{view}"),
                parts,
            });
        }
    }
    Ok(entries)
}

/// The file of this path with one of the known extensions.
fn existing(path: &Path) -> Option<PathBuf> {
    let with = |extension: &&str| {
        let mut name = path.as_os_str().to_owned();
        name.push(format!(".{extension}"));
        PathBuf::from(name)
    };
    let known = ["npy"].iter().chain(&PICTURES);
    known.map(with).find(|path| path.is_file())
}

fn part(role: Role, path: PathBuf) -> Part {
    Part {
        role,
        path,
        required: true,
    }
}

fn stem(path: &Path) -> String {
    path.file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_light_is_no_part_of_a_scenes_name() {
        assert_eq!(without_light("kitchen_light12"), "kitchen");
        assert_eq!(without_light("kitchen"), "kitchen");
        assert_eq!(without_light("red_light"), "red_light");
        assert_eq!(without_light("a_light_bulb"), "a_light_bulb");
    }
}
