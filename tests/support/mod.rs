//! Support for tests that run the programs.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Returns the folder of the programs, which are built once with the same selection as the test run, so that cargo rebuilds
/// nothing.
/// `SUPPLE_PROGRAMS` names another folder, for example with the programs of an older version.
pub fn programs() -> &'static Path {
    static PROGRAMS: OnceLock<PathBuf> = OnceLock::new();
    PROGRAMS.get_or_init(|| {
        if let Some(folder) = std::env::var_os("SUPPLE_PROGRAMS") {
            return folder.into();
        }
        let selection =
            "test --no-run --locked --workspace --exclude supple-python --lib --bins --tests";
        let built = Command::new(env!("CARGO"))
            .args(selection.split(' '))
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .output()
            .expect("cargo runs");
        let words = String::from_utf8_lossy(&built.stderr);
        assert!(built.status.success(), "{words}");
        let test = std::env::current_exe().expect("this test");
        let deps = test.parent().expect("deps");
        deps.parent().expect("the profile's folder").to_owned()
    })
}
