//! Tests of complete systems from the operator's side: idle is accepted although clients, files, memory or locks are missing, and
//! the commands report each failure with its exit code and a remedy.

use crate::running::{PREFIX, Up, json, stderr_of, supple, temporary_folder};
use crate::support::programs;
use core::time::Duration;
use rustix::fs::{FlockOperation, flock};
use rustix::process::{Signal, kill_process};
use std::path::Path;
use std::process::{Child, Command, Output};
use supple_core::controller::{Mode, Request};
use supple_ipc::message::Outcome;
use supple_ipc::{Domain, OperatorClient, TelemetryReader, idle_socket, request_idle};
use supple_realtime::pause;

/// Maximum number of cycles until idle is accepted, at 1 kHz.
const IDLE_WITHIN_CYCLES: u64 = 20;
/// Number of attempts, of which the best counts: a real blockage affects all attempts, a busy machine does not.
const ATTEMPTS: u32 = 5;
const TIMEOUT: Duration = Duration::from_secs(30);

/// Starts a simulated arm that tracks; returns the system, its domain and a reader of its telemetry.
fn tracking() -> (Up, Domain, TelemetryReader) {
    let up = Up::tracking(&["--plant", "sim", "--no-log"]);
    let domain = Domain::in_folder(&up.folder.path().join("supple"), PREFIX).expect("a domain");
    let mut reader = TelemetryReader::new(&domain).expect("a reader");
    wait_for_mode(&mut reader, Mode::Track);
    (up, domain, reader)
}

/// Reads telemetry until the controller is in a mode; returns the cycle.
fn wait_for_mode(reader: &mut TelemetryReader, mode: Mode) -> u64 {
    for _ in 0..60_000 {
        let Some(telemetry) = reader.wait(TIMEOUT).expect("read") else {
            break;
        };
        if telemetry.record().mode() == Some(mode) {
            return telemetry.state.cycle;
        }
        assert_eq!(
            telemetry.record().fault,
            0,
            "{}",
            telemetry.record().fault_text
        );
    }
    panic!("the controller did not enter mode {}", mode.name());
}

/// Returns the newest cycle.
fn newest_cycle(reader: &mut TelemetryReader) -> u64 {
    let mut cycle = reader
        .wait(TIMEOUT)
        .expect("read")
        .expect("some")
        .state
        .cycle;
    while let Some(telemetry) = reader.receive().expect("read") {
        cycle = telemetry.state.cycle;
    }
    cycle
}

