//! `relit-extract`: turns recordings into training shards of masked frames, joins, verifies and sums them up.

mod cli;

fn main() -> std::process::ExitCode {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    return_large_buffers();
    cli::run()
}

/// Lets the C library give buffers as large as a frame back to the system as soon as they are freed. Otherwise each
/// thread's heap keeps those of the first steps, a fifth of all memory, to the end.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code, reason = "settings of the C library")]
fn return_large_buffers() {
    // SAFETY: the calls set numbers of the allocator, and no other thread runs yet. Where one fails, nothing changes.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, 2 << 20);
        // The first call makes this one small, and the heaps shrink and grow all the time.
        libc::mallopt(libc::M_TRIM_THRESHOLD, 4 << 20);
    }
}
