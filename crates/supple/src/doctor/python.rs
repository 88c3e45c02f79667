//! Checks whether Python and the package `supple` are installed, in the version of this program.

use super::checks::Check;
use std::process::{Command, Stdio};

const NAME: &str = "python";
/// Python program that prints the version of Python, and of the package if it is installed.
const SCRIPT: &str = "import sys
print('.'.join(str(part) for part in sys.version_info[:3]))
try:
    import supple
    print(supple.__version__)
except ImportError:
    pass";
/// Oldest version that the package supports.
const OLDEST: (u32, u32) = (3, 11);

/// Checks the interpreter of this name. The result is at most a warning, because only the package needs Python.
pub fn check(interpreter: &str) -> Check {
    let ran = Command::new(interpreter)
        .args(["-B", "-c", SCRIPT])
        .stdin(Stdio::null())
        .output();
    let Ok(output) = ran else {
        return Check::warn(
            NAME,
            format!("{interpreter} is not installed; the programs do not need it"),
            "install Python 3.11 or later to use the package `supple`",
        );
    };
    let text = String::from_utf8_lossy(&output.stdout);
    let mut lines = text.lines();
    let version = lines.next().unwrap_or_default();
    if !supports(version) {
        return Check::warn(
            NAME,
            format!("{interpreter} {version}"),
            "install Python 3.11 or later to use the package `supple`",
        );
    }
    match lines.next() {
        Some(package) if package == env!("CARGO_PKG_VERSION") => {
            Check::pass(NAME, format!("{interpreter} {version}, supple {package}"))
        }
        Some(package) => Check::warn(
            NAME,
            format!(
                "{interpreter} {version}, supple {package}; this program is {}",
                env!("CARGO_PKG_VERSION")
            ),
            "install the package of this version with pip; other versions cannot connect to the systems of this program",
        ),
        None => Check::warn(
            NAME,
            format!(
                "{interpreter} {version} without the package supple; the programs do not need it"
            ),
            "pip install ./python",
        ),
    }
}

fn supports(version: &str) -> bool {
    let mut parts = version.split('.').map(str::parse::<u32>);
    match (parts.next(), parts.next()) {
        (Some(Ok(major)), Some(Ok(minor))) => (major, minor) >= OLDEST,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_compared_as_numbers() {
        for (version, expected) in [
            ("3.11.7", true),
            ("3.9.2", false),
            ("4.0.0", true),
            ("", false),
        ] {
            assert_eq!(supports(version), expected, "{version}");
        }
    }

    #[test]
    fn a_missing_interpreter_is_a_warning_with_a_remedy() {
        let check = check("no-such-python");
        assert_eq!(check.verdict, super::super::checks::Verdict::Warn);
        assert!(check.remedy.is_some());
    }
}
