//! Tests of arms without brakes as processes: the motors are enabled, the arm tracks, and is laid down before the motors are
//! disabled.

use crate::running::{Up, json, run, stderr_of, temporary_folder};
use core::time::Duration;
use rustix::process::{Signal, kill_process};
use std::path::Path;
use supple_realtime::pause;

/// Maximum number of cycles for laying the arm down.
const LAID_DOWN_CYCLES: u64 = 6000;

/// Time in which a declaration, before the shutdown, has arrived.
const DECLARED: Duration = Duration::from_millis(100);
/// Time for which an arm that nobody supports must be held at the end.
const HELD: Duration = Duration::from_secs(4);

/// A YAM in virtual time, in which a busy machine does not disable the motors.
const IN_VIRTUAL_TIME: [&str; 8] = [
    "--plant",
    "emu",
    "--arm",
    "yam",
    "--virtual-time",
    "--for",
    "3600",
    "--no-log",
];

/// Reads the numbers of a column of a trace.
fn column(trace: &Path, name: &str) -> Vec<f64> {
    let text = std::fs::read_to_string(trace).expect("a trace");
    let mut lines = text.lines();
    let mut head = lines.next().expect("a head").split(',');
    let at = head.position(|column| column == name).expect("the column");
    let values = lines.filter_map(|line| line.split(',').nth(at)?.parse().ok());
    values.collect()
}

/// Asserts that the arm was laid down: the reports list the stages in order, and the arm lies when its motors are disabled.
fn assert_laid_down(stderr: &str, trace: &Path) {
    let mut from = 0;
    for stage in [
        "supple-can: active",
        "holding the arm: ",
        "laying the arm down: ",
        "disabling the motors: ",
        "s: disabled",
    ] {
        let found = stderr[from..].find(stage);
        from += found.unwrap_or_else(|| panic!("{stage}: {stderr}"));
    }
    let enabled = column(trace, "motors_in_torque_mode");
    assert!(enabled.contains(&6.0));
    assert_eq!(enabled.last(), Some(&0.0));
    let speed = column(trace, "joint_speed_rad_per_s");
    let fastest = |rows: &[f64]| rows.iter().copied().fold(0.0, f64::max);
    // No joint moves fast at any time, and no joint moves when the motors are disabled.
    assert!(fastest(&speed) < 0.8, "{} rad/s", fastest(&speed));
    let disabled = enabled.iter().rposition(|motors| *motors > 0.0);
    let at_rest = &speed[disabled.expect("enabled")..];
    assert!(fastest(at_rest) < 0.05, "{} rad/s", fastest(at_rest));
}

/// Two runs give the same log, which replays; the arm tracks and is laid down at the end.
#[test]
fn an_arm_without_brakes_tracks_and_is_laid_down_at_the_end_of_its_run() {
    let up = |name: &str| {
        let folder = temporary_folder();
        let (log, trace) = (format!("{name}.mcap"), format!("{name}.csv"));
        let output = run(
            folder.path(),
            &[
                "up",
                "--plant",
                "emu",
                "--arm",
                "yam",
                "--virtual-time",
                "--for",
                "10",
                "--json",
                "--log",
                &log,
                "--trace",
                &trace,
            ],
        );
        let stderr = stderr_of(&output);
        assert_eq!(output.status.code(), Some(0), "{stderr}");
        let summary = json(&output);
        for counter in ["missed", "late", "tx_lost", "telemetry_lost"] {
            assert_eq!(summary[counter], 0, "{counter} in {summary}");
        }
        assert_eq!(summary["faults"], serde_json::json!([]));
        let cycles = summary["cycles"].as_u64().expect("a number");
        assert!(
            (4000..4000 + LAID_DOWN_CYCLES).contains(&cycles),
            "{summary}"
        );
        let rms_m = summary["rms_error_m"].as_f64().expect("it tracked");
        assert!(rms_m < 0.02, "{summary}");
        assert_laid_down(&stderr, &folder.path().join(trace));
        let replayed = run(folder.path(), &["log", "replay", &log]);
        assert!(replayed.status.success(), "{}", stderr_of(&replayed));
        std::fs::read(folder.path().join(log)).expect("the log")
    };
    assert!(up("one") == up("two"), "two runs wrote different logs");
}

