//! Puts the board's memory map on the linker's path.
//!
//! The linker looks in its working directory first, and cargo runs it at the
//! workspace root, where the real board's `memory.x` lies. `link.x` of
//! cortex-m-rt would therefore include that file for every board, whatever the
//! search path says; so the emulated board brings a complete script of its own.

use std::{env, fs, path::PathBuf};

fn main() {
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let (source, name, script) = if env::var_os("CARGO_FEATURE_MPS2_AN386").is_some() {
        (
            "src/board/mps2_an386.ld",
            "mps2_an386.ld",
            "-Tmps2_an386.ld",
        )
    } else {
        ("../memory.x", "memory.x", "-Tlink.x")
    };
    fs::copy(source, out.join(name)).expect("the board's linker script is readable");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins={script}");
    println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rerun-if-changed={source}");
    println!("cargo:rerun-if-changed=build.rs");
}
