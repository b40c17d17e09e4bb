//! Tells programs and tests where they find libtorch, where they are built with it.

use std::env;

fn main() {
    // torch-sys tells its direct dependents where the library is.
    if let Ok(folder) = env::var("DEP_TCH_LIBTORCH_LIB") {
        println!("cargo:rustc-link-arg=-Wl,-rpath,{folder}");
    }
    println!("cargo:rerun-if-changed=build.rs");
}
