//! The real program: what it is told wrongly is said with the remedy.

use std::process::{Command, Output};

fn can(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_supple-can"));
    command.args(arguments).output().expect("it runs")
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_wrong_arm_is_code_3() {
    let output = can(&["--arm", "wam9"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(words(&output).contains("wam9"), "{}", words(&output));
}

#[test]
fn a_bus_that_is_none_is_refused_with_what_one_is() {
    let output = can(&["--bus", "usb:1"]);
    assert_eq!(output.status.code(), Some(2));
    let words = words(&output);
    assert!(
        words.contains("can:NAME") && words.contains("unix:FOLDER"),
        "{words}"
    );
}

#[test]
fn a_rate_out_of_range_is_refused() {
    let output = can(&["--rate-hz", "5"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(words(&output).contains("10..=10000"), "{}", words(&output));
}
