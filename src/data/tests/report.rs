//! The report's page, as a browser gets it.
#![expect(
    clippy::unwrap_used,
    reason = "a test fails by a panic, in its helpers too"
)]

use std::f64::consts::TAU;

use image::{Rgb, RgbImage};
use relit_data::geometry::Rect;
use relit_data::image_stats::{Measures, SATURATION_LEVEL};
use relit_data::report::{Page, render};
use relit_data::shard::record::FrameRecord;
use relit_data::spec_net_gate::SPEC_NET_GATE;

/// A turn of a glossy object: highlights come and go with the lights.
fn record(index: u32, frames: u32) -> FrameRecord {
    let angle = TAU * f64::from(index) / f64::from(frames);
    let flutter = f64::from(index.wrapping_mul(2_654_435_761) >> 20) / 4096.0 - 0.5;
    let lights = (angle.sin() + 0.6 * (2.0 * angle + 1.0).sin()).max(-0.8);
    let fraction = 0.045 + 0.022 * lights + 0.0008 * flutter;
    let any = 0.22 + 0.14 * lights + 0.004 * flutter;
    let mask_px: u64 = 60_916;
    let pixels = |part: f64| (part * 60_916.0) as u64;
    let measures = Measures {
        mask_px,
        saturated_px: pixels(fraction),
        saturated_any_px: pixels(any),
        mean_rgb: [118.0, 126.0, 131.0].map(|mean| mean + 22.0 * lights + 0.6 * flutter),
        sharpness: 410.0 + 60.0 * (3.0 * angle).cos() + 9.0 * flutter,
    };
    let crop = Rect::new(120, 60, 380, 380);
    FrameRecord {
        t_us: i64::from(index) * 33_333,
        angle_deg: Some(360.0 * f64::from(index) / f64::from(frames)),
        duplicate: index % 500 == 499,
        size: [256; 2],
        ..FrameRecord::new(
            "20261120T093015Z-cow",
            "cow",
            index,
            crop,
            &measures,
            SPEC_NET_GATE,
        )
    }
}

fn turn(frames: u32) -> Vec<FrameRecord> {
    (0..frames).map(|index| record(index, frames)).collect()
}

/// A ball lit from the light's direction, on black.
fn thumbnail(record: &FrameRecord) -> (u32, RgbImage) {
    let light = record.angle_deg.unwrap_or(0.0).to_radians();
    let image = RgbImage::from_fn(256, 256, |x, y| {
        let (u, v) = (
            (f64::from(x) - 127.5) / 110.0,
            (f64::from(y) - 127.5) / 110.0,
        );
        let depth = 1.0 - u * u - v * v;
        if depth < 0.0 {
            return Rgb([0; 3]);
        }
        let lit =
            (0.6 * u * light.sin() + 0.5 * depth.sqrt() * (1.2 + light.cos()) - 0.3 * v).max(0.0);
        let noise = f64::from((x * 7919 + y * 104_729) % 13) - 6.0;
        Rgb([90.0, 140.0, 150.0].map(|c| (30.0 + c * lit + 160.0 * lit.powi(12) + noise) as u8))
    });
    (record.index, image)
}

fn thumbnails(records: &[FrameRecord], count: usize) -> Vec<(u32, RgbImage)> {
    records
        .chunks(records.len().div_ceil(count))
        .filter_map(|c| c.first())
        .map(thumbnail)
        .collect()
}

fn pairs(rows: &[(&str, &str)]) -> Vec<(String, String)> {
    rows.iter()
        .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()))
        .collect()
}

fn page<'a>(records: &'a [FrameRecord], thumbnails: &'a [(u32, RgbImage)]) -> Page<'a> {
    Page {
        records,
        thumbnails,
        settings: &[],
        facts: &[],
        warnings: &[],
        quality: None,
        gate: SPEC_NET_GATE,
        saturation_level: SATURATION_LEVEL,
    }
}

fn polyline<'a>(html: &'a str, class: &str) -> Vec<&'a str> {
    let start = format!("<polyline class=\"{class}\" points=\"");
    html.lines()
        .filter_map(|line| line.strip_prefix(start.as_str()))
        .collect()
}

