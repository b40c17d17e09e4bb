//! One recording from its files to its entry in the data set.

use std::path::Path;

use image::imageops::thumbnail;
use image::{GrayImage, RgbImage};
use rayon::ThreadPool;

use super::pipeline::{Lost, Processed, Stage};
use super::plan::{Plan, Use};
use super::{Basis, Error, Observer, Options, Scaler, binary, bounding_box, cut, square_around};
use crate::geometry::Rect;
use crate::report::{self, Page, Thumbnail};
use crate::session::{MASK_FILE, Notice, Recording};
use crate::shard::{
    self, Dataset, Digest, FileEntry, FrameRecord, Input, MaskInfo, MaskSpans, OutputFolder,
    Sample, SessionEntry, SessionWriter, ShardEntry, Size,
};
use crate::video::Video;

/// Pictures on the report's contact sheet.
const THUMBNAILS: u32 = 24;
/// Their largest side, pixels.
const THUMBNAIL_SIDE: u32 = 256;
/// How many damaged frames are told one by one.
const TOLD: usize = 8;
/// Most pixels of a crop: each thread works on a few pictures of this size.
const MAX_CROP_PIXELS: u64 = 1 << 26;

/// A recording that can be extracted.
#[derive(Debug)]
pub(super) struct Job {
    recording: Recording,
    video: Video,
    input: Input,
    mask: Mask,
    notices: Vec<Notice>,
}

/// The mask of a video.
#[derive(Debug)]
struct Mask {
    /// 0 or 255, as large as the frames.
    pixels: GrayImage,
    bounding_box: Rect,
    blake3: Digest,
}

impl Job {
    /// Opens recording, video and mask, and looks whether they belong together.
    pub(super) fn open(path: &Path, options: &Options) -> Result<Self, Error> {
        let recording = Recording::open(path)?;
        let mask_path = match (&options.mask, &recording.folder) {
            (Some(mask), _) => mask.clone(),
            (None, Some(folder)) => folder.join(MASK_FILE),
            (None, None) => return Err(Error::NoMask(path.to_owned())),
        };
        if !mask_path.is_file() {
            return Err(Error::NoMask(path.to_owned()));
        }
        let video = Video::open(&recording.video)?;
        let mask = Mask::open(&mask_path, (video.facts().width, video.facts().height))?;
        let (bytes, blake3) = digest(&recording.video)?;
        let mut notices = recording.notices.clone();
        compare_with_manifest(&recording, &video, blake3, &mut notices);
        notices.extend(
            video
                .damage()
                .iter()
                .map(|damage| Notice::Loss(damage.to_string())),
        );
        notices.extend(video.notes().iter().cloned().map(Notice::Warning));
        let name = recording.video.file_name().unwrap_or_default();
        let input = Input {
            video: name.to_string_lossy().into_owned(),
            codec: video.facts().codec.clone(),
            frames: video.frames().len() as u64,
            bytes,
            blake3,
            index_blake3: None,
        };
        Ok(Self {
            recording,
            video,
            input,
            mask,
            notices,
        })
    }

    pub(super) fn id(&self) -> &str {
        &self.recording.id
    }

    /// Whether the data set in `out` holds this recording, of the same video and mask, whole.
    pub(super) fn is_vouched_for(&self, dataset: &Dataset, out: &Path) -> bool {
        dataset.session(self.id()).is_some_and(|entry| {
            entry.input.blake3 == self.input.blake3 && entry.mask.blake3 == self.mask.blake3
        }) && dataset.vouches_for(out, self.id()).is_ok()
    }

    /// Extracts the recording into `folder`.
    pub(super) fn run(
        self,
        folder: &OutputFolder,
        options: &Options,
        pool: &ThreadPool,
        observer: &dyn Observer,
    ) -> Result<(SessionEntry, Vec<ShardEntry>), Error> {
        let mut plan = Plan::new(&self.video, self.recording.frames.as_ref(), options.frames)?;
        let mut notices = self.notices.clone();
        notices.extend(self.judge(&plan));
        if options.strict {
            refuse(&plan, &notices)?;
        }
        let stage = self.stage(options)?;
        let mut writer = SessionWriter::create(
            folder.path(),
            options.layout,
            self.id(),
            options.frames,
            stage.scaler.mask(),
        )?;
        let mut made = Made::new(options.frames);
        let mut uses = plan.uses();
        let mut lost = Vec::new();
        while !uses.is_empty() {
            let now_lost = stage.run(&uses, pool, |frame| {
                for &chosen in uses.get(&frame.number).into_iter().flatten() {
                    let record = self.record(&stage, &plan, &frame, chosen, options);
                    made.keep(&record, &frame.image, options.frames);
                    let (image, png) = (frame.image.clone(), frame.png.clone());
                    writer.push(Sample { record, image, png })?;
                    observer.advanced();
                }
                Ok(())
            })?;
            uses = plan.replace(&now_lost)?;
            lost.extend(now_lost);
            if options.strict
                && let Some(frame) = lost.first()
            {
                return Err(Error::Strict(told(frame)));
            }
        }
        notices.extend(notices_of_lost(&lost));
        let warnings: Vec<String> = notices.iter().map(|n| n.text().to_owned()).collect();
        let files = writer.finish()?;
        let Made {
            records,
            thumbnails,
        } = made.in_order();
        let report = self.report(folder, options, &records, &thumbnails, &warnings)?;
        let count = |is: fn(&FrameRecord) -> bool| records.iter().filter(|r| is(r)).count() as u32;
        let entry = SessionEntry {
            id: self.recording.id.clone(),
            object: self.recording.object.clone(),
            input: self.input.clone(),
            mask: MaskInfo {
                blake3: self.mask.blake3,
                px: stage.spans.pixels(),
                bounding_box: self.mask.bounding_box,
            },
            selection: match plan.selection.basis {
                Basis::Angle => shard::Selection::Angle,
                Basis::Time => shard::Selection::Time,
            },
            samples: options.frames,
            duplicates: count(|r| r.duplicate),
            spec_net: count(|r| r.spec_net),
            lossy: notices.iter().any(Notice::is_loss),
            warnings,
            table: files.table,
            report: Some(report),
        };
        Ok((entry, files.shards))
    }

