//! Tests of complete systems as processes: `supple up` with a simulated arm, and the operator commands.

use crate::running::{Up, json, run, stderr_of, temporary_folder};
use crate::support::programs;
use serde_json::Value;
use std::process::Command;
use tempfile::TempDir;

/// Runs a system twice in virtual time and asserts that the logs are identical and can be replayed. Returns the summary and the
/// folder with the log.
fn in_virtual_time(arguments: &[&str], seconds: &str, cycles: u64) -> (Value, TempDir) {
    let up = |name: &str| {
        let folder = temporary_folder();
        let log = format!("{name}.mcap");
        let how = ["--for", seconds, "--json", "--virtual-time", "--log", &log];
        let output = run(folder.path(), &[&["up"], arguments, &how[..]].concat());
        assert!(output.status.success(), "{}", stderr_of(&output));
        let summary = json(&output);
        let counted = summary["cycles"].as_u64();
        // At the end, the drives of an arm on a bus are set to idle, which takes some cycles.
        let idle_cycles = if arguments.contains(&"emu") { 20 } else { 0 };
        assert!(
            counted.is_some_and(|n| (cycles..=cycles + idle_cycles).contains(&n)),
            "{summary}"
        );
        for counter in ["missed", "late", "tx_lost", "telemetry_lost"] {
            assert_eq!(summary[counter], 0, "{counter} in {summary}");
        }
        assert_eq!(summary["faults"], Value::Array(Vec::new()));
        let replayed = run(folder.path(), &["log", "replay", &log]);
        assert!(replayed.status.success(), "{}", stderr_of(&replayed));
        let bytes = std::fs::read(folder.path().join(&log)).expect("the log");
        (summary, bytes, folder)
    };
    let (summary, one, folder) = up("one");
    let (_, two, _folder) = up("two");
    assert!(one.len() > 100_000);
    assert!(one == two, "two runs wrote different logs");
    (summary, folder)
}

fn rms_error_m(summary: &Value) -> f64 {
    let error_m = summary["rms_error_m"].as_f64();
    error_m.unwrap_or_else(|| panic!("counter was tracked: {summary}"))
}

#[test]
fn two_runs_in_virtual_time_give_identical_logs_that_replay() {
    let (summary, _folder) = in_virtual_time(&["--plant", "sim"], "6", 6000);
    assert!(rms_error_m(&summary) < 0.02, "{summary}");
    assert_eq!(summary["bus_load"], 0.0);
}

/// Runs all processes from power-up through activation on the pendant to tracking.
#[test]
fn the_emulated_arm_starts_up_is_activated_and_tracks() {
    let (summary, folder) = in_virtual_time(&["--plant", "emu"], "7", 7000);
    assert!(rms_error_m(&summary) < 0.02, "{summary}");
    let bus_load = summary["bus_load"].as_f64().expect("a fraction");
    assert!((0.45..0.64).contains(&bus_load), "{bus_load}");
    let events = ["log", "export", "one.mcap", "--channel", "/arm_events"];
    let output = run(folder.path(), &events);
    let events = String::from_utf8_lossy(&output.stdout).into_owned();
    let at = |what: &str| {
        let found = events.find(what);
        found.unwrap_or_else(|| panic!("{what}: {events}{}", stderr_of(&output)))
    };
    assert!(at("Pressed(Idle)") < at("Pressed(Activate)"));
    assert!(at("Pressed(Activate)") < at("motor 1 Torque"));
}

/// A run that ends before the trajectory ends well and says which part it left out.
#[test]
fn a_run_shorter_than_its_start_ends_well_and_says_so() {
    for (plant, seconds, name) in [
        ("sim", "0.05", "approach"),
        ("sim", "1", "trajectory"),
        ("emu", "1", "trajectory"),
        ("emu --arm yam", "1", "trajectory"),
    ] {
        let folder = temporary_folder();
        let how = format!("up --plant {plant} --virtual-time --for {seconds} --no-log");
        let arguments: Vec<&str> = how.split(' ').collect();
        let output = run(folder.path(), &arguments);
        let said = stderr_of(&output);
        assert_eq!(output.status.code(), Some(0), "{said}");
        let expected = format!(
            "the run ends after {:.2} s, before the {name}",
            seconds.parse::<f64>().expect("a number")
        );
        assert!(said.contains(&expected), "{said}");
    }
}

