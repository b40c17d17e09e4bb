//! The page about a mask: verdict and reasons, the drift over the turn, and the worst frames. One file without
//! scripts that loads nothing.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::{GrayImage, RgbImage};
use relit_data::geometry::Rect;
use relit_grabcut::{MaskError, preview};
use relit_video::Video;

use super::super::MaskingError;
use super::MaskReport;
use super::drift::FrameDrift;

/// JPEG quality of the frames, 1 to 100.
const QUALITY: u8 = 85;
/// Size of the plot, units.
const PLOT: (f32, f32) = (800.0, 160.0);
/// The plot reaches at least so high, pixels of drift.
const LEAST_HEIGHT: f32 = 2.0;

const STYLE: &str = "body{font:16px/1.4 system-ui,sans-serif;max-width:56rem;margin:1rem auto;padding:0 1rem;color:#1b1e24}\
h1{font-size:1.2rem}.verdict{font-weight:700}.fits{color:#13703a}.drifts,.unknown{color:#96550a}.wrong{color:#b3261e}\
svg{width:100%;height:auto;background:#f4f5f7}figure{display:inline-block;margin:.3rem;vertical-align:top}img{max-width:26rem;width:100%}";

pub(super) fn page(
    id: &str,
    report: &MaskReport,
    drifts: &[FrameDrift],
    shown: &[u64],
    video: &Video,
    mask: &GrayImage,
) -> Result<String, MaskingError> {
    let (class, word) = report.verdict.words();
    let word = format!("{}{}", word[..1].to_uppercase(), &word[1..]);
    let id = escaped(id);
    let reasons: String = report
        .reasons
        .iter()
        .map(|reason| format!("<li>{}</li>", escaped(reason)))
        .collect();
    let frames = figures(drifts, shown, video, mask)?;
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
         <title>The mask of {id}</title><style>{STYLE}</style></head><body>\n<h1>The mask of {id}</h1>\n\
         <p class=\"verdict {class}\">{word}.</p>\n<ul>{reasons}</ul>\n\
         <h2>Drift over the turn, pixels</h2>\n{}\n<h2>The mask's own frame, and the worst ones</h2>\n{frames}</body></html>\n",
        plot(drifts, video.frames().len()),
    ))
}

fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;");
    text.replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// Drift over the frames as a line.
fn plot(drifts: &[FrameDrift], frames: usize) -> String {
    let (width, height) = PLOT;
    let most = drifts
        .iter()
        .map(FrameDrift::px)
        .fold(LEAST_HEIGHT, f32::max);
    let last = frames.saturating_sub(1).max(1) as f32;
    let mut points = String::new();
    for drift in drifts {
        let (x, y) = (
            drift.frame as f32 / last * width,
            height - drift.px() / most * height,
        );
        // Writing to a string does not fail.
        let _ = write!(points, "{x:.1},{y:.1} ");
    }
    let level = height - height / most;
    format!(
        "<svg viewBox=\"0 -4 {width} {}\" role=\"img\" aria-label=\"Drift over the frames\">\
         <path d=\"M0 {level:.1}H{width}\" stroke=\"#9aa3b2\" stroke-dasharray=\"4 4\"/>\
         <text x=\"4\" y=\"{:.1}\" font-size=\"12\" fill=\"#5a6270\">1 px</text>\
         <polyline points=\"{points}\" fill=\"none\" stroke=\"#b3261e\" stroke-width=\"1.2\"/></svg>",
        height + 8.0,
        level - 4.0,
    )
}

fn figures(
    drifts: &[FrameDrift],
    shown: &[u64],
    video: &Video,
    mask: &GrayImage,
) -> Result<String, MaskingError> {
    let part = surroundings(mask);
    let mut figures = String::new();
    for &number in shown {
        let picture = cropped(&preview(&video.frame(number)?, mask), part);
        let mut jpeg = Vec::new();
        JpegEncoder::new_with_quality(&mut jpeg, QUALITY)
            .encode_image(&picture)
            .map_err(|source| MaskError::Encode {
                what: "a frame",
                source,
            })?;
        let drift = drifts.iter().find(|drift| drift.frame == number);
        let drift = drift.map_or("object not found".to_owned(), |drift| {
            format!("{:.2} px", drift.px())
        });
        let _ = writeln!(
            figures,
            "<figure><img alt=\"Frame {number} with the mask's outline\" src=\"data:image/jpeg;base64,{}\"><figcaption>Frame {number}: {drift}</figcaption></figure>",
            STANDARD.encode(jpeg)
        );
    }
    Ok(figures)
}

/// The object's bounds with some space around, inside the frame.
fn surroundings(mask: &GrayImage) -> Rect {
    let (width, height) = mask.dimensions();
    let inside = mask.enumerate_pixels().filter(|(.., p)| p.0[0] >= 128);
    let (mut low, mut high) = ((width, height), (0, 0));
    for (x, y, _) in inside {
        low = (low.0.min(x), low.1.min(y));
        high = (high.0.max(x), high.1.max(y));
    }
    let space = (width.max(height) / 30).max(4);
    let (left, top) = (low.0.saturating_sub(space), low.1.saturating_sub(space));
    let right = (high.0 + space + 1).min(width).max(left + 1);
    let bottom = (high.1 + space + 1).min(height).max(top + 1);
    Rect::new(left as i32, top as i32, right - left, bottom - top)
}

fn cropped(image: &RgbImage, part: Rect) -> RgbImage {
    let (x, y) = (part.x.unsigned_abs(), part.y.unsigned_abs());
    image::imageops::crop_imm(image, x, y, part.w, part.h).to_image()
}
