//! The pendant's socket: an operator's buttons from outside, and what the arm is doing.
//!
//! A thread takes connections and hands each line to the loop that owns the arm; the answer is one line of
//! JSON. Clients that say nothing, or do not read, hold up nobody (`pendant_clients.rs`). Nothing here is on the bus.

use crate::emulator::{Emulator, Happening};
use crate::options::{button, press};
use crate::pendant_clients::{Question, serve};
use serde::Serialize;
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use supple_bus::virtual_time::Peer;
use supple_bus::{BusError, OwnerFolder};

/// Name of the socket in the bus's folder.
pub const SOCKET: &str = "pendant";

/// The socket, and what came over it.
pub struct PendantSocket {
    path: PathBuf,
    questions: Receiver<Question>,
}

#[derive(Serialize)]
struct Status {
    time_ns: u64,
    safety_mode: String,
    cause: String,
    pendant: String,
    motor_modes: Vec<String>,
    motor_torque_nm: Vec<f64>,
    position_rad: Vec<f64>,
    tip_m: [f64; 3],
    contact_force_n: [f64; 3],
    bus_busy_ns: u64,
}

#[derive(Serialize)]
struct Entry {
    time_ns: u64,
    what: String,
}

#[derive(Serialize)]
struct Refusal {
    error: String,
}

impl PendantSocket {
    /// Listens in the folder, for the owner alone. A socket left by a process that has ended is replaced.
    ///
    /// # Errors
    /// Where the socket cannot be made.
    pub fn open(folder: &OwnerFolder) -> Result<PendantSocket, BusError> {
        let path = folder.path().join(SOCKET);
        if UnixStream::connect(&path).is_ok() {
            return Err(BusError::Taken { path });
        }
        let failed = |source| BusError::Io {
            action: "making the pendant's socket",
            source,
        };
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(failed(error));
            }
            _ => {}
        }
        let listener = UnixListener::bind(&path).map_err(failed)?;
        std::fs::set_permissions(&path, Permissions::from_mode(0o600)).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let (sender, questions) = channel();
        std::thread::Builder::new()
            .name("pendant".to_owned())
            .spawn(move || serve(&listener, &sender))
            .map_err(failed)?;
        Ok(PendantSocket { path, questions })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Answers what has come.
    pub fn answer<const N: usize>(&self, emulator: &mut Emulator<N>) {
        while let Ok(question) = self.questions.try_recv() {
            let answer = answer(emulator, question.line.trim());
            // Who asked may have gone.
            let _ = question.answer.send(answer);
        }
    }
}

impl Drop for PendantSocket {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

/// What the socket answers to a line, which is done to the arm: one line of JSON.
pub fn answer<const N: usize>(emulator: &mut Emulator<N>, line: &str) -> String {
    if let Some(press) = button(line) {
        emulator.press(press);
        return json(&status(emulator));
    }
    if line.contains('@') {
        return match press(line) {
            Ok(later) => {
                later.plan(emulator, emulator.now_ns());
                json(&status(emulator))
            }
            Err(error) => json(&Refusal {
                error: error.to_string(),
            }),
        };
    }
    match line {
        "status" => json(&status(emulator)),
        "record" => {
            let happenings = emulator.happenings_by_the_wall();
            let entries = happenings.map(|(time_ns, happening)| Entry {
                time_ns,
                what: match happening {
                    Happening::Motor(index, mode) => format!("motor {} {mode:?}", index + 1),
                    other => format!("{other:?}"),
                },
            });
            json(&entries.collect::<Vec<_>>())
        }
        other => json(&Refusal {
            error: format!("`{other}` is none of idle, activate, e-stop, release, status, record"),
        }),
    }
}

fn status<const N: usize>(emulator: &Emulator<N>) -> Status {
    let truth = emulator.truth();
    let pucks = emulator.pucks().iter();
    Status {
        time_ns: emulator.wall_ns(),
        safety_mode: format!("{:?}", emulator.safety().mode()),
        cause: format!("{:?}", emulator.safety().cause()),
        pendant: format!("{:?}", emulator.safety().pendant()),
        motor_modes: pucks.map(|puck| format!("{:?}", puck.mode())).collect(),
        motor_torque_nm: emulator.motor_torque_nm().iter().copied().collect(),
        position_rad: truth.position_rad.iter().copied().collect(),
        tip_m: truth.tip_position_m.into(),
        contact_force_n: truth.contact_force_n.into(),
        bus_busy_ns: emulator.bus_busy_ns(),
    }
}

fn json(value: &impl Serialize) -> String {
    // Plain data always has a form; its absence would show as an empty line.
    serde_json::to_string(value).unwrap_or_default()
}
