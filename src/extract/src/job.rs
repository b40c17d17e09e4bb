//! The extraction of one recording, from its files to its entry in the data set.

use std::collections::HashMap;
use std::mem::take;
use std::path::Path;
use std::time::SystemTime;

use image::RgbImage;
use image::imageops::thumbnail;
use rayon::ThreadPool;

use relit_data::causes::with_causes;
use relit_data::counts::count_of;
use relit_data::image_stats::MaskSpans;
use relit_data::report::{self, Page, THUMBNAIL_SIDE};
use relit_data::session::{INDEX_FILE, Notice, Recording, Status};
use relit_data::shard::{
    Align, Dataset, Digest, FrameRecord, ImageSize, MaskInfo, MaskMisfit, OutputFolder, Sample,
    SessionEntry, SessionQuality, ShardEntry, ShardWriter, SourceVideo,
};
use relit_video::Video;

use super::interpolated_shifts::ShiftCourse;
use super::mask_warnings::mask_warnings;
use super::object::ObjectMask;
use super::pipeline::{self, LostFrame, ProcessedFrame, Stage};
use super::plan::{Assignment, Assignments, Plan};
use super::quality;
use super::select::{TURN_DEG, TURN_TOLERANCE_DEG};
use super::stability::Stability;
use super::{Aligner, ExtractError, ExtractOptions, Observer, Scaler, cut, square_around};

/// Images on the report's contact sheet.
const THUMBNAILS: u32 = 24;
/// Number of runs of damaged frames that are reported one by one.
const MAX_REPORTED: usize = 8;
/// Frames in which shifts are learnt, spread over the turn.
const ALIGN_FRAMES: usize = 36;
/// Fewest key frames that do for that.
const MIN_KEY_FRAMES: usize = 20;
/// Largest crop, pixels: each thread needs memory for a few images of this size.
const MAX_CROP_PIXELS: u64 = 1 << 26;

/// A recording that can be extracted.
#[derive(Debug)]
pub(super) struct Job {
    recording: Recording,
    video: Video,
    /// Length and time of the video's file when it was opened.
    video_file: (u64, SystemTime),
    input: SourceVideo,
    mask: ObjectMask,
    notices: Vec<Notice>,
}

impl Job {
    /// Opens recording, video and mask, and checks that they belong together.
    pub(super) fn open(path: &Path, options: &ExtractOptions) -> Result<Self, ExtractError> {
        let recording = Recording::open(path)?;
        let video_file = length_and_time(&recording.video)?;
        let video = Video::open(&recording.video)?;
        let size = (video.facts().width, video.facts().height);
        let stored = video.facts().stored_size;
        let mask = ObjectMask::open(&recording, options.mask.as_deref(), size, stored)?;
        let (bytes, blake3) = digest(&recording.video)?;
        let name = recording.video.file_name().unwrap_or_default();
        let input = SourceVideo {
            video: name.to_string_lossy().into_owned(),
            codec: video.facts().codec.clone(),
            frames: video.frames().len() as u64,
            bytes,
            blake3,
            colour_conversion: video.facts().colour_conversion.clone(),
            index_blake3: index_digest(&recording)?,
        };
        let mut notices = recording.notices.clone();
        notices.extend(differences(&recording, &input));
        notices.extend(contradictions(&recording, &video));
        notices.extend(video.damage().iter().cloned().map(Notice::Loss));
        notices.extend(video.notes().iter().cloned().map(Notice::Warning));
        notices.extend(mask.warnings().map(Notice::Warning));
        Ok(Self {
            recording,
            video,
            video_file,
            input,
            mask,
            notices,
        })
    }

    /// What a few frames of the video say against the mask, and how much that is.
    fn check_mask(&self) -> (Vec<Notice>, Option<MaskMisfit>) {
        match mask_warnings(&self.video, &self.mask.image, self.mask.frame) {
            Ok((reasons, misfit)) => (reasons.into_iter().map(Notice::Warning).collect(), misfit),
            Err(error) => {
                let text = format!("the mask could not be checked: {}", with_causes(&error));
                (vec![Notice::Warning(text)], None)
            }
        }
    }

    pub(super) fn id(&self) -> &str {
        &self.recording.id
    }

