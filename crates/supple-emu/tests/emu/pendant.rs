//! Tests of the pendant socket of the program `supple-emu`: clients that send nothing or do not read do not block others.

use core::time::Duration;
use std::io::{Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Instant;
use tempfile::TempDir;

/// Timeout of an answer, longer than any test takes.
const WITHIN: Duration = Duration::from_secs(60);

struct Arm {
    child: Child,
    folder: TempDir,
}

impl Arm {
    fn start() -> Arm {
        let folder = tempfile::tempdir().expect("a folder");
        let owner = std::fs::Permissions::from_mode(0o700);
        std::fs::set_permissions(folder.path(), owner).expect("changed");
        let child = Command::new(env!("CARGO_BIN_EXE_supple-emu"))
            .arg("--virtual-time")
            .arg("--bus")
            .arg(format!("unix:{}", folder.path().join("bus").display()))
            .stderr(Stdio::null())
            .spawn()
            .expect("it starts");
        let arm = Arm { child, folder };
        let start = Instant::now();
        while arm.connect().is_none() {
            assert!(start.elapsed() < WITHIN, "no pendant socket");
            std::thread::yield_now();
        }
        arm
    }

    fn connect(&self) -> Option<UnixStream> {
        UnixStream::connect(Path::new(self.folder.path()).join("bus/pendant")).ok()
    }

    /// Sends a line and returns the answer.
    fn send_line(&self, words: &str) -> String {
        let mut stream = self.connect().expect("it listens");
        stream.set_read_timeout(Some(WITHIN)).expect("set");
        writeln!(stream, "{words}").expect("written");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("an answer");
        answer
    }
}

impl Drop for Arm {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn the_emergency_stop_is_not_blocked_by_clients_without_a_complete_line() {
    let arm = Arm::start();
    let silent: Vec<UnixStream> = (0..40)
        .map(|k| {
            let mut stream = arm.connect().expect("it listens");
            if k % 2 == 0 {
                stream.write_all(b"id").expect("written");
            }
            stream
        })
        .collect();
    assert!(arm.send_line("idle").contains("\"safety_mode\""));
    assert!(arm.send_line("e-stop").contains("EStop"));
    drop(silent);
    assert!(arm.send_line("status").contains("EStop"));
}

#[test]
fn clients_that_do_not_read_block_no_other_client() {
    let arm = Arm::start();
    let deaf: Vec<UnixStream> = (0..100)
        .map(|_| {
            let mut stream = arm.connect().expect("it listens");
            writeln!(stream, "record").expect("written");
            stream
        })
        .collect();
    // The line was queued after those of the earlier clients, which have therefore been served.
    loop {
        let answer = arm.send_line("e-stop");
        if answer.contains("EStop") {
            break;
        }
        // Too many answers were pending: the command is executed without an answer.
        assert_eq!(answer, "");
    }
    drop(deaf);
}

/// Tests a line that arrives in pieces, and a line without a newline from a client that has closed its sending side.
#[test]
fn a_line_may_arrive_in_pieces() {
    let arm = Arm::start();
    let mut stream = arm.connect().expect("it listens");
    stream.set_read_timeout(Some(WITHIN)).expect("set");
    for piece in ["sta", "tu", "s"] {
        stream.write_all(piece.as_bytes()).expect("written");
        std::thread::yield_now();
    }
    stream.shutdown(std::net::Shutdown::Write).expect("shut");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    assert!(answer.contains("\"safety_mode\""), "{answer}");
}

#[test]
fn a_line_that_is_too_long_is_refused_without_effect() {
    let arm = Arm::start();
    assert!(!arm.send_line("idle").contains("EStop"));
    let mut stream = arm.connect().expect("it listens");
    stream.set_read_timeout(Some(WITHIN)).expect("set");
    let line = format!("e-stop{}", " ".repeat(250));
    stream.write_all(line.as_bytes()).expect("written");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    assert!(answer.contains("at most 256 bytes"), "{answer}");
    assert!(!arm.send_line("status").contains("EStop"));
}
