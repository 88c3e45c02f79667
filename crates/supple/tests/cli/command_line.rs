//! Tests of the command line: help, names, exit codes.

use crate::support::{self, assert_one_clear_line, run};
use supple_plant::PlantOptions;
use supple_plant::options::OPTIONS;

#[test]
fn help_lists_the_commands_and_the_exit_codes() {
    let help = run(&["--help"]);
    assert_eq!(help.code, Some(0));
    for word in [
        "demo",
        "log",
        "arms",
        "plant",
        "effects",
        "completions",
        "Exit codes",
        "a file cannot be read",
    ] {
        assert!(help.stdout.contains(word), "{word} in {}", help.stdout);
    }
    let demo = run(&["demo", "--help"]);
    assert_eq!(demo.code, Some(0));
    for word in [
        "--arm",
        "--out",
        "--seed",
        "--json",
        "--quiet",
        "--no-logs",
        "Exit codes",
    ] {
        assert!(demo.stdout.contains(word), "{word} in {}", demo.stdout);
    }
}

#[test]
fn an_invalid_command_line_exits_with_code_2_and_has_no_effect() {
    for args in [
        &[][..],
        &["dem"],
        &["demo", "--seed", "minus one"],
        &["demo", "--seed", "-1"],
        &["demo", "extra"],
        &["log"],
        &["log", "export", "a.mcap", "--every", "0"],
        &["completions", "no-such-shell"],
    ] {
        let answer = run(args);
        assert_eq!(answer.code, Some(2), "{args:?}: {}", answer.stderr);
        assert!(answer.stdout.is_empty(), "{args:?}: {}", answer.stdout);
    }
}

#[test]
fn the_built_in_arms_are_listed() {
    let answer = run(&["arms"]);
    assert_eq!(answer.code, Some(0));
    for arm in supple_model::assets() {
        assert!(answer.stdout.contains(arm), "{arm} in {}", answer.stdout);
    }
    let json = run(&["arms", "--json"]);
    let arms: serde_json::Value = serde_json::from_str(&json.stdout).expect("JSON");
    let mut joints = std::collections::BTreeMap::new();
    for arm in arms.as_array().expect("a list") {
        let count = arm["joints"].as_array().map_or(0, Vec::len);
        joints.insert(arm["name"].as_str().expect("a name"), count);
    }
    let expected = [
        ("openarm", 7),
        ("paper3", 3),
        ("wam3", 3),
        ("wam4", 4),
        ("wam7", 7),
        ("yam", 6),
    ];
    assert_eq!(joints, expected.into());
}

/// A table becomes a URDF that loads as an arm; an error names file, row, column and value.
#[test]
fn a_denavit_hartenberg_table_becomes_an_arm() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (table, urdf) = (path("table.csv"), path("three.urdf"));
    let text = "a_m,alpha_deg,d_m,theta_rad\n0,90,0.2,0\n0.5,0,0,0\n0.4,0,0,0\n";
    std::fs::write(&table, text).expect("written");
    let of_standard = ["arms", "from-dh", &table, &urdf, "--convention", "standard"];
    let answer = run(&of_standard);
    assert_eq!(answer.code, Some(0), "{}", answer.stderr);
    let name = supple_model::UrdfName::parse(&format!("{urdf}#tool0")).expect("a URDF");
    let arm = supple_model::Description::from_urdf(&name).expect("an arm");
    assert_eq!(arm.dof(), 3);

    let again = run(&of_standard);
    assert_ne!(again.code, Some(0), "an existing file stays");
    std::fs::write(&table, text.replace("0.5", "x")).expect("written");
    let wrong = run(&[&of_standard[..], &["--force"]].concat());
    assert_eq!(wrong.code, Some(3), "{}", wrong.stderr);
    for word in ["table.csv", "row 2", "a_m", "`x`"] {
        assert!(wrong.stderr.contains(word), "{word}: {}", wrong.stderr);
    }
    let without = run(&["arms", "from-dh", &table, &urdf]);
    assert_eq!(without.code, Some(2), "the convention is not guessed");
}

/// A copy can be loaded, equals the arm, and replaces existing files only with --force.
#[test]
fn an_arm_is_copied() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("mine");
    let path = path.to_str().expect("UTF-8");
    let answer = run(&["arms", "copy", "wam7", path]);
    assert_eq!(answer.code, Some(0), "{}", answer.stderr);
    let held = |path: &str| {
        let arm = supple_model::Description::load(path).expect("an arm");
        let roles = arm.config::<7>().expect("seven joints").roles;
        roles
            .iter()
            .filter(|role| **role != supple_core::config::Role::Active)
            .count()
    };
    assert_eq!(held(path), 4);
    let again = run(&["arms", "copy", "wam7", path, "--all-joints-active"]);
    assert_eq!(again.code, Some(6), "{}", again.stderr);
    assert!(again.stderr.contains("--force"), "{}", again.stderr);
    assert_eq!(held(path), 4);
    let forced = [
        "arms",
        "copy",
        "wam7",
        path,
        "--all-joints-active",
        "--force",
    ];
    assert_eq!(run(&forced).code, Some(0));
    assert_eq!(held(path), 0);
}

