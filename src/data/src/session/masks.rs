//! The masks of several recordings in one folder: each has the name of its clip or of its session's folder.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use super::Recording;

/// What stands behind a clip's name in the name of its mask, where both may lie in one folder.
pub const MASK_SUFFIX: &str = "-mask";

/// The name, without ending, of the mask of the recording at `path` among those of others: that of the clip or of the
/// session's folder.
pub fn mask_stem(path: &Path) -> OsString {
    if !path.is_dir() {
        return path.file_stem().unwrap_or_default().to_owned();
    }
    if let Some(name) = path.file_name() {
        return name.to_owned();
    }
    // A path such as "." has no usable name.
    let real = path.canonicalize().ok();
    let name = real.as_deref().and_then(Path::file_name);
    name.unwrap_or_default().to_owned()
}

/// The mask of a recording in the folder `masks`: `NAME.png` or `NAME-mask.png`, where NAME is that of its clip, of its
/// session's folder, or its id. `None` if neither exists.
pub fn mask_in(masks: &Path, recording: &Recording) -> Option<PathBuf> {
    let mut stems = Vec::new();
    stems.extend(recording.folder.as_deref().map(mask_stem));
    stems.push(OsString::from(&recording.id));
    if recording.manifest.is_none() {
        // The video of a session has the same name in each of them.
        stems.insert(0, mask_stem(&recording.video));
    }
    let names = stems.iter().flat_map(|stem| {
        let named = |ending: &str| {
            let mut name = stem.clone();
            name.push(ending);
            name
        };
        ["", MASK_SUFFIX].map(|suffix| named(&format!("{suffix}.png")))
    });
    let names: Vec<OsString> = names.collect();
    let exact = names.iter().map(|name| masks.join(name));
    let mut exact = exact.filter(|path| path.is_file());
    exact.next().or_else(|| alike_in(masks, &names))
}

/// A file with one of these names, whose ending may be in capitals. Of two clips whose names differ in case, neither gets the
/// other's mask.
fn alike_in(folder: &Path, names: &[OsString]) -> Option<PathBuf> {
    let mut found: Vec<PathBuf> = fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| {
            let is_png = path
                .extension()
                .is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
            let mut name = path.file_stem().unwrap_or_default().to_owned();
            name.push(".png");
            is_png && names.contains(&name) && path.is_file()
        })
        .collect();
    found.sort();
    found.into_iter().next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clips_mask_has_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let clip = folder.path().join("my cup.mp4");
        fs::write(&clip, b"").unwrap();
        let recording = Recording::open(&clip).unwrap();
        let masks = folder.path().join("masks");
        fs::create_dir(&masks).unwrap();
        assert_eq!(mask_in(&masks, &recording), None);
        for name in ["cup.png", "My Cup.png", "my cup-preview.png", "my cup.json"] {
            fs::write(masks.join(name), b"").unwrap();
        }
        assert_eq!(mask_in(&masks, &recording), None);
        // From the least fitting name to the best.
        for name in ["my cup.PNG", "my_cup.png", "my cup-mask.png", "my cup.png"] {
            fs::write(masks.join(name), b"").unwrap();
            assert_eq!(mask_in(&masks, &recording), Some(masks.join(name)));
        }
    }

    #[test]
    fn the_mask_of_a_folder_with_a_video_has_the_name_of_one_of_them() {
        let folder = tempfile::tempdir().unwrap();
        let session = folder.path().join("mug");
        fs::create_dir(&session).unwrap();
        fs::write(session.join("GOPR0001.MP4"), b"").unwrap();
        let recording = Recording::open(&session).unwrap();
        for name in ["mug.png", "GOPR0001.png"] {
            fs::write(folder.path().join(name), b"").unwrap();
            let found = mask_in(folder.path(), &recording);
            assert_eq!(found, Some(folder.path().join(name)));
        }
        assert_eq!(mask_stem(&session), "mug");
    }
}
