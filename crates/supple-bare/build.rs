//! Link arguments of the freestanding program. They apply to this package's binary only.

use std::env::var;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=cortex-m.ld");
    if var("CARGO_FEATURE_FREESTANDING").is_err() {
        return;
    }
    let folder = var("CARGO_MANIFEST_DIR").unwrap_or_default();
    let link = |argument: &str| println!("cargo:rustc-link-arg-bins={argument}");
    match var("CARGO_CFG_TARGET_OS").as_deref() {
        Ok("none") => link(&format!("-T{folder}/cortex-m.ld")),
        _ => ["-nostartfiles", "-nodefaultlibs", "-static", "-no-pie"]
            .into_iter()
            .for_each(link),
    }
}
