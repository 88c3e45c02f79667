//! Tests that the controller enters idle within 20 cycles of the request, whatever else happens.

use crate::scripted::{Bench, PERIOD};
use crate::support::terminate;
use core::time::Duration;
use std::os::unix::fs::chown;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Instant;
use supple_core::config::Role;
use supple_core::controller::{Mode, Request};
use supple_core::{Controller, Vector};
use supple_ipc::message::{Drives, Outcome};
use supple_ipc::{OperatorClient, TelemetryReader};
use supple_model::Description;
use supple_realtime::pause;

/// Time for which the simulated disk does not answer.
const DISK_HANGS: Duration = Duration::from_secs(4);
/// Id of a user that owns no file of this test.
const NOBODY: u32 = 65534;
/// Environment variable that tells a child process of this test that it has a separate /dev/shm.
const OWN_SHARED_MEMORY: &str = "SUPPLE_TEST_OWN_SHARED_MEMORY";

fn end(mut bench: Bench) {
    terminate(&bench.child);
    let status = bench.child.wait().expect("it ends");
    assert_eq!(status.code(), Some(0), "{status}");
}

/// A stopped thread of another process; dropping this value lets it continue.
struct StoppedThread(libc::pid_t);

impl StoppedThread {
    /// Stops the thread of this name; `None` if the system does not permit it.
    fn thread(child: &Child, name: &str) -> Option<StoppedThread> {
        let tasks = format!("/proc/{}/task", child.id());
        let mut tasks = std::fs::read_dir(tasks).expect("it runs").flatten();
        let task = tasks.find(|task| {
            std::fs::read_to_string(task.path().join("comm")).is_ok_and(|comm| comm.trim() == name)
        });
        let task = task.expect("the thread exists").file_name();
        let id: libc::pid_t = task.to_string_lossy().parse().expect("a number");
        let none = core::ptr::null_mut::<libc::c_void>();
        // SAFETY: these calls pass no memory except the status word.
        unsafe {
            if libc::ptrace(libc::PTRACE_SEIZE, id, none, none) != 0 {
                println!(
                    "skipped: this user may not stop a thread: {}",
                    std::io::Error::last_os_error()
                );
                return None;
            }
            assert_eq!(libc::ptrace(libc::PTRACE_INTERRUPT, id, none, none), 0);
            let mut status = 0;
            assert_eq!(libc::waitpid(id, &raw mut status, libc::__WALL), id);
        }
        Some(StoppedThread(id))
    }
}

impl Drop for StoppedThread {
    fn drop(&mut self) {
        let none = core::ptr::null_mut::<libc::c_void>();
        // SAFETY: the call passes no memory; the thread may have ended.
        unsafe { libc::ptrace(libc::PTRACE_DETACH, self.0, none, none) };
    }
}

fn fault_tables(bench: &Bench) -> usize {
    std::fs::read_dir(bench.domain.folder().join("faults")).map_or(0, Iterator::count)
}

/// The disk does not answer for four seconds while the table of a fault is written: idle, reset and telemetry continue to
/// work, and the table is written afterwards.
#[test]
fn idle_acts_while_the_disk_hangs() {
    let mut bench = Bench::start(Stdio::null());
    let mut reader = TelemetryReader::new(&bench.domain).expect("a reader");
    let mut operator = OperatorClient::new(&bench.domain).expect("an operator");
    bench.hold(&mut operator);
    let Some(stopped) = StoppedThread::thread(&bench.child, "supple-rt-disk") else {
        return end(bench);
    };
    bench.fault();
    bench.reset(&mut operator);
    let since = Instant::now();
    let (mut steps, mut lost) = (None, 0);
    while since.elapsed() < DISK_HANGS {
        bench.assert_idle_acts(&mut operator);
        bench.hold(&mut operator);
        bench.run(100);
        while let Some(telemetry) = reader.receive().expect("read") {
            lost += steps.map_or(0, |step: u64| telemetry.step() - step - 1);
            steps = Some(telemetry.step());
        }
    }
    assert_eq!(lost, 0, "cycles of telemetry");
    assert_eq!(fault_tables(&bench), 0, "the disk hangs");
    drop(stopped);
    for _ in 0..2000 {
        if fault_tables(&bench) > 0 {
            break;
        }
        bench.cycle();
    }
    assert!(fault_tables(&bench) > 0, "the disk answers again");
    end(bench);
}

/// A reader of telemetry does not read for more than two seconds: idle acts, and the reader then continues with the cycles
/// that are left in its queue.
#[test]
fn idle_acts_while_a_reader_lags() {
    let mut bench = Bench::start(Stdio::null());
    let mut reader = TelemetryReader::new(&bench.domain).expect("a reader");
    let mut operator = OperatorClient::new(&bench.domain).expect("an operator");
    bench.hold(&mut operator);
    bench.run(2500);
    bench.assert_idle_acts(&mut operator);
    // The unread telemetry is older; after it, the reader receives new telemetry.
    while reader.receive().expect("read").is_some() {}
    bench.run(100);
    let mut last = None;
    while let Some(telemetry) = reader.receive().expect("read") {
        last = Some(telemetry.state.cycle);
    }
    let behind = bench.cycle - last.expect("some telemetry");
    assert!(behind < 100, "{behind} cycles behind");
    end(bench);
}

/// A file that the test created in /dev/shm; dropping this value removes the file.
struct RemovedOnDrop(PathBuf);

