//! Tests of `supple new`, which creates an arm from a URDF alone.

use crate::support::{Answer, assert_one_clear_line, run_in, tree};
use serde_json::Value;
use std::fs;
use std::path::Path;
use supple_model::Description;

/// Writes the URDF of the 4-joint arm without its TOML. The URDF has masses and limits but no settings of a controller.
fn robot_in(folder: &Path) {
    let built_in = Description::asset("wam4").expect("built in");
    fs::write(folder.join("robot.urdf"), built_in.urdf()).expect("written");
}

fn new_in(folder: &Path, more: &[&str]) -> Answer {
    run_in(folder, &[&["new", "robot.urdf", "--json"], more].concat())
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn a_urdf_gives_an_arm_with_every_derived_setting_and_its_reason() {
    let folder = tempfile::tempdir().expect("a folder");
    robot_in(folder.path());
    let answer = new_in(folder.path(), &[]);
    assert_eq!(answer.code, Some(0), "{}", answer.stderr);
    let arm = folder.path().join("robot");
    assert_eq!(
        tree(&arm),
        ["arm.svg", "arm.toml", "arm.urdf"].map(Path::new)
    );
    let drawing = read(&arm.join("arm.svg"));
    let document = roxmltree::Document::parse(&drawing).expect("XML");
    let texts = document
        .descendants()
        .filter(|node| node.has_tag_name("text"));
    let texts: Vec<&str> = texts.filter_map(|node| node.text()).collect();
    for legend in ["arm and joints at home", "sinusoid", "quadrant"] {
        assert!(texts.contains(&legend), "{legend} in {texts:?}");
    }
    let summary: Value = serde_json::from_str(&answer.stdout).expect("JSON");

    // The text of the TOML contains each setting, and the parsed TOML has each value at the reported key.
    let toml = read(&arm.join("arm.toml"));
    let derived = summary["derived"].as_array().expect("a list");
    assert!(derived.len() > 20, "{derived:?}");
    for setting in derived {
        let text = |name: &str| setting[name].as_str().expect("text");
        let (key, value, why) = (text("key"), text("value"), text("why"));
        let last = key
            .rsplit([' ', '.'])
            .next()
            .expect("a name")
            .trim_matches(['`', '"']);
        let line = toml
            .lines()
            .find(|line| line.contains(last) && line.contains(value));
        assert!(line.is_some(), "{key} = {value} in {toml}");
        assert!(toml.contains(why), "{why} in {toml}");
    }
    // The written TOML is complete: no setting remains to be derived.
    let written = Description::load(&arm).expect("an arm");
    assert!(written.completed().expect("complete").derived.is_empty());

    assert_eq!(summary["fault"], Value::Null);
    let number = |name: &str| summary[name].as_f64().expect("a number");
    assert_eq!(number("run_s"), 5.0);
    let allowed_m = supple_experiment::scenario::allowed_error_m(number("tip_weight_n"));
    assert_eq!(number("allowed_error_m"), allowed_m);
    assert!(
        number("rms_error_m") > 0.0 && number("rms_error_m") < allowed_m,
        "{} of {allowed_m} m",
        number("rms_error_m")
    );
}

#[test]
fn an_existing_arm_is_replaced_only_with_force() {
    let folder = tempfile::tempdir().expect("a folder");
    robot_in(folder.path());
    fs::create_dir(folder.path().join("robot")).expect("a folder");
    let toml = folder.path().join("robot/arm.toml");
    fs::write(&toml, "# mine\n").expect("written");
    let refused = new_in(folder.path(), &[]);
    assert_eq!(refused.code, Some(6), "{}", refused.stderr);
    assert_one_clear_line(&refused, &["robot/arm.toml", "--force"]);
    assert_eq!(read(&toml), "# mine\n");
    let forced = new_in(folder.path(), &["--force"]);
    assert_eq!(forced.code, Some(0), "{}", forced.stderr);
    assert!(read(&toml).contains("written by `supple new` from robot.urdf"));
}

#[test]
fn a_xacro_file_is_rejected_with_the_command_that_expands_it() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("robot.urdf.xacro"), "<robot/>").expect("written");
    let answer = run_in(folder.path(), &["new", "robot.urdf.xacro"]);
    assert_eq!(answer.code, Some(3), "{}", answer.stderr);
    assert_one_clear_line(
        &answer,
        &["xacro robot.urdf.xacro > robot.urdf", "pip install xacro"],
    );
    assert_eq!(tree(folder.path()), [Path::new("robot.urdf.xacro")]);
}

#[test]
fn an_unknown_tip_is_rejected_before_anything_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    robot_in(folder.path());
    let answer = new_in(folder.path(), &["--tip", "no_such_link"]);
    assert_eq!(answer.code, Some(3), "{}", answer.stderr);
    assert_one_clear_line(&answer, &["robot.urdf", "no_such_link"]);
    assert!(!folder.path().join("robot").exists());
}
