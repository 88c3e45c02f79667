//! Runs the program `supple-can`: it reports invalid arguments with a remedy.

use std::process::{Command, Output};

fn can(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_supple-can"));
    command.args(arguments).output().expect("it runs")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn an_unknown_arm_exits_with_code_3() {
    let output = can(&["--arm", "wam9"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains("wam9"), "{}", stderr(&output));
}

#[test]
fn an_invalid_bus_is_rejected_with_the_valid_forms() {
    let output = can(&["--bus", "usb:1"]);
    assert_eq!(output.status.code(), Some(2));
    let stderr = stderr(&output);
    assert!(
        stderr.contains("can:NAME") && stderr.contains("unix:FOLDER"),
        "{stderr}"
    );
}

#[test]
fn a_rate_out_of_range_is_rejected() {
    let output = can(&["--rate-hz", "5"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("10..=10000"),
        "{}",
        stderr(&output)
    );
}
