//! Checks the dependencies between crates against ARCHITECTURE.md.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
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

/// Dependencies of a crate on crates of the workspace: always, and of its tests alone.
type Arrows = [BTreeSet<String>; 2];

/// Arrows of every crate, from its manifest.
fn arrows() -> BTreeMap<String, Arrows> {
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

/// Arrows of every crate, from the table in ARCHITECTURE.md.
fn documented_arrows() -> BTreeMap<String, Arrows> {
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
    let (documented, real) = (documented_arrows(), arrows());
    let names = |map: &BTreeMap<String, Arrows>| map.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&documented), names(&real), "crates");
    for (package, arrows) in real {
        assert_eq!(documented[&package], arrows, "{package}: documented, real");
    }
}

/// Files of a crate by their module paths, such as `controller::step`; `mod.rs` and `lib.rs` are their folder's.
fn modules(source: &Path) -> BTreeMap<String, String> {
    let mut modules = BTreeMap::new();
    let mut open = vec![(source.to_owned(), Vec::<String>::new())];
    while let Some((folder, path)) = open.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let entry = entry.expect("an entry").path();
            let stem = entry
                .file_stem()
                .expect("a name")
                .to_string_lossy()
                .into_owned();
            let inner = |name: String| path.iter().cloned().chain([name]).collect::<Vec<_>>();
            if entry.is_dir() {
                open.push((entry, inner(stem)));
            } else if entry.extension().is_some_and(|end| end == "rs") {
                let own = match stem.as_str() {
                    "mod" | "lib" | "main" => path.clone(),
                    _ => inner(stem),
                };
                let text = std::fs::read_to_string(&entry).expect("readable");
                modules
                    .entry(own.join("::"))
                    .or_insert_with(String::new)
                    .push_str(&text);
            }
        }
    }
    modules
}

/// Modules that a file imports from by `use crate::..` or `use super::..`; a parent that re-exports its children does not
/// import them so.
fn imports(module: &str, text: &str, known: &BTreeMap<String, String>) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut text = format!("\n{text}");
    for visible in ["pub", "pub(crate)", "pub(super)"] {
        text = text.replace(&format!("\n{visible} use "), "\nuse ");
    }
    for statement in text.split("\nuse ").skip(1) {
        let statement = statement.split(';').next().unwrap_or_default();
        let (head, list) = statement.split_once('{').unwrap_or((statement, ""));
        let mut head: Vec<&str> = head
            .trim()
            .split("::")
            .filter(|part| !part.is_empty())
            .collect();
        let mut base: Vec<&str> = Vec::new();
        match head.first() {
            Some(&"crate") => {}
            Some(&"super") => {
                base = module.split("::").collect();
                base.pop();
                while head.get(1) == Some(&"super") {
                    base.pop();
                    head.remove(1);
                }
            }
            _ => continue,
        }
        head.remove(0);
        let names = list.split([',', '{', '}']).map(str::trim).map(|name| {
            let path = name.split(" as ").next().unwrap_or_default();
            path.split("::").collect::<Vec<_>>()
        });
        for name in names.chain([Vec::new()]) {
            let path = [&base[..], &head[..], &name[..]].concat();
            let whole = (0..=path.len()).rev().map(|end| path[..end].join("::"));
            let whole = whole.map(|path| path.trim_end_matches(':').to_owned());
            if let Some(target) = whole.into_iter().find(|path| known.contains_key(path)) {
                found.insert(target);
            }
        }
    }
    found.remove(module);
    found
}

/// Layers of supple-core, as ARCHITECTURE.md lists them, from the lowest to the highest.
const LAYERS: [&str; 8] = [
    "math",
    "model",
    "record",
    "config",
    "dynamics",
    "trajectory",
    "law",
    "controller",
];

#[test]
fn layers_of_the_core_import_only_from_lower_ones() {
    let known = modules(&Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/supple-core/src"));
    let layer = |module: &str| {
        let folder = module.split("::").next().unwrap_or_default();
        LAYERS.iter().position(|name| *name == folder)
    };
    for (module, text) in known.iter().filter(|(module, _)| !module.is_empty()) {
        let own = layer(module).unwrap_or_else(|| panic!("{module} is in no layer"));
        for imported in imports(module, text, &known) {
            let other = layer(&imported);
            assert!(
                imported.is_empty() || other <= Some(own),
                "{module} imports {imported}"
            );
        }
    }
}

#[test]
fn no_two_files_import_each_other() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates");
    let mut pairs = Vec::new();
    for folder in std::fs::read_dir(crates).expect("crates").flatten() {
        let known = modules(&folder.path().join("src"));
        let all: BTreeMap<&String, BTreeSet<String>> = known
            .iter()
            .map(|(module, text)| (module, imports(module, text, &known)))
            .collect();
        for (module, imported) in &all {
            for other in imported {
                if other > *module && all[other].contains(*module) {
                    pairs.push(format!("{}: {module} <-> {other}", folder.path().display()));
                }
            }
        }
    }
    assert!(pairs.is_empty(), "{pairs:#?}");
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

/// Dependencies of a crate on other projects, its own and those of the crates of the workspace that it needs.
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
fn the_operator_links_no_plotter_and_the_reports_no_running_system() {
    let (operator, report) = (
        foreign_dependencies("supple"),
        foreign_dependencies("supple-report"),
    );
    for (crates, drawing, system) in [(&operator, false, true), (&report, true, false)] {
        for name in ["plotters", "resvg", "askama"] {
            assert_eq!(crates.contains(name), drawing, "{name}");
        }
        for name in ["iceoryx2", "socketcan", "supple-bus", "supple-ipc"] {
            assert_eq!(crates.contains(name), system, "{name}");
        }
    }
}

/// If the default build contained the freestanding program, plain `cargo build` would fail or, worse, abort on panic
/// everywhere; if it contained the Python package, it would need an interpreter.
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
fn core_and_protocol_have_neither_std_nor_unsafe_code() {
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

/// Anchor of a heading: its words in lower case, joined by hyphens.
fn heading_anchor(line: &str) -> Option<String> {
    let words = line.strip_prefix('#')?.trim_start_matches('#').trim();
    let anchor = words.to_lowercase().replace(' ', "-");
    Some(anchor.replace(|c: char| !c.is_alphanumeric() && c != '-', ""))
}
