//! `supple up` as a process that a test case starts.

use crate::cli::UpArgs;
use rustix::process::{Pid, Signal, kill_process};
use std::fs::File;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use supple_cli::exit::Failure;

/// `supple up` as a child process.
pub struct Up(Child);

impl Up {
    /// Starts `supple up`; it and its processes write their standard error to `reports`.
    ///
    /// # Errors
    /// [`Failure::File`].
    pub fn start(up: &UpArgs, reports: Option<File>) -> Result<Up, Failure> {
        let this = std::env::current_exe()
            .map_err(|error| Failure::file("find", Path::new("this program"), error))?;
        let child = Command::new(&this)
            .args(up.to_arguments())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(reports.map_or(Stdio::inherit(), Stdio::from))
            .spawn();
        child
            .map(Up)
            .map_err(|error| Failure::file("start", &this, error))
    }

    /// Returns the id of the process.
    pub fn process(&self) -> Pid {
        Pid::from_child(&self.0)
    }

    /// Sends a signal to the process.
    pub fn signal(&self, signal: Signal) {
        // Ignore errors: the process may have exited already.
        let _ = kill_process(self.process(), signal);
    }

    /// Terminates the process and waits for it.
    pub fn end(mut self) {
        self.signal(Signal::CONT);
        self.signal(Signal::TERM);
        let _ = self.0.wait();
    }
}

impl Drop for Up {
    fn drop(&mut self) {
        // The processes that it started end with it.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
