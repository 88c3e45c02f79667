//! The processes of a system: started from beside this program, watched over, ended in order.

use super::plan::{CONTROLLER, Program};
use crate::console::remark;
use crate::exit::Failure;
use crate::interrupt;
use core::time::Duration;
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use rustix::process::{Pid, Signal, kill_process};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Instant;
use supple_ipc::{Domain, pause};

/// Exit code of a program that could not write a file.
const FILE_CODE: i32 = 6;
/// How long another process's lock may be one that it has just given back.
const HELD_BY_A_FORK: Duration = Duration::from_millis(200);
/// How often an ending process is looked at.
const LOOK_EVERY: Duration = Duration::from_millis(5);

/// The processes; what still runs when this is dropped is killed.
#[derive(Debug, Default)]
pub struct Children {
    running: Vec<(&'static str, Child)>,
    /// Programs that have ended, each with how.
    ended: Vec<(&'static str, ExitStatus)>,
}

impl Children {
    /// Starts a program that is beside this one. It hears no interrupt of a terminal: it is ended in order,
    /// after what it knows has been asked of it.
    ///
    /// # Errors
    /// [`Failure::NoSibling`] says how to build what is missing.
    pub fn start(&mut self, program: &Program) -> Result<(), Failure> {
        let Program { name, arguments } = program;
        let program = sibling(name)?;
        let child = Command::new(&program)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .process_group(0)
            .spawn()
            .map_err(|error| Failure::file("start", &program, error))?;
        if *name == CONTROLLER {
            interrupt::pass_on_to(&child);
        }
        self.running.push((name, child));
        Ok(())
    }

    /// All of them run.
    ///
    /// # Errors
    /// [`Failure::ProcessEnded`].
    pub fn check(&mut self) -> Result<(), Failure> {
        for (name, child) in &mut self.running {
            if let Some(status) = status(child)? {
                return Err(ended(name, status));
            }
        }
        Ok(())
    }

    /// All of them run, or `may_end` has ended well where it may.
    ///
    /// # Errors
    /// [`Failure::ProcessEnded`].
    pub fn check_running(
        &mut self,
        one_may_end: bool,
        may_end: &'static str,
    ) -> Result<(), Failure> {
        for (name, child) in &mut self.running {
            if let Some(status) = status(child)? {
                let expected = one_may_end && *name == may_end && status.success();
                if !expected {
                    return Err(ended(name, status));
                }
            }
        }
        Ok(())
    }

    /// A program has done all it had to.
    ///
    /// # Errors
    /// [`Failure::ProcessEnded`] where it ended otherwise.
    pub fn all_ended_well(&mut self, name: &'static str) -> Result<bool, Failure> {
        let Some((_, child)) = self.running.iter_mut().find(|(n, _)| *n == name) else {
            return Ok(self.ended.iter().any(|(n, _)| *n == name));
        };
        match status(child)? {
            Some(status) if status.success() => Ok(true),
            Some(status) => Err(ended(name, status)),
            None => Ok(false),
        }
    }

    /// Sends a program a signal.
    ///
    /// # Errors
    /// [`Failure::NoSuchProcess`] where it is none of these.
    pub fn signal(&self, name: &'static str, signal: Signal) -> Result<(), Failure> {
        let Some((_, child)) = self.running.iter().find(|(n, _)| *n == name) else {
            return Err(Failure::NoSuchProcess { name });
        };
        if let Some(pid) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
            // A process that has just ended needs no signal.
            let _ = kill_process(pid, signal);
        }
        Ok(())
    }

    /// Starts a program again that was killed.
    ///
    /// # Errors
    /// As [`Children::start`].
    pub fn restart(&mut self, program: &Program) -> Result<(), Failure> {
        if let Some(place) = self.running.iter().position(|(n, _)| *n == program.name) {
            kill(&mut self.running.remove(place).1);
        }
        self.start(program)
    }

    /// A program whose trace ended before its run.
    pub fn trace_ended(&self) -> Option<&'static str> {
        let mut ended = self.ended.iter();
        let found = ended.find(|(_, status)| status.code() == Some(FILE_CODE));
        found.map(|(name, _)| *name)
    }

