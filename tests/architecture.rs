//! The arrows of ARCHITECTURE.md, held against what cargo sees.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

/// Crate, and the crates of ours it may depend on. An arrow that is not here is refused; a crate that
/// is not here is refused too.
const ALLOWED: &[(&str, &[&str])] = &[
    ("supple-core", &[]),
    ("supple-files", &[]),
    ("supple-model", &["supple-core", "supple-files"]),
    (
        "supple-plant",
        &["supple-core", "supple-files", "supple-model"],
    ),
    (
        "supple-log",
        &["supple-core", "supple-files", "supple-model"],
    ),
    (
        "supple-experiment",
        &[
            "supple-core",
            "supple-model",
            "supple-plant",
            "supple-log",
            "supple-ident",
        ],
    ),
    (
        "supple",
        &[
            "supple-core",
            "supple-files",
            "supple-model",
            "supple-log",
            "supple-plant",
            "supple-experiment",
            "supple-ident",
            "supple-bus",
            "supple-ipc",
            "supple-realtime",
        ],
    ),
    ("supple-bare", &["supple-core"]),
    ("supple-puck", &["supple-core"]),
    ("supple-bus", &["supple-puck"]),
    ("supple-ipc", &["supple-core", "supple-model"]),
    ("supple-realtime", &[]),
    (
        "supple-can",
        &[
            "supple-core",
            "supple-model",
            "supple-puck",
            "supple-bus",
            "supple-ipc",
            "supple-realtime",
        ],
    ),
    (
        "supple-emu",
        &[
            "supple-core",
            "supple-model",
            "supple-puck",
            "supple-bus",
            "supple-plant",
            "supple-realtime",
        ],
    ),
    ("supple-benches", &["supple-core", "supple-model"]),
    (
        "supple-latency",
        &["supple-core", "supple-ipc", "supple-realtime"],
    ),
    (
        "supple-rt",
        &[
            "supple-core",
            "supple-model",
            "supple-ipc",
            "supple-realtime",
        ],
    ),
    (
        "supple-sim",
        &[
            "supple-core",
            "supple-model",
            "supple-ipc",
            "supple-realtime",
            "supple-plant",
        ],
    ),
    (
        "supple-ident",
        &["supple-core", "supple-files", "supple-model", "supple-log"],
    ),
    (
        "supple-fuzz",
        &[
            "supple-core",
            "supple-model",
            "supple-log",
            "supple-plant",
            "supple-puck",
            "supple-bus",
            "supple-ipc",
            "supple-emu",
            "supple-ident",
        ],
    ),
    (
        "supple-python",
        &[
            "supple-core",
            "supple-files",
            "supple-model",
            "supple-log",
            "supple-plant",
            "supple-experiment",
            "supple-ident",
        ],
    ),
];

fn metadata() -> serde_json::Value {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo metadata runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).expect("cargo metadata prints JSON")
}

/// Every crate of ours with its dependencies on crates of ours, whatever their kind.
fn arrows() -> BTreeMap<String, BTreeSet<String>> {
    let metadata = metadata();
    let packages = metadata["packages"].as_array().expect("packages");
    let name = |value: &serde_json::Value| value["name"].as_str().unwrap_or_default().to_owned();
    let ours: BTreeSet<String> = packages.iter().map(name).collect();
    packages
        .iter()
        .filter(|package| name(package) != "supple-workspace")
        .map(|package| {
            let dependencies = package["dependencies"].as_array().expect("dependencies");
            let dependencies = dependencies.iter().map(name);
            (
                name(package),
                dependencies.filter(|d| ours.contains(d)).collect(),
            )
        })
        .collect()
}

#[test]
fn only_the_drawn_arrows_exist() {
    let allowed: BTreeMap<&str, &[&str]> = ALLOWED.iter().copied().collect();
    for (package, dependencies) in arrows() {
        let permitted = allowed
            .get(package.as_str())
            .unwrap_or_else(|| panic!("{package} is not in the drawing"));
        for dependency in dependencies {
            assert!(
                permitted.contains(&dependency.as_str()),
                "{package} -> {dependency} is not in the drawing"
            );
        }
    }
}

#[test]
fn core_depends_on_nothing_but_mathematics() {
    let metadata = metadata();
    let packages = metadata["packages"].as_array().expect("packages");
    let core = packages.iter().find(|p| p["name"] == "supple-core");
    let dependencies = core.expect("supple-core")["dependencies"].as_array();
    let normal: BTreeSet<&str> = dependencies
        .expect("dependencies")
        .iter()
        .filter(|d| d["kind"].is_null())
        .filter_map(|d| d["name"].as_str())
        .collect();
    assert_eq!(
        normal,
        BTreeSet::from(["bytemuck", "libm", "nalgebra", "safe_arch", "wide"])
    );
}

/// With a package of its own profile in the default build, plain `cargo build` would fail or, worse,
/// abort on panic everywhere; with the Python package in it, it would need an interpreter.
#[test]
fn only_the_freestanding_program_and_the_python_package_stay_out_of_the_default_build() {
    let metadata = metadata();
    let ids = |list: &str| -> BTreeSet<String> {
        let ids = metadata[list].as_array().expect("package ids").iter();
        ids.map(ToString::to_string).collect()
    };
    let left_out: Vec<String> = ids("workspace_members")
        .difference(&ids("workspace_default_members"))
        .cloned()
        .collect();
    assert!(
        matches!(&left_out[..], [bare, python]
            if bare.contains("/supple-bare#") && python.contains("/python#supple-python")),
        "{left_out:?}"
    );
}

#[test]
fn every_crate_takes_the_lints_of_the_workspace() {
    let metadata = metadata();
    let packages = metadata["packages"].as_array().expect("packages").iter();
    for package in packages.filter(|p| p["name"] != "supple-workspace") {
        let path = package["manifest_path"].as_str().expect("a path");
        let manifest = std::fs::read_to_string(path).expect("a manifest");
        assert!(
            manifest.contains("\n[lints]\nworkspace = true\n"),
            "{path} lacks [lints] workspace = true"
        );
    }
}

#[test]
fn core_and_protocol_have_neither_std_nor_unsafe_code() {
    for package in ["supple-core", "supple-puck"] {
        let path = format!("{}/crates/{package}/src/lib.rs", env!("CARGO_MANIFEST_DIR"));
        let source = std::fs::read_to_string(path).expect("the root of the crate");
        for attribute in ["#![no_std]", "#![forbid(unsafe_code)]"] {
            let stated = source.lines().any(|line| line == attribute);
            assert!(stated, "{package} lacks {attribute}");
        }
    }
}

#[test]
fn links_of_the_documents_lead_somewhere() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    for document in ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"] {
        let text = std::fs::read_to_string(root.join(document)).expect("a root document");
        for link in text.split("](").skip(1) {
            let target = link.split(')').next().expect("text before the bracket");
            match target.strip_prefix('#') {
                Some(anchor) => assert!(
                    text.lines()
                        .any(|line| heading_anchor(line).as_deref() == Some(anchor)),
                    "{document} has no heading for #{anchor}"
                ),
                None if target.contains("://") => {}
                None => assert!(root.join(target).exists(), "{document} -> {target}"),
            }
        }
    }
}

/// Anchor that a heading gets: its words in small letters, joined by hyphens.
fn heading_anchor(line: &str) -> Option<String> {
    let words = line.strip_prefix('#')?.trim_start_matches('#').trim();
    let anchor = words.to_lowercase().replace(' ', "-");
    Some(anchor.replace(|c: char| !c.is_alphanumeric() && c != '-', ""))
}
