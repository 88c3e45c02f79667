//! Tests of the end of a run by a full disk, a terminal interrupt and a fault: the arm keeps running as long as possible, the log
//! is preserved, and the exit code shows the cause.

use crate::running::{Up, json, stderr_of, supple, temporary_folder};
use crate::support::programs;
use rustix::process::{Resource, Rlimit, Signal, kill_process_group, prlimit};
use std::fs;
use std::path::Path;
use std::process::Command;
use supple_model::Description;

/// A limit on the file size of `supple up` simulates a full disk for this process only.
#[test]
fn a_full_disk_ends_the_log_but_not_the_run() {
    let start = || Up::start(&["--json", "--plant", "sim", "--log", "run.mcap"]);
    Up::again_after_a_stall(start, fill_the_disk);
}

fn fill_the_disk(up: &mut Up) {
    up.wait_until("control", |status| status["cycle"].as_u64() > Some(1000));
    let part = up.folder.path().join("run.mcap.part");
    let length = fs::metadata(&part).expect("the log").len();
    let limit = Rlimit {
        current: Some(length),
        maximum: Some(length),
    };
    prlimit(Some(up.process()), Resource::Fsize, limit).expect("a limit");
    let then = up.wait_until("a look", |_| true);
    let later = up.wait_until("more cycles", |status| {
        status["cycle"].as_u64() > then["cycle"].as_u64().map(|cycle| cycle + 1000)
    });
    assert_eq!(later["drives"], "active", "{later}");
    let stopped = up.run(&["stop"]);
    assert!(stopped.status.success(), "{}", stderr_of(&stopped));
    let output = up.ended();
    let summary = json(&output);
    for message in [
        &stderr_of(&output),
        summary["incomplete_output"].as_str().expect("why"),
    ] {
        for word in ["the log ends", "run.mcap.part", "File too large"] {
            assert!(message.contains(word), "{word} in {message}");
        }
    }
    assert_eq!(stderr_of(&output).matches("the log ends here").count(), 1);
    // On a slow machine, a fault may also occur.
    let faults = summary["faults"].as_array().expect("a list").len();
    let code = if faults == 0 { 6 } else { 5 };
    assert_eq!(output.status.code(), Some(code), "{}", stderr_of(&output));
    assert!(part.exists() && !up.folder.path().join("run.mcap").exists());
    let recovered = up.run(&["log", "recover", "run.mcap.part"]);
    assert!(recovered.status.success(), "{}", stderr_of(&recovered));
    let left: Vec<_> = fs::read_dir(up.folder.path())
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| {
            path.extension()
                .is_some_and(|end| end == "pid" || end == "sock")
        })
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

/// A terminal interrupts all foreground processes at once.
#[test]
fn an_interrupt_keeps_the_events_of_the_arm() {
    let mut up = Up::start(&["--json", "--plant", "emu", "--log", "run.mcap"]);
    up.wait_until("a controller", |_| true);
    kill_process_group(up.process(), Signal::INT).expect("sent");
    let output = up.ended();
    assert!(
        up.folder.path().join("run.mcap").exists(),
        "{}",
        stderr_of(&output)
    );
    let events = up.run(&["log", "export", "run.mcap", "--channel", "/arm_events"]);
    let text = String::from_utf8_lossy(&events.stdout).into_owned();
    assert!(
        text.contains("Pressed(Idle)"),
        "{text}{}",
        stderr_of(&output)
    );
}

/// Creates the 4-joint arm with a limit that the first millimetres of error exceed.
fn timid_arm(folder: &Path) {
    let arm = Description::asset("wam4").expect("built in");
    let limit = |line: &str| {
        let key = line.split('=').next().unwrap_or_default().trim();
        match key {
            "tracking_error_m" | "start_error_m" => format!("{key} = 0.002\n"),
            _ => format!("{line}\n"),
        }
    };
    let toml: String = arm.toml().lines().map(limit).collect();
    assert!(toml.contains("tracking_error_m = 0.002"));
    fs::write(folder.join("arm.toml"), toml).expect("written");
    fs::write(folder.join("arm.urdf"), arm.urdf()).expect("written");
}

#[test]
fn a_run_that_ends_with_a_fault_is_code_5_with_its_summary() {
    let folder = temporary_folder();
    timid_arm(folder.path());
    let arguments = "up --plant sim --arm ./arm.toml --json --virtual-time --for 8 --log run.mcap";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let output = supple(folder.path(), &arguments).output().expect("it runs");
    assert_eq!(output.status.code(), Some(5), "{}", stderr_of(&output));
    let summary = json(&output);
    let faults = summary["faults"].as_array().expect("a list");
    assert_eq!(faults.len(), 1, "{summary}");
    assert!(summary["incomplete_output"].is_null(), "{summary}");
    assert!(folder.path().join("run.mcap").exists());
}

/// If the emulated arm does not start, only its own error is reported, and no error of its pendant.
#[test]
fn an_emulated_arm_that_does_not_start_is_the_only_failure() {
    let folder = temporary_folder();
    let inject = "encoder-stuck:joint=9,at-s=1";
    let arguments = ["up", "--plant", "emu", "--no-log", "--inject", inject];
    let output = supple(folder.path(), &arguments).output().expect("it runs");
    let text = stderr_of(&output);
    assert_eq!(output.status.code(), Some(10), "{text}");
    assert!(text.contains("supple-emu: error: "), "{text}");
    assert!(!text.contains("no arm events"), "{text}");
}

/// Every program uses the exit codes of `supple --help`.
#[test]
fn the_processes_use_the_documented_exit_codes() {
    let folder = temporary_folder();
    let fifo = folder.path().join("fifo");
    let made = Command::new("mkfifo").arg(&fifo).status();
    assert!(made.expect("mkfifo exists").success());
    let arm = Description::asset("wam4").expect("built in");
    let urdf = arm.urdf().replace("</robot>", "<gazebo/></robot>");
    fs::write(folder.path().join("arm.toml"), arm.toml()).expect("written");
    fs::write(folder.path().join("arm.urdf"), urdf).expect("written");
    let run = |program: &str, arguments: &[&str]| {
        Command::new(programs().join(program))
            .args(arguments)
            .current_dir(folder.path())
            .env("XDG_RUNTIME_DIR", folder.path())
            .env("SUPPLE_PREFIX", "codes")
            .output()
            .expect("it runs")
    };
    for program in ["supple-rt", "supple-sim", "supple-can", "supple-emu"] {
        for (code, arguments, word) in [
            (2, &["--no-such-option"][..], "--no-such-option"),
            (3, &["--arm", "nowhere/arm.toml"], "nowhere/arm.toml"),
            (3, &["--arm", "./fifo"], "a FIFO"),
            (3, &["--arm", "./arm.toml", "--strict"], "<gazebo>"),
            (3, &["--arm", "./arm.urdf", "--tip", "no_link"], "no_link"),
        ] {
            let output = run(program, arguments);
            assert_eq!(output.status.code(), Some(code), "{program} {arguments:?}");
            assert!(stderr_of(&output).contains(word), "{}", stderr_of(&output));
        }
    }
    for program in ["supple-sim", "supple-emu"] {
        let output = run(program, &["--trace", "fifo", "--no-realtime"]);
        assert_eq!(output.status.code(), Some(6), "{}", stderr_of(&output));
        assert!(
            stderr_of(&output).contains("a FIFO"),
            "{}",
            stderr_of(&output)
        );
        let output = run(program, &["--block-m", "1e300"]);
        assert_eq!(output.status.code(), Some(2), "{}", stderr_of(&output));
    }
}
