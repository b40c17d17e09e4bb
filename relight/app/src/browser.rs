//! The engine as the page's worker calls it: four functions over the module's memory.
//!
//! A request is written into bytes of `relight_alloc` and passed to `relight_answer`, which owns them then. A reply begins with
//! its length as a little-endian 32-bit integer and is given back by `relight_free`. After a panic, which is a trap to the
//! worker, `relight_fault` returns its text; the engine must not be called again.
#![allow(
    unsafe_code,
    reason = "functions that JavaScript calls have their own names, and pass addresses"
)]

use std::cell::RefCell;
use std::panic;
use std::slice;

use crate::Studio;

thread_local! {
    static STUDIO: RefCell<Studio> = RefCell::new(started());
    static FAULT: RefCell<String> = const { RefCell::new(String::new()) };
}

/// The engine, whose panics leave their text.
fn started() -> Studio {
    panic::set_hook(Box::new(|info| {
        FAULT.with(|fault| *fault.borrow_mut() = info.to_string());
    }));
    Studio::new()
}

/// Room for a request of `length` bytes.
// SAFETY: the name is used once in this module.
#[unsafe(no_mangle)]
extern "C" fn relight_alloc(length: usize) -> *mut u8 {
    Box::into_raw(vec![0_u8; length].into_boxed_slice()).cast()
}

/// Gives back what `relight_alloc` or a reply took.
///
/// # Safety
/// The address is one of these, with its length, and was not given back before.
// SAFETY: the name is used once in this module.
#[unsafe(no_mangle)]
unsafe extern "C" fn relight_free(address: *mut u8, length: usize) {
    // SAFETY: by the contract above these are the parts of a boxed slice.
    drop(unsafe { Box::from_raw(slice::from_raw_parts_mut(address, length)) });
}

/// Answers a request and takes its bytes over.
///
/// # Safety
/// The bytes are those of `relight_alloc`, and were not given back.
// SAFETY: the name is used once in this module.
#[unsafe(no_mangle)]
unsafe extern "C" fn relight_answer(address: *mut u8, length: usize) -> *mut u8 {
    // SAFETY: by the contract above these are the parts of a boxed slice.
    let request = unsafe { Box::from_raw(slice::from_raw_parts_mut(address, length)) };
    handed_over(STUDIO.with(|studio| studio.borrow_mut().answer(&request)))
}

/// The text of the last panic.
// SAFETY: the name is used once in this module.
#[unsafe(no_mangle)]
extern "C" fn relight_fault() -> *mut u8 {
    handed_over(FAULT.with(|fault| fault.borrow().clone().into_bytes()))
}

/// Bytes behind their length.
fn handed_over(bytes: Vec<u8>) -> *mut u8 {
    let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX).to_le_bytes();
    let reply = [&length[..], &bytes].concat();
    Box::into_raw(reply.into_boxed_slice()).cast()
}