#[test]
fn a_signal_in_motion_lays_the_arm_down_before_its_motors_are_disabled() {
    let mut up = Up::start(&[&IN_VIRTUAL_TIME[..], &["--trace", "trace.csv", "--json"]].concat());
    up.wait_until("tracking", |status| {
        status["mode"] == "track" && status["mode_time_s"].as_f64() > Some(2.0)
    });
    kill_process(up.process(), Signal::TERM).expect("it runs");
    let output = up.ended();
    let stderr = stderr_of(&output);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    assert_eq!(json(&output)["faults"], serde_json::json!([]));
    assert_laid_down(&stderr, &up.folder.path().join("trace.csv"));
}

/// Gravity hold does not end the laying down, and its error explains this; afterwards the arm can be enabled again.
#[test]
fn gravity_hold_is_refused_while_the_arm_is_laid_down() {
    let up = Up::start(&IN_VIRTUAL_TIME);
    up.wait_until("tracking", |status| status["mode"] == "track");
    let idle = up.run(&["mode", "idle"]);
    assert!(idle.status.success(), "{}", stderr_of(&idle));
    up.wait_until("held", |status| status["drives"] == "held");
    let refused = up.run(&["mode", "gravity-hold"]);
    let words = stderr_of(&refused);
    assert_eq!(refused.status.code(), Some(11), "{words}");
    for part in ["laid down", "drives idle", "`supple mode idle`"] {
        assert!(words.contains(part), "{part}: {words}");
    }
    up.wait_until("a lying arm", |status| status["drives"] == "idle");
    for mode in ["idle", "gravity-hold"] {
        let output = up.run(&["mode", mode]);
        assert!(output.status.success(), "{}", stderr_of(&output));
    }
    up.wait_until("active drives", |status| status["drives"] == "active");
}

/// Writes a YAM whose motors wait 0.4 s for a command instead of 20 ms, so that a busy machine does not disable them; returns the
/// path of its description.
fn patient_yam(folder: &Path) -> String {
    let asset = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/yam");
    std::fs::copy(asset.join("arm.urdf"), folder.join("arm.urdf")).expect("it is written");
    let text = std::fs::read_to_string(asset.join("arm.toml")).expect("it is read");
    let patient = text.replace("watchdog_s = 0.02", "watchdog_s = 0.4");
    assert_ne!(patient, text);
    let path = folder.join("arm.toml");
    std::fs::write(&path, patient).expect("it is written");
    path.into_os_string().into_string().expect("UTF-8")
}

/// Expected: after the signal the arm is held, with its motors enabled, until `supple stop --supported`; then the system ends. A
/// declaration before the shutdown is forgotten.
#[test]
fn an_arm_is_held_at_the_end_until_it_is_supported() {
    let folder = temporary_folder();
    let arm = patient_yam(folder.path());
    let arguments = [
        "--plant",
        "emu",
        "--arm",
        &arm,
        "--no-log",
        "--no-realtime",
        "--hold-until-supported",
        "--json",
    ];
    Up::again_after_a_stall(|| Up::start(&arguments), is_held_until_supported);
}

fn is_held_until_supported(up: &mut Up) {
    up.wait_until("active drives", |status| status["drives"] == "active");
    kill_process(up.child("supple-can"), Signal::USR1).expect("it runs");
    pause(DECLARED);
    let status = up.wait_until("a status", |_| true);
    assert_eq!(status["drives"], "active", "{status}");
    let stopped = up.run(&["stop", "--json"]);
    assert!(stopped.status.success(), "{}", stderr_of(&stopped));
    assert_eq!(json(&stopped)["ended"], false, "it is held");
    let words = stderr_of(&stopped);
    assert!(words.contains("supple stop --supported"), "{words}");
    pause(HELD);
    let supported = up.run(&["stop", "--supported"]);
    assert!(supported.status.success(), "{}", stderr_of(&supported));
    let output = up.ended();
    let stderr = stderr_of(&output);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    // Another thread writes this line.
    assert!(stderr.contains("holding the arm: "), "{stderr}");
    let mut from = 0;
    for stage in [
        "the arm is held: support it, then run `supple stop --supported`",
        "the arm is supported: its torque fades",
        "disabling the motors: ",
        "s: disabled",
    ] {
        let found = stderr[from..].find(stage);
        from += found.unwrap_or_else(|| panic!("{stage}: {stderr}"));
    }
    assert!(!stderr.contains("laying the arm down"), "{stderr}");
}

/// An arm whose motors brake cannot be held at the end.
#[test]
fn an_arm_with_brakes_is_not_held_at_the_end() {
    let folder = temporary_folder();
    let output = run(
        folder.path(),
        &["up", "--plant", "emu", "--hold-until-supported"],
    );
    let words = stderr_of(&output);
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(words.contains("--hold-until-supported"), "{words}");
}