/// Seven joints run at 1 kHz on shared memory, and on the bus at its maximum rate; a higher rate is an error.
#[test]
fn seven_joints_run_as_processes() {
    let seven = ["--arm", "wam7"];
    let of = |plant: &'static str, rest: &[&'static str]| {
        [&["--plant", plant], &seven[..], rest].concat()
    };
    let (summary, _folder) = in_virtual_time(&of("sim", &[]), "6", 6000);
    assert!(rms_error_m(&summary) < 0.02, "{summary}");
    let (summary, _folder) = in_virtual_time(&of("emu", &["--rate-hz", "700"]), "8", 5600);
    assert!(rms_error_m(&summary) < 0.02, "{summary}");

    let folder = temporary_folder();
    let too_fast = ["--virtual-time", "--for", "1", "--no-log"];
    let output = run(
        folder.path(),
        &[&["up"], &of("emu", &too_fast)[..]].concat(),
    );
    assert_eq!(output.status.code(), Some(10));
    for part in ["positions 660 us", "1335 us", "749 Hz", "--rate-hz"] {
        assert!(
            stderr_of(&output).contains(part),
            "{part}: {}",
            stderr_of(&output)
        );
    }
}

#[test]
fn a_running_system_executes_or_refuses_requests() {
    Up::while_tracking(&["--plant", "sim", "--json"], execute_or_refuse_requests);
}

fn execute_or_refuse_requests(up: &mut Up) {
    let output = up.run(&[
        "gains",
        "--stiffness",
        "25",
        "--damping",
        "3,3,4",
        "--ramp",
        "0.1",
        "--json",
    ]);
    assert!(output.status.success(), "{}", stderr_of(&output));
    assert_eq!(json(&output)["accepted"], true);
    up.wait_until("other gains", |status| {
        status["stiffness_n_per_m"] == serde_json::json!([25.0, 25.0, 25.0])
            && status["damping_n_s_per_m"] == serde_json::json!([3.0, 3.0, 4.0])
    });

    let refused = up.run(&["gains", "--stiffness", "5000", "--json"]);
    assert_eq!(refused.status.code(), Some(11));
    let message = json(&refused)["error"]["message"].to_string();
    assert!(message.contains("stiffness_n_per_m is 5000"), "{message}");

    let refused = up.run(&["reset"]);
    assert_eq!(
        refused.status.code(),
        Some(11),
        "there is no fault to reset"
    );

    for (mode, drives) in [
        ("gravity-hold", "active"),
        ("idle", "idle"),
        ("gravity-hold", "active"),
    ] {
        let output = up.run(&["mode", mode]);
        assert!(output.status.success(), "{}", stderr_of(&output));
        let name = mode.replace('-', "_");
        up.wait_until(mode, |status| {
            status["mode"] == name && status["drives"] == drives
        });
    }
    let second = up.run(&["up", "--plant", "sim", "--no-log"]);
    assert_eq!(second.status.code(), Some(10), "{}", stderr_of(&second));

    let output = up.run(&["track", "arc"]);
    assert!(output.status.success(), "{}", stderr_of(&output));
    up.wait_until("the arc", |status| status["mode"] == "track");

    let output = up.run(&["stop", "--json"]);
    assert!(output.status.success(), "{}", stderr_of(&output));
    assert_eq!(json(&output)["ended"], true, "it waits for the end");
    let output = up.ended();
    assert!(output.status.success(), "{}", stderr_of(&output));
    let replayed = up.run(&["log", "replay", "out/up.mcap"]);
    assert!(replayed.status.success(), "{}", stderr_of(&replayed));
}

/// A run without `--log` keeps the log of the run before it under another name; one with `--log` replaces its file.
#[test]
fn a_second_run_keeps_the_log_of_the_first() {
    let folder = temporary_folder();
    let up = |more: &[&str]| {
        let short = ["up", "--plant", "sim", "--virtual-time", "--for", "0.2"];
        let output = run(folder.path(), &[&short[..], more].concat());
        assert!(output.status.success(), "{}", stderr_of(&output));
    };
    let read = |name: &str| std::fs::read(folder.path().join(name)).expect("a log");
    up(&[]);
    let first = read("out/up.mcap");
    up(&["--arm", "wam7"]);
    assert!(read("out/up.previous.mcap") == first);
    up(&["--log", "out/up.mcap"]);
    assert!(read("out/up.mcap") == first, "the first run again");
    assert!(read("out/up.previous.mcap") == first);
}

/// Expected: starts that fail before the first cycle, however many, replace no log.
#[test]
fn starts_that_fail_keep_both_logs() {
    let folder = temporary_folder();
    let up = |plant: &str| {
        let words = ["up", "--virtual-time", "--for", "0.2"].into_iter();
        let words: Vec<&str> = words.chain(plant.split(' ')).collect();
        run(folder.path(), &words)
    };
    for _ in 0..2 {
        let output = up("--plant sim");
        assert!(output.status.success(), "{}", stderr_of(&output));
    }
    let read = |name: &str| std::fs::read(folder.path().join(name)).expect("a log");
    let names = ["out/up.mcap", "out/up.previous.mcap"];
    let before = names.map(read);
    for _ in 0..2 {
        let failed = up("--plant emu --arm yam --misbehave silent:motor=2");
        assert_eq!(failed.status.code(), Some(10), "{}", stderr_of(&failed));
    }
    assert!(names.map(read) == before);
}

