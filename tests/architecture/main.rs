//! Checks the dependencies between crates, and between the files of each, against ARCHITECTURE.md.

mod imports;

use imports::{Modules, python_imports};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

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

/// Dependencies of a crate on crates of the workspace: of the crate, and only of its tests.
type Dependencies = [BTreeSet<String>; 2];

/// Dependencies of every crate, from its manifest.
fn dependencies() -> BTreeMap<String, Dependencies> {
    let metadata = metadata();
    let packages = metadata["packages"].as_array().expect("packages");
    let name = |value: &serde_json::Value| value["name"].as_str().unwrap_or_default().to_owned();
    let ours: BTreeSet<String> = packages.iter().map(name).collect();
    let of = |package: &serde_json::Value| {
        let dependencies = package["dependencies"].as_array().expect("dependencies");
        let of_kind = |dev: bool| -> BTreeSet<String> {
            let kind = |d: &&serde_json::Value| (d["kind"] == "dev") == dev;
            let names = dependencies.iter().filter(kind).map(name);
            names.filter(|d| ours.contains(d)).collect()
        };
        let (always, tests) = (of_kind(false), of_kind(true));
        let tests = tests.difference(&always).cloned().collect();
        (name(package), [always, tests])
    };
    let packages = packages.iter().filter(|p| name(p) != "supple-workspace");
    packages.map(of).collect()
}

/// Dependencies of every crate, from the table in ARCHITECTURE.md.
fn documented_dependencies() -> BTreeMap<String, Dependencies> {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/ARCHITECTURE.md"));
    let text = text.expect("a document");
    let names = |list: &str| {
        let names = list.split(',').map(str::trim);
        let names = names.filter(|name| !name.is_empty() && *name != "nothing");
        names.map(|name| format!("supple-{name}")).collect()
    };
    let row = |line: &str| {
        let mut cells = line.strip_prefix("| `supple")?.split('|').map(str::trim);
        let name = format!("supple{}", cells.next()?.strip_suffix('`')?);
        let depends_on = cells.nth(1)?;
        let (always, tests) = depends_on
            .split_once("; tests:")
            .unwrap_or((depends_on, ""));
        Some((name, [names(always), names(tests)]))
    };
    let table = text
        .lines()
        .skip_while(|line| !line.starts_with("| crate |"));
    let table = table.take_while(|line| line.starts_with('|'));
    table.filter_map(row).collect()
}

#[test]
fn documented_dependencies_are_the_real_ones() {
    let (documented, real) = (documented_dependencies(), dependencies());
    let names = |map: &BTreeMap<String, Dependencies>| map.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&documented), names(&real), "crates");
    for (package, dependencies) in real {
        assert_eq!(
            documented[&package], dependencies,
            "{package}: documented, real"
        );
    }
}

/// Layers of supple-core, as ARCHITECTURE.md lists them, from the lowest to the highest.
const LAYERS: [&str; 9] = [
    "math",
    "model",
    "record",
    "config",
    "dynamics",
    "trajectory",
    "law",
    "controller",
    "sizes",
];

/// Returns the root files of all targets of the workspace, except build scripts.
fn targets() -> Vec<PathBuf> {
    let metadata = metadata();
    let packages = metadata["packages"].as_array().expect("packages").iter();
    let targets = packages.flat_map(|package| package["targets"].as_array().expect("targets"));
    let path =
        |target: &serde_json::Value| PathBuf::from(target["src_path"].as_str().expect("a path"));
    let mut targets: Vec<PathBuf> = targets.map(path).collect();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let programs = std::fs::read_dir(root.join("tests/fuzz/libfuzzer/fuzz_targets"));
    let programs = programs.into_iter().flatten().flatten();
    targets.extend(programs.map(|entry| entry.path()));
    targets
}

#[test]
fn layers_of_the_core_import_only_from_lower_ones() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/supple-core/src");
    let layer = |file: &Path| {
        let inner = file.strip_prefix(&source).ok()?;
        let name = inner.components().next()?.as_os_str().to_str()?;
        let name = name.trim_end_matches(".rs");
        LAYERS.iter().position(|layer| *layer == name)
    };
    let mut edges = 0;
    for (file, imported) in Modules::read(&source.join("lib.rs")).imports() {
        if file == source.join("lib.rs") || !file.starts_with(&source) {
            continue;
        }
        let own = layer(&file).unwrap_or_else(|| panic!("{} is in no layer", file.display()));
        for other in imported.iter().filter(|other| other.starts_with(&source)) {
            let of_other = layer(other);
            let lower = of_other.is_some_and(|other| other <= own);
            assert!(lower, "{} imports {}", file.display(), other.display());
            edges += usize::from(of_other < Some(own));
        }
    }
    assert!(edges > 100, "{edges} imports of lower layers");
}