#[test]
fn idle_is_accepted_while_all_slots_a_queue_quota_and_the_lock_are_taken() {
    let (up, domain, mut reader) = tracking();
    // Clients occupy all slots; one sends more requests for a cycle that never comes than the queue holds of one operator.
    let readers: Vec<_> = (0..20)
        .map_while(|_| TelemetryReader::new(&domain).ok())
        .collect();
    let mut operators: Vec<_> = (0..20)
        .map_while(|_| OperatorClient::new(&domain).ok())
        .collect();
    assert!(readers.len() < 20 && operators.len() < 20);
    let busy = &mut operators[0];
    for _ in 0..16 {
        busy.send::<4>(&Request::GravityHold, Some(u64::MAX))
            .expect("sent");
    }
    let refused = up.run(&["status"]);
    assert_eq!(refused.status.code(), Some(10), "all slots are in use");
    let holder = std::process::id().to_string();
    assert!(
        stderr_of(&refused).contains(&holder),
        "{}",
        stderr_of(&refused)
    );
    // This test holds the membership lock, as a process does that is suspended while it joins.
    let lock = domain.folder().join(format!("{PREFIX}.membership.lock"));
    let lock = std::fs::File::open(lock).expect("a lock");
    flock(&lock, FlockOperation::LockExclusive).expect("locked");

    let mut quickest = u64::MAX;
    for _ in 0..ATTEMPTS {
        let requested_cycle = newest_cycle(&mut reader);
        let answer = request_idle(&domain, TIMEOUT)
            .expect("requested")
            .expect("an answer");
        assert_eq!(
            (answer.outcome, answer.mode),
            (Outcome::Accepted, Some(Mode::Idle))
        );
        quickest = quickest.min(answer.cycle - requested_cycle);
        wait_for_mode(&mut reader, Mode::Idle);
        busy.send::<4>(&Request::GravityHold, None)
            .expect("sent")
            .expect("a controller that receives it");
        wait_for_mode(&mut reader, Mode::GravityHold);
    }
    assert!(quickest <= IDLE_WITHIN_CYCLES, "{quickest} cycles");
    let output = up.run(&["mode", "idle"]);
    assert!(output.status.success(), "{}", stderr_of(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("mode idle since cycle"));
    wait_for_mode(&mut reader, Mode::Idle);
    flock(&lock, FlockOperation::Unlock).expect("unlocked");
    drop((reader, readers, operators));
    let output = up.end();
    assert!(output.status.success(), "{}", stderr_of(&output));
}

#[test]
fn commands_exit_with_code_5_during_a_fault() {
    let (up, _domain, mut reader) = tracking();
    // No arm states arrive, so that the controller enters a fault.
    let sim = up.child("supple-sim");
    kill_process(sim, Signal::STOP).expect("it runs");
    wait_for_mode(&mut reader, Mode::Fault);
    kill_process(sim, Signal::CONT).expect("it runs");
    let status = up.run(&["status", "--json"]);
    assert_eq!(status.status.code(), Some(5), "{}", stderr_of(&status));
    let status = json(&status);
    assert_eq!(status["mode"], "fault", "{status}");
    assert!(status["fault"].is_string(), "{status}");
    let output = up.run(&["mode", "idle"]);
    assert_eq!(output.status.code(), Some(5), "{}", stderr_of(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("mode fault"));
    assert!(
        stderr_of(&output).contains("supple reset"),
        "{}",
        stderr_of(&output)
    );
    let output = up.end();
    assert_eq!(output.status.code(), Some(5), "{}", stderr_of(&output));
}

/// Another program has replaced the file of the idle socket: `supple mode idle` sends an operator request, as for other modes.
#[test]
fn idle_is_accepted_without_its_socket() {
    let (up, domain, mut reader) = tracking();
    let socket = idle_socket(&domain);
    std::fs::remove_file(&socket).expect("removed");
    std::fs::write(&socket, "other").expect("written");
    let output = up.run(&["mode", "idle"]);
    let message = stderr_of(&output);
    assert!(output.status.success(), "{message}");
    for part in ["warning", ".idle.socket", "does not answer"] {
        assert!(message.contains(part), "{part}: {message}");
    }
    wait_for_mode(&mut reader, Mode::Idle);
}

/// The arm of the running system is the default; another arm is refused.
#[test]
fn commands_use_the_arm_of_the_running_system() {
    Up::while_tracking(&["--plant", "sim", "--no-log", "--arm", "wam3"], |up| {
        commands_use_the_arm(up)
    });
}

fn commands_use_the_arm(up: &Up) {
    let tracked = up.run(&["track", "arc"]);
    assert!(tracked.status.success(), "{}", stderr_of(&tracked));
    for command in [&["track", "arc"][..], &["probe"]] {
        let other = up.run(&[command, &["--arm", "wam4"]].concat());
        let message = stderr_of(&other);
        assert_eq!(other.status.code(), Some(3), "{message}");
        for part in ["has 4 joints", "running system has 3 joints", "--arm wam3"] {
            assert!(message.contains(part), "{part}: {message}");
        }
    }
    // An arm with the same number of joints, one of which has another name.
    let folder = tempfile::tempdir().expect("a folder");
    let copy = folder.path().join("copy");
    let copy = copy.to_str().expect("UTF-8");
    assert!(up.run(&["arms", "copy", "wam3", copy]).status.success());
    for file in ["arm.toml", "arm.urdf"] {
        let path = folder.path().join("copy").join(file);
        let text = std::fs::read_to_string(&path).expect("copied");
        std::fs::write(&path, text.replace("joint1", "shoulder")).expect("written");
    }
    let other = up.run(&["track", "arc", "--arm", copy]);
    let message = stderr_of(&other);
    assert_eq!(other.status.code(), Some(3), "{message}");
    for part in [
        "the joints shoulder, ",
        "has the joints joint1, ",
        "--arm wam3",
    ] {
        assert!(message.contains(part), "{part}: {message}");
    }
}

/// A program that cleans /tmp has removed the files that `supple mode idle` and `supple stop` need: they are created again.
#[test]
fn removed_files_of_a_running_system_are_created_again() {
    let (mut up, domain, _) = tracking();
    let pidfile = domain.folder().join(format!("{PREFIX}.pid"));
    let files = [idle_socket(&domain), pidfile];
    for file in &files {
        std::fs::remove_file(file).expect("removed");
    }
    for _ in 0..6000 {
        if files.iter().all(|file| file.exists()) {
            break;
        }
        pause(Duration::from_millis(5));
    }
    let answer = request_idle(&domain, TIMEOUT).expect("requested");
    assert_eq!(answer.expect("an answer").outcome, Outcome::Accepted);
    let stopped = up.run(&["stop"]);
    assert!(stopped.status.success(), "{}", stderr_of(&stopped));
    let output = up.ended();
    assert!(output.status.success(), "{}", stderr_of(&output));
    assert!(files.iter().all(|file| !file.exists()), "no file is left");
}

/// A controller that SIGSTOP suspends does not answer: the message contains the reaction of the arm and a remedy.
#[test]
fn the_error_of_an_unanswered_idle_request_describes_the_reaction_of_the_drives() {
    let (up, ..) = tracking();
    let controller = up.child("supple-rt");
    kill_process(controller, Signal::STOP).expect("it runs");
    let output = up.run(&["mode", "idle"]);
    kill_process(controller, Signal::CONT).expect("it runs");
    let message = stderr_of(&output);
    assert_eq!(output.status.code(), Some(10), "{message}");
    for part in [
        "does not answer",
        "10 ms",
        "brake",
        "emergency stop",
        "supple stop",
    ] {
        assert!(message.contains(part), "{part}: {message}");
    }
    // That would be the remedy if no system were running.
    assert!(!message.contains("start one"), "{message}");
}

#[test]
fn a_killed_controller_ends_the_system_with_code_10() {
    let (mut up, ..) = tracking();
    kill_process(up.child("supple-rt"), Signal::KILL).expect("it runs");
    let output = up.ended();
    assert_eq!(output.status.code(), Some(10), "{}", stderr_of(&output));
    assert!(
        stderr_of(&output).contains("supple-rt exited"),
        "{}",
        stderr_of(&output)
    );
}

#[test]
fn concurrent_starts_leave_exactly_one_system_running() {
    let folder = temporary_folder();
    let start = || {
        supple(
            folder.path(),
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
    let all: Vec<String> = outputs.iter().map(stderr_of).collect();
    assert_eq!((ran.len(), refused.len()), (1, 2), "{all:?}");
    for output in refused {
        assert_eq!(output.status.code(), Some(10));
        assert!(
            stderr_of(output).contains("a system is already running"),
            "{}",
            stderr_of(output)
        );
    }
}

/// Runs a script in its own mount namespace with a small /dev/shm; `None` if the host does not permit namespaces.
fn with_shared_memory(size: &str, script: &str, folder: &Path) -> Option<Output> {
    let mount = format!("mount -t tmpfs -o size={size} tmpfs /dev/shm");
    let in_namespace = |script: &str| {
        Command::new("unshare")
            .args(["-rm", "sh", "-c", script])
            .env("XDG_RUNTIME_DIR", folder)
            .env("SUPPLE_PREFIX", PREFIX)
            .env("BIN", programs())
            .output()
    };
    let possible = in_namespace(&mount).is_ok_and(|output| output.status.success());
    if !possible {
        println!("skipped: mount namespaces are not permitted");
        return None;
    }
    Some(in_namespace(&format!("{mount}\n{script}")).expect("it runs"))
}

#[test]
fn too_little_shared_memory_is_reported_at_the_start() {
    let folder = temporary_folder();
    let script = "exec \"$BIN/supple-rt\" --virtual-time";
    let Some(output) = with_shared_memory("8m", script, folder.path()) else {
        return;
    };
    assert_eq!(output.status.code(), Some(10), "{}", stderr_of(&output));
    for part in ["/dev/shm has", "MB are needed", "size="] {
        assert!(
            stderr_of(&output).contains(part),
            "{part}: {}",
            stderr_of(&output)
        );
    }
}

/// Other processes fill shared memory completely: the system keeps running, idle is accepted, a command that needs
/// memory reports an error, and the shutdown is orderly.
#[test]
fn a_system_keeps_running_when_shared_memory_is_full() {
    let folder = temporary_folder();
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
    let script = format!("cd '{}'\n{script}", folder.path().display());
    let Some(output) = with_shared_memory("60m", &script, folder.path()) else {
        return;
    };
    let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
    for part in [
        "mode idle since cycle",
        "idle: 0",
        "status: 10",
        "stop: 0",
        "up: 0",
    ] {
        assert!(
            stdout.contains(part),
            "{part}: {stdout}{}",
            stderr_of(&output)
        );
    }
    assert!(
        stderr_of(&output).contains("MB are needed"),
        "{}",
        stderr_of(&output)
    );
}