#[test]
fn without_a_system_every_command_is_code_10() {
    let folder = temporary_folder();
    for command in [
        &["status"][..],
        &["mode", "idle"],
        &["reset"],
        &["stop"],
        &["gains", "--stiffness", "5"],
    ] {
        let output = run(folder.path(), command);
        assert_eq!(
            output.status.code(),
            Some(10),
            "{command:?}: {}",
            stderr_of(&output)
        );
        assert!(
            stderr_of(&output).contains("supple up"),
            "{}",
            stderr_of(&output)
        );
    }
}

#[test]
fn the_error_of_a_missing_program_contains_its_build_command() {
    let folder = temporary_folder();
    let alone = folder.path().join("alone");
    std::fs::create_dir(&alone).expect("a folder");
    let alone = alone.join("supple");
    std::fs::copy(programs().join("supple"), &alone).expect("copied");
    for (arguments, missing) in [
        (&["up", "--plant", "sim", "--no-log"][..], "supple-rt"),
        (&["demo"], "supple-report"),
    ] {
        let output = Command::new(&alone)
            .args(arguments)
            .current_dir(folder.path())
            .env("XDG_RUNTIME_DIR", folder.path())
            .output()
            .expect("it runs");
        assert_eq!(output.status.code(), Some(10));
        let remedy = format!("cargo build --release -p {missing}`");
        let message = stderr_of(&output);
        assert!(message.contains(&remedy), "{message}");
    }
}

/// Exit code, messages and results are those of `supple-report`.
#[test]
fn supple_demo_runs_supple_report() {
    let folder = temporary_folder();
    let output = Command::new(programs().join("supple"))
        .args(["demo", "--arm", "wam5", "--json"])
        .current_dir(folder.path())
        .output()
        .expect("it runs");
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr_of(&output).contains("wam5"));
    let object: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(object["error"]["kind"], "description");
}

/// Without a terminal, each change of mode or drives is reported on a line.
#[test]
fn a_piped_run_reports_each_change_on_a_line() {
    let folder = temporary_folder();
    let how = ["up", "--plant", "sim", "--virtual-time", "--for", "6"];
    let output = run(folder.path(), &how);
    let text = stderr_of(&output);
    let at = |what: &str| {
        let found = text.find(what);
        found.unwrap_or_else(|| panic!("{what}: {text}"))
    };
    assert!(at("s: gravity_hold, drives active") < at("s: move, drives active"));
    assert!(at("s: move, drives active") < at("s: track, drives active"));
    assert!(!text.contains("Shift-Activate"), "{text}");
}

/// After an emergency stop, the messages describe how to continue, and these steps work. Without power, the arm falls and loses its
/// position reference: it is no longer in the home pose of the start, so the operator must confirm the home pose.
#[test]
fn after_an_emergency_stop_the_operator_must_confirm_the_home_pose() {
    let up = Up::tracking(&["--plant", "emu"]);
    let press = |arguments: &[&str]| {
        let output = up.run(arguments);
        assert!(output.status.success(), "{}", stderr_of(&output));
    };
    press(&["pendant", "e-stop"]);
    up.wait_until("no power", |status| status["drives"] == "off");
    let back = |up: &Up| {
        for button in ["release", "idle", "cradle"] {
            press(&["pendant", button]);
        }
        // The motors wake up first; the command waits for the request of the arm.
        up.run(&["at-home"])
    };
    // Without a terminal, the pose cannot be confirmed.
    let text = stderr_of(&back(&up));
    assert!(text.contains("was not confirmed"), "{text}");
    // The power is lost again: the request is removed.
    press(&["pendant", "e-stop"]);
    let text = stderr_of(&up.run(&["at-home", "--yes"]));
    assert!(text.contains("no arm asks for its home pose"), "{text}");
    let text = stderr_of(&back(&up));
    assert!(text.contains("was not confirmed"), "{text}");
    press(&["at-home", "--yes"]);
    up.wait_until("power", |status| status["drives"] == "idle");
    press(&["reset"]);
    press(&["mode", "gravity-hold"]);
    press(&["pendant", "activate"]);
    up.wait_until("torque", |status| status["drives"] == "active");
    press(&["track", "sinusoid"]);
    up.wait_until("tracking", |status| status["mode"] == "track");
    let text = stderr_of(&up.end());
    assert!(text.contains("emergency stop"), "{text}");
    assert!(
        text.contains("supple pendant cradle`, `supple at-home`"),
        "{text}"
    );
    assert!(text.contains("has lost its position reference"), "{text}");
}
