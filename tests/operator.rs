//! Whole systems by the real programs, with everything taken that others can take: the operator is heard, and one who
//! comes second is refused in order.

mod support;

use core::time::Duration;
use rustix::fs::{FlockOperation, flock};
use rustix::process::{Pid, Signal, kill_process};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use supple_core::controller::{Mode, Request};
use supple_ipc::message::Outcome;
use supple_ipc::{Domain, Operator, TelemetryReader, ask_for_idle};
use support::programs;
use tempfile::TempDir;

const PREFIX: &str = "heard";
/// Cycles in which idle is to be heard, at 1 kHz.
const HEARD_WITHIN: u64 = 20;
/// Whoever is held up is so each time; a machine that is busy is not.
const ATTEMPTS: u32 = 5;
const SOON: Duration = Duration::from_secs(30);

fn place() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let owner = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(folder.path(), owner).expect("changed");
    folder
}

fn supple(place: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(programs().join("supple"));
    command
        .args(arguments)
        .current_dir(place)
        .env("XDG_RUNTIME_DIR", place)
        .env("SUPPLE_PREFIX", PREFIX)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// `supple up` in the background.
struct Up {
    place: TempDir,
    child: Option<Child>,
    domain: Domain,
}

impl Up {
    fn start() -> Up {
        let place = place();
        let domain = Domain::within(&place.path().join("supple"), PREFIX).expect("a domain");
        let child = supple(place.path(), &["up", "--plant", "sim", "--no-log"]).spawn();
        Up {
            child: Some(child.expect("it starts")),
            domain,
            place,
        }
    }

    fn ask(&self, arguments: &[&str]) -> Output {
        supple(self.place.path(), arguments)
            .output()
            .expect("it runs")
    }

    /// The process of `supple up` that goes by this name.
    fn process(&self, name: &str) -> Pid {
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

    fn end(mut self) -> Output {
        let child = self.child.take().expect("it runs");
        let up = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
        kill_process(up.expect("a number"), Signal::TERM).expect("it runs");
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

/// Reads until the controller is in a mode; the cycle.
fn until(reader: &mut TelemetryReader, mode: Mode) -> u64 {
    for _ in 0..60_000 {
        let Some(telemetry) = reader.wait(SOON).expect("read") else {
            break;
        };
        if telemetry.mode() == Some(mode) {
            return telemetry.state.cycle;
        }
        assert_eq!(telemetry.fault, 0, "{}", telemetry.fault_text);
    }
    panic!("mode {} did not come", mode.name());
}

/// The newest cycle.
fn now(reader: &mut TelemetryReader) -> u64 {
    let mut cycle = reader.wait(SOON).expect("read").expect("some").state.cycle;
    while let Some(telemetry) = reader.receive().expect("read") {
        cycle = telemetry.state.cycle;
    }
    cycle
}

#[test]
fn idle_passes_readers_operators_requests_and_a_lock_that_others_hold() {
    let up = Up::start();
    let mut reader = TelemetryReader::new(&up.domain).expect("a reader");
    until(&mut reader, Mode::Track);
    // Clients that hang, each in a place that it will not give back; requests that fill the queue.
    let readers: Vec<_> = (0..20)
        .map_while(|_| TelemetryReader::new(&up.domain).ok())
        .collect();
    let mut operators: Vec<_> = (0..20)
        .map_while(|_| Operator::new(&up.domain).ok())
        .collect();
    assert!(readers.len() < 20 && operators.len() < 20);
    let busy = &mut operators[0];
    for _ in 0..16 {
        busy.send::<4>(&Request::GravityHold, Some(u64::MAX))
            .expect("sent");
    }
    let refused = up.ask(&["status"]);
    assert_eq!(refused.status.code(), Some(10), "all places are taken");
    let holder = std::process::id().to_string();
    assert!(words(&refused).contains(&holder), "{}", words(&refused));
    // A process that is stopped while it joins.
    let lock = up.domain.folder().join(format!("{PREFIX}.turn.lock"));
    let lock = std::fs::File::open(lock).expect("a lock");
    flock(&lock, FlockOperation::LockExclusive).expect("locked");

    let mut quickest = u64::MAX;
    for _ in 0..ATTEMPTS {
        let asked = now(&mut reader);
        let answer = ask_for_idle(&up.domain, SOON)
            .expect("asked")
            .expect("an answer");
        assert_eq!(
            (answer.outcome, answer.mode),
            (Outcome::Accepted, Some(Mode::Idle))
        );
        quickest = quickest.min(answer.cycle - asked);
        until(&mut reader, Mode::Idle);
        busy.send::<4>(&Request::GravityHold, None)
            .expect("sent")
            .expect("there is room");
        until(&mut reader, Mode::GravityHold);
    }
    assert!(quickest <= HEARD_WITHIN, "{quickest} cycles");
    let output = up.ask(&["mode", "idle"]);
    assert!(output.status.success(), "{}", words(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("mode idle since cycle"));
    until(&mut reader, Mode::Idle);
    flock(&lock, FlockOperation::Unlock).expect("unlocked");
    drop((reader, readers, operators));
    let output = up.end();
    assert!(output.status.success(), "{}", words(&output));
}

#[test]
fn what_ends_in_a_fault_says_so_by_its_exit_code() {
    let up = Up::start();
    let mut reader = TelemetryReader::new(&up.domain).expect("a reader");
    until(&mut reader, Mode::Track);
    // The arm's states stay away: a fault.
    let sim = up.process("supple-sim");
    kill_process(sim, Signal::STOP).expect("it runs");
    until(&mut reader, Mode::Fault);
    kill_process(sim, Signal::CONT).expect("it runs");
    let output = up.ask(&["mode", "idle"]);
    assert_eq!(output.status.code(), Some(5), "{}", words(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("mode fault"));
    assert!(
        words(&output).contains("supple reset"),
        "{}",
        words(&output)
    );
    let output = up.end();
    assert_eq!(output.status.code(), Some(5), "{}", words(&output));
}

#[test]
fn a_controller_that_is_gone_is_noticed() {
    let mut up = Up::start();
    let mut reader = TelemetryReader::new(&up.domain).expect("a reader");
    until(&mut reader, Mode::Track);
    kill_process(up.process("supple-rt"), Signal::KILL).expect("it runs");
    let output = up.child.take().expect("running").wait_with_output();
    let output = output.expect("it ends by itself");
    assert_eq!(output.status.code(), Some(10), "{}", words(&output));
    assert!(
        words(&output).contains("supple-rt has ended"),
        "{}",
        words(&output)
    );
}

#[test]
fn of_several_that_start_at_once_one_runs_and_the_others_say_why_not() {
    let place = place();
    let start = || {
        supple(
            place.path(),
            &["up", "--plant", "sim", "--no-log", "--for", "3"],
        )
        .spawn()
        .expect("it starts")
    };
    let children: Vec<Child> = (0..3).map(|_| start()).collect();
    let outputs: Vec<Output> = children
        .into_iter()
        .map(|child| child.wait_with_output().expect("it ends"))
        .collect();
    let (ran, refused): (Vec<_>, Vec<_>) =
        outputs.iter().partition(|output| output.status.success());
    let all: Vec<String> = outputs.iter().map(words).collect();
    assert_eq!((ran.len(), refused.len()), (1, 2), "{all:?}");
    for output in refused {
        assert_eq!(output.status.code(), Some(10));
        assert!(
            words(output).contains("a system runs already"),
            "{}",
            words(output)
        );
    }
}

/// In a room of its own, whose shared memory is as small as the test likes; `None` where the system does not let
/// anybody have one.
fn with_shared_memory(size: &str, script: &str, place: &Path) -> Option<Output> {
    let mount = format!("mount -t tmpfs -o size={size} tmpfs /dev/shm");
    let in_a_room = |script: &str| {
        Command::new("unshare")
            .args(["-rm", "sh", "-c", script])
            .env("XDG_RUNTIME_DIR", place)
            .env("SUPPLE_PREFIX", PREFIX)
            .env("BIN", programs())
            .output()
    };
    let possible = in_a_room(&mount).is_ok_and(|output| output.status.success());
    if !possible {
        println!("skipped: no mount of its own is to be had");
        return None;
    }
    Some(in_a_room(&format!("{mount}\n{script}")).expect("it runs"))
}

#[test]
fn too_little_shared_memory_is_refused_at_the_start() {
    let place = place();
    let script = "exec \"$BIN/supple-rt\" --virtual-time";
    let Some(output) = with_shared_memory("8m", script, place.path()) else {
        return;
    };
    assert_eq!(output.status.code(), Some(10), "{}", words(&output));
    for part in ["/dev/shm has", "MB are wanted", "size="] {
        assert!(words(&output).contains(part), "{part}: {}", words(&output));
    }
}

/// A system that runs when others fill shared memory to the last page: it goes on, idle is heard, a command that needs
/// memory says so, and all ends in order.
#[test]
fn a_system_goes_on_when_shared_memory_is_full() {
    let place = place();
    let script = r#"
        "$BIN/supple" up --plant sim --no-log --no-realtime >/dev/null 2>up.txt &
        up=$!
        tries=0
        until "$BIN/supple" status >/dev/null 2>&1; do
            tries=$((tries + 1))
            [ $tries -lt 60 ] || { cat up.txt; exit 99; }
        done
        head -c 100M /dev/zero > /dev/shm/fill 2>/dev/null
        "$BIN/supple" mode idle; echo "idle: $?"
        "$BIN/supple" status; echo "status: $?"
        "$BIN/supple" stop; echo "stop: $?"
        wait $up; echo "up: $?"
    "#;
    let script = format!("cd '{}'\n{script}", place.path().display());
    let Some(output) = with_shared_memory("60m", &script, place.path()) else {
        return;
    };
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    for part in [
        "mode idle since cycle",
        "idle: 0",
        "status: 10",
        "stop: 0",
        "up: 0",
    ] {
        assert!(said.contains(part), "{part}: {said}{}", words(&output));
    }
    assert!(
        words(&output).contains("MB are wanted"),
        "{}",
        words(&output)
    );
}
