//! The mask of a recording: one frame read, three files written beside each other.
//!
//! `NAME.png` is the mask, `NAME.json` its record, `NAME-preview.png` the picture to judge it by.
//! A mask is replaced only where its record vouches for it, because then it can be made again.

mod error;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use image::RgbImage;

use relit_data::durable;
use relit_data::session::{MASK_FILE, Notice, Recording};
use relit_mask::{
    Hints, MASK_SCHEMA, Mask, MaskRecord, RecordFault, RecordedHints, RecordedResult, Settings,
    Software, Source, Warning, grey_png, preview, rgb_png, segment,
};
use relit_video::Video;

pub use error::Error;

/// What is to be made.
#[derive(Debug, Clone)]
pub struct Request {
    frame: u64,
    hints: Hints,
    settings: Settings,
    recipe: Option<Recipe>,
    force: bool,
}

/// A record that is to be followed to the same bytes.
#[derive(Debug, Clone)]
struct Recipe {
    path: PathBuf,
    record: MaskRecord,
}

/// A mask on disk.
#[derive(Debug, Clone)]
pub struct Made {
    /// The recording's id.
    pub recording: String,
    /// Where the three files are.
    pub files: MaskFiles,
    /// What the record says.
    pub record: MaskRecord,
    /// What the user has to know of the recording.
    pub notices: Vec<Notice>,
}

/// The names of a mask's three files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MaskFiles {
    /// The mask.
    pub mask: PathBuf,
    /// Its record.
    pub record: PathBuf,
    /// The preview.
    pub preview: PathBuf,
}

impl Request {
    /// A mask on frame number `frame`, 0-based, by `hints`.
    #[must_use]
    pub fn new(frame: u64, hints: Hints, settings: Settings) -> Self {
        Self {
            frame,
            hints,
            settings,
            recipe: None,
            force: false,
        }
    }

    /// The mask that the record `path` tells of, to the same bytes.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Recipe`].
    pub fn from_recipe(path: &Path) -> Result<Self, Error> {
        let wrong = |fault: RecordFault| Error::Recipe {
            path: path.to_owned(),
            why: fault.to_string(),
        };
        let bytes = fs::read(path).map_err(Error::io(path, "read"))?;
        let record = MaskRecord::from_json(&bytes).map_err(wrong)?;
        let hints = record.hints.hints().map_err(wrong)?;
        let path = path.to_owned();
        Ok(Self {
            frame: record.source.frame,
            hints,
            settings: record.settings,
            recipe: Some(Recipe { path, record }),
            force: false,
        })
    }

    /// Replace a mask that nothing vouches for, and follow a recipe also to other bytes.
    #[must_use]
    pub fn with_force(self, force: bool) -> Self {
        Self { force, ..self }
    }
}

impl MaskFiles {
    /// The files of the mask `mask`, whose name has to end in `.png`.
    ///
    /// # Errors
    /// [`Error::OutputName`].
    pub fn of(mask: &Path) -> Result<Self, Error> {
        let is_png = mask
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
        match mask.file_stem() {
            Some(stem) if is_png => {
                let mut preview = stem.to_owned();
                preview.push("-preview.png");
                Ok(Self {
                    mask: mask.to_owned(),
                    record: mask.with_extension("json"),
                    preview: mask.with_file_name(preview),
                })
            }
            _ => Err(Error::OutputName(mask.to_owned())),
        }
    }
}

/// Makes the mask of the recording at `input`, a session folder or a video file, and writes its
/// files: to `output`, else as `mask.png` in the session folder or, for a bare video, in the
/// working directory. Each file appears whole or not at all, the mask last; nothing is written
/// where anything fails before.
///
/// # Errors
/// [`Error::Session`] where there is no recording; else [`Error::Recording`] around any other.
pub fn make(input: &Path, output: Option<MaskFiles>, request: &Request) -> Result<Made, Error> {
    let recording = Recording::open(input)?;
    match make_unnamed(&recording, output, request) {
        Ok((files, record)) => Ok(Made {
            recording: recording.id,
            files,
            record,
            notices: recording.notices,
        }),
        Err(source) => Err(Error::Recording {
            recording: recording.id,
            source: Box::new(source),
        }),
    }
}

fn make_unnamed(
    recording: &Recording,
    output: Option<MaskFiles>,
    request: &Request,
) -> Result<(MaskFiles, MaskRecord), Error> {
    let files = match output {
        Some(files) => files,
        None => MaskFiles::of(&recording.folder.clone().unwrap_or_default().join(MASK_FILE))?,
    };
    may_write(&files, request.force)?;
    let record = cut_and_write(&recording.video, &files, request)?;
    Ok((files, record))
}

