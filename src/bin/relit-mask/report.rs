//! What relit-mask says of a mask that it made.

use relit::masking::Made;
use serde_json::json;

use relit::console::Console;

/// Tells of one mask: its warnings, then where it is and how large.
pub(crate) fn tell(made: &Made, console: Console) {
    let id = &made.recording;
    for notice in &made.notices {
        console.warn(&format!("{id}: {}", notice.text()));
    }
    for warning in &made.record.warnings {
        console.warn(&format!("{id}: {warning}"));
    }
    let (source, result) = (&made.record.source, &made.record.result);
    let frame_px = f64::from(source.width) * f64::from(source.height);
    let text = format!(
        "{id}: {} with {} pixels ({:.1} % of the frame) at {}, {} of {} parts; look at {}",
        made.files.mask.display(),
        result.area_px,
        100.0 * result.area_px as f64 / frame_px,
        result.bounding_box,
        result.components_kept,
        result.components,
        made.files.preview.display(),
    );
    let event = json!({
        "event": "mask",
        "recording": id,
        "mask": made.files.mask.to_string_lossy(),
        "record": made.files.record.to_string_lossy(),
        "preview": made.files.preview.to_string_lossy(),
        "source": source,
        "result": result,
        "warnings": made.record.warnings,
    });
    console.say(&text, &event);
}