impl Drop for RemovedOnDrop {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// While the system runs, another user creates files in /dev/shm that are named like the system's: new clients are served
/// or refused with the reason, and idle acts.
#[test]
fn idle_acts_beside_files_of_another_user() {
    let mut bench = Bench::start(Stdio::null());
    let mut operator = OperatorClient::new(&bench.domain).expect("an operator");
    bench.hold(&mut operator);
    let prefix = bench.domain.object_prefix();
    let mut made = Vec::new();
    for name in ["not_ours", "node.0_9_3.global_mgmt", "zzz.data"] {
        let file = RemovedOnDrop(Path::new("/dev/shm").join(format!("{prefix}{name}")));
        std::fs::write(&file.0, b"nonsense").expect("written");
        if let Err(error) = chown(&file.0, Some(NOBODY), Some(NOBODY)) {
            println!("skipped: this user may not change the owner of a file: {error}");
            return end(bench);
        }
        made.push(file);
    }
    bench.assert_idle_acts(&mut operator);
    if let Err(error) = TelemetryReader::new(&bench.domain) {
        assert!(error.to_string().contains("user"), "{error}");
    }
    bench.assert_idle_acts(&mut operator);
    assert!(
        made.iter().all(|file| file.0.exists()),
        "others' files stay"
    );
    end(bench);
}

/// Other processes have used all free shared memory: idle acts. The test runs in a separate mount namespace.
#[test]
fn idle_acts_while_shared_memory_is_full() {
    if std::env::var_os(OWN_SHARED_MEMORY).is_some() {
        return with_full_shared_memory();
    }
    let this = std::env::current_exe().expect("this test");
    let mount = "mount -t tmpfs -o size=100m tmpfs /dev/shm";
    let in_namespace = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["-rm", "sh", "-c", script]).arg(&this);
        command.env(OWN_SHARED_MEMORY, "1").output()
    };
    if !in_namespace(mount).is_ok_and(|output| output.status.success()) {
        println!("skipped: mount namespaces are not permitted");
        return;
    }
    let test = "idle_requests::idle_acts_while_shared_memory_is_full";
    let script = format!("{mount} && exec \"$0\" --exact {test} --nocapture");
    let output = in_namespace(&script).expect("it runs");
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{words}{errors}");
    assert!(words.contains("1 passed"), "{words}");
}

fn with_full_shared_memory() {
    let mut bench = Bench::start(Stdio::null());
    let mut operator = OperatorClient::new(&bench.domain).expect("an operator");
    bench.hold(&mut operator);
    let filled = std::fs::write("/dev/shm/fill", vec![0_u8; 200 << 20]);
    assert!(filled.is_err(), "/dev/shm is full");
    bench.assert_idle_acts(&mut operator);
    bench.hold(&mut operator);
    bench.fault();
    bench.reset(&mut operator);
    bench.assert_idle_acts(&mut operator);
    end(bench);
}

/// A move that waits is checked from the pose of the arm shortly before its cycle: from there the tip would be too fast.
#[test]
fn a_move_that_waits_is_checked_from_the_pose_in_which_it_begins() {
    let description = Description::asset("wam4").expect("built in");
    let config = description.config::<4>().expect("valid");
    let controller = Controller::new(config).expect("valid");
    let mut bench = Bench::start(Stdio::null());
    let home = Vector::from(bench.position_rad);
    // A move from home that is refused only for the speed of the tip: each joint turns by one radian or not at all, below its
    // speed limit.
    let to = |code: u32| {
        let way = |joint: usize| match config.roles[joint] {
            Role::Active => f64::from(code / 3_u32.pow(joint as u32) % 3) - 1.0,
            // The position loop would move the joint back, which this scripted arm does not simulate.
            Role::Held { .. } => 0.0,
        };
        Request::Move {
            target_rad: home + Vector::from_fn(|joint, _| way(joint)),
            duration_s: 1.1,
        }
    };
    let request = (0..81).map(to).find(|request| {
        let checked = supple_core::controller::check_motion(&controller, &home, request);
        // The target is within the hard stops, with a margin for the soft stops.
        let Request::Move { target_rad, .. } = request else {
            return false;
        };
        let limits = &config.limits;
        let inside = (0..4).all(|joint| {
            let angle = target_rad[joint];
            angle > limits.position_lower_rad[joint] + 0.3
                && angle < limits.position_upper_rad[joint] - 0.3
        });
        inside && checked.is_err_and(|refusal| refusal.to_string().contains("tip speed"))
    });
    let request = request.expect("a move with a fast tip");
    let Request::Move { target_rad, .. } = request else {
        panic!("{request:?}");
    };
    // From its target, the move has length zero.
    bench.position_rad = target_rad.into();
    let mut operator = OperatorClient::new(&bench.domain).expect("an operator");
    bench.hold(&mut operator);
    // The arm is then moved by hand, without torque. (Requests from before that are refused because of it.)
    bench.drives = Drives::Idle;
    bench.run(10);
    let at_cycle = bench.cycle + 600;
    operator
        .send::<4>(&request, Some(at_cycle))
        .expect("sent")
        .expect("a controller");
    bench.run(100);
    for k in 1..=200 {
        let share = f64::from(k) / 200.0;
        bench.position_rad = (target_rad + (home - target_rad) * share).into();
        bench.cycle();
    }
    bench.run(50);
    bench.drives = Drives::Active;
    let mut replies = Vec::new();
    for _ in 0..400 {
        assert_ne!(bench.cycle(), Some(Mode::Move));
        while let Some(reply) = operator.receive().expect("read") {
            replies.push((reply.outcome(), reply.text.as_str().to_owned()));
        }
    }
    pause(PERIOD);
    let (outcome, text) = replies.last().expect("a reply");
    assert_eq!(*outcome, Outcome::Refused, "{replies:?}");
    assert!(text.contains("tip speed"), "{text}");
    end(bench);
}
