//! The pendant of an emulated arm: a socket in the folder of its bus, a line of JSON for each line.

use crate::cli::PendantAction;
use crate::console::say;
use crate::exit::Failure;
use core::time::Duration;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::Instant;
use supple_bus::Address;
use supple_ipc::{Domain, pause};

/// Name of the socket in the bus's folder.
const SOCKET: &str = "pendant";
/// Longest wait for an answer.
const ANSWER_WITHIN: Duration = Duration::from_secs(2);
/// How often an arm that is starting is looked for.
const LOOK_EVERY: Duration = Duration::from_millis(5);

/// A pendant.
#[derive(Clone, Debug)]
pub struct Pendant {
    socket: PathBuf,
}

/// Something that happened to the arm.
#[derive(Clone, Debug, Deserialize)]
pub struct Happening {
    /// When, by the clock of the arm's states \[ns\].
    pub time_ns: u64,
    /// In words.
    pub what: String,
}

#[derive(Deserialize)]
struct Refusal {
    error: String,
}

impl Pendant {
    /// Of the arm on this bus; a CAN interface's is a real one.
    pub fn of(bus: &Address) -> Option<Pendant> {
        match bus {
            Address::Folder(folder) => Some(Pendant {
                socket: folder.join(SOCKET),
            }),
            Address::Interface(_) => None,
        }
    }

    /// Waits until the arm is there; `check` says whether it still may come.
    ///
    /// # Errors
    /// [`Failure::Pendant`] where it does not come, and what `check` says.
    pub fn wait(
        &self,
        within: Duration,
        check: &mut dyn FnMut() -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let start = Instant::now();
        loop {
            match self.say("status") {
                Ok(_) => return Ok(()),
                Err(error) if start.elapsed() > within => return Err(error),
                Err(_) => check()?,
            }
            pause(LOOK_EVERY);
        }
    }

    /// Presses a button now, or later as in `activate@held+0.2`.
    ///
    /// # Errors
    /// [`Failure::Pendant`].
    pub fn press(&self, button: &str) -> Result<(), Failure> {
        self.say(button).map(|_| ())
    }

    /// Everything that has happened to the arm.
    ///
    /// # Errors
    /// [`Failure::Pendant`].
    pub fn record(&self) -> Result<Vec<Happening>, Failure> {
        self.parsed(&self.say("record")?)
    }

    /// Says a line; gives the answer.
    ///
    /// # Errors
    /// [`Failure::Pendant`].
    pub fn say(&self, line: &str) -> Result<String, Failure> {
        let answer = self.exchange(line).map_err(|error| self.silent(error))?;
        if answer.trim().is_empty() {
            return Err(self.silent("it hung up"));
        }
        match serde_json::from_str::<Refusal>(&answer) {
            Ok(refusal) => Err(self.silent(refusal.error)),
            Err(_) => Ok(answer),
        }
    }

    fn exchange(&self, line: &str) -> std::io::Result<String> {
        let mut stream = UnixStream::connect(&self.socket)?;
        stream.set_read_timeout(Some(ANSWER_WITHIN))?;
        writeln!(stream, "{line}")?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer)?;
        Ok(answer)
    }

    fn parsed<T: DeserializeOwned>(&self, answer: &str) -> Result<T, Failure> {
        serde_json::from_str(answer).map_err(|error| self.silent(error))
    }

    fn silent(&self, cause: impl ToString) -> Failure {
        Failure::Pendant {
            socket: self.socket.clone(),
            cause: cause.to_string(),
        }
    }
}

/// Does something at the pendant of a system's emulated arm; prints its answer.
///
/// # Errors
/// [`Failure::Pendant`].
pub fn pendant(action: PendantAction, prefix: Option<&str>) -> Result<(), Failure> {
    let domain = Domain::new(prefix)?;
    let bus = Address::of_system(domain.prefix())?;
    let line = match action {
        PendantAction::Idle => "idle",
        PendantAction::Activate => "activate",
        PendantAction::EStop => "e-stop",
        PendantAction::Release => "release",
        PendantAction::Status => "status",
        PendantAction::Record => "record",
    };
    match Pendant::of(&bus) {
        Some(pendant) => say(pendant.say(line)?.trim_end()),
        None => Ok(()),
    }
}
