//! What libtorch refuses in a method of `tch` that has no result ends it by a panic: it becomes an error here.

use std::any::Any;
use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

use tch::TchError;

use crate::error::TrainError;

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Computes on tensors; what libtorch refuses is an error in its own words, and nothing else is printed.
pub(super) fn guarded<R>(work: impl FnOnce() -> Result<R, TrainError>) -> Result<R, TrainError> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let others = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            if !GUARDED.get() || refusal(panic.payload()).is_none() {
                others(panic);
            }
        }));
    });
    let before = GUARDED.replace(true);
    let done = panic::catch_unwind(AssertUnwindSafe(work));
    GUARDED.set(before);
    done.unwrap_or_else(|panic| match refusal(&*panic) {
        Some(words) => Err(TchError::Torch(words).into()),
        None => panic::resume_unwind(panic),
    })
}

/// What libtorch says in the panic of an unwrapped [`TchError`], without the lines for those who build it.
fn refusal(panic: &(dyn Any + Send)) -> Option<String> {
    let (_, words) = panic.downcast_ref::<String>()?.split_once("Torch(\"")?;
    let line = words.split("\\n").next().unwrap_or(words);
    Some(line.trim_end_matches("\")").replace("\\\"", "\""))
}

#[cfg(test)]
mod tests {
    use relit_data::causes::with_causes;
    use tch::{Device, Kind, Tensor};

    use super::*;

    #[test]
    fn what_libtorch_refuses_is_an_error_in_its_words_and_other_panics_stay_panics() {
        let ones = |side: i64| Tensor::ones([side], (Kind::Float, Device::Cpu));
        let refused = guarded(|| Ok(ones(2) + ones(3))).unwrap_err();
        let words = with_causes(&refused);
        assert!(
            words.contains("size of tensor a (2)") && !words.contains('\n'),
            "{words}"
        );
        assert_eq!(guarded(|| Ok(3)).unwrap(), 3);
        let fault = || guarded::<()>(|| panic!("another"));
        assert!(panic::catch_unwind(fault).is_err());
    }
}
