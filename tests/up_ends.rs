//! How a system ends when its disk is full, when its terminal is interrupted, in a fault: the arm goes on for as
//! long as it can, the log keeps what it has, and the exit code says what was in the way.

mod support;

use rustix::process::{Pid, Resource, Rlimit, Signal, kill_process_group, prlimit};
use serde_json::Value;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use supple_model::Description;
use support::programs;
use tempfile::TempDir;

/// A system in the background, in a process group of its own as a shell gives it.
struct Up {
    place: TempDir,
    child: Option<Child>,
}

impl Up {
    fn start(arguments: &[&str]) -> Up {
        let place = tempfile::tempdir().expect("a folder");
        let owner = fs::Permissions::from_mode(0o700);
        fs::set_permissions(place.path(), owner).expect("changed");
        let child = supple(place.path(), &[&["up", "--json"], arguments].concat())
            .process_group(0)
            .spawn();
        let child = Some(child.expect("it starts"));
        Up { place, child }
    }

    fn ask(&self, arguments: &[&str]) -> Output {
        let output = supple(self.place.path(), arguments).output();
        output.expect("it runs")
    }

    fn process(&self) -> Pid {
        Pid::from_child(self.child.as_ref().expect("running"))
    }

    /// Looks until the status is as it should be; very many looks without it are a failure.
    fn until(&self, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        let mut last = String::new();
        for _ in 0..100 {
            let output = self.ask(&["status", "--json"]);
            if output.status.success() {
                let status = json(&output);
                if is_so(&status) {
                    return status;
                }
                last = status.to_string();
            }
        }
        panic!("{what} did not come about: {last}");
    }

    fn ended(&mut self) -> Output {
        let child = self.child.take().expect("running");
        child.wait_with_output().expect("it ends")
    }
}

impl Drop for Up {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn supple(place: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(programs().join("supple"));
    command
        .args(arguments)
        .current_dir(place)
        .env("XDG_RUNTIME_DIR", place)
        .env("SUPPLE_PREFIX", "ends")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn json(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}{}", words(output)))
}

/// The disk is full for `supple up` alone, by a limit on the length of its files.
#[test]
fn a_full_disk_ends_the_log_and_not_the_arm() {
    let mut up = Up::start(&["--plant", "sim", "--log", "run.mcap"]);
    up.until("control", |status| status["cycle"].as_u64() > Some(1000));
    let part = up.place.path().join("run.mcap.part");
    let length = fs::metadata(&part).expect("the log").len();
    let limit = Rlimit {
        current: Some(length),
        maximum: Some(length),
    };
    prlimit(Some(up.process()), Resource::Fsize, limit).expect("a limit");
    let then = up.until("a look", |_| true);
    let later = up.until("more cycles", |status| {
        status["cycle"].as_u64() > then["cycle"].as_u64().map(|cycle| cycle + 1000)
    });
    assert_eq!(later["drives"], "active", "{later}");
    let stopped = up.ask(&["stop"]);
    assert!(stopped.status.success(), "{}", words(&stopped));
    let output = up.ended();
    let summary = json(&output);
    for said in [&words(&output), summary["cut_short"].as_str().expect("why")] {
        for word in ["the log ends", "run.mcap.part", "File too large"] {
            assert!(said.contains(word), "{word} in {said}");
        }
    }
    assert_eq!(words(&output).matches("the log ends here").count(), 1);
    // On a machine that is late a fault may have come beside it.
    let faults = summary["faults"].as_array().expect("a list").len();
    let code = if faults == 0 { 6 } else { 5 };
    assert_eq!(output.status.code(), Some(code), "{}", words(&output));
    assert!(part.exists() && !up.place.path().join("run.mcap").exists());
    let recovered = up.ask(&["log", "recover", "run.mcap.part"]);
    assert!(recovered.status.success(), "{}", words(&recovered));
    let left: Vec<_> = fs::read_dir(up.place.path())
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| {
            path.extension()
                .is_some_and(|end| end == "pid" || end == "sock")
        })
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

/// The terminal interrupts every process in the foreground at once.
#[test]
fn an_interrupt_keeps_the_events_of_the_arm() {
    let mut up = Up::start(&["--plant", "emu", "--log", "run.mcap"]);
    up.until("a controller", |_| true);
    kill_process_group(up.process(), Signal::INT).expect("sent");
    let output = up.ended();
    assert!(
        up.place.path().join("run.mcap").exists(),
        "{}",
        words(&output)
    );
    let events = up.ask(&["log", "export", "run.mcap", "--channel", "/arm_events"]);
    let text = String::from_utf8_lossy(&events.stdout).into_owned();
    assert!(text.contains("Pressed(Idle)"), "{text}{}", words(&output));
}

/// The 4-joint arm with a limit that the first millimetres of error pass.
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
fn a_run_that_a_fault_ends_is_code_5_with_its_summary() {
    let place = tempfile::tempdir().expect("a folder");
    let owner = fs::Permissions::from_mode(0o700);
    fs::set_permissions(place.path(), owner).expect("changed");
    timid_arm(place.path());
    let arguments = "up --plant sim --arm ./arm.toml --json --virtual-time --for 8 --log run.mcap";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let output = supple(place.path(), &arguments).output().expect("it runs");
    assert_eq!(output.status.code(), Some(5), "{}", words(&output));
    let summary = json(&output);
    let faults = summary["faults"].as_array().expect("a list");
    assert_eq!(faults.len(), 1, "{summary}");
    assert!(summary["cut_short"].is_null(), "{summary}");
    assert!(place.path().join("run.mcap").exists());
}

/// Every program has the codes of `supple --help`.
#[test]
fn the_processes_have_the_codes_of_the_table() {
    let place = tempfile::tempdir().expect("a folder");
    let owner = fs::Permissions::from_mode(0o700);
    fs::set_permissions(place.path(), owner).expect("changed");
    let fifo = place.path().join("fifo");
    let made = Command::new("mkfifo").arg(&fifo).status();
    assert!(made.expect("mkfifo is there").success());
    let arm = Description::asset("wam4").expect("built in");
    let urdf = arm.urdf().replace("</robot>", "<gazebo/></robot>");
    fs::write(place.path().join("arm.toml"), arm.toml()).expect("written");
    fs::write(place.path().join("arm.urdf"), urdf).expect("written");
    let run = |program: &str, arguments: &[&str]| {
        Command::new(programs().join(program))
            .args(arguments)
            .current_dir(place.path())
            .env("XDG_RUNTIME_DIR", place.path())
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
        ] {
            let output = run(program, arguments);
            assert_eq!(output.status.code(), Some(code), "{program} {arguments:?}");
            assert!(words(&output).contains(word), "{}", words(&output));
        }
    }
    for program in ["supple-sim", "supple-emu"] {
        let output = run(program, &["--trace", "fifo", "--no-realtime"]);
        assert_eq!(output.status.code(), Some(6), "{}", words(&output));
        assert!(words(&output).contains("a FIFO"), "{}", words(&output));
        let output = run(program, &["--block-m", "1e300"]);
        assert_eq!(output.status.code(), Some(2), "{}", words(&output));
    }
}