    /// The entry of this recording in the data set, if it was made from the same video, index and mask, and these
    /// options accept it.
    pub(super) fn existing_entry<'a>(
        &self,
        dataset: &'a Dataset,
        options: &ExtractOptions,
    ) -> Option<&'a SessionEntry> {
        let entry = dataset.session(self.id())?;
        let same = entry.input == self.input && entry.mask.blake3 == self.mask.blake3;
        let accepted = options.partial || entry.covered_deg.is_none();
        (same && accepted).then_some(entry)
    }

    /// Whether the data set holds a session of this name from another video.
    pub(super) fn would_replace_another(&self, dataset: &Dataset) -> bool {
        dataset
            .session(self.id())
            .is_some_and(|entry| entry.input.blake3 != self.input.blake3)
    }

    /// The session of the data set that has another name, and yet the same files where a file system ignores case.
    pub(super) fn alike<'a>(&self, dataset: &'a Dataset) -> Option<&'a str> {
        let entry = dataset.session_alike(self.id())?;
        (entry.id != self.id()).then_some(&entry.id)
    }

    /// Extracts the recording into `folder`.
    pub(super) fn run(
        self,
        folder: &OutputFolder,
        options: &ExtractOptions,
        pool: &ThreadPool,
        observer: &dyn Observer,
    ) -> Result<(SessionEntry, Vec<ShardEntry>), ExtractError> {
        let plan = Plan::new(&self.video, self.recording.frames.as_ref(), options.frames);
        let mut plan = plan.map_err(|error| {
            if self.is_aborted() {
                error.into_aborted_capture()
            } else {
                error
            }
        })?;
        self.check_turn(&plan, options.partial)?;
        let samples = u32::try_from(plan.selection.frames.len()).unwrap_or(options.frames);
        let mut notices = self.notices.clone();
        notices.extend(self.notices_of_plan(&plan, options.frames));
        let mut stage = self.stage(options)?;
        let mut stability = Stability::new(options.max_shift);
        let mut writer = ShardWriter::create(
            folder.path(),
            options.layout,
            self.id(),
            samples,
            stage.scaler.mask(),
        )?;
        let mut thumbnails = Vec::new();
        let mut assignments = plan.assignments();
        let mut lost = Vec::new();
        let mut warnings = None;
        let mut course = ShiftCourse::default();
        let mut waiting = Assignments::new();
        pool.in_place_scope(|scope| {
            // The look at the mask takes one thread for a while, and the others go on.
            scope.spawn(|_| warnings = Some(self.check_mask()));
            if options.align != Align::Off {
                stage.align = self.align(&stage, &plan, options, pool)?;
            }
            let mut all_known = false;
            while !assignments.is_empty() {
                let newly_lost = stage.run(&assignments, pool, |mut frame| {
                    let assigned = assignments.get(&frame.number);
                    let assigned = assigned.map(Vec::as_slice).unwrap_or_default();
                    if let Some(alignment) = &frame.alignment {
                        course.add(frame.number, alignment);
                        if alignment.shift.is_none() && !all_known {
                            // It waits until the frames around it are known.
                            waiting.entry(frame.number).or_default().extend(assigned);
                            return Ok(());
                        }
                        stability.add(frame.number, alignment, frame.interpolated);
                    }
                    for (at, &sample) in assigned.iter().enumerate() {
                        let record = self.record(&stage, &plan, &frame, sample, options);
                        if is_thumbnail(record.index, samples) {
                            thumbnails.push((record.index, small(&frame.image)));
                        }
                        let (image, png) = if at + 1 == assigned.len() {
                            (take(&mut frame.image), take(&mut frame.png))
                        } else {
                            (frame.image.clone(), frame.png.clone())
                        };
                        writer.push(Sample { record, image, png })?;
                        observer.advanced();
                    }
                    Ok(())
                })?;
                // Where those that took the place of others are lost, too, so is what depends on them.
                let doubtful: Vec<_> = newly_lost
                    .iter()
                    .filter(|_| !lost.is_empty())
                    .map(|frame| self.video.until_next_key(frame.number))
                    .collect();
                let numbers = newly_lost.iter().map(|frame| frame.number).collect();
                assignments = plan.replace(&numbers, &doubtful)?;
                lost.extend(newly_lost);
                if assignments.is_empty() && !all_known {
                    all_known = true;
                    assignments = take(&mut waiting);
                    if let Some(align) = &mut stage.align {
                        align.interpolated = course.fill(assignments.keys().copied());
                    }
                }
            }
            Ok::<(), ExtractError>(())
        })?;
        let (warnings, misfit) = warnings.unwrap_or_default();
        notices.extend(warnings);
        if options.align != Align::Off && stage.align.is_none() {
            notices.push(Notice::Warning(
                "the object has too little structure to measure its shifts: they are unknown"
                    .to_owned(),
            ));
        }
        stability.check()?;
        thumbnails.sort_by_key(|(index, _)| *index);
        notices.extend(notices_of_lost(&lost));
        if let Some(align) = &stage.align {
            notices.extend(stability.notices(align.aligner.min_confidence()));
        }
        let taken: Vec<_> = (0..samples).filter_map(|k| writer.sample(k)).collect();
        let findings = quality::findings(&taken, options.frames);
        for found in &findings {
            if let Some(record) = writer.record_mut(found.index) {
                record.exposure_step = found.exposure_step;
                record.identical_to = found.identical_to;
                record.blur = found.blur;
            }
        }
        let taken = (0..samples).filter_map(|k| writer.sample(k));
        let records: Vec<FrameRecord> = taken.map(|(record, _)| record.clone()).collect();
        notices.extend(quality::notices(&findings));
        let lossy = notices.iter().any(Notice::is_loss);
        let quality = SessionQuality::from_records(&records, lossy, part_of_turn(&plan));
        let quality = quality.with_mask(misfit);
        // Whatever can fail is done before the shard of an earlier run is replaced.
        let page = self.page(options, &records, &thumbnails, &notices, &quality)?;
        self.check_video_file()?;
        let files = writer.finish()?;
        let report = folder.write(&format!("{}.html", self.id()), page.as_bytes())?;
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
            selection: plan.selection.basis(),
            samples,
            covered_deg: part_of_turn(&plan),
            rig: self
                .recording
                .manifest
                .as_ref()
                .and_then(|manifest| manifest.rig),
            duplicates: count(|r| r.duplicate),
            spec_net: count(|r| r.spec_net),
            lossy,
            quality,
            warnings: texts(&notices),
            table: files.table,
            report: Some(report),
        };
        Ok((entry, files.shards))
    }

    /// That what was read is the video whose hash is recorded.
    fn check_video_file(&self) -> Result<(), ExtractError> {
        let video = &self.recording.video;
        if length_and_time(video)? == self.video_file {
            return Ok(());
        }
        Err(ExtractError::Refused(format!(
            "{} was changed while it was read: extract it again",
            video.display()
        )))
    }

    fn is_aborted(&self) -> bool {
        let manifest = self.recording.manifest.as_ref();
        manifest.is_some_and(|manifest| matches!(manifest.status, Status::Aborted(_)))
    }

    /// That the recording is a whole turn, or part of one where that is requested.
    fn check_turn(&self, plan: &Plan, partial: bool) -> Result<(), ExtractError> {
        if let Some(covered_deg) = part_of_turn(plan).filter(|_| !partial) {
            return Err(ExtractError::TooLittle(format!(
                "the frames cover {covered_deg:.1} of 360 degrees: give --partial to extract what they show, or record it again"
            )));
        }
        let Some(manifest) = self.recording.manifest.as_ref() else {
            return Ok(());
        };
        match &manifest.turntable {
            Some(table) if !plan.has_angles() && manifest.status != Status::Complete => {
                let covered_deg = plan.seconds() * table.degrees_per_second;
                if covered_deg < TURN_DEG - TURN_TOLERANCE_DEG {
                    Err(ExtractError::TooLittle(format!(
                        "the frames cover about {covered_deg:.0} of 360 degrees, at unknown angles: record it again, or give the video file itself to spread frames over time"
                    )))
                } else {
                    Ok(())
                }
            }
            _ => Ok(()),
        }
    }

    fn stage(&self, options: &ExtractOptions) -> Result<Stage<'_>, ExtractError> {
        let facts = self.video.facts();
        let crop = square_around(
            self.mask.bounding_box,
            options.margin,
            (facts.width, facts.height),
        );
        if u64::from(crop.w) * u64::from(crop.h) > MAX_CROP_PIXELS {
            return Err(ExtractError::Refused(format!(
                "a crop of {} x {} pixels is too large: give a smaller --margin",
                crop.w, crop.h
            )));
        }
        let crop_mask = cut(&self.mask.image, crop);
        let side = match options.size {
            ImageSize::Pixels(side) => Some(side),
            ImageSize::Native(_) => None,
        };
        Ok(Stage {
            video: &self.video,
            crop,
            object: self.mask.bounding_box,
            spans: MaskSpans::from_mask(&crop_mask),
            scaler: Scaler::new(crop_mask, side)?,
            saturation_level: options.saturation_level,
            align: None,
        })
    }

    /// Learns the object from frames of the whole turn; `None` if it has too little structure.
    fn align(
        &self,
        stage: &Stage<'_>,
        plan: &Plan,
        options: &ExtractOptions,
        pool: &ThreadPool,
    ) -> Result<Option<pipeline::Align>, ExtractError> {
        let chosen = &plan.selection.frames;
        let keys = self.video.key_frames();
        let of_mask = self.mask.frame.filter(|&frame| frame < self.input.frames);
        let (frames, reference) = frames_to_align(chosen, keys, of_mask);
        let mut samples = stage.align_samples(&frames, pool)?;
        if !frames.contains(&reference) {
            samples.extend(stage.sample_by_index(reference));
        }
        // If the mask's frame is lost, the nearest one takes its place.
        let nearest = samples
            .iter()
            .enumerate()
            .min_by_key(|(_, (number, _))| number.abs_diff(reference));
        let Some((nearest, _)) = nearest else {
            return Ok(None);
        };
        let samples: Vec<_> = samples.into_iter().map(|(_, sample)| sample).collect();
        let mask = cut(&self.mask.image, stage.crop);
        let aligner = pool.install(|| Aligner::learn(&samples, nearest, &mask, options.max_shift));
        Ok(aligner.map(|aligner| pipeline::Align {
            aligner,
            correction: (options.align == Align::Correct).then_some(pipeline::Correction {
                above: options.align_tolerance,
                most: options.max_shift,
            }),
            interpolated: HashMap::new(),
        }))
    }

    fn record(
        &self,
        stage: &Stage<'_>,
        plan: &Plan,
        frame: &ProcessedFrame,
        sample: Assignment,
        options: &ExtractOptions,
    ) -> FrameRecord {
        let candidate = plan.candidate(frame.number);
        let alignment = frame.alignment;
        let shift = alignment.and_then(|alignment| alignment.shift);
        FrameRecord {
            source_frame: frame.number,
            t_us: candidate.map_or(0, |candidate| candidate.t_us),
            angle_deg: candidate.and_then(|candidate| candidate.angle_deg),
            duplicate: sample.duplicate,
            size: frame.image.dimensions().into(),
            shift_px: shift.map(|shift| shift.map(thousandths)),
            shift_applied: frame.shift_applied,
            align_confidence: alignment.map(|alignment| thousandths(alignment.confidence)),
            shift_interpolated_sd_px: frame.interpolated.map(thousandths),
            ..FrameRecord::new(
                &self.recording.id,
                &self.recording.object,
                sample.index,
                stage.crop,
                &frame.measures,
                options.gate,
            )
        }
    }

    /// What the plan shows: repeated frames, an incomplete turn, gaps.
    fn notices_of_plan(&self, plan: &Plan, wanted: u32) -> Vec<Notice> {
        let mut notices = Vec::new();
        if self.recording.frames.is_none() {
            notices.extend(plan.gap_warnings().into_iter().map(Notice::Warning));
        }
        if let Some(left_out) = plan.without_angle() {
            notices.push(Notice::Warning(format!(
                "{} no angle although others have one, and {} left out",
                match left_out {
                    1 => "1 frame has".to_owned(),
                    n => format!("{n} frames have"),
                },
                if left_out == 1 { "is" } else { "are" },
            )));
        }
        if let Some(frame) = plan.reversal_frame() {
            notices.push(Notice::Warning(format!(
                "the table's angle goes back at frame {frame}: check {INDEX_FILE} there"
            )));
        }
        let repeated = plan.repeated();
        if repeated > 0 {
            notices.push(Notice::Warning(format!(
                "{repeated} of {} {}: the video has {}",
                count_of(plan.selection.frames.len() as u64, "sample"),
                match repeated {
                    1 => "repeats a source frame and is flagged as a duplicate",
                    _ => "repeat a source frame and are flagged as duplicates",
                },
                count_of(plan.usable() as u64, "usable frame"),
            )));
        }
        if let Some(covered) = part_of_turn(plan) {
            notices.push(Notice::Loss(format!(
                "the frames cover {covered:.1} of 360 degrees: {} of {wanted} samples are there",
                plan.selection.frames.len(),
            )));
        }
        notices
    }

    /// The session's page.
    fn page(
        &self,
        options: &ExtractOptions,
        records: &[FrameRecord],
        thumbnails: &[(u32, RgbImage)],
        notices: &[Notice],
        quality: &SessionQuality,
    ) -> Result<String, ExtractError> {
        let facts = self.video.facts();
        let pair = |name: &str, value: String| (name.to_owned(), value);
        let crop = records.first().map(|record| record.crop.to_string());
        Ok(report::render(&Page {
            records,
            thumbnails,
            settings: &options.settings().rows(),
            facts: &[
                pair("video", self.input.video.clone()),
                pair("codec", format!("{}, {}", facts.codec, facts.pixel_format)),
                pair(
                    "frame size",
                    format!("{} x {} pixels", facts.width, facts.height),
                ),
                pair("frames in the video", self.input.frames.to_string()),
                pair("mask, bounding box", self.mask.bounding_box.to_string()),
                pair("crop", crop.unwrap_or_default()),
                pair("video BLAKE3", self.input.blake3.to_string()),
                pair("mask BLAKE3", self.mask.blake3.to_string()),
            ],
            warnings: &texts(notices),
            quality: Some(quality),
            gate: options.gate,
            saturation_level: options.saturation_level,
        })?)
    }
}

