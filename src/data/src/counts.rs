//! Numbers of things in sentences for people.

/// A number with its noun: `1 frame`, `2 frames`.
///
/// ```
/// use relit_data::counts::count_of;
///
/// assert_eq!(count_of(1, "frame"), "1 frame");
/// assert_eq!(count_of(0, "frame"), "0 frames");
/// ```
pub fn count_of(count: u64, noun: &str) -> String {
    match count {
        1 => format!("1 {noun}"),
        n => format!("{n} {noun}s"),
    }
}