const WARNINGS: [&str; 2] = [
    "3 samples show a source frame that another sample shows already.",
    "The mask touches the lower edge of the frame: the object may be cut off.",
];

/// The page of a whole turn, with all that a page can have.
fn whole_turn() -> String {
    let records = turn(1500);
    let thumbnails = thumbnails(&records, 24);
    let settings = pairs(&[
        ("Frames", "1500, by table angle"),
        ("Size", "256 x 256 pixels"),
        ("Crop", "380 x 380 pixels at 120, 60"),
        ("Margin", "5 %"),
        ("Saturation level", "250"),
        ("Gate", "5 %"),
        ("Alignment", "off"),
    ]);
    let facts = pairs(&[
        (
            "Video",
            "video.mkv, MJPEG, 640 x 480, full range, 1500 frames, 50.0 s",
        ),
        ("Mask", "mask.png, 60916 pixels, 1 component"),
        ("Shard", "20261120T093015Z-cow.tar, 61.4 MB"),
        (
            "BLAKE3",
            "9c4328f8345ae3d35f08cecdd10bb32944bcb1d97222f6567cbb3f6a3c783f0d",
        ),
    ]);
    let warnings = WARNINGS.map(str::to_owned);
    let page = Page {
        settings: &settings,
        facts: &facts,
        warnings: &warnings,
        ..page(&records, &thumbnails)
    };
    render(&page).unwrap()
}

#[test]
fn the_page_of_a_whole_turn_is_one_small_file_without_outside_links() {
    let html = whole_turn();
    // Left in the build folder for a look in a browser.
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(folder.join("report.html"), &html).unwrap();
    assert!(html.len() < 700_000, "{} bytes", html.len());
    for outside in ["http://", "https://", "href=", "url(", "<script", "@import"] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert_eq!(
        html.matches("src=").count(),
        html.matches("src=\"data:image/").count()
    );
}

#[test]
fn the_same_session_gives_the_same_page() {
    let records = turn(60);
    let thumbnails = thumbnails(&records, 24);
    let first = render(&page(&records, &thumbnails)).unwrap();
    assert_eq!(first, render(&page(&records, &thumbnails)).unwrap());
}

#[test]
fn the_contact_sheet_is_labelled() {
    let records = turn(240);
    let thumbnails = thumbnails(&records, 24);
    let html = render(&page(&records, &thumbnails)).unwrap();
    let sheet = html.split("<h2>Contact sheet</h2>").nth(1).unwrap();
    let (label, figures) = sheet.split_once("<div").unwrap();
    assert!(label.contains("24 of 240") && label.contains("table angle"));
    for (index, _) in &thumbnails {
        let angle = 360 * index / 240;
        let label = format!("<b>{angle}.0°</b> <span>sample {index}</span>");
        assert!(figures.contains(&label), "{label}");
    }
}

#[test]
fn the_contact_sheet_marks_frames_in_which_spec_net_is_on() {
    let records = turn(240);
    let thumbnails = thumbnails(&records, 24);
    let html = render(&page(&records, &thumbnails)).unwrap();
    let on = thumbnails
        .iter()
        .filter(|(index, _)| records[*index as usize].spec_net)
        .count();
    assert_eq!(html.matches("<figure class=\"frame").count(), 24);
    assert_eq!(html.matches("<figure class=\"frame on\">").count(), on);
    assert_eq!(html.matches(">Spec-Net</i>").count(), on);
    assert!(on > 0 && on < 24);
}

#[test]
fn every_quantity_has_one_line_with_a_point_a_sample() {
    let html = whole_turn();
    for class in ["all", "any", "r", "g", "b", "sharp"] {
        let lines = polyline(&html, class);
        assert_eq!(lines.len(), 1, "{class}");
        assert_eq!(lines[0].split(' ').count(), 1500, "{class}");
        assert!(
            !lines[0].contains("NaN") && !lines[0].contains("inf"),
            "{class}"
        );
    }
}

