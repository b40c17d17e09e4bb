//! Frames out of a video file, as players show them, by the programs `ffmpeg` and `ffprobe`: upright, with square pixels, in
//! sRGB.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use relight_core::image::{Extent, ImageError, Planes, Rgb, Srgb};
use relit_data::colour::{ColourFault, ToSrgb, YuvDecoding};
use serde::Deserialize;

use super::movie::{Ffmpeg, FrameRate, SILENT, file_url, no_program};

/// The most pixels of a video's frame.
const MAX_PIXELS: usize = 1 << 26;
/// The first stream of pictures that is not a cover.
const STREAM: &str = "V:0";
/// Pixels that are not square are stretched to squares; FFmpeg has turned the frame already.
const SQUARE_PIXELS: &str = "scale='max(1,round(iw*max(1,sar)))':'max(1,round(ih/min(1,sar)))'";
/// Videos with more rows have the matrix of BT.709 by default, as in players.
const MAX_SD_ROWS: usize = 576;

/// Which frames of a video are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameTiming {
    /// Each once, whenever it is shown.
    Each,
    /// Frames at even intervals, by the video's frame rate.
    Even,
}

/// A video that is read, frame by frame.
#[derive(Debug)]
pub struct MovieReader {
    path: PathBuf,
    extent: Extent,
    frame_rate: FrameRate,
    /// The conversion of colours that are not sRGB; frames then come as YUV with 16 bits.
    wide: Option<WideColour>,
    program: Ffmpeg,
}

impl MovieReader {
    /// Starts `ffmpeg` for a file.
    ///
    /// # Errors
    /// If a program cannot be started, the file is not a video, or its colours cannot be converted.
    pub fn open(path: &Path, timing: FrameTiming) -> Result<Self, ImageError> {
        let facts = Facts::probe(path)?;
        let frame_rate = facts
            .frame_rate()
            .ok_or_else(|| no_video(path, "it has no known frame rate"))?;
        let extent = displayed_extent(path)?;
        let wide = facts.wide_colour(extent.height);
        let wide = wide.map_err(|fault| {
            ImageError::file(
                path,
                format!(
                    "cannot be read: {fault} cannot be converted to sRGB: convert the video to SDR with BT.709 colours first"
                ),
            )
        })?;
        // All frames get the size of the first.
        let mut scale = format!("scale={}:{}", extent.width, extent.height);
        if wide.is_some() {
            // RGB becomes YUV of BT.709; YUV keeps its matrix.
            scale.push_str(":out_range=tv:out_color_matrix=");
            scale.push_str(if facts.is_rgb() { "bt709" } else { "auto" });
        } else if facts.matrix().is_none() && extent.height > MAX_SD_ROWS {
            scale.push_str(":in_color_matrix=bt709");
        }
        let mut command = ffmpeg(path);
        command
            .args(["-f", "rawvideo", "-pix_fmt"])
            .arg(if wide.is_some() {
                "yuv444p16le"
            } else {
                "rgb24"
            })
            .args(match timing {
                FrameTiming::Each => ["-fps_mode".to_owned(), "passthrough".to_owned()],
                FrameTiming::Even => ["-r".to_owned(), frame_rate.to_string()],
            })
            .args(["-vf", &scale, "pipe:1"])
            .stdout(Stdio::piped());
        Ok(Self {
            path: path.to_owned(),
            extent,
            frame_rate,
            wide,
            program: Ffmpeg::start(&mut command)?,
        })
    }

    /// Width and height of its frames.
    pub const fn extent(&self) -> Extent {
        self.extent
    }

    /// Frames a second.
    pub const fn frame_rate(&self) -> FrameRate {
        self.frame_rate
    }

    /// The conversion of its colours to sRGB, in words; `None` if they are read as sRGB.
    pub fn colour_conversion(&self) -> Option<String> {
        self.wide.as_ref().map(|wide| wide.to_srgb.to_string())
    }

