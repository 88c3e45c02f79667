//! The real program: what it is told wrongly is said with the remedy.

use std::process::{Command, Output};

fn emu(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_supple-emu"));
    command.args(arguments).output().expect("it runs")
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_wrong_arm_is_code_3() {
    let output = emu(&["--arm", "wam9"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(words(&output).contains("wam9"), "{}", words(&output));
}

#[test]
fn a_button_that_is_none_is_named_with_those_that_are() {
    for wrong in [
        "fire@1",
        "idle",
        "idle@soon",
        "activate@held+-1",
        "idle@inf",
    ] {
        let output = emu(&["--press", wrong]);
        assert_eq!(output.status.code(), Some(2), "{wrong}");
        let words = words(&output);
        assert!(words.contains(wrong) && words.contains("e-stop"), "{words}");
    }
}

#[test]
fn an_injection_that_cannot_be_is_code_2() {
    for (wrong, remedy) in [
        ("encoder-stick", "encoder-stuck"),
        ("encoder-nan", "reply-lost:every=1"),
    ] {
        let output = emu(&["--inject", wrong]);
        assert_eq!(output.status.code(), Some(2), "{wrong}");
        let words = words(&output);
        assert!(words.contains(remedy), "{words}");
    }
}

#[test]
fn a_can_interface_has_no_virtual_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = Command::new(env!("CARGO_BIN_EXE_supple-emu"))
        .args(["--bus", "can:vcan0", "--virtual-time"])
        .env("XDG_RUNTIME_DIR", folder.path())
        .output()
        .expect("it runs");
    assert_eq!(output.status.code(), Some(2), "{}", words(&output));
    assert!(words(&output).contains("unix:FOLDER"), "{}", words(&output));
}
