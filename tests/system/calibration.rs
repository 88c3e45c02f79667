//! `supple calibrate --plant`: from an arm to its model, on processes.

use crate::running::{json, run, stderr_of, supple, temporary_folder};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::path::Path;

/// Arguments of a short calibration on the emulated arm in lockstep.
const EMULATED: [&str; 12] = [
    "calibrate",
    "--plant",
    "emu",
    "--virtual-time",
    "--realistic",
    "--start-error",
    "0.15,0.5",
    "--candidates",
    "60",
    "--warm-up",
    "0",
    "--yes",
];

fn progress(folder: &Path) -> Value {
    let text = std::fs::read_to_string(folder.join("out/calibrate/calibration.json"));
    serde_json::from_str(&text.expect("written")).expect("JSON")
}

/// Names of the finished steps.
fn steps(progress: &Value) -> Vec<String> {
    let steps = progress["finished"].as_array().expect("a list");
    let name = |step: &Value| step["step"].as_str().expect("a name").to_owned();
    steps.iter().map(name).collect()
}

/// The emulated arm is interrupted in the middle of a motion: every log is whole. It is resumed to the end: nothing that
/// is finished is repeated, and the saved model explains the torques better than the one that it started from.
#[test]
fn an_emulated_arm_is_calibrated_across_an_interrupt() {
    let folder = temporary_folder();
    let mut interrupted = supple(folder.path(), &EMULATED).spawn().expect("it starts");
    let log = folder.path().join("out/calibrate/logs/full-pass.mcap");
    while !std::fs::metadata(&log).is_ok_and(|file| file.len() > 100_000) {
        let ended = interrupted.try_wait().expect("a child");
        assert!(ended.is_none(), "it ended before the full pass: {ended:?}");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    kill_process(Pid::from_child(&interrupted), Signal::INT).expect("it runs");
    let output = interrupted.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(130), "{}", stderr_of(&output));
    assert!(
        stderr_of(&output).contains("--resume"),
        "{}",
        stderr_of(&output)
    );
    let replayed = run(
        folder.path(),
        &["log", "replay", "out/calibrate/logs/full-pass.mcap"],
    );
    assert!(replayed.status.success(), "{}", stderr_of(&replayed));
    let before = steps(&progress(folder.path()));
    assert_eq!(
        before.last().map(String::as_str),
        Some("first_fit"),
        "{before:?}"
    );

    let resumed = run(
        folder.path(),
        &[&EMULATED[..], &["--resume", "--json"]].concat(),
    );
    assert!(resumed.status.success(), "{}", stderr_of(&resumed));
    assert!(
        !stderr_of(&resumed).contains("breakaway torque"),
        "{}",
        stderr_of(&resumed)
    );
    let found = json(&resumed);
    let all = steps(&found);
    assert_eq!(all.len(), 13, "{all:?}");
    assert_eq!(all[..before.len()], before);
    let fit = &found["fit"];
    let unexplained = |key: &str| fit[key].as_f64().expect("a fraction");
    assert!(
        unexplained("unseen_relative") < unexplained("unseen_relative_before"),
        "{fit}"
    );
    assert!(unexplained("unseen_relative") < 0.1, "{fit}");
    let moved_s = found["moved_s"].as_f64().expect("a time");
    assert!(moved_s < 400.0, "{moved_s} s of motion");
    assert!(folder.path().join("out/calibrate/arm.toml").exists());
    let svg = std::fs::read_to_string(folder.path().join("out/calibrate/sweep.svg"));
    assert!(svg.expect("drawn").contains("from the side"));
}

/// A motor that turns the other way is named before anything moves far, with the remedy.
#[test]
fn a_reversed_motor_is_named() {
    let folder = temporary_folder();
    let wrong = ["--inject", "torque-sign:joint=0", "--warm-up", "0"];
    let arguments = [&EMULATED[..4], &["--candidates", "60", "--yes"], &wrong].concat();
    let output = run(folder.path(), &arguments);
    // The controller notices before the ramp has ended.
    assert_eq!(output.status.code(), Some(5), "{}", stderr_of(&output));
    let text = stderr_of(&output);
    for part in [
        "torque ramp on joint 0 (joint1)",
        "check the signs",
        "--resume",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

/// Without a terminal and without --yes nothing sweeps the space; the drawing is there to be looked at.
#[test]
fn the_swept_space_must_be_confirmed() {
    let folder = temporary_folder();
    let arguments = ["calibrate", "--plant", "in-process", "--candidates", "60"];
    let output = run(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(4), "{}", stderr_of(&output));
    for part in ["minutes of motion", "sweep.svg", "--yes"] {
        assert!(
            stderr_of(&output).contains(part),
            "{part}: {}",
            stderr_of(&output)
        );
    }
    assert_eq!(steps(&progress(folder.path())), ["wiring"]);
}
