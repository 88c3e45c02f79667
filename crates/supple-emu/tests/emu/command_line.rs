//! Tests of the program `supple-emu`: it reports invalid arguments with a remedy.

use std::process::{Command, Output};

fn emu(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_supple-emu"));
    command.args(arguments).output().expect("it runs")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn an_unknown_arm_exits_with_code_3() {
    let output = emu(&["--arm", "wam9"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains("wam9"), "{}", stderr(&output));
}

#[test]
fn an_unknown_button_is_rejected_with_the_valid_names() {
    for wrong in [
        "fire@1",
        "idle",
        "idle@soon",
        "activate@held+-1",
        "idle@inf",
    ] {
        let output = emu(&["--press", wrong]);
        assert_eq!(output.status.code(), Some(2), "{wrong}");
        let stderr = stderr(&output);
        assert!(
            stderr.contains(wrong) && stderr.contains("e-stop"),
            "{stderr}"
        );
    }
}

#[test]
fn an_invalid_injection_exits_with_code_2() {
    for (wrong, remedy) in [
        ("encoder-stick", "encoder-stuck"),
        ("encoder-nan", "reply-lost:every=1"),
    ] {
        let output = emu(&["--inject", wrong]);
        assert_eq!(output.status.code(), Some(2), "{wrong}");
        let stderr = stderr(&output);
        assert!(stderr.contains(remedy), "{stderr}");
    }
}

#[test]
fn a_can_interface_with_virtual_time_is_rejected() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = Command::new(env!("CARGO_BIN_EXE_supple-emu"))
        .args(["--bus", "can:vcan0", "--virtual-time"])
        .env("XDG_RUNTIME_DIR", folder.path())
        .output()
        .expect("it runs");
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("unix:FOLDER"),
        "{}",
        stderr(&output)
    );
}