#[test]
fn no_two_files_import_each_other() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut pairs = BTreeSet::new();
    let rust = targets()
        .into_iter()
        .map(|root| Modules::read(&root).imports());
    for imports in rust.chain([python_imports(&root.join("python/package/supple"))]) {
        for (file, imported) in &imports {
            for other in imported.iter().filter(|other| *other > file) {
                if imports.get(other).is_some_and(|back| back.contains(file)) {
                    pairs.insert(format!("{} <-> {}", file.display(), other.display()));
                }
            }
        }
    }
    assert!(pairs.is_empty(), "{}: {pairs:#?}", pairs.len());
}

#[test]
fn core_depends_only_on_mathematical_crates() {
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

/// Returns the dependencies of a crate on other projects, including those through crates of the workspace.
fn foreign_dependencies(of: &str) -> BTreeSet<String> {
    let metadata = metadata();
    let packages = metadata["packages"].as_array().expect("packages");
    let (mut open, mut found) = (vec![of.to_owned()], BTreeSet::new());
    while let Some(name) = open.pop() {
        let Some(package) = packages.iter().find(|p| p["name"] == *name) else {
            continue;
        };
        let dependencies = package["dependencies"].as_array().expect("dependencies");
        let normal = dependencies.iter().filter(|d| d["kind"].is_null());
        for name in normal.filter_map(|d| d["name"].as_str()) {
            if found.insert(name.to_owned()) {
                open.push(name.to_owned());
            }
        }
    }
    found
}

#[test]
fn supple_links_no_plotting_library_and_supple_report_no_shared_memory_or_bus() {
    let (operator, report) = (
        foreign_dependencies("supple"),
        foreign_dependencies("supple-report"),
    );
    for (crates, drawing, system) in [(&operator, false, true), (&report, true, false)] {
        for name in ["plotters", "resvg", "ttf-parser", "dejavu", "askama"] {
            assert_eq!(crates.contains(name), drawing, "{name}");
        }
        for name in ["iceoryx2", "socketcan", "supple-bus", "supple-ipc"] {
            assert_eq!(crates.contains(name), system, "{name}");
        }
    }
}

/// With the freestanding program in the default build, `cargo build` would fail, or compile all crates to abort on panic. With
/// the Python package, it would need an interpreter. With the bridge to ROS 2, it would compile Zenoh for everybody.
#[test]
fn the_default_build_excludes_the_freestanding_program_the_python_package_and_the_bridge_to_ros() {
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
        matches!(&left_out[..], [bare, ros, python]
            if bare.contains("/supple-bare#")
                && ros.contains("/supple-ros#")
                && python.contains("/python#supple-python")),
        "{left_out:?}"
    );
}

#[test]
fn every_crate_uses_the_workspace_lints() {
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
fn core_and_protocol_crates_use_no_std_and_no_unsafe_code() {
    for package in [
        "supple-core",
        "supple-can-frame",
        "supple-damiao",
        "supple-puck",
    ] {
        let path = format!("{}/crates/{package}/src/lib.rs", env!("CARGO_MANIFEST_DIR"));
        let source = std::fs::read_to_string(path).expect("the root of the crate");
        for attribute in ["#![no_std]", "#![forbid(unsafe_code)]"] {
            let stated = source.lines().any(|line| line == attribute);
            assert!(stated, "{package} lacks {attribute}");
        }
    }
}

#[test]
fn links_in_the_documents_have_targets() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let documents = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"].map(|name| root.join(name));
    let pages = std::fs::read_dir(root.join("docs")).expect("a folder");
    let pages = pages.map(|page| page.expect("an entry").path());
    let pages = pages.filter(|path| path.extension().is_some_and(|end| end == "md"));
    for path in documents.into_iter().chain(pages) {
        let (document, folder) = (path.display(), path.parent().expect("a folder"));
        let text = std::fs::read_to_string(&path).expect("a document");
        for link in text.split("](").skip(1) {
            let target = link.split(')').next().expect("text before the bracket");
            if target.contains("://") {
                continue;
            }
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let linked = match file {
                "" => path.clone(),
                file => folder.join(file),
            };
            assert!(linked.exists(), "{document} -> {target}");
            if !anchor.is_empty() {
                let text = std::fs::read_to_string(&linked).expect("a document");
                let mut anchors = text.lines().filter_map(heading_anchor);
                assert!(
                    anchors.any(|heading| heading == anchor),
                    "{document}: {} has no heading for #{anchor}",
                    linked.display()
                );
            }
        }
    }
}

/// Returns the anchor of a heading: its words in lower case, joined by hyphens.
fn heading_anchor(line: &str) -> Option<String> {
    let words = line.strip_prefix('#')?.trim_start_matches('#').trim();
    let anchor = words.to_lowercase().replace(' ', "-");
    Some(anchor.replace(|c: char| !c.is_alphanumeric() && c != '-', ""))
}