    /// Asks a program to end and waits for it, with `meanwhile` done again and again until it fails; kills it
    /// where it does not end in time.
    ///
    /// # Errors
    /// What `meanwhile` says, once the program has ended.
    pub fn end(
        &mut self,
        name: &'static str,
        within: Duration,
        meanwhile: &mut dyn FnMut() -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let Some(place) = self.running.iter().position(|(n, _)| *n == name) else {
            return Ok(());
        };
        let (name, mut child) = self.running.remove(place);
        if status(&mut child)?.is_none() {
            terminate(&child);
        }
        let start = Instant::now();
        let mut done = Ok(());
        let status = loop {
            if let Some(status) = status(&mut child)? {
                break status;
            }
            if done.is_ok() {
                done = meanwhile();
            }
            if start.elapsed() > within {
                kill(&mut child);
            }
            pause(LOOK_EVERY);
        };
        if !status.success() {
            remark(&format!(
                "{name} has ended ({status}); its own words are above"
            ));
        }
        self.ended.push((name, status));
        done
    }
}

impl Drop for Children {
    fn drop(&mut self) {
        for (_, child) in &mut self.running {
            kill(child);
        }
    }
}

fn terminate(child: &Child) {
    if let Some(pid) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
        // A process that has just ended needs no signal.
        let _ = kill_process(pid, Signal::TERM);
    }
}

fn kill(child: &mut Child) {
    let _ = child.kill();
    let _ = child.wait();
}

fn status(child: &mut Child) -> Result<Option<ExitStatus>, Failure> {
    child
        .try_wait()
        .map_err(|error| Failure::file("wait for", Path::new("a process"), error))
}

fn ended(name: &'static str, status: ExitStatus) -> Failure {
    Failure::ProcessEnded {
        name,
        status: status.to_string(),
    }
}

fn sibling(name: &'static str) -> Result<PathBuf, Failure> {
    let this = std::env::current_exe()
        .map_err(|error| Failure::file("find", Path::new("this program"), error))?;
    let program = this.with_file_name(name);
    match program.is_file() {
        true => Ok(program),
        false => Err(Failure::NoSibling { name, program }),
    }
}

/// Says which process runs the system, for `supple stop`; a lock on it keeps a second one out.
#[derive(Debug)]
pub struct Pidfile {
    path: PathBuf,
    _locked: File,
}

impl Pidfile {
    /// Of a system that this process runs.
    ///
    /// # Errors
    /// [`Failure::AlreadyRunning`], [`Failure::File`].
    pub fn create(domain: &Domain) -> Result<Pidfile, Failure> {
        let path = place(domain);
        let failed = |error: io::Error| Failure::file("write", &path, error);
        let start = Instant::now();
        loop {
            let mut options = OpenOptions::new();
            options.read(true).write(true).create(true).mode(0o600);
            let mut file = options.open(&path).map_err(failed)?;
            match flock(&file, FlockOperation::NonBlockingLockExclusive) {
                // A process that starts another shares its locks with it for a moment.
                Err(Errno::WOULDBLOCK) if start.elapsed() < HELD_BY_A_FORK => {
                    pause(LOOK_EVERY);
                    continue;
                }
                Err(Errno::WOULDBLOCK) => {
                    return Err(Failure::AlreadyRunning {
                        prefix: domain.prefix().to_owned(),
                        process: fs::read_to_string(&path)
                            .ok()
                            .and_then(|text| text.trim().parse().ok())
                            .unwrap_or_default(),
                    });
                }
                locked => locked.map_err(|error| failed(error.into()))?,
            }
            // One that was removed meanwhile is not the one that others find.
            let is_there = fs::metadata(&path)
                .is_ok_and(|there| file.metadata().is_ok_and(|mine| mine.ino() == there.ino()));
            if !is_there {
                continue;
            }
            file.set_len(0).map_err(failed)?;
            file.write_all(std::process::id().to_string().as_bytes())
                .map_err(failed)?;
            return Ok(Pidfile {
                path,
                _locked: file,
            });
        }
    }
}

impl Drop for Pidfile {
    fn drop(&mut self) {
        // What is left over is found stale by whoever reads it. Removed before it is unlocked.
        let _ = fs::remove_file(&self.path);
    }
}

fn place(domain: &Domain) -> PathBuf {
    domain.folder().join(format!("{}.pid", domain.prefix()))
}

/// Asks the `supple up` of a system to end. False where there is none.
///
/// # Errors
/// [`Failure::File`].
pub fn stop_running(domain: &Domain) -> Result<bool, Failure> {
    let path = place(domain);
    let Some(process) = running(&path) else {
        return Ok(false);
    };
    kill_process(process, Signal::TERM)
        .map(|()| true)
        .map_err(|error| Failure::file("end the process of", &path, error.into()))
}

/// The `supple up` of a file, if it runs. A number that another program has by now is not meant.
fn running(path: &Path) -> Option<Pid> {
    let text = fs::read_to_string(path).ok()?;
    let process = Pid::from_raw(text.trim().parse().ok()?)?;
    let name = fs::read_to_string(format!("/proc/{}/comm", text.trim())).ok()?;
    (name.trim() == "supple").then_some(process)
}
