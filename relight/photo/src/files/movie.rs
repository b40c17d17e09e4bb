//! Frames into a video file, by the program `ffmpeg`. Knows nothing of what the frames show.

use std::ffi::OsString;
use std::fmt;
use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Stdio};
use std::thread::{self, JoinHandle};

use relight_core::image::{Extent, ImageError, Rgb, Srgb};
use relight_core::parallel;
use relit_data::durable::Partial;

/// The colours of what is written, as a filter.
const COLOURS: &str = "setparams=colorspace=bt709:color_primaries=bt709:color_trc=iec61966-2-1";
/// The number of frames that each thread computes before they are encoded.
const FRAMES_A_THREAD: u32 = 2;

/// What a video file is encoded as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MovieFormat {
    /// H.264 in MP4.
    Mp4,
    /// VP9 in WebM.
    Webm,
}

/// That the program is not there.
pub(super) fn no_program(reason: io::Error) -> ImageError {
    ImageError::Other(format!(
        "ffmpeg, which videos need, cannot be started: install it: {reason}"
    ))
}

impl MovieFormat {
    fn arguments(self) -> impl Iterator<Item = &'static str> {
        let line = match self {
            Self::Mp4 => "-c:v libx264 -crf 18 -movflags +faststart -f mp4",
            Self::Webm => "-c:v libvpx-vp9 -crf 24 -b:v 0 -f webm",
        };
        line.split(' ')
    }
}

/// Frames a second, as a ratio: 29.97 is 30000/1001.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameRate {
    numerator: u32,
    denominator: u32,
}

impl FrameRate {
    /// The fastest that a video may have, frames a second.
    const MAX: u32 = 240;

    /// `None` unless it is above 0, and within what videos have.
    pub const fn new(numerator: u32, denominator: u32) -> Option<Self> {
        let is_rate = numerator > 0 && denominator > 0 && numerator / denominator <= Self::MAX;
        if is_rate {
            Some(Self {
                numerator,
                denominator,
            })
        } else {
            None
        }
    }

    /// Frames a second.
    pub fn per_second(self) -> f64 {
        f64::from(self.numerator) / f64::from(self.denominator)
    }
}

/// So many frames a second, at least one.
impl From<u32> for FrameRate {
    fn from(frames: u32) -> Self {
        Self {
            numerator: frames.max(1),
            denominator: 1,
        }
    }
}

impl fmt::Display for FrameRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.numerator, self.denominator)
    }
}

/// A video that is being written. It appears under its name when it is finished, whole; dropped before, it
/// leaves nothing.
#[derive(Debug)]
pub struct MovieWriter {
    path: PathBuf,
    extent: Extent,
    /// Dropped before its file is removed.
    program: Ffmpeg,
    partial: Partial,
}

/// `ffmpeg` under way; it ends when this is dropped.
#[derive(Debug)]
pub(super) struct Ffmpeg {
    pub(super) child: Child,
    /// Reads what it complains of, so that it is not blocked by that.
    errors: Option<JoinHandle<Option<String>>>,
}

impl Ffmpeg {
    pub(super) fn start(command: &mut Command) -> Result<Self, ImageError> {
        let mut child = command.stderr(Stdio::piped()).spawn().map_err(no_program)?;
        let pipe = child.stderr.take();
        let errors = pipe.map(|pipe| thread::spawn(|| last_line(pipe)));
        Ok(Self { child, errors })
    }

    /// Whether it ends well.
    pub(super) fn is_done(&mut self) -> bool {
        self.child.wait().is_ok_and(|status| status.success())
    }

    /// Waits for its end, and its last complaint.
    pub(super) fn said(&mut self) -> Option<String> {
        self.errors.take()?.join().ok()?
    }
}

impl Drop for Ffmpeg {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl MovieWriter {
    /// Whether `ffmpeg` can be started.
    ///
    /// # Errors
    /// If it cannot.
    pub fn check() -> Result<(), ImageError> {
        Command::new("ffmpeg")
            .arg("-version")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
            .map(drop)
            .map_err(no_program)
    }

