//! With the feature `libtorch`: compiles `native/`: the way to c10d, and settings of the allocator, and tells tests where they find libtorch.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{env, fs};

/// The headers of Gloo that c10d's own headers ask for: PyTorch's wheels lack them.
const GLOO: [&str; 5] = [
    "algorithm.h",
    "common/error.h",
    "context.h",
    "rendezvous/store.h",
    "transport/device.h",
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=native");
    if env::var_os("CARGO_FEATURE_LIBTORCH").is_none() {
        return Ok(());
    }
    // torch-sys tells its direct dependents where the library is.
    let libraries = PathBuf::from(env::var("DEP_TCH_LIBTORCH_LIB")?);
    println!("cargo:rustc-link-arg=-Wl,-rpath,{}", libraries.display());
    let headers = libraries.with_file_name("include");
    let gloo = PathBuf::from(env::var("OUT_DIR")?).join("gloo-headers");
    write_forwarding_headers(&gloo.join("gloo"))?;
    cc::Build::new()
        .cpp(true)
        .std("c++17")
        .define("USE_C10D_GLOO", None)
        .include("native")
        .include(gloo)
        // libtorch's own headers are full of what compilers warn of.
        .flag(format!("-isystem{}", headers.display()))
        .flag(format!(
            "-isystem{}",
            headers.join("torch/csrc/api/include").display()
        ))
        .flag_if_supported("-Wno-unused-parameter")
        .file("native/c10d.cpp")
        .file("native/memory.cpp")
        .try_compile("relight_train_native")?;
    Ok(())
}

/// One line each: what they declare is in native/gloo.h.
fn write_forwarding_headers(folder: &Path) -> Result<(), Box<dyn Error>> {
    for header in GLOO {
        let path = folder.join(header);
        fs::create_dir_all(path.parent().unwrap_or(folder))?;
        fs::write(path, "#include \"gloo.h\"\n")?;
    }
    Ok(())
}
