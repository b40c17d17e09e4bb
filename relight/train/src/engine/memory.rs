//! Memory between steps.

/// Keeps the memory that tensors free for the next ones, instead of giving it back to the system after each step: steps on a
/// processor become faster by up to a half, and the program's memory does not shrink. Does nothing without glibc.
pub fn keep_memory() {
    #[allow(
        unsafe_code,
        reason = "an allocator's settings are changed by a call into the C library"
    )]
    // SAFETY: the function takes nothing, returns nothing, and sets two numbers of the allocator.
    unsafe {
        rl_keep_memory();
    }
}

#[allow(unsafe_code, reason = "native/memory.cpp is compiled by build.rs")]
unsafe extern "C" {
    fn rl_keep_memory();
}