    fn stage(&self, options: &Options) -> Result<Stage<'_>, Error> {
        let facts = self.video.facts();
        let crop = square_around(
            self.mask.bounding_box,
            options.margin,
            (facts.width, facts.height),
        );
        if u64::from(crop.w) * u64::from(crop.h) > MAX_CROP_PIXELS {
            return Err(Error::CropTooLarge(crop));
        }
        let crop_mask = cut(&self.mask.pixels, crop);
        let side = match options.size {
            Size::Pixels(side) => Some(side),
            Size::Native(_) => None,
        };
        Ok(Stage {
            video: &self.video,
            crop,
            spans: MaskSpans::of(&crop_mask),
            scaler: Scaler::new(crop_mask, side)?,
            saturation_level: options.saturation_level,
        })
    }

    fn record(
        &self,
        stage: &Stage<'_>,
        plan: &Plan,
        frame: &Processed,
        chosen: Use,
        options: &Options,
    ) -> FrameRecord {
        let candidate = plan.candidate(frame.number);
        let measures = &frame.measures;
        let saturated_fraction = measures.saturated_fraction();
        FrameRecord {
            session: self.recording.id.clone(),
            object: self.recording.object.clone(),
            index: chosen.index,
            source_frame: frame.number,
            t_us: candidate.map_or(0, |candidate| candidate.t_us),
            angle_deg: candidate.and_then(|candidate| candidate.angle_deg),
            duplicate: chosen.duplicate,
            crop: stage.crop,
            size: frame.image.dimensions().into(),
            shift_px: None,
            shift_applied: false,
            mask_px: measures.mask_px,
            saturated_px: measures.saturated_px,
            saturated_fraction,
            saturated_any_px: measures.saturated_any_px,
            spec_net: saturated_fraction > options.gate,
            mean_rgb: measures.mean_rgb,
            sharpness: measures.sharpness,
        }
    }

    /// What the plan shows: repeated frames, a turn that is not whole, gaps.
    fn judge(&self, plan: &Plan) -> Vec<Notice> {
        let mut notices = Vec::new();
        if self.recording.frames.is_none() {
            notices.extend(plan.gap_warnings().into_iter().map(Notice::Warning));
        }
        if let Some(left_out) = plan.without_angle() {
            notices.push(Notice::Warning(format!(
                "{left_out} frames have no angle, where others have one, and are left out"
            )));
        }
        let repeated = plan.repeated();
        if repeated > 0 {
            notices.push(Notice::Warning(format!(
                "{repeated} of {} samples repeat a source frame and are flagged as duplicates: the video has {} usable frames",
                plan.selection.frames.len(),
                plan.usable(),
            )));
        }
        if let Some(covered) = plan.selection.covered_deg
            && plan.selection.is_partial()
        {
            notices.push(Notice::Loss(format!(
                "the frames cover {covered:.1} of 360 degrees: the samples are spread over these"
            )));
        }
        notices
    }

    /// Writes the session's page.
    fn report(
        &self,
        folder: &OutputFolder,
        options: &Options,
        records: &[FrameRecord],
        thumbnails: &[Thumbnail],
        warnings: &[String],
    ) -> Result<FileEntry, Error> {
        let facts = self.video.facts();
        let pair = |name: &str, value: String| (name.to_owned(), value);
        let crop = records
            .first()
            .map_or_else(String::new, |record| record.crop.to_string());
        let page = report::render(&Page {
            records,
            thumbnails,
            settings: &setting_rows(options),
            facts: &[
                pair("video", self.input.video.clone()),
                pair("codec", format!("{}, {}", facts.codec, facts.pixel_format)),
                pair(
                    "frame size",
                    format!("{} x {} pixels", facts.width, facts.height),
                ),
                pair("frames in the video", self.input.frames.to_string()),
                pair("mask, bounding box", self.mask.bounding_box.to_string()),
                pair("crop", crop),
                pair("video BLAKE3", self.input.blake3.to_string()),
                pair("mask BLAKE3", self.mask.blake3.to_string()),
            ],
            warnings,
            gate: options.gate,
            saturation_level: options.saturation_level,
        })?;
        Ok(folder.write(&format!("{}.html", self.id()), page.as_bytes())?)
    }
}