#[test]
fn the_line_crosses_the_gate_exactly_where_spec_net_switches() {
    let records = turn(300);
    let html = render(&page(&records, &[])).unwrap();
    let gate = html
        .split("class=\"gate\" d=\"M54 ")
        .nth(1)
        .unwrap()
        .split('H')
        .next()
        .unwrap();
    let gate: f64 = gate.parse().unwrap();
    for (point, record) in polyline(&html, "all")[0].split(' ').zip(&records) {
        let y: f64 = point.split([',', '"']).nth(1).unwrap().parse().unwrap();
        // Coordinates are rounded to a tenth: on the line itself either side is right.
        assert!(
            (y - gate).abs() <= 0.1 || (y < gate) == record.spec_net,
            "{}",
            record.index
        );
    }
}

#[test]
fn the_verdict_says_what_came_out() {
    let html = whole_turn();
    let on = turn(1500).iter().filter(|r| r.spec_net).count();
    assert!(html.contains("<b>1500</b>") && html.contains("<b>3</b>"));
    assert!(html.contains(&format!("<b>{on}</b>")));
    assert!(html.contains("<b>2</b>"));
    for warning in WARNINGS {
        assert!(html.contains(warning), "{warning}");
    }
}

#[test]
fn names_are_shown_as_they_are_and_never_as_markup() {
    let mut records = turn(3);
    for record in &mut records {
        record.session = "20261120T093015Z-<script>alert(1)</script>".to_owned();
        record.object = "Schüssel & \"碗\" 🐄".to_owned();
    }
    let rows = pairs(&[("<img src=x>", "'\"><svg onload=x>")]);
    let warnings = ["</ul><script>".to_owned()];
    let page = Page {
        settings: &rows,
        warnings: &warnings,
        ..page(&records, &[])
    };
    let html = render(&page).unwrap();
    assert!(!html.contains("<script") && !html.contains("<img") && !html.contains("<svg onload"));
    assert!(html.contains("Schüssel &amp; &quot;碗&quot; 🐄"));
}

#[test]
fn a_single_black_frame_without_an_angle_has_a_page() {
    let mut only = record(0, 1);
    only.angle_deg = None;
    only.duplicate = true;
    only.spec_net = false;
    only.mask_px = 0;
    only.saturated_px = 0;
    only.saturated_any_px = 0;
    only.saturated_fraction = 0.0;
    only.mean_rgb = [0.0; 3];
    only.sharpness = 0.0;
    let html = render(&page(&[only], &[])).unwrap();
    // One sample and one duplicate, and none in which Spec-Net is on.
    assert_eq!(html.matches("<b>1</b>").count(), 2);
    assert!(!html.contains("NaN"));
}

/// What is written below the axis of the angles.
fn axis_title(html: &str) -> &str {
    let last = html.rsplit("<text class=\"middle\"").next().unwrap();
    last.split(['<', '>']).nth(1).unwrap()
}

/// What is said about the angles above the plots.
fn note(html: &str) -> &str {
    let last = html.rsplit("<p class=\"note\">").next().unwrap();
    last.split('<').next().unwrap()
}

#[test]
fn one_missing_angle_moves_the_whole_axis_to_the_index_and_the_page_says_so() {
    let mut records = turn(4);
    records[2].angle_deg = None;
    let html = render(&page(&records, &[])).unwrap();
    let with_angles = render(&page(&turn(4), &[])).unwrap();
    assert_ne!(axis_title(&html), axis_title(&with_angles));
    assert_ne!(note(&html), note(&with_angles));
    let abscissae: Vec<&str> = polyline(&html, "sharp")[0]
        .split(' ')
        .map(|p| p.split(',').next().unwrap())
        .collect();
    assert_eq!(abscissae, ["54", "179", "304", "429"]);
}

#[test]
fn a_turn_that_passes_360_degrees_is_drawn_from_left_to_right() {
    let mut records = turn(90);
    for record in &mut records {
        record.angle_deg = record.angle_deg.map(|angle| -100.0 - angle);
    }
    let html = render(&page(&records, &[])).unwrap();
    let abscissae: Vec<f64> = polyline(&html, "all")[0]
        .split(' ')
        .map(|p| p.split(',').next().unwrap().parse().unwrap())
        .collect();
    assert!(abscissae.is_sorted());
    assert!(abscissae[0] >= 54.0 && abscissae[89] <= 554.0);
}
