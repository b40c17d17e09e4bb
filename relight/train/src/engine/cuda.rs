//! GPUs: libtorch's library for CUDA, loaded when one is asked for.
//!
//! Nothing in the program names a symbol of that library, so that the linker leaves it out, and one program serves machines
//! with and without a GPU.

use libloading::library_filename;
use tch::{Cuda, Device};

use crate::error::TrainError;

/// The GPU of a number, from 0.
///
/// # Errors
/// [`TrainError::Refused`] if libtorch has no library for CUDA that can be loaded, or finds fewer GPUs.
pub fn cuda_device(number: usize) -> Result<Device, TrainError> {
    load()?;
    let count = Cuda::device_count();
    if i64::try_from(number).is_ok_and(|number| number < count) {
        // Pictures of a run have one size: what is fastest for the first is so for all.
        Cuda::cudnn_set_benchmark(true);
        Ok(Device::Cuda(number))
    } else {
        Err(TrainError::Refused(format!(
            "GPU {number}, counted from 0, does not exist: libtorch finds {count}"
        )))
    }
}

/// Loads the library, for as long as the program runs. Before anything else asks libtorch about CUDA: it remembers the answer.
fn load() -> Result<(), TrainError> {
    let name = library_filename("torch_cuda");
    #[allow(
        unsafe_code,
        reason = "the library is libtorch's own, of the version that the program was built with"
    )]
    // SAFETY: what runs on loading registers the library's kernels with libtorch, and it is never unloaded.
    let library = unsafe {
        #[cfg(unix)]
        {
            use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_NOW};
            Library::open(Some(name), RTLD_NOW | RTLD_GLOBAL)
        }
        #[cfg(not(unix))]
        libloading::Library::new(name)
    };
    let library = library.map_err(|fault| {
        TrainError::Refused(format!(
            "libtorch's CUDA library cannot be loaded ({fault}): install PyTorch for CUDA; give its folder torch as LIBTORCH \
             to the build, or torch/lib in LD_LIBRARY_PATH"
        ))
    });
    std::mem::forget(library?);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gpu_that_is_not_there_is_told_in_one_sentence() {
        let error = cuda_device(4711).unwrap_err();
        assert!(matches!(error, TrainError::Refused(_)), "{error:?}");
        let text = error.to_string();
        let named = ["CUDA", "4711"];
        assert!(named.iter().any(|named| text.contains(named)), "{text}");
    }
}