/// With `strict`: an error where something is lost or a frame is repeated.
fn refuse(plan: &Plan, notices: &[Notice]) -> Result<(), Error> {
    if let Some(loss) = notices.iter().find(|notice| notice.is_loss()) {
        return Err(Error::Strict(loss.text().to_owned()));
    }
    match plan.repeated() {
        0 => Ok(()),
        n => Err(Error::Strict(format!(
            "{n} samples would repeat a source frame"
        ))),
    }
}

fn notices_of_lost(lost: &[Lost]) -> Vec<Notice> {
    let mut notices: Vec<Notice> = lost.iter().take(TOLD).map(told).map(Notice::Loss).collect();
    if lost.len() > TOLD {
        let more = lost.len() - TOLD;
        notices.push(Notice::Loss(format!(
            "{more} more frames cannot be decoded"
        )));
    }
    notices
}

fn told(lost: &Lost) -> String {
    format!(
        "frame {} cannot be decoded: {}; a neighbour stands in for it",
        lost.number, lost.fault
    )
}

fn setting_rows(options: &Options) -> Vec<(String, String)> {
    let settings = serde_json::to_value(options.settings()).unwrap_or_default();
    let rows = settings.as_object().into_iter().flatten();
    rows.map(|(name, value)| {
        let text = value
            .as_str()
            .map_or_else(|| value.to_string(), str::to_owned);
        (name.replace('_', " "), text)
    })
    .collect()
}

/// What is kept of the samples for table and report.
struct Made {
    records: Vec<FrameRecord>,
    thumbnails: Vec<Thumbnail>,
}

impl Made {
    fn new(samples: u32) -> Self {
        Self {
            records: Vec::with_capacity(samples as usize),
            thumbnails: Vec::new(),
        }
    }

    fn keep(&mut self, record: &FrameRecord, image: &RgbImage, samples: u32) {
        if is_thumbnail(record.index, samples) {
            let image = small(image);
            self.thumbnails.push(Thumbnail {
                index: record.index,
                image,
            });
        }
        self.records.push(record.clone());
    }

    fn in_order(mut self) -> Self {
        self.records.sort_by_key(|record| record.index);
        self.thumbnails.sort_by_key(|thumbnail| thumbnail.index);
        self
    }
}

/// Whether a sample is one of the evenly spread ones on the contact sheet.
fn is_thumbnail(index: u32, samples: u32) -> bool {
    let place = |index: u32| u64::from(index) * u64::from(THUMBNAILS) / u64::from(samples);
    index == 0 || place(index) != place(index - 1)
}

fn small(image: &RgbImage) -> RgbImage {
    let (width, height) = image.dimensions();
    if width.max(height) <= THUMBNAIL_SIDE {
        return image.clone();
    }
    // Crops are square.
    thumbnail(image, THUMBNAIL_SIDE, THUMBNAIL_SIDE)
}

impl Mask {
    fn open(path: &Path, frame: (u32, u32)) -> Result<Self, Error> {
        let broken = |source| Error::Mask {
            path: path.to_owned(),
            source,
        };
        let bytes = std::fs::read(path).map_err(|source| Error::Read {
            path: path.to_owned(),
            source,
        })?;
        let pixels = binary(
            &image::load_from_memory(&bytes)
                .map_err(broken)?
                .into_luma8(),
        );
        if pixels.dimensions() != frame {
            let mask = pixels.dimensions();
            return Err(Error::MaskSize {
                path: path.to_owned(),
                mask,
                frame,
            });
        }
        let bounding_box =
            bounding_box(&pixels).ok_or_else(|| Error::EmptyMask(path.to_owned()))?;
        Ok(Self {
            pixels,
            bounding_box,
            blake3: Digest::of(&bytes),
        })
    }
}

fn digest(path: &Path) -> Result<(u64, Digest), Error> {
    Digest::of_file(path).map_err(|source| Error::Read {
        path: path.to_owned(),
        source,
    })
}

/// Notes where the video is not what the manifest says of it.
fn compare_with_manifest(
    recording: &Recording,
    video: &Video,
    blake3: Digest,
    notices: &mut Vec<Notice>,
) {
    let Some(manifest) = &recording.manifest else {
        return;
    };
    let file = &manifest.video.file;
    let found = video.frames().len() as u64;
    if let Some(said) = manifest.video.frames
        && said != found
    {
        notices.push(Notice::Loss(format!(
            "{file} has {found} frames where the manifest says {said}"
        )));
    }
    let size_differs = notices
        .iter()
        .any(|notice| notice.is_loss() && notice.text().contains(file));
    if let Some(said) = &manifest.video.blake3
        && !said.eq_ignore_ascii_case(&blake3.to_string())
        && !size_differs
    {
        notices.push(Notice::Loss(format!(
            "{file} is not the file that was recorded: its BLAKE3 differs from the manifest's"
        )));
    }
}