#[test]
fn plant_options_are_listed_and_a_set_is_shown_as_a_file() {
    let list = run(&["plant", "list"]);
    assert_eq!(list.code, Some(0), "{}", list.stderr);
    let json = run(&["plant", "list", "--json"]);
    let options: serde_json::Value = serde_json::from_str(&json.stdout).expect("JSON");
    for option in OPTIONS {
        assert!(list.stdout.contains(option.name), "{}", option.name);
    }
    assert_eq!(options.as_array().expect("a list").len(), OPTIONS.len());
    let sets = PlantOptions::realistic();
    for ((_, value), line) in sets.values().zip(options.as_array().expect("a list")) {
        assert_eq!(line["sets"]["realistic"].as_f64(), value, "{line}");
        assert!(
            line["sets"].as_object().is_some_and(|sets| sets.len() <= 3),
            "{line}"
        );
    }
    assert!(
        list.stdout.contains("openarm-realistic: "),
        "{}",
        list.stdout
    );
    let shown = run(&["plant", "show", "realistic"]);
    let found = PlantOptions::from_toml(&shown.stdout, "shown").expect("a file of options");
    assert_eq!(found, PlantOptions::realistic());
    let unknown = run(&["plant", "show", "surreal"]);
    assert_eq!(unknown.code, Some(2));
    assert_one_clear_line(&unknown, &["surreal", "realistic"]);
}

#[test]
fn invalid_plant_options_are_rejected_before_anything_starts() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("plant.toml");
    std::fs::write(&file, "base_tilt_rad = 3.5\n").expect("written");
    let file = support::arg(&file);
    let up = ["up", "--no-log", "--for", "1", "--plant"];
    let wrong = run(&[&up[..], &["sim", "--plant-options", file]].concat());
    assert_eq!(wrong.code, Some(3), "{}", wrong.stderr);
    assert_one_clear_line(
        &wrong,
        &["plant.toml", "base_tilt_rad", "3.5", "from 0 to 0.5 rad"],
    );
    let absent = run(&[&up[..], &["emu", "--plant-options", "nowhere.toml"]].concat());
    assert_eq!(absent.code, Some(6), "{}", absent.stderr);
    let real = run(&[&up[..], &["can", "--realistic"]].concat());
    assert_eq!(real.code, Some(2), "{}", real.stderr);
    assert_one_clear_line(&real, &["--plant sim"]);
    let block = run(&[&up[..], &["can", "--block-m", "0.1"]].concat());
    assert_eq!(block.code, Some(2), "{}", block.stderr);
    assert_one_clear_line(&block, &["--block-m", "--plant sim"]);
    for option in [&["--bus", "can:can0"][..], &["--zero-at-home"], &["--tare"]] {
        let no_bus = run(&[&up[..], &["sim"], option].concat());
        assert_eq!(no_bus.code, Some(2), "{}", no_bus.stderr);
        assert_one_clear_line(&no_bus, &[option[0], "--plant emu"]);
    }
    let both = run(&[&up[..], &["sim", "--realistic", "--plant-options", file]].concat());
    assert_eq!(both.code, Some(2), "{}", both.stderr);
}

#[test]
fn completions_name_the_commands() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let answer = run(&["completions", shell]);
        assert_eq!(answer.code, Some(0), "{shell}");
        assert!(answer.stdout.contains("no-logs"), "{shell}");
    }
}

#[test]
fn a_closed_pipe_is_not_an_error() {
    use std::process::Stdio;
    let mut child = support::program(&["completions", "bash"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty());
}

#[test]
fn standard_output_on_a_full_disk_is_code_6() {
    let full = std::fs::File::options()
        .write(true)
        .open("/dev/full")
        .expect("/dev/full");
    let output = support::program(&["arms"])
        .stdout(full)
        .output()
        .expect("it starts");
    let answer = support::Answer::from(output);
    assert_eq!(answer.code, Some(6));
    assert_one_clear_line(&answer, &["standard output", "No space left"]);
}

#[test]
fn the_doctor_lists_every_check_and_its_exit_code_matches() {
    let answer = run(&["doctor", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&answer.stdout).expect("JSON");
    let ready = report["ready"].as_bool().expect("a verdict");
    assert_eq!(answer.code, Some(if ready { 0 } else { 8 }));
    let names: Vec<_> = report["checks"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|check| check["name"].as_str())
        .collect();
    for name in [
        "kernel",
        "priority",
        "memlock",
        "governor",
        "isolation",
        "can",
        "python",
    ] {
        assert!(names.contains(&name), "{name} in {names:?}");
    }
    let text = run(&["doctor"]).stdout;
    for name in names {
        assert!(text.contains(name), "{name} in {text}");
    }
}

/// After the definitions for other readers of the format, a page begins with its title.
#[test]
fn every_manual_page_begins_with_its_title() {
    let folder = tempfile::tempdir().expect("a folder");
    let pages = folder.path().join("man1");
    let answer = run(&["man", support::arg(&pages), "--json"]);
    assert_eq!(answer.code, Some(0), "{}", answer.stderr);
    let written: Vec<std::path::PathBuf> = serde_json::from_str(&answer.stdout).expect("JSON");
    assert_eq!(written.len(), support::tree(&pages).len());
    for name in ["supple.1", "supple-up.1", "supple-log-info.1"] {
        assert!(written.contains(&pages.join(name)), "{name} in {written:?}");
    }
    for page in written {
        let text = std::fs::read_to_string(&page).expect("a page");
        let first = text
            .lines()
            .find(|line| !line.starts_with(".ie") && !line.starts_with(".el"));
        let name = page
            .file_stem()
            .and_then(|name| name.to_str())
            .expect("text");
        let title = format!(".TH {name} 1");
        assert!(
            first.is_some_and(|line| line.starts_with(&title)),
            "{first:?} in {name}"
        );
    }
}