/// Frames that are spread over the chosen ones (sorted), and that of the mask: the first one if it is not known.
/// They are key frames, which are decoded alone, if enough are among the chosen; the mask's may then be none of
/// them.
fn frames_to_align(chosen: &[u64], keys: &[u64], of_mask: Option<u64>) -> (Vec<u64>, u64) {
    let is_key = |number: &u64| keys.binary_search(number).is_ok();
    let alone: Vec<u64> = chosen.iter().copied().filter(is_key).collect();
    let few = alone.len() < MIN_KEY_FRAMES;
    let from = if few { chosen } else { &alone };
    let mut frames: Vec<u64> = (0..ALIGN_FRAMES)
        .filter_map(|k| from.get(k * from.len() / ALIGN_FRAMES))
        .copied()
        .collect();
    let reference = of_mask.or(frames.first().copied()).unwrap_or_default();
    if few || is_key(&reference) {
        frames.push(reference);
    }
    frames.sort_unstable();
    frames.dedup();
    (frames, reference)
}

/// A value of pixels or of a share as it is recorded: to three decimals.
fn thousandths(value: f64) -> f64 {
    (1000.0 * value).round() / 1000.0
}

/// The degrees of a part of a turn; `None` for a whole one.
fn part_of_turn(plan: &Plan) -> Option<f64> {
    let partial = plan.selection.is_partial();
    plan.selection.covered_deg().filter(|_| partial)
}

