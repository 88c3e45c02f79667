//! Tests that a quantity of the record is declared in one place: in a copy of the tree, a scalar and a torque term are added by
//! two edits each, and logs, tables and telemetry contain them.

#[path = "support/table.rs"]
mod table;

use core::num::NonZeroU64;
use std::fs;
use std::path::Path;
use std::process::Command;
use supple_log::{Reader, export_csv};
use table::cells;

/// Edit of a file: file, text in it, and lines to insert after the text.
type Edit = (&'static str, &'static str, &'static str);

const SCALAR: [Edit; 2] = [
    (
        "crates/supple-core/src/controller/output.rs",
        "        number min_singular_value_m;\n",
        "        /// A quantity of this test.\n        number added_scalar_m;\n",
    ),
    (
        "crates/supple-core/src/controller/step.rs",
        "    Output {\n        cycle: input.cycle,\n",
        "        added_scalar_m: 0.5,\n",
    ),
];

const TERM: [Edit; 2] = [
    (
        "crates/supple-core/src/law/torques.rs",
        "    handover,\n",
        "    /// A term of this test.\n    added_term,\n",
    ),
    (
        "crates/supple-core/src/controller/step.rs",
        "    state.blend_torque(controller, &mut torques);\n",
        "    torques.added_term[0] = 0.25;\n",
    ),
];

fn copy_of_the_tree(to: &Path) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let listed = Command::new("git")
        .args(["ls-files", "-z"])
        .current_dir(root)
        .output()
        .expect("git runs");
    let names = String::from_utf8(listed.stdout).expect("names");
    for name in names.split('\0').filter(|name| !name.is_empty()) {
        let (from, to) = (root.join(name), to.join(name));
        fs::create_dir_all(to.parent().expect("a folder")).expect("made");
        fs::copy(&from, &to).unwrap_or_else(|error| panic!("{}: {error}", from.display()));
    }
}

/// Gives the packages of the copy another version, so that in the shared target folder cargo does not mistake them for packages
/// of this tree: cargo distinguishes members of a workspace by their path within it.
fn set_version(tree: &Path) {
    const OURS: &str = "version = \"0.1.0\"";
    const COPY: &str = "version = \"0.1.0-copy\"";
    let path = tree.join("Cargo.toml");
    let manifest = fs::read_to_string(&path).expect("readable");
    assert_eq!(
        manifest.matches(OURS).count(),
        1,
        "the version of the workspace"
    );
    fs::write(&path, manifest.replace(OURS, COPY)).expect("written");
    let path = tree.join("Cargo.lock");
    let lock = fs::read_to_string(&path).expect("readable");
    let packages: Vec<String> = lock
        .split("[[package]]\n")
        .map(|package| match package.starts_with("name = \"supple") {
            true => package.replacen(OURS, COPY, 1),
            false => package.to_owned(),
        })
        .collect();
    fs::write(&path, packages.join("[[package]]\n")).expect("written");
}

fn edit(tree: &Path, (file, behind, lines): &Edit) {
    let path = tree.join(file);
    let text = fs::read_to_string(&path).expect("readable");
    assert_eq!(text.matches(behind).count(), 1, "{file}: {behind}");
    fs::write(&path, text.replace(behind, &format!("{behind}{lines}"))).expect("written");
}

#[test]
#[ignore = "builds a copy of the tree: `./ci.sh edits`"]
fn a_scalar_and_a_term_are_two_edits_each() {
    let folder = tempfile::tempdir().expect("a folder");
    let tree = folder.path().join("tree");
    copy_of_the_tree(&tree);
    set_version(&tree);
    for change in SCALAR.iter().chain(&TERM) {
        edit(&tree, change);
    }
    let log = folder.path().join("run.mcap");
    // The target folder is beside that of the tests, because the dependencies on other projects are the same.
    let target = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .parent()
        .expect("the target folder");
    let cargo = |command: &str, of: &[&str]| {
        let whole = ["--locked", "--workspace", "--exclude", "supple-python"];
        let status = Command::new(env!("CARGO"))
            .arg(command)
            .args(whole)
            .args(of)
            .current_dir(&tree)
            .env("CARGO_TARGET_DIR", target)
            .status();
        assert!(status.expect("cargo runs").success(), "{command} {of:?}");
    };
    cargo("build", &["--example", "sample_log"]);
    let written = Command::new(target.join("debug/examples/sample_log"))
        .arg(&log)
        .status();
    assert!(written.expect("it runs").success());
    // The program that publishes telemetry builds with the new quantities.
    cargo("check", &["--bin", "supple-rt"]);

    let table = folder.path().join("table.csv");
    let mut out = fs::File::create(&table).expect("made");
    export_csv(&log, "/controller_state", NonZeroU64::MIN, &mut out).expect("exported");
    let text = fs::read_to_string(&table).expect("readable");
    let mut lines = text.lines().map(cells);
    let heading = lines.next().expect("a heading");
    let at = |column: &str| {
        let found = heading.iter().position(|name| *name == column);
        found.unwrap_or_else(|| panic!("no {column} in {heading:?}"))
    };
    let (scalar, term) = (at("added_scalar_m"), at("torques.added_term.joint1"));
    let mut rows = 0;
    for row in lines {
        assert_eq!((row[scalar], row[term]), ("0.5", "0.25"));
        rows += 1;
    }
    // This version reads the log of the edited version, and omits the quantities that it does not have.
    let steps = Reader::open(&log).and_then(|reader| reader.records::<4>());
    assert_eq!(steps.expect("a log").count(), rows);
    assert!(rows > 1000);
}
