//! Tests of the program `supple-rt` under a simulated service manager, which is a datagram socket.

use crate::support::terminate;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixDatagram;
use std::process::{Child, Command, Stdio};
use supple_core::Controller;
use supple_ipc::{ControllerLink, Domain};
use supple_model::Description;
use supple_realtime::{LivenessMonitor, Stop};
use supple_rt::{ControlLoop, loop_queues};
use tempfile::TempDir;

struct Manager {
    folder: TempDir,
    socket: UnixDatagram,
}

fn manager() -> Manager {
    let folder = tempfile::tempdir().expect("a folder");
    let owner = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(folder.path(), owner).expect("changed");
    let socket = UnixDatagram::bind(folder.path().join("notify")).expect("a socket");
    Manager { folder, socket }
}

impl Manager {
    fn start(&self, watchdog_usec: &str) -> Child {
        Command::new(env!("CARGO_BIN_EXE_supple-rt"))
            .args(["--prefix", "heartbeat", "--no-realtime"])
            .env("XDG_RUNTIME_DIR", self.folder.path())
            .env("NOTIFY_SOCKET", self.folder.path().join("notify"))
            .env("WATCHDOG_USEC", watchdog_usec)
            .env_remove("WATCHDOG_PID")
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts")
    }

    fn next(&self) -> String {
        let mut buffer = [0; 256];
        let bytes = self.socket.recv(&mut buffer).expect("a message");
        String::from_utf8(buffer[..bytes].to_vec()).expect("text")
    }
}

#[test]
fn service_manager_gets_ready_watchdog_and_stopping() {
    let manager = manager();
    let mut child = manager.start("100000");
    assert_eq!(manager.next(), "READY=1\n");
    // No plant is connected: the loop counts as alive while it waits for one.
    for _ in 0..3 {
        assert_eq!(manager.next(), "WATCHDOG=1\n");
    }
    terminate(&child);
    let last = std::iter::repeat_with(|| manager.next()).find(|word| word != "WATCHDOG=1\n");
    assert_eq!(last.as_deref(), Some("STOPPING=1\n"));
    assert!(child.wait().expect("it ends").success());
}

#[test]
fn invalid_watchdog_time_is_refused_at_start() {
    let manager = manager();
    let output = manager.start("soon").wait_with_output().expect("it ends");
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("WATCHDOG_USEC is `soon`"), "{text}");
}

/// The liveness counter increases by one in each iteration of the loop, and not otherwise.
#[test]
fn stalled_loop_sends_no_watchdog_message() {
    let folder = tempfile::tempdir().expect("a folder");
    let domain = Domain::in_folder(&folder.path().join("run"), "heartbeat").expect("a domain");
    let link = ControllerLink::new(&domain).expect("a controller");
    let description = Description::asset("wam4").expect("built in");
    let config = description.config::<4>().expect("valid");
    let (queues, _helper_queues) = loop_queues();
    let liveness = queues.liveness();
    let mut monitor = LivenessMonitor::new(&[liveness]);
    let controller = Controller::new(config).expect("valid");
    let mut control = ControlLoop::new(controller, queues, true);
    assert!(!monitor.all_advanced());
    control
        .run_iteration(&link, &Stop::default())
        .expect("an iteration");
    assert!(monitor.all_advanced());
    assert!(!monitor.all_advanced());
}
