//! The live page of a system: a second process of this program, `supple view`. The system does not depend on it and continues
//! without it.

use crate::cli::UpArgs;
use core::time::Duration;
use rustix::process::{Pid, Signal, kill_process};
use std::os::fd::AsFd;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Instant;
use supple_cli::exit::Failure;
use supple_ipc::Domain;
use supple_realtime::pause;

/// Time after which the process is killed if it does not end.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(1);
/// Poll interval while the process ends.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// The process of the page; dropping this value ends it.
#[derive(Debug)]
pub struct Viewer(Child);

impl Viewer {
    /// Starts the process. It prints its URL on standard error, because standard output is for the summary.
    ///
    /// # Errors
    /// [`Failure::File`].
    pub fn start(args: &UpArgs, domain: &Domain) -> Result<Viewer, Failure> {
        let this = |error| Failure::file("find", Path::new("this program"), error);
        let program = std::env::current_exe().map_err(this)?;
        let failed = |error| Failure::file("start", &program, error);
        let stderr = std::io::stderr().as_fd().try_clone_to_owned();
        let mut command = Command::new(&program);
        command.args(["view", "--supervised", "--arm", &args.arm]);
        command.args(["--prefix", domain.prefix()]);
        if let Some(face_m) = args.block_m {
            command.arg(format!("--block-m={face_m}"));
        }
        if args.strict {
            command.arg("--strict");
        }
        let started = command
            .stdin(Stdio::null())
            .stdout(stderr.map_err(failed)?)
            .spawn();
        started.map(Viewer).map_err(failed)
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        if let Some(pid) = i32::try_from(self.0.id()).ok().and_then(Pid::from_raw) {
            // Ignore errors: the process may have exited already.
            let _ = kill_process(pid, Signal::TERM);
        }
        let start = Instant::now();
        while matches!(self.0.try_wait(), Ok(None)) {
            if start.elapsed() > SHUTDOWN_TIMEOUT {
                let _ = self.0.kill();
                let _ = self.0.wait();
                return;
            }
            pause(POLL_INTERVAL);
        }
    }
}
