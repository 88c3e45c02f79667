//! Tests of an emulated arm whose processes share a standard error that is not read, full or closed: `supple up`, `supple-can`,
//! `supple-emu` and `supple-rt` all write to it. The arm tracks, and idle acts within 20 cycles of the request.

use crate::running::{PREFIX, supple, temporary_folder};
use core::time::Duration;
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::process::{Pid, Signal, kill_process};
use std::io::{PipeReader, PipeWriter, Write, pipe};
use std::os::unix::process::CommandExt;
use std::process::{Child, Stdio};
use supple_core::controller::{Mode, Request};
use supple_ipc::message::{Drives, Outcome, Telemetry};
use supple_ipc::{Domain, OperatorClient, TelemetryReader, request_idle};
use tempfile::TempDir;

/// Maximum number of cycles until idle is accepted, at 1 kHz.
const IDLE_WITHIN_CYCLES: u64 = 20;
/// Number of attempts: a blocked process fails all of them, a busy machine does not.
const ATTEMPTS: u32 = 5;
const TIMEOUT: Duration = Duration::from_secs(30);

/// A system in the background whose standard error is not read.
struct UnreadSystem {
    child: Child,
    domain: Domain,
    reader: TelemetryReader,
    _folder: TempDir,
}

impl UnreadSystem {
    fn start(stderr: &PipeWriter) -> UnreadSystem {
        let folder = temporary_folder();
        let domain = Domain::in_folder(&folder.path().join("supple"), PREFIX).expect("a domain");
        let reader = TelemetryReader::new(&domain).expect("a reader");
        let up = ["up", "--plant", "emu", "--no-log", "--no-realtime"];
        let child = supple(folder.path(), &up)
            .stdout(Stdio::null())
            .stderr(stderr.try_clone().expect("a copy"))
            .process_group(0)
            .spawn();
        UnreadSystem {
            child: child.expect("it starts"),
            domain,
            reader,
            _folder: folder,
        }
    }

    /// Waits for telemetry for which the condition holds; `None` if the system ends or is in a fault before.
    fn until(&mut self, condition: impl Fn(&Telemetry) -> bool) -> Option<Telemetry> {
        for _ in 0..60_000 {
            let telemetry = self.reader.wait(TIMEOUT).expect("read")?;
            if condition(&telemetry) {
                return Some(telemetry);
            }
            if telemetry.record().fault != 0 {
                return None;
            }
        }
        None
    }

    /// Returns the newest cycle.
    fn now(&mut self) -> Option<u64> {
        let mut cycle = self.reader.wait(TIMEOUT).expect("read")?.state.cycle;
        while let Some(telemetry) = self.reader.receive().expect("read") {
            cycle = telemetry.state.cycle;
        }
        Some(cycle)
    }

    /// Requests idle; returns the number of cycles until it acts. The drives then become idle.
    fn idle(&mut self) -> Option<u64> {
        let asked = self.now()?;
        let answer = request_idle(&self.domain, TIMEOUT)
            .expect("requested")
            .expect("an answer");
        assert_eq!(answer.outcome, Outcome::Accepted);
        self.until(|telemetry| telemetry.state.drives() == Drives::Idle)?;
        Some(answer.cycle - asked)
    }

    fn end(mut self) -> Option<i32> {
        let pid = Pid::from_child(&self.child);
        kill_process(pid, Signal::TERM).expect("it runs");
        self.child.wait().expect("it ends").code()
    }
}

fn check(stderr: &PipeWriter) {
    let mut quickest = u64::MAX;
    for _ in 0..ATTEMPTS {
        let mut up = UnreadSystem::start(stderr);
        let tracks = |telemetry: &Telemetry| {
            telemetry.record().mode() == Some(Mode::Track)
                && telemetry.state.drives() == Drives::Active
        };
        let acted = up.until(tracks).and_then(|_| up.idle());
        if let Some(cycles) = acted {
            quickest = quickest.min(cycles);
            // The controller also answers the operator again.
            let mut operator = OperatorClient::new(&up.domain).expect("an operator");
            let sent = operator.send::<4>(&Request::GravityHold, None);
            assert!(sent.expect("sent").is_some());
            let held = |t: &Telemetry| t.record().mode() == Some(Mode::GravityHold);
            assert!(up.until(held).is_some());
            drop(operator);
            assert_eq!(up.end(), Some(0));
        } else {
            up.end();
        }
        if quickest <= IDLE_WITHIN_CYCLES {
            return;
        }
    }
    panic!("idle acted after {quickest} cycles, which is too late");
}

/// Creates a full pipe.
fn full() -> (PipeReader, PipeWriter) {
    let (reader, mut writer) = pipe().expect("a pipe");
    let flags = fcntl_getfl(&writer).expect("flags");
    fcntl_setfl(&writer, flags | OFlags::NONBLOCK).expect("set");
    while writer.write(&[b'.'; 4096]).is_ok() {}
    while writer.write(b".").is_ok() {}
    fcntl_setfl(&writer, flags).expect("set");
    (reader, writer)
}

#[test]
fn idle_acts_while_standard_error_is_full() {
    let (_reader, writer) = full();
    check(&writer);
}

#[test]
fn idle_acts_while_standard_error_is_closed() {
    let (reader, writer) = pipe().expect("a pipe");
    drop(reader);
    check(&writer);
}
