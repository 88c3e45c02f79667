//! Client of the pendant of an emulated arm: a socket in the folder of the bus, which answers each text line with one line of
//! JSON.

use crate::cli::PendantAction;
use core::time::Duration;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::Instant;
use supple_bus::Address;
use supple_cli::console::print_line;
use supple_cli::exit::Failure;
use supple_ipc::Domain;
use supple_realtime::pause;

/// Name of the socket in the folder of the bus.
const SOCKET: &str = "pendant";
/// Timeout for a reply.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(2);
/// Poll interval while waiting for an arm to start.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// Connection to the pendant of an emulated arm.
#[derive(Clone, Debug)]
pub struct Pendant {
    socket: PathBuf,
}

/// An event of the arm.
#[derive(Clone, Debug, Deserialize)]
pub struct ArmEvent {
    /// Time of the event on the clock of the arm's states \[ns\].
    pub time_ns: u64,
    /// Description.
    pub what: String,
}

#[derive(Deserialize)]
struct Refusal {
    error: String,
}

impl Pendant {
    /// Returns the pendant of the emulated arm on this bus; `None` for a CAN interface, whose pendant is real hardware.
    pub fn of(bus: &Address) -> Option<Pendant> {
        match bus {
            Address::Folder(folder) => Some(Pendant {
                socket: folder.join(SOCKET),
            }),
            Address::Interface(_) => None,
        }
    }

    /// Waits until the arm answers; `check` fails if it can no longer start.
    ///
    /// # Errors
    /// [`Failure::Pendant`] after the timeout, and the errors of `check`.
    pub fn wait(
        &self,
        within: Duration,
        check: &mut dyn FnMut() -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let start = Instant::now();
        loop {
            match self.send_line("status") {
                Ok(_) => return Ok(()),
                Err(error) if start.elapsed() > within => return Err(error),
                Err(_) => check()?,
            }
            pause(POLL_INTERVAL);
        }
    }

    /// Presses a button immediately, or later as in `activate@held+0.2`.
    ///
    /// # Errors
    /// [`Failure::Pendant`].
    pub fn press(&self, button: &str) -> Result<(), Failure> {
        self.send_line(button).map(|_| ())
    }

    /// Returns all events of the arm since its start.
    ///
    /// # Errors
    /// [`Failure::Pendant`].
    pub fn record(&self) -> Result<Vec<ArmEvent>, Failure> {
        self.parsed(&self.send_line("record")?)
    }

    /// Sends a line and returns the reply.
    ///
    /// # Errors
    /// [`Failure::Pendant`].
    pub fn send_line(&self, line: &str) -> Result<String, Failure> {
        let answer = self.exchange(line).map_err(|error| self.no_answer(error))?;
        if answer.trim().is_empty() {
            return Err(self.no_answer("the connection was closed"));
        }
        match serde_json::from_str::<Refusal>(&answer) {
            Ok(refusal) => Err(self.no_answer(refusal.error)),
            Err(_) => Ok(answer),
        }
    }

    fn exchange(&self, line: &str) -> std::io::Result<String> {
        let mut stream = UnixStream::connect(&self.socket)?;
        stream.set_read_timeout(Some(ANSWER_TIMEOUT))?;
        writeln!(stream, "{line}")?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer)?;
        Ok(answer)
    }

    fn parsed<T: DeserializeOwned>(&self, answer: &str) -> Result<T, Failure> {
        serde_json::from_str(answer).map_err(|error| self.no_answer(error))
    }

    fn no_answer(&self, cause: impl ToString) -> Failure {
        Failure::Pendant {
            socket: self.socket.clone(),
            cause: cause.to_string(),
        }
    }
}

/// Runs `supple pendant`: sends a button press or query to the emulated pendant and prints its reply.
///
/// # Errors
/// [`Failure::Pendant`].
pub fn pendant(action: PendantAction, prefix: Option<&str>) -> Result<(), Failure> {
    let domain = Domain::new(prefix).map_err(Failure::system)?;
    let bus = Address::of_system(domain.prefix()).map_err(Failure::system)?;
    let line = match action {
        PendantAction::Idle => "idle",
        PendantAction::Activate => "activate",
        PendantAction::EStop => "e-stop",
        PendantAction::Release => "release",
        PendantAction::Cradle => "cradle",
        PendantAction::Status => "status",
        PendantAction::Record => "record",
    };
    match Pendant::of(&bus) {
        Some(pendant) => print_line(pendant.send_line(line)?.trim_end()),
        None => Ok(()),
    }
}
