//! Runs the tests in `tests/python`, which read a log with third-party Python libraries for MCAP.

use std::path::Path;
use std::process::Command;

/// `SUPPLE_PYTHON` names a Python with `tests/python/requirements.txt` installed.
#[test]
#[ignore = "needs Python with tests/python/requirements.txt: `./ci.sh python` installs them"]
fn python_readers() {
    let python = std::env::var_os("SUPPLE_PYTHON").unwrap_or_else(|| "python3".into());
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let status = Command::new(&python)
        .args([
            "-m",
            "pytest",
            "-q",
            "-W",
            "error",
            "-p",
            "no:cacheprovider",
            "tests/python",
        ])
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .current_dir(root)
        .status();
    let status = status.unwrap_or_else(|error| panic!("{}: {error}", python.display()));
    assert!(status.success(), "{status}");
}
