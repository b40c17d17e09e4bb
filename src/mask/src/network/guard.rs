//! The engine takes files from anywhere, and damage that it does not expect ends it by a panic: it becomes an error here.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

use tract_onnx::prelude::TractResult;

/// Longer words of the engine are cut off, in characters.
const LONGEST: usize = 160;

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Lets the engine work; what fails is one short sentence, and nothing else is printed.
pub(super) fn guarded<T>(work: impl FnOnce() -> TractResult<T>) -> Result<T, String> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let others = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            if !GUARDED.get() {
                others(panic);
            }
        }));
    });
    let before = GUARDED.replace(true);
    let done = panic::catch_unwind(AssertUnwindSafe(work));
    GUARDED.set(before);
    match done {
        Ok(Ok(result)) => Ok(result),
        Ok(Err(fault)) => Err(sentence(&fault.root_cause().to_string())),
        Err(_) => Err("it is damaged, or has parts that are not supported".to_owned()),
    }
}

/// The beginning of what the engine says, in one line.
fn sentence(words: &str) -> String {
    let line = words.split_whitespace().collect::<Vec<_>>().join(" ");
    let line = line.trim_end_matches('.');
    match line.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &line[..end]),
        None => line.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_of_the_engine_is_an_error_and_a_long_fault_one_short_line() {
        let ended: Result<(), String> = guarded(|| panic!("index out of bounds"));
        assert!(ended.is_err());
        let words = "a fault\nover lines ".repeat(100);
        let said = guarded::<()>(|| Err(std::io::Error::other(words).into())).unwrap_err();
        assert!(said.len() <= LONGEST + 3 && !said.contains('\n'), "{said}");
        assert_eq!(guarded(|| Ok(3)), Ok(3));
    }
}
