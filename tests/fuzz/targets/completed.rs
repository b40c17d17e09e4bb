//! Hardly any mutation of a JSON file keeps all required fields. A target that reads it twice, as it
//! is and with the missing fields added, gets past the first missing field.

use serde_json::Value;
use serde_json::map::Entry;

/// The JSON object `bytes` with missing fields added from `whole`, at any depth; `None` if it is not
/// JSON.
pub(crate) fn completed(bytes: &[u8], whole: &[u8]) -> Option<Vec<u8>> {
    let mut value = serde_json::from_slice(bytes).ok()?;
    fill(&mut value, serde_json::from_slice(whole).ok()?);
    serde_json::to_vec(&value).ok()
}

fn fill(value: &mut Value, whole: Value) {
    let (Value::Object(fields), Value::Object(whole)) = (value, whole) else {
        return;
    };
    for (key, of_whole) in whole {
        match fields.entry(key) {
            Entry::Vacant(place) => {
                place.insert(of_whole);
            }
            Entry::Occupied(mut place) => fill(place.get_mut(), of_whole),
        }
    }
}