fn texts(notices: &[Notice]) -> Vec<String> {
    notices
        .iter()
        .map(|notice| notice.text().to_owned())
        .collect()
}

/// Whether a sample is on the contact sheet, whose samples are evenly spread.
fn is_thumbnail(index: u32, samples: u32) -> bool {
    let slot = |index: u32| u64::from(index) * u64::from(THUMBNAILS) / u64::from(samples);
    index == 0 || slot(index) != slot(index - 1)
}

fn small(image: &RgbImage) -> RgbImage {
    let (width, height) = image.dimensions();
    if width.max(height) <= THUMBNAIL_SIDE {
        return image.clone();
    }
    // Crops are square.
    thumbnail(image, THUMBNAIL_SIDE, THUMBNAIL_SIDE)
}

/// One loss for each run of consecutive frames that were lost for the same reason.
fn notices_of_lost(lost: &[LostFrame]) -> Vec<Notice> {
    let mut sorted: Vec<&LostFrame> = lost.iter().collect();
    sorted.sort_by_key(|frame| frame.number);
    let runs = sorted.chunk_by(|a, b| a.number + 1 == b.number && a.fault == b.fault);
    let notice = |run: &[&LostFrame]| {
        let (first, last) = (run.first()?, run.last()?);
        let frames = match (first.number, last.number) {
            (first, last) if first == last => format!("frame {first}"),
            (first, last) => format!("frames {first} to {last}"),
        };
        let fault = &first.fault;
        Some(Notice::Loss(format!(
            "{frames} cannot be decoded: {fault}; neighbouring frames are used instead"
        )))
    };
    let mut notices: Vec<Notice> = runs.filter_map(notice).collect();
    if notices.len() > MAX_REPORTED {
        let more = notices.len() - MAX_REPORTED;
        notices.truncate(MAX_REPORTED);
        notices.push(Notice::Loss(format!(
            "frames cannot be decoded at {} more",
            count_of(more as u64, "position")
        )));
    }
    notices
}