    /// Starts `ffmpeg` for frames of one size. The last line of an odd width or height is shown twice, since
    /// both formats halve the resolution of colours. A missing folder is made.
    ///
    /// # Errors
    /// If the program cannot be started, or the folder not be made.
    pub fn create(
        path: &Path,
        format: MovieFormat,
        extent: Extent,
        frame_rate: impl Into<FrameRate>,
    ) -> Result<Self, ImageError> {
        fs::create_dir_all(path.parent().unwrap_or(Path::new("")))
            .map_err(ImageError::write(path))?;
        let partial = Partial::create(path).map_err(ImageError::write(path))?;
        let shown = even(extent);
        let mut command = Command::new("ffmpeg");
        command
            .args(["-hide_banner", "-loglevel", "error", "-nostdin", "-y"])
            .args(["-f", "rawvideo", "-pixel_format", "rgb24", "-video_size"])
            .arg(format!("{}x{}", shown.width, shown.height))
            .args(["-framerate", &frame_rate.into().to_string(), "-i", "pipe:0"])
            // Older versions of the program take what options state of the colours, newer ones what the frames do.
            .args(["-vf", &format!("scale=out_color_matrix=bt709,{COLOURS}")])
            .args(["-pix_fmt", "yuv420p", "-colorspace", "bt709"])
            .args(["-color_primaries", "bt709", "-color_trc", "iec61966-2-1"])
            .args(format.arguments())
            .arg(file_url(partial.path()))
            .stdin(Stdio::piped())
            .stdout(Stdio::null());
        Ok(Self {
            path: path.to_owned(),
            extent,
            program: Ffmpeg::start(&mut command)?,
            partial,
        })
    }

    /// Writes a video of `count` frames. Some are computed in parallel; they are encoded in order, and `written` is
    /// called after each.
    ///
    /// # Errors
    /// If a frame cannot be computed, the video cannot be written, or `count` is 0.
    pub fn write_frames<E: From<ImageError> + Send>(
        path: &Path,
        (format, frames_per_second): (MovieFormat, u32),
        count: u32,
        frame: impl Fn(u32) -> Result<Rgb<Srgb>, E> + Sync,
        mut written: impl FnMut(),
    ) -> Result<(), E> {
        let together = parallel::threads() as u32 * FRAMES_A_THREAD;
        let mut movie: Option<Self> = None;
        for first in (0..count).step_by(together as usize) {
            let some = together.min(count - first) as usize;
            for image in parallel::map(some, |at| frame(first + at as u32)) {
                let image = image?;
                let extent = image.planes().extent();
                let movie = match &mut movie {
                    Some(movie) => movie,
                    none => none.insert(Self::create(path, format, extent, frames_per_second)?),
                };
                movie.push(&image)?;
                written();
            }
        }
        movie.map_or(Ok(()), |movie| Ok(movie.finish()?))
    }

    /// Adds a frame; values beyond 0 to 1 are clipped.
    ///
    /// # Errors
    /// If it has another size, or the program has ended.
    pub fn push(&mut self, frame: &Rgb<Srgb>) -> Result<(), ImageError> {
        let found = frame.planes().extent();
        if found != self.extent {
            let Extent { width, height } = self.extent;
            return Err(self.failed(Some(format!(
                "a frame of {} x {} pixels was given for a video of {width} x {height}",
                found.width, found.height
            ))));
        }
        let bytes = filled_up(frame.planes().to_bytes(), found);
        let written = match &mut self.program.child.stdin {
            Some(pipe) => pipe.write_all(&bytes),
            None => Ok(()),
        };
        // What is wrong is said by the program, not by the broken pipe.
        written.map_err(|_| self.failure())
    }

    /// Waits for the program and gives the file its name.
    ///
    /// # Errors
    /// If the program failed, or the file cannot be given its name.
    pub fn finish(mut self) -> Result<(), ImageError> {
        drop(self.program.child.stdin.take());
        let is_done = self.program.is_done();
        let said = self.program.said();
        // On a full disk ffmpeg says so, ends without an error, and leaves a file that no player opens.
        if !is_done || said.is_some() {
            return Err(self.failed(said));
        }
        let published = self.partial.seal().and_then(|sealed| sealed.publish());
        published.map_err(ImageError::write(&self.path))
    }

