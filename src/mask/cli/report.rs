//! What `relit-mask` prints about a mask.

use std::path::Path;

use relit_console::{Console, Event};
use relit_mask::MaskOutput;
use relit_web::Announcement;
use serde_json::json;

/// Prints the warnings about one mask, its files and its size.
pub(crate) fn print(output: &MaskOutput, console: Console) {
    let id = &output.recording;
    for notice in &output.notices {
        console.warn(&format!("{id}: {}", notice.text()));
    }
    for warning in &output.record.warnings {
        console.warn(&format!("{id}: {warning}"));
    }
    let (source, result) = (&output.record.source, &output.record.result);
    let frame_px = f64::from(source.width) * f64::from(source.height);
    let text = format!(
        "{id}: {} with {} pixels ({:.1} % of the frame) at {}, {} of {} parts; check {}",
        output.files.mask.display(),
        result.area_px,
        100.0 * result.area_px as f64 / frame_px,
        result.bounding_box,
        result.components_kept,
        result.components,
        output.files.preview.display(),
    );
    let alpha = output.record.settings.alpha;
    let path = |path: &Path| path.to_string_lossy().into_owned();
    let event = Event::Mask {
        recording: id.clone(),
        mask: path(&output.files.mask),
        record: path(&output.files.record),
        preview: path(&output.files.preview),
        alpha: alpha.then(|| path(&output.files.alpha)),
        source: json!(source),
        result: json!(result),
        warnings: output.record.warnings.clone(),
    };
    console.say(&text, &event);
}

/// Prints where the editor is.
pub(crate) fn print_editor(announcement: &Announcement, console: Console) {
    let url = &announcement.url;
    let qr = match (announcement.address.ip().is_loopback(), &announcement.qr) {
        (false, Some(qr)) => format!("{qr}\n"),
        _ => String::new(),
    };
    console.say(
        &format!("{qr}Open in a browser: {url}"),
        &Event::Editor {
            address: announcement.address.to_string(),
            url: url.clone(),
        },
    );
}
