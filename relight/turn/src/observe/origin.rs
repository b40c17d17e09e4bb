//! The origin of a shard: its entry in `dataset.json`, and the session or video nearby.

use std::fs;
use std::path::{Path, PathBuf};

use relit_data::session::{MANIFEST_FILE, Recording};
use relit_data::shard::{Dataset, SessionEntry};

use crate::error::TurnError;

/// The data set that a shard belongs to, or that is given as a folder, and the folder.
pub(crate) fn dataset_of(shard: &Path) -> Option<(Dataset, PathBuf)> {
    let folder = if shard.is_dir() {
        shard.to_owned()
    } else {
        parent_of(shard)?
    };
    Some((Dataset::read(&folder).ok()?, folder))
}

/// The entry of a shard's session; of a whole data set that of its first.
pub(crate) fn session_of<'a>(dataset: &'a Dataset, shard: &Path) -> Option<&'a SessionEntry> {
    let is_dataset = shard.is_dir();
    let is_of = |id: &str| {
        let mut shards = dataset.shards_of(id);
        shards.any(|entry| {
            shard
                .file_name()
                .is_some_and(|name| name == entry.file.as_str())
        })
    };
    let mut sessions = dataset.sessions.iter();
    sessions.find(|session| is_dataset || is_of(&session.id))
}

/// The session or video that a shard was made from, as `dataset.json` names it: in the folder of the data set, in the
/// one around it, or in a folder of that.
///
/// # Errors
/// If it is in none of them; that of opening what is there.
pub(crate) fn recording_of(shard: &Path) -> Result<Recording, TurnError> {
    let nothing = || {
        TurnError::Refused(format!(
            "the session or video from which {} was made is not next to its data set: give it with --session",
            shard.display()
        ))
    };
    let (dataset, folder) = dataset_of(shard).ok_or_else(nothing)?;
    let session = session_of(&dataset, shard).ok_or_else(nothing)?;
    let found = folders_near(&folder)
        .iter()
        .find_map(|near| find_in(near, session));
    Ok(Recording::open(&found.ok_or_else(nothing)?)?)
}

/// The session's folder, or its video, in a folder.
fn find_in(folder: &Path, session: &SessionEntry) -> Option<PathBuf> {
    let own = folder.join(&session.id);
    let video = folder.join(&session.input.video);
    if own.join(MANIFEST_FILE).is_file() || is_video_of(&own.join(&session.input.video), session) {
        Some(own)
    } else if is_video_of(&video, session) {
        Some(video)
    } else {
        None
    }
}

/// Whether a file has the length of a session's video.
fn is_video_of(path: &Path, session: &SessionEntry) -> bool {
    fs::metadata(path).is_ok_and(|found| found.is_file() && found.len() == session.input.bytes)
}

/// A folder, the one around it, and the folders of that, sorted by name.
fn folders_near(folder: &Path) -> Vec<PathBuf> {
    let mut near = vec![folder.to_owned()];
    let Some(around) = parent_of(folder) else {
        return near;
    };
    let entries = fs::read_dir(&around).into_iter().flatten().flatten();
    let mut beside: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(|path| path.is_dir())
        .collect();
    beside.sort();
    near.push(around);
    near.extend(beside);
    near
}

/// The folder that a path is in, also of a name alone.
fn parent_of(path: &Path) -> Option<PathBuf> {
    fs::canonicalize(path).ok()?.parent().map(Path::to_owned)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    const VIDEO: &[u8] = b"a video";

    /// A data set in the folder `out`, of the session `mug`, whose video is `clip.mkv`.
    fn shard_in(root: &Path) -> PathBuf {
        let out = root.join("out");
        fs::create_dir(&out).unwrap();
        let digest = "0".repeat(64);
        let described = json!({
            "schema": "relit.dataset/1",
            "software": {"name": "relit", "version": "1"},
            "settings": {"frames": 4, "size": 64, "margin": 0.1, "saturation_level": 250, "gate": 0.05,
                         "align": "off", "layout": "webdataset", "scaling": "area"},
            "sessions": [{
                "id": "mug", "object": "mug", "selection": "time", "samples": 4, "duplicates": 0, "spec_net": 0,
                "input": {"video": "clip.mkv", "codec": "ffv1", "frames": 4, "bytes": VIDEO.len(), "blake3": digest},
                "mask": {"blake3": digest, "px": 9, "bounding_box": [0, 0, 3, 3]},
                "lossy": false, "warnings": [], "report": null,
                "quality": {"verdict": "good", "reasons": [], "saturated_mean": 0.0, "sharpness_median": 0.0,
                            "shift_rms_px": null, "shift_max_px": null, "moved": 0, "unregistered": 0,
                            "exposure_steps": 0, "identical": 0, "blurred": 0},
                "table": {"file": "mug.parquet", "bytes": 1, "blake3": digest},
            }],
            "shards": [{"file": "mug.tar", "session": "mug", "samples": 4, "bytes": 1, "blake3": digest}],
        });
        fs::write(out.join(Dataset::FILE), described.to_string()).unwrap();
        let shard = out.join("mug.tar");
        fs::write(&shard, "").unwrap();
        shard
    }

    #[test]
    fn the_video_is_found_beside_the_data_set_and_in_folders_there() {
        for place in ["out", "", "videos", "mug", "sessions/mug"] {
            let root = tempfile::tempdir().unwrap();
            let shard = shard_in(root.path());
            let folder = root.path().join(place);
            fs::create_dir_all(&folder).unwrap();
            fs::write(folder.join("clip.mkv"), VIDEO).unwrap();
            let found = recording_of(&shard).unwrap();
            let expected = fs::canonicalize(folder.join("clip.mkv")).unwrap();
            assert_eq!(fs::canonicalize(found.video).unwrap(), expected, "{place}");
        }
    }

    #[test]
    fn a_video_of_another_length_or_elsewhere_is_not_that_of_the_shard() {
        let root = tempfile::tempdir().unwrap();
        let shard = shard_in(root.path());
        let refused = || matches!(recording_of(&shard), Err(TurnError::Refused(_)));
        assert!(refused());
        fs::write(root.path().join("clip.mkv"), b"another video").unwrap();
        assert!(refused());
        fs::remove_file(root.path().join("out").join(Dataset::FILE)).unwrap();
        fs::write(root.path().join("clip.mkv"), VIDEO).unwrap();
        assert!(refused());
    }
}