    /// The next frame; none after the last.
    ///
    /// # Errors
    /// If the program fails, or the file ends in the middle of a frame.
    pub fn frame(&mut self) -> Result<Option<Rgb<Srgb>>, ImageError> {
        let Some(pipe) = &mut self.program.child.stdout else {
            return Ok(None);
        };
        let sample = if self.wide.is_some() { 2 } else { 1 };
        let size = 3 * sample * self.extent.pixels();
        let mut bytes = Vec::with_capacity(size);
        let read = pipe.take(size as u64).read_to_end(&mut bytes);
        if read.is_err() || (!bytes.is_empty() && bytes.len() < size) {
            return Err(self.failure());
        }
        if bytes.is_empty() {
            return if self.program.is_done() {
                Ok(None)
            } else {
                Err(self.failure())
            };
        }
        if let Some(wide) = &self.wide {
            bytes = wide.levels(&bytes);
        }
        let mut planes = Planes::zeros(self.extent);
        for (channel, plane) in planes.planes_mut().into_iter().enumerate() {
            for (value, pixel) in plane.iter_mut().zip(bytes.chunks_exact(3)) {
                *value = f32::from(pixel[channel]) / 255.0;
            }
        }
        Ok(Some(Rgb::new(planes)))
    }

    fn failure(&mut self) -> ImageError {
        drop(self.program.child.stdout.take());
        // What is not read any more cannot end by itself.
        let _ = self.program.child.kill();
        let said = self.program.said();
        no_video(&self.path, said.as_deref().unwrap_or(SILENT))
    }
}

/// How frames of YUV become sRGB.
#[derive(Debug, PartialEq)]
struct WideColour {
    decoding: YuvDecoding,
    to_srgb: ToSrgb,
}

impl WideColour {
    /// sRGB of three planes of limited range with 16 bits, little end first.
    fn levels(&self, bytes: &[u8]) -> Vec<u8> {
        let samples = bytes.as_chunks::<2>().0;
        let (luma, differences) = samples.split_at(samples.len() / 3);
        let (blue, red) = differences.split_at(luma.len());
        let value = |sample: &[u8; 2]| f32::from(u16::from_le_bytes(*sample));
        let pixels = luma.iter().zip(blue).zip(red);
        let levels = pixels.flat_map(|((luma, blue), red)| {
            let coded = self.decoding.rgb([luma, blue, red].map(value));
            self.to_srgb.levels(coded)
        });
        levels.collect()
    }
}

/// `ffmpeg` with a file's video as its input.
fn ffmpeg(path: &Path) -> Command {
    let mut command = Command::new("ffmpeg");
    command
        .args(["-hide_banner", "-loglevel", "error", "-nostdin", "-i"])
        .arg(file_url(path))
        .args(["-map", &format!("0:{STREAM}")])
        .stdin(Stdio::null());
    command
}

/// Width and height of a video as displayed, by the header of its first frame as a PPM.
fn displayed_extent(path: &Path) -> Result<Extent, ImageError> {
    let output = ffmpeg(path)
        .args(["-frames:v", "1", "-vf", SQUARE_PIXELS])
        .args(["-f", "image2pipe", "-c:v", "ppm", "pipe:1"])
        .output();
    let output = output.map_err(no_program)?;
    let start = &output.stdout[..output.stdout.len().min(64)];
    let header = String::from_utf8_lossy(start);
    let mut numbers = header
        .split_ascii_whitespace()
        .skip(1)
        .map(|part| part.parse::<usize>().ok());
    let mut next = || numbers.next().flatten().filter(|&number| number > 0);
    match (next(), next()) {
        (Some(width), Some(height)) if width.saturating_mul(height) <= MAX_PIXELS => {
            Ok(Extent::new(width, height))
        }
        _ => Err(unread(path, &output)),
    }
}

fn no_video(path: &Path, said: &str) -> ImageError {
    ImageError::file(path, format!("is not a readable video: {said}"))
}

/// The same, by what a program wrote.
fn unread(path: &Path, output: &Output) -> ImageError {
    let errors = String::from_utf8_lossy(&output.stderr);
    let last = errors.lines().last();
    no_video(
        path,
        last.unwrap_or("it has no frames of a known size").trim(),
    )
}

/// The output of `ffprobe` for a video and its first frame.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Facts {
    streams: Vec<Stated>,
    frames: Vec<Stated>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Stated {
    r_frame_rate: Option<String>,
    avg_frame_rate: Option<String>,
    color_space: Option<String>,
    color_transfer: Option<String>,
    color_primaries: Option<String>,
}

impl Facts {
    fn probe(path: &Path) -> Result<Self, ImageError> {
        const COLOURS: &str = "color_space,color_transfer,color_primaries";
        let entries = format!("stream=r_frame_rate,avg_frame_rate,{COLOURS}:frame={COLOURS}");
        let output = Command::new("ffprobe")
            .args(["-v", "error", "-select_streams", STREAM, "-of", "json"])
            .args(["-read_intervals", "%+#1", "-show_entries", &entries])
            .arg(file_url(path))
            .stdin(Stdio::null())
            .output()
            .map_err(no_program)?;
        let facts: Option<Self> = serde_json::from_slice(&output.stdout).ok();
        facts
            .filter(|facts| !facts.streams.is_empty())
            .ok_or_else(|| unread(path, &output))
    }