fn cut_and_write(video: &Path, files: &MaskFiles, request: &Request) -> Result<MaskRecord, Error> {
    let (frame, source) = read_frame(video, request.frame)?;
    if let Some(recipe) = &request.recipe
        && !request.force
        && !same_picture(&recipe.record.source, &source)
    {
        return Err(Error::OtherFrame {
            frame: request.frame,
            video: video.to_owned(),
            recipe: recipe.path.clone(),
        });
    }
    let mask = segment(&frame, &request.hints, &request.settings)?;
    let png = grey_png(mask.image(), "the mask")?;
    let record = record_of(source, request, &mask, &png)?;
    let picture = rgb_png(&preview(&frame, mask.image()), "the preview")?;
    let json = record.to_json();
    let json = json.map_err(|error| Error::io(&files.record, "written")(error.into()))?;
    write(&files.preview, &picture)?;
    write(&files.record, &json)?;
    write(&files.mask, &png)?;
    Ok(record)
}

fn read_frame(path: &Path, number: u64) -> Result<(RgbImage, Source), Error> {
    let video = Video::open(path)?;
    let frame = video.frame(number)?;
    let info = video.frames().iter().find(|info| info.number == number);
    let name = path.file_name().unwrap_or_default();
    let source = Source {
        video: name.to_string_lossy().into_owned(),
        frame: number,
        t_us: info.map_or(0, |info| info.t_us),
        width: frame.width(),
        height: frame.height(),
        frame_blake3: blake3::hash(frame.as_raw()).to_hex().to_string(),
    };
    Ok((frame, source))
}

fn same_picture(a: &Source, b: &Source) -> bool {
    (a.width, a.height, &a.frame_blake3) == (b.width, b.height, &b.frame_blake3)
}

fn record_of(
    source: Source,
    request: &Request,
    mask: &Mask,
    png: &[u8],
) -> Result<MaskRecord, Error> {
    let result = RecordedResult::new(mask.figures(), png);
    let mut warnings: Vec<String> = mask.warnings().iter().map(Warning::to_string).collect();
    let software = Software::here();
    if let Some(Recipe { path, record }) = &request.recipe
        && record.result.mask_blake3 != result.mask_blake3
    {
        if !request.force {
            return Err(Error::NotReproduced {
                recipe: path.clone(),
                made_by: record.software.to_string(),
                now: software.to_string(),
            });
        }
        warnings.push(Warning::NotReproduced.to_string());
    }
    Ok(MaskRecord {
        schema: MASK_SCHEMA.to_owned(),
        software,
        source,
        hints: RecordedHints::new(&request.hints)?,
        settings: request.settings,
        result,
        warnings,
    })
}

/// Whether what stands where the files would go can be replaced.
fn may_write(files: &MaskFiles, force: bool) -> Result<(), Error> {
    let record = match read_if_there(&files.record)? {
        None => None,
        Some(bytes) => {
            let record = MaskRecord::from_json(&bytes).map_err(|fault| Error::ForeignFile {
                path: files.record.clone(),
                why: fault.to_string(),
            })?;
            Some(record)
        }
    };
    if force {
        return Ok(());
    }
    let Some(mask) = read_if_there(&files.mask)? else {
        return Ok(());
    };
    let found = blake3::hash(&mask).to_hex();
    match record {
        Some(record) if record.result.mask_blake3 == found.as_str() => Ok(()),
        _ => Err(Error::Handmade(files.mask.clone())),
    }
}

fn read_if_there(path: &Path) -> Result<Option<Vec<u8>>, Error> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(Error::io(path, "read")(error)),
    }
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    durable::write_whole(path, bytes).map_err(Error::io(path, "written"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn record_and_preview_stand_beside_the_mask() {
        let files = MaskFiles::of(Path::new("a/mug.v2.PNG")).unwrap();
        assert_eq!(files.record, Path::new("a/mug.v2.json"));
        assert_eq!(files.preview, Path::new("a/mug.v2-preview.png"));
    }

    #[test]
    fn a_mask_has_to_be_called_png() {
        for name in ["mask", "mask.jpg", "session.json", ".png", ""] {
            let files = MaskFiles::of(Path::new(name));
            assert!(matches!(files, Err(Error::OutputName(_))), "{name}");
        }
    }

    #[test]
    fn a_file_that_is_no_record_is_never_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let files = MaskFiles::of(&folder.path().join("session.png")).unwrap();
        fs::write(&files.record, r#"{"schema": "relit.session/1"}"#).unwrap();
        let result = may_write(&files, true);
        assert!(matches!(result, Err(Error::ForeignFile { .. })));
    }

    #[test]
    fn a_mask_without_record_is_replaced_only_by_force() {
        let folder = tempfile::tempdir().unwrap();
        let files = MaskFiles::of(&folder.path().join("mask.png")).unwrap();
        assert!(may_write(&files, false).is_ok());
        fs::write(&files.mask, "painted").unwrap();
        assert!(matches!(may_write(&files, false), Err(Error::Handmade(_))));
        assert!(may_write(&files, true).is_ok());
    }
}
