//! Runs `supple up` in the background in a temporary folder and collects its output.

use crate::support::programs;
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process, waitid};
use serde_json::Value;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use tempfile::TempDir;

/// Number of attempts to start a system that tracks, of which one must succeed.
const STARTS: u32 = 4;
/// Number of cycles after which the drives of a starting system have been activated.
const SETTLED_CYCLES: u64 = 2000;

/// Every test has its own folder for sockets and shared memory, so all systems can use the same prefix.
pub const PREFIX: &str = "test";

/// Creates a folder that only the owner can access, as a system requires.
pub fn temporary_folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let owner = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(folder.path(), owner).expect("changed");
    folder
}

pub fn supple(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(programs().join("supple"));
    command
        .args(arguments)
        .current_dir(folder)
        .env("XDG_RUNTIME_DIR", folder)
        .env("SUPPLE_PREFIX", PREFIX)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

pub fn run(folder: &Path, arguments: &[&str]) -> Output {
    supple(folder, arguments).output().expect("it runs")
}

pub fn json(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text)
        .unwrap_or_else(|error| panic!("{error}: {text}{}", stderr_of(output)))
}

pub fn stderr_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A system in the background, in its own process group as in a shell.
pub struct Up {
    pub folder: TempDir,
    child: Option<Child>,
    /// What it has written on standard error; empty until it has ended.
    written: String,
}

impl Up {
    /// Starts `supple up` with these arguments.
    pub fn start(arguments: &[&str]) -> Up {
        let folder = temporary_folder();
        let child = supple(folder.path(), &[&["up"], arguments].concat())
            .process_group(0)
            .spawn();
        let child = Some(child.expect("it starts"));
        let written = String::new();
        Up {
            folder,
            child,
            written,
        }
    }

    /// Starts a system as [`Up::start`] does, and waits until it tracks. If a busy machine stalls a process, so that the drives become
    /// idle or a fault latches, starts the system again, at most [`STARTS`] times.
    pub fn tracking(arguments: &[&str]) -> Up {
        let mut last = String::new();
        for _ in 0..STARTS {
            let up = Up::start(arguments);
            let status = up.wait_until("tracking or a stall", |status| {
                let settled = status["cycle"].as_u64() > Some(SETTLED_CYCLES);
                let lost = settled && status["drives"] == "idle";
                status["mode"] == "track" || status["mode"] == "fault" || lost
            });
            if status["mode"] == "track" {
                return up;
            }
            last = format!("{status}: {}", stderr_of(&up.end()));
        }
        panic!("the system did not track: {last}");
    }

    /// Runs a scenario with a system that tracks at its beginning, as [`Up::again_after_a_stall`] does.
    pub fn while_tracking(arguments: &[&str], scenario: impl Fn(&mut Up)) {
        Up::again_after_a_stall(|| Up::tracking(arguments), scenario);
    }

    /// Runs a scenario. If a stall of the machine makes the drives idle or latches a fault, so that the scenario panics, runs it again
    /// with a new system, at most [`STARTS`] times.
    pub fn again_after_a_stall(start: impl Fn() -> Up, scenario: impl Fn(&mut Up)) {
        for later in (0..STARTS).rev() {
            let mut up = start();
            let Err(panic) = catch_unwind(AssertUnwindSafe(|| scenario(&mut up))) else {
                return;
            };
            if later == 0 || !up.has_stalled() {
                resume_unwind(panic);
            }
            eprintln!("the machine stalled: the scenario begins again after this failure");
        }
    }

    /// Whether answers were missed, and the drives are idle while the controller is active, or a fault is latched that missed answers
    /// cause: this is so after a stall of the machine.
    fn has_stalled(&self) -> bool {
        let late = ["no new arm state", "no encoder reply"];
        if self.child.is_none() {
            let faults = late.map(|words| format!("fault: {words}"));
            return faults.iter().any(|fault| self.written.contains(fault));
        }
        let output = self.run(&["status", "--json"]);
        let status: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
        let missed = status["missed"].as_u64().unwrap_or(0);
        let lost = status["drives"] == "idle" && status["mode"] == "gravity_hold";
        let fault = status["fault"].as_str().unwrap_or_default();
        (lost || late.iter().any(|words| fault.contains(words))) && missed > 0
    }

    pub fn run(&self, arguments: &[&str]) -> Output {
        run(self.folder.path(), arguments)
    }

    /// PID of `supple up`.
    pub fn process(&self) -> Pid {
        Pid::from_child(self.child.as_ref().expect("running"))
    }

    /// PID of the child process of this name.
    pub fn child(&self, name: &str) -> Pid {
        let up = self.child.as_ref().expect("it runs").id();
        let children = std::fs::read_to_string(format!("/proc/{up}/task/{up}/children"));
        let children = children.expect("readable");
        let of_name = |pid: &&str| {
            std::fs::read_to_string(format!("/proc/{pid}/comm"))
                .is_ok_and(|comm| comm.trim() == name)
        };
        let pid = children.split_whitespace().find(of_name).expect("it runs");
        Pid::from_raw(pid.parse().expect("a number")).expect("not zero")
    }

    /// Whether `supple up` has ended.
    fn has_ended(&self) -> bool {
        let how = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        waitid(WaitId::Pid(self.process()), how).is_ok_and(|status| status.is_some())
    }

    /// Polls the status until the condition holds; fails after many polls, or if the system has ended.
    pub fn wait_until(&self, what: &str, condition: impl Fn(&Value) -> bool) -> Value {
        let mut last = String::new();
        for _ in 0..400 {
            let output = self.run(&["status", "--json"]);
            // With a latched fault, the status is also printed, with exit code 5.
            if matches!(output.status.code(), Some(0 | 5)) {
                let status = json(&output);
                if condition(&status) {
                    return status;
                }
                last = status.to_string();
            } else if self.has_ended() {
                panic!("{what} was not reached, the system has ended: {last}");
            }
        }
        panic!("{what} was not reached: {last}");
    }

    /// Waits until `supple up` exits by itself; returns its output.
    pub fn ended(&mut self) -> Output {
        let child = self.child.take().expect("running");
        let output = child.wait_with_output().expect("it ends");
        self.written = stderr_of(&output);
        output
    }

    /// Terminates `supple up`; returns its output.
    pub fn end(mut self) -> Output {
        kill_process(self.process(), Signal::TERM).expect("it runs");
        self.ended()
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
