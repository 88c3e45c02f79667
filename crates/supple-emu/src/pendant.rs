//! The pendant's socket: accepts button presses and reports the state of the arm.
//!
//! A thread accepts connections and forwards each line to the loop that owns the arm; the answer is one line of
//! JSON. Idle clients and clients that do not read do not block other clients (`pendant_clients.rs`). The socket is separate
//! from the bus.

use crate::emulator::{ArmEvent, Emulator};
use crate::options::{button, press};
use crate::pendant_clients::{PendantRequest, serve};
use serde::Serialize;
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use supple_bus::virtual_time::EmulatedNodes;
use supple_bus::{BusError, OwnerFolder};

/// Name of the socket in the bus's folder.
pub const SOCKET: &str = "pendant";

/// The socket and its pending requests.
pub struct PendantSocket {
    path: PathBuf,
    requests: Receiver<PendantRequest>,
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
struct ErrorReply {
    error: String,
}

impl PendantSocket {
    /// Creates the socket in the folder, accessible only to the owner. Replaces the socket of a process that has ended.
    ///
    /// # Errors
    /// If the socket cannot be created.
    pub fn open(folder: &OwnerFolder) -> Result<PendantSocket, BusError> {
        let path = folder.path().join(SOCKET);
        if UnixStream::connect(&path).is_ok() {
            return Err(BusError::SocketInUse { path });
        }
        let failed = |source| BusError::Io {
            action: "creating the pendant's socket",
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
        let (sender, requests) = channel();
        std::thread::Builder::new()
            .name("pendant".to_owned())
            .spawn(move || serve(&listener, &sender))
            .map_err(failed)?;
        Ok(PendantSocket { path, requests })
    }

    /// Path of the socket.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Answers all pending requests.
    pub fn answer<const N: usize>(&self, emulator: &mut Emulator<N>) {
        while let Ok(request) = self.requests.try_recv() {
            let answer = answer(emulator, request.line.trim());
            // The client may have disconnected.
            let _ = request.answer.send(answer);
        }
    }
}

impl Drop for PendantSocket {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Applies a line from the socket to the arm; returns the answer, one line of JSON.
pub fn answer<const N: usize>(emulator: &mut Emulator<N>, line: &str) -> String {
    if let Some(press) = button(line) {
        emulator.press(press);
        return json(&status(emulator));
    }
    if line.contains('@') {
        return match press(line) {
            Ok(scheduled) => {
                scheduled.schedule(emulator, emulator.now_ns());
                json(&status(emulator))
            }
            Err(error) => json(&ErrorReply {
                error: error.to_string(),
            }),
        };
    }
    match line {
        "status" => json(&status(emulator)),
        "cradle" => match emulator.put_into_cradle() {
            Ok(()) => json(&status(emulator)),
            Err(reason) => json(&ErrorReply {
                error: reason.to_owned(),
            }),
        },
        "record" => {
            let arm_events = emulator.events_in_monotonic_time();
            let entries = arm_events.map(|(time_ns, arm_event)| Entry {
                time_ns,
                what: match arm_event {
                    ArmEvent::Motor(index, mode) => format!("motor {} {mode:?}", index + 1),
                    other => format!("{other:?}"),
                },
            });
            json(&entries.collect::<Vec<_>>())
        }
        other => json(&ErrorReply {
            error: format!(
                "`{other}`: expected idle, activate, e-stop, release, cradle, status or record"
            ),
        }),
    }
}

fn status<const N: usize>(emulator: &Emulator<N>) -> Status {
    let truth = emulator.truth();
    let pucks = emulator.pucks().iter();
    Status {
        time_ns: emulator.monotonic_ns(),
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
    // Plain data can always be serialised; an error would result in an empty line.
    serde_json::to_string(value).unwrap_or_default()
}
