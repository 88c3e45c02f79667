//! Conditions in which a request of an operator must still arrive: a full request queue, a full disk, standard error that is
//! not read.

use super::spec::RequestObstruction;
use super::up_process::Up;
use crate::cli::UpArgs;
use crate::operate::OperatorSession;
use core::time::Duration;
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::process::{Resource, Rlimit, prlimit};
use std::fs::File;
use std::io::{PipeReader, PipeWriter, Write};
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::time::Instant;
use supple_cli::exit::Failure;
use supple_core::config::Gains;
use supple_core::controller::Request;
use supple_ipc::Domain;
use supple_ipc::message::Telemetry;

/// Number of queued requests that fills the request queue.
const QUEUE_CAPACITY: u64 = 16;
/// Distance of the cycles of the queued requests from the current cycle.
const FAR_FUTURE_CYCLES: u64 = 1_000_000_000;
/// Timeout for telemetry of a running system.
const TELEMETRY_TIMEOUT: Duration = Duration::from_secs(20);

/// Requests idle; returns the time until its reply \[ms\], or the reason of a refusal.
///
/// # Errors
/// If the system is not running.
pub fn idle_after<const N: usize>(domain: &Domain) -> Result<Result<f64, String>, Failure> {
    let begin = Instant::now();
    match OperatorSession::<N>::new(domain)?.send_request(&Request::Idle, None) {
        Ok(_) => Ok(Ok(begin.elapsed().as_secs_f64() * 1e3)),
        Err(Failure::Refused { reason }) => Ok(Err(reason)),
        Err(failure) => Err(failure),
    }
}

/// Requests idle as [`idle_after`] does while the request queue is full; `next` reads telemetry.
///
/// # Errors
/// If the system is not running.
pub fn idle_past_a_full_queue<const N: usize>(
    domain: &Domain,
    mut next: impl FnMut() -> Result<Option<Telemetry>, Failure>,
) -> Result<Result<f64, String>, Failure> {
    let begin = Instant::now();
    let cycle = loop {
        if let Some(telemetry) = next()? {
            break telemetry.state.cycle;
        }
        if begin.elapsed() > TELEMETRY_TIMEOUT {
            return Err(Failure::DidNotReachTracking);
        }
    };
    let far = cycle + FAR_FUTURE_CYCLES;
    // One operator may fill at most half of the queue.
    let mut others = [
        OperatorSession::<N>::new(domain)?,
        OperatorSession::<N>::new(domain)?,
    ];
    let gains = Request::Gains {
        gains: Gains::isotropic(5.0, 1.5),
        ramp_s: 1.0,
    };
    for request in 0..QUEUE_CAPACITY {
        others[request as usize % 2].queue(&gains, far + request)?;
    }
    idle_after::<N>(domain)
}

/// An output of `supple up` that becomes full.
pub enum FullOutput {
    /// A log on a full disk, simulated by a limit of the file size for this process.
    Log(PathBuf),
    /// Standard error that is not read: a full pipe, with the side that is not read.
    StandardError {
        _unread: PipeReader,
        writer: PipeWriter,
    },
}

impl FullOutput {
    /// Prepares the output.
    ///
    /// # Errors
    /// [`Failure::System`] if the system refuses a pipe.
    pub fn new(full: RequestObstruction, domain: &Domain) -> Result<FullOutput, Failure> {
        match full {
            RequestObstruction::StandardErrorFull => {
                let (_unread, writer) = std::io::pipe().map_err(Failure::system)?;
                Ok(FullOutput::StandardError { _unread, writer })
            }
            _ => {
                let name = format!("{}.mcap", domain.prefix());
                Ok(FullOutput::Log(domain.folder().join(name)))
            }
        }
    }

    /// Starts `supple up` with this output, which still accepts data.
    ///
    /// # Errors
    /// [`Failure::File`], [`Failure::System`].
    pub fn start(&self, up: &UpArgs) -> Result<Up, Failure> {
        match self {
            FullOutput::Log(file) => Up::start(
                &UpArgs {
                    log: Some(file.clone()),
                    no_log: false,
                    ..up.clone()
                },
                None,
            ),
            FullOutput::StandardError { writer, .. } => {
                let end = OwnedFd::from(writer.try_clone().map_err(Failure::system)?);
                Up::start(up, Some(File::from(end)))
            }
        }
    }

    /// Makes the output full.
    ///
    /// # Errors
    /// [`Failure::File`] if the log is missing, [`Failure::System`] if the system refuses the limit.
    pub fn fill(&self, up: &Up) -> Result<(), Failure> {
        match self {
            FullOutput::Log(file) => {
                let part = part_of(file);
                let length = std::fs::metadata(&part)
                    .map_err(|error| Failure::file("read", &part, error))?
                    .len();
                let limit = Rlimit {
                    current: Some(length),
                    maximum: Some(length),
                };
                prlimit(Some(up.process()), Resource::Fsize, limit).map_err(Failure::system)?;
            }
            FullOutput::StandardError { writer, .. } => {
                let flags = fcntl_getfl(writer).map_err(Failure::system)?;
                fcntl_setfl(writer, flags | OFlags::NONBLOCK).map_err(Failure::system)?;
                for block in [4096, 1] {
                    let mut end = writer;
                    while end.write(&[b'.'; 4096][..block]).is_ok() {}
                }
                fcntl_setfl(writer, flags).map_err(Failure::system)?;
            }
        }
        Ok(())
    }

    /// Whether the output accepted no data after it was full; call it after the run. The log is then incomplete, or the pipe still
    /// accepts no byte.
    pub fn was_full(&self) -> bool {
        match self {
            FullOutput::Log(file) => part_of(file).exists() && !file.exists(),
            FullOutput::StandardError { writer, .. } => {
                fcntl_setfl(writer, OFlags::NONBLOCK | OFlags::WRONLY).is_ok()
                    && (&mut &*writer).write(b".").is_err()
            }
        }
    }

    /// Removes the files of the run.
    pub fn remove(self) {
        if let FullOutput::Log(file) = self {
            let _ = std::fs::remove_file(part_of(&file));
            let _ = std::fs::remove_file(file);
        }
    }
}

/// The file of a log that is still being written.
fn part_of(file: &std::path::Path) -> PathBuf {
    let mut part = file.as_os_str().to_owned();
    part.push(".part");
    PathBuf::from(part)
}