/// BLAKE3 of the frame index, if it was used.
fn index_digest(recording: &Recording) -> Result<Option<Digest>, ExtractError> {
    match (&recording.frames, &recording.folder) {
        (Some(_), Some(folder)) => Ok(Some(digest(&folder.join(INDEX_FILE))?.1)),
        _ => Ok(None),
    }
}

fn length_and_time(path: &Path) -> Result<(u64, SystemTime), ExtractError> {
    let metadata = std::fs::metadata(path).map_err(ExtractError::io("read", path))?;
    let time = metadata.modified();
    Ok((metadata.len(), time.unwrap_or(SystemTime::UNIX_EPOCH)))
}

fn digest(path: &Path) -> Result<(u64, Digest), ExtractError> {
    Digest::hash_file(path).map_err(ExtractError::io("read", path))
}

/// Differences between the video and what manifest and index say about it.
fn differences(recording: &Recording, input: &SourceVideo) -> Vec<Notice> {
    let file = &input.video;
    let found = input.frames;
    let mut notices = Vec::new();
    let lines = recording
        .frames
        .as_ref()
        .map(|index| index.entries().len() as u64);
    if let Some(lines) = lines
        && lines != found
    {
        notices.push(Notice::Loss(format!(
            "{file} has {} and {INDEX_FILE} has {lines}: they were matched by their time stamps",
            count_of(found, "frame")
        )));
    }
    let Some(manifest) = &recording.manifest else {
        return notices;
    };
    if let Some(recorded) = manifest.video.frames
        && recorded != found
        && Some(recorded) != lines
    {
        notices.push(Notice::Loss(format!(
            "{file} has {}, but the manifest says {recorded}",
            count_of(found, "frame")
        )));
    }
    // Another file size was reported when the recording was opened.
    let same_size = manifest
        .video
        .bytes
        .is_none_or(|bytes| bytes == input.bytes);
    if let Some(recorded) = &manifest.video.blake3
        && !recorded.eq_ignore_ascii_case(&input.blake3.to_string())
        && same_size
    {
        notices.push(Notice::Loss(format!(
            "{file} is not the file that was recorded: its BLAKE3 differs from the manifest's"
        )));
    }
    notices
}

/// Differences between the video's format and what the manifest says about it.
fn contradictions(recording: &Recording, video: &Video) -> Vec<Notice> {
    let Some(manifest) = &recording.manifest else {
        return Vec::new();
    };
    let facts = video.facts();
    let mut notices = Vec::new();
    let recorded = &manifest.video.codec;
    if !recorded.eq_ignore_ascii_case(&facts.codec) {
        let found = &facts.codec;
        notices.push(Notice::Warning(format!(
            "the video is {found}, but the manifest says {recorded}"
        )));
    }
    let recorded = (manifest.camera.width, manifest.camera.height);
    if recorded != (facts.width, facts.height) && recorded != (facts.height, facts.width) {
        notices.push(Notice::Warning(format!(
            "the frames are {} x {} pixels, but the manifest says {} x {}",
            facts.width, facts.height, recorded.0, recorded.1
        )));
    }
    notices
}
