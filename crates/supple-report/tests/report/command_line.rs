//! Tests of the command line: commands and errors.

use crate::support::{assert_one_clear_line, run};

#[test]
fn help_lists_the_commands_that_need_no_running_system() {
    let help = run(&["--help"]);
    assert_eq!(help.code, Some(0));
    let listed: Vec<&str> = help
        .stdout
        .lines()
        .filter_map(|line| line.strip_prefix("  ")?.split_whitespace().next())
        .collect();
    for command in [
        "demo",
        "identify",
        "excite",
        "breakaway",
        "calibrate",
        "learn",
        "log",
        "arms",
    ] {
        assert!(listed.contains(&command), "{command} in {}", help.stdout);
    }
    for command in ["up", "status", "drill"] {
        assert!(!listed.contains(&command), "{command} in {}", help.stdout);
        assert_eq!(run(&[command]).code, Some(2));
    }
}

#[test]
fn an_unknown_arm_is_code_3_and_the_arms_are_listed() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let answer = run(&["demo", "--arm", "wam5", "--out", crate::support::arg(&out)]);
    assert_eq!(answer.code, Some(3));
    assert_one_clear_line(
        &answer,
        &[
            "wam5", "paper3", "wam3", "wam4", "wam7", "openarm", "yam", "TOML",
        ],
    );
    assert!(answer.stdout.is_empty());
    assert!(
        crate::support::tree(folder.path()).is_empty(),
        "no file is left"
    );
}

#[test]
fn with_json_an_error_is_an_object_on_standard_output() {
    let answer = run(&["demo", "--arm", "wam5", "--json"]);
    assert_eq!(answer.code, Some(3));
    let object: serde_json::Value = serde_json::from_str(&answer.stdout).expect("JSON");
    let error = &object["error"];
    assert_eq!(error["kind"], "description");
    assert_eq!(error["exit_code"], 3);
    assert!(error["message"].as_str().expect("text").contains("wam5"));
    assert_one_clear_line(&answer, &["wam5"]);
}