    fn failure(&mut self) -> ImageError {
        drop(self.program.child.stdin.take());
        let said = self.program.said();
        self.failed(said)
    }

    fn failed(&self, said: Option<String>) -> ImageError {
        let said = said.unwrap_or_else(|| SILENT.to_owned());
        let fault = format!("could not be written by ffmpeg: {said}");
        ImageError::file(&self.path, fault)
    }
}

/// A size whose sides are even.
const fn even(extent: Extent) -> Extent {
    Extent::new(
        extent.width.next_multiple_of(2),
        extent.height.next_multiple_of(2),
    )
}

/// Pixels of three bytes with the last column and the last row twice where there is an odd number of them.
fn filled_up(bytes: Vec<u8>, extent: Extent) -> Vec<u8> {
    let whole = even(extent);
    if whole == extent {
        return bytes;
    }
    let mut filled = Vec::with_capacity(3 * whole.pixels());
    for row in 0..whole.height {
        let line = row.min(extent.height.saturating_sub(1)) * 3 * extent.width;
        let line = bytes.get(line..line + 3 * extent.width).unwrap_or_default();
        filled.extend_from_slice(line);
        if whole.width > extent.width {
            filled.extend_from_slice(line.last_chunk::<3>().unwrap_or(&[0; 3]));
        }
    }
    filled
}

/// A file as FFmpeg's programs take it, whatever its name: one with a colon may look like a protocol, one that begins with
/// `-` like an option.
pub(super) fn file_url(path: &Path) -> OsString {
    let mut url = OsString::from("file:");
    url.push(path);
    url
}

/// The reason for a program that printed none.
pub(super) const SILENT: &str = "it ended without a message";

/// Reads all that a program writes, and keeps its last line.
fn last_line(mut pipe: ChildStderr) -> Option<String> {
    let mut bytes = Vec::new();
    // What was read before an error is all there is to say.
    let _ = pipe.read_to_end(&mut bytes);
    let text = String::from_utf8_lossy(&bytes);
    let last = text.lines().rfind(|line| !line.trim().is_empty());
    Some(last?.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::{FrameTiming, MovieReader};
    use relight_core::image::Planes;

    fn has_ffmpeg() -> bool {
        let found = MovieWriter::check();
        if found.is_err() {
            relit_test_support::say_skipped("the program ffmpeg is not installed");
        }
        found.is_ok()
    }

    fn grey(side: usize) -> Rgb<Srgb> {
        Rgb::new(Planes::filled(Extent::new(side, side), [0.5; 3]))
    }

    fn names_in(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect()
    }

    #[test]
    fn frames_of_odd_size_become_a_video_of_as_many_frames() {
        if !has_ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("turn.mp4");
        let mut movie =
            MovieWriter::create(&path, MovieFormat::Mp4, Extent::new(33, 33), 30).unwrap();
        for _ in 0..7 {
            movie.push(&grey(33)).unwrap();
        }
        movie.finish().unwrap();
        assert_eq!(names_in(folder.path()), ["turn.mp4"]);
        let probed = Command::new("ffprobe")
            .args([
                "-v",
                "error",
                "-count_frames",
                "-of",
                "csv=p=0",
                "-show_entries",
            ])
            .arg("stream=width,height,nb_read_frames")
            .arg(&path)
            .output()
            .unwrap();
        assert_eq!(String::from_utf8_lossy(&probed.stdout).trim(), "34,34,7");
        // What the even size has more shows the edge, and no black line.
        let mut clip = MovieReader::open(&path, FrameTiming::Each).unwrap();
        let frame = clip.frame().unwrap().unwrap();
        for (x, y) in [(33, 5), (5, 33), (33, 33)] {
            assert!(
                (frame.planes().pixel(x, y)[1] - 0.5).abs() < 0.03,
                "{x} {y}"
            );
        }
    }

    #[test]
    fn a_video_is_written_and_read_whatever_its_name() {
        assert_eq!(file_url(Path::new("-x.mp4")), "file:-x.mp4");
        if !has_ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        for name in ["a:b.mp4", "cup%d.mp4", "-x.mp4", "[x]?*.mp4", "pipe:0.mp4"] {
            let path = folder.path().join(name);
            let extent = Extent::new(32, 32);
            let mut movie = MovieWriter::create(&path, MovieFormat::Mp4, extent, 30).unwrap();
            movie.push(&grey(32)).unwrap();
            movie.finish().unwrap();
            let mut clip = MovieReader::open(&path, FrameTiming::Each).unwrap();
            assert!(clip.frame().unwrap().is_some(), "{name}");
        }
    }

    #[test]
    fn the_last_column_and_row_of_an_odd_size_come_twice() {
        let bytes: Vec<u8> = (0..27).collect();
        let filled = filled_up(bytes.clone(), Extent::new(3, 3));
        assert_eq!(filled.len(), 48);
        assert_eq!(filled[6..12], [6, 7, 8, 6, 7, 8]);
        assert_eq!(filled[24..36], filled[36..48]);
        assert_eq!(filled_up(bytes.clone(), Extent::new(1, 9)).len(), 60);
        assert_eq!(
            filled_up(bytes[..24].to_vec(), Extent::new(4, 2)),
            bytes[..24]
        );
    }

    #[test]
    fn a_video_that_cannot_be_written_is_told_with_the_program_s_words_and_leaves_nothing() {
        if !has_ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        // H.264 has no frame as wide as that.
        let path = folder.path().join("turn.mp4");
        let extent = Extent::new(20_000, 2);
        let mut movie = MovieWriter::create(&path, MovieFormat::Mp4, extent, 30).unwrap();
        let wide = Rgb::new(Planes::filled(extent, [0.5; 3]));
        // The pipe may take some frames before it breaks.
        let pushed = (0..50).try_for_each(|_| movie.push(&wide));
        let error = pushed.and_then(|()| movie.finish()).unwrap_err();
        assert!(error.to_string().contains("turn.mp4"), "{error}");
        assert!(names_in(folder.path()).is_empty());
    }

    #[test]
    fn a_folder_for_a_video_is_made_and_a_file_in_its_place_is_told() {
        if !has_ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let create =
            |path: &Path| MovieWriter::create(path, MovieFormat::Mp4, Extent::new(32, 32), 30);
        let path = folder.path().join("new").join("turn.mp4");
        let mut movie = create(&path).unwrap();
        movie.push(&grey(32)).unwrap();
        movie.finish().unwrap();
        assert!(path.is_file());
        let below = create(&path.join("turn.mp4")).map(|_| ());
        assert!(below.is_err());
    }

    #[test]
    fn a_frame_of_another_size_is_refused_and_an_unfinished_video_leaves_nothing() {
        if !has_ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("turn.webm");
        let mut movie =
            MovieWriter::create(&path, MovieFormat::Webm, Extent::new(32, 32), 30).unwrap();
        movie.push(&grey(32)).unwrap();
        let fault = movie.push(&grey(16)).unwrap_err().to_string();
        assert!(fault.contains("16 x 16"), "{fault}");
        drop(movie);
        assert!(names_in(folder.path()).is_empty());
    }

    #[test]
    fn what_is_written_is_read_frame_by_frame() {
        if !has_ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("clip.mp4");
        let mut movie =
            MovieWriter::create(&path, MovieFormat::Mp4, Extent::new(32, 16), 12).unwrap();
        for level in [0.2, 0.6] {
            let frame = Rgb::new(Planes::filled(Extent::new(32, 16), [level; 3]));
            movie.push(&frame).unwrap();
        }
        movie.finish().unwrap();
        let mut clip = MovieReader::open(&path, FrameTiming::Each).unwrap();
        assert_eq!(
            (clip.extent(), clip.frame_rate()),
            (Extent::new(32, 16), FrameRate::from(12))
        );
        for level in [0.2, 0.6] {
            let frame = clip.frame().unwrap().unwrap();
            assert!((frame.planes().pixel(9, 9)[1] - level).abs() < 0.02);
        }
        assert!(clip.frame().unwrap().is_none());
    }

    #[test]
    fn what_is_no_video_is_refused() {
        if !has_ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("clip.mp4");
        fs::write(&path, "no video").unwrap();
        let error = MovieReader::open(&path, FrameTiming::Each)
            .unwrap_err()
            .to_string();
        assert!(error.contains("clip.mp4"), "{error}");
    }

    /// A video of one colour, made by `ffmpeg`.
    fn clip(folder: &Path, arguments: &str) -> PathBuf {
        let path = folder.join("clip.mp4");
        let made = Command::new("ffmpeg")
            .args(["-nostdin", "-loglevel", "error", "-y"])
            .args(arguments.split(' '))
            .arg(&path)
            .status();
        assert!(made.unwrap().success(), "{arguments}");
        path
    }

    fn extents(path: &Path) -> (Extent, u32) {
        let mut movie = MovieReader::open(path, FrameTiming::Even).unwrap();
        let mut frames = 0;
        while let Some(frame) = movie.frame().unwrap() {
            assert_eq!(frame.planes().extent(), movie.extent());
            frames += 1;
        }
        (movie.extent(), frames)
    }

    #[test]
    fn a_video_is_read_upright_with_square_pixels_and_at_its_own_rate() {
        if !has_ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let source = "-f lavfi -i testsrc2=size=64x32:rate=15/2:duration=1.2";
        let path = clip(
            folder.path(),
            &format!("{source} -c:v libx264 -vf setsar=3/2"),
        );
        assert_eq!(extents(&path), (Extent::new(96, 32), 9));
        let movie = MovieReader::open(&path, FrameTiming::Even).unwrap();
        let rate = movie.frame_rate();
        assert_eq!(rate.to_string(), "15/2");
        let turned = folder.path().join("turned.mp4");
        let copied = Command::new("ffmpeg")
            .args(["-nostdin", "-loglevel", "error", "-y", "-i"])
            .arg(&path)
            .args([
                "-c",
                "copy",
                "-bsf:v",
                "h264_metadata=display_orientation=insert:rotate=90",
            ])
            .arg(&turned)
            .status();
        assert!(copied.unwrap().success());
        assert_eq!(extents(&turned), (Extent::new(32, 96), 9));
        // What is written has the rate as well.
        let written = folder.path().join("written.mp4");
        let extent = Extent::new(32, 32);
        let mut movie = MovieWriter::create(&written, MovieFormat::Mp4, extent, rate).unwrap();
        for _ in 0..5 {
            movie.push(&grey(32)).unwrap();
        }
        movie.finish().unwrap();
        let movie = MovieReader::open(&written, FrameTiming::Each).unwrap();
        assert_eq!(movie.frame_rate(), rate);
    }

    #[test]
    fn hdr_is_read_with_its_reference_white_as_white() {
        if !has_ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        // 58 % of PQ, as limited luma of 8 bits; a lossless video keeps it.
        let encoded = |transfer: &str| {
            let stated = format!("colorspace=bt2020nc:color_primaries=bt2020:color_trc={transfer}");
            let options = stated.replace(':', " -").replace('=', " ");
            let source = "-f lavfi -i color=black:size=32x32:rate=5:duration=1";
            let level = "geq=lum=143:cb=128:cr=128,format=yuv420p";
            format!("{source} -vf {level},setparams={stated} -c:v libx264 -qp 0 -{options}")
        };
        let path = clip(folder.path(), &encoded("smpte2084"));
        let mut movie = MovieReader::open(&path, FrameTiming::Each).unwrap();
        assert!(
            movie
                .colour_conversion()
                .is_some_and(|by| by.contains("PQ"))
        );
        let frame = movie.frame().unwrap().unwrap();
        let value = frame.planes().pixel(9, 9)[1];
        assert!((value - 1.0).abs() < 0.03, "{value}");
        let path = clip(folder.path(), &encoded("log100"));
        let refused = MovieReader::open(&path, FrameTiming::Each);
        let refused = refused.unwrap_err().to_string();
        assert!(refused.starts_with(path.to_str().unwrap()), "{refused}");
    }
}
