//! The real program under a service manager that the test plays: a datagram socket.

use rustix::process::{Pid, Signal, kill_process};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixDatagram;
use std::process::{Child, Command, Stdio};
use supple_core::Controller;
use supple_ipc::{ControllerLink, Domain};
use supple_model::Description;
use supple_realtime::{Stop, Watch};
use supple_rt::{ControlLoop, rings};
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
        String::from_utf8(buffer[..bytes].to_vec()).expect("words")
    }
}

#[test]
fn start_life_and_end_are_told_to_the_service_manager() {
    let manager = manager();
    let mut child = manager.start("100000");
    assert_eq!(manager.next(), "READY=1\n");
    // No plant is there: waiting for one is being alive.
    for _ in 0..3 {
        assert_eq!(manager.next(), "WATCHDOG=1\n");
    }
    let process = i32::try_from(child.id()).expect("a process number");
    let process = Pid::from_raw(process).expect("not zero");
    kill_process(process, Signal::TERM).expect("it runs");
    let last = std::iter::repeat_with(|| manager.next()).find(|word| word != "WATCHDOG=1\n");
    assert_eq!(last.as_deref(), Some("STOPPING=1\n"));
    assert!(child.wait().expect("it ends").success());
}

#[test]
fn a_wrong_time_of_the_watchdog_is_refused_before_anything_moves() {
    let manager = manager();
    let output = manager.start("soon").wait_with_output().expect("it ends");
    let words = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{words}");
    assert!(words.contains("WATCHDOG_USEC is `soon`"), "{words}");
}

/// What the watch looks at is what the loop does: one turn, one count, and none without a turn.
#[test]
fn a_loop_that_does_not_turn_gives_no_sign_of_life() {
    let folder = tempfile::tempdir().expect("a folder");
    let domain = Domain::within(&folder.path().join("run"), "heartbeat").expect("a domain");
    let link = ControllerLink::new(&domain).expect("a controller");
    let description = Description::asset("wam4").expect("built in");
    let config = description.config::<4>().expect("sound");
    let (inside, _outside) = rings();
    let pulse = inside.pulse();
    let mut watch = Watch::new(&[pulse]);
    let controller = Controller::new(config).expect("sound");
    let mut control = ControlLoop::new(controller, inside, true);
    assert!(!watch.moved_on());
    control.turn(&link, &Stop::default()).expect("a turn");
    assert!(watch.moved_on());
    assert!(!watch.moved_on());
}