    /// What the first frame states, else the stream.
    fn stated(&self, of: impl Fn(&Stated) -> Option<&String>) -> Option<&str> {
        let all = self.frames.first().into_iter().chain(&self.streams);
        let known = all
            .filter_map(of)
            .find(|name| !matches!(name.as_str(), "unknown" | "reserved"));
        known.map(String::as_str)
    }

    /// The rate at which frames are shown: the mean where the other is that of fields, or no rate at all.
    fn frame_rate(&self) -> Option<FrameRate> {
        let stream = self.streams.first()?;
        let parsed = |text: &Option<String>| {
            let (numerator, denominator) = text.as_ref()?.split_once('/')?;
            FrameRate::new(numerator.parse().ok()?, denominator.parse().ok()?)
        };
        match (parsed(&stream.r_frame_rate), parsed(&stream.avg_frame_rate)) {
            (Some(rate), Some(mean)) if rate.per_second() > 1.5 * mean.per_second() => Some(mean),
            (rate, mean) => rate.or(mean),
        }
    }

    fn matrix(&self) -> Option<&str> {
        self.stated(|stated| stated.color_space.as_ref())
    }

    fn is_rgb(&self) -> bool {
        self.matrix() == Some("gbr")
    }

    /// The conversion of colours that are not sRGB. `rows`: the height of the frames, by which players take the matrix
    /// that is not stated.
    fn wide_colour(&self, rows: usize) -> Result<Option<WideColour>, ColourFault> {
        let matrix = match self.matrix() {
            None if rows <= MAX_SD_ROWS => 6,
            None | Some("gbr" | "bt709") => 1,
            Some("fcc") => 4,
            Some("bt470bg" | "smpte170m") => 6,
            Some("smpte240m") => 7,
            Some("bt2020nc") => 9,
            Some(other) => return Err(ColourFault::Matrix(other.to_owned())),
        };
        let transfer = self.stated(|stated| stated.color_transfer.as_ref());
        let primaries = self.stated(|stated| stated.color_primaries.as_ref());
        let Some(to_srgb) = ToSrgb::named(transfer, primaries)? else {
            return Ok(None);
        };
        let decoding = YuvDecoding::new(matrix, false)?;
        Ok(Some(WideColour { decoding, to_srgb }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facts(rates: [&str; 2], colours: [&str; 3]) -> Facts {
        let text = format!(
            r#"{{"streams": [{{"r_frame_rate": "{}", "avg_frame_rate": "{}", "color_space": "{}",
                "color_transfer": "{}", "color_primaries": "{}"}}]}}"#,
            rates[0], rates[1], colours[0], colours[1], colours[2]
        );
        serde_json::from_str(&text).unwrap()
    }

    #[test]
    fn frame_rates_stay_ratios() {
        const UNKNOWN: [&str; 3] = ["unknown"; 3];
        for (rates, wanted) in [
            (["15/2", "15/2"], Some("15/2")),
            (["30000/1001", "30000/1001"], Some("30000/1001")),
            // Fields.
            (["50/1", "25/1"], Some("25/1")),
            // Frames at any time.
            (["90000/1", "1234/100"], Some("1234/100")),
            (["30/1", "0/0"], Some("30/1")),
            (["0/0", "0/0"], None),
        ] {
            let rate = facts(rates, UNKNOWN).frame_rate();
            assert_eq!(
                rate.map(|rate| rate.to_string()).as_deref(),
                wanted,
                "{rates:?}"
            );
        }
    }

    #[test]
    fn colours_are_known_by_ffmpeg_s_names_or_refused() {
        let wide = |colours| facts(["25/1", "25/1"], colours).wide_colour(100);
        assert_eq!(wide(["bt709", "bt709", "bt709"]), Ok(None));
        assert_eq!(wide(["unknown", "unknown", "unknown"]), Ok(None));
        let hdr = wide(["bt2020nc", "smpte2084", "bt2020"]).unwrap().unwrap();
        assert!(hdr.to_srgb.to_string().contains("PQ"), "{hdr:?}");
        let refused = wide(["ictcp", "smpte2084", "bt2020"]);
        assert!(matches!(refused, Err(ColourFault::Matrix(_))));
        let refused = wide(["bt709", "log100", "bt709"]);
        assert!(matches!(refused, Err(ColourFault::Transfer(_))));
    }
}
