//! Child processes of a system: starts, supervises and terminates the programs that are installed beside this one.

use super::plan::{CONTROLLER, Program};
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
use supple_cli::console::print_status;
use supple_cli::exit::Failure;
use supple_cli::interrupt;
use supple_cli::sibling::program_beside;
use supple_ipc::Domain;
use supple_realtime::{pause, support_is_declared};

/// Exit code of a program that cannot write a file.
const FILE_CODE: i32 = 6;
/// Time to wait for a lock that a forked child may still hold briefly.
const FORK_LOCK_GRACE: Duration = Duration::from_millis(200);
/// Interval at which a declaration that the arm is supported is repeated to a program that is ending.
const DECLARE_INTERVAL: Duration = Duration::from_millis(200);
/// Time from the request to shut down to the declaration, in which a system begins its shutdown.
const DECLARE_DELAY: Duration = Duration::from_millis(500);
/// Poll interval while waiting for a process to exit.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// The child processes; dropping this value kills those that still run.
#[derive(Debug, Default)]
pub struct ChildProcesses {
    running: Vec<(&'static str, Child)>,
    /// Programs that have exited, with their exit status.
    ended: Vec<(&'static str, ExitStatus)>,
    /// File to which the processes write their standard error; without it, they use that of this process.
    reports: Option<File>,
}

impl ChildProcesses {
    /// Redirects the standard error of all processes that are started later to a file.
    pub fn report_to(&mut self, file: File) {
        self.reports = Some(file);
    }

    /// Starts a program that is installed beside this one. The child ignores terminal interrupts: the parent
    /// terminates it in order, after it has collected its data.
    ///
    /// # Errors
    /// [`Failure::MissingProgram`], which states how to build the program.
    pub fn start(&mut self, program: &Program) -> Result<(), Failure> {
        let Program { name, arguments } = program;
        let program = program_beside(name)?;
        let reports = match &self.reports {
            Some(file) => {
                let file = file.try_clone();
                Stdio::from(file.map_err(|error| Failure::file("start", &program, error))?)
            }
            None => Stdio::inherit(),
        };
        let child = Command::new(&program)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(reports)
            .process_group(0)
            .spawn()
            .map_err(|error| Failure::file("start", &program, error))?;
        if *name == CONTROLLER {
            interrupt::forward_interrupts_to(&child);
        }
        self.running.push((name, child));
        Ok(())
    }

    /// Checks that all processes are running.
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

    /// Checks that all processes are running. With `may_exit`, the program `may_end` may have exited successfully.
    ///
    /// # Errors
    /// [`Failure::ProcessEnded`].
    pub fn check_running(&mut self, may_exit: bool, may_end: &'static str) -> Result<(), Failure> {
        for (name, child) in &mut self.running {
            if let Some(status) = status(child)? {
                let expected = may_exit && *name == may_end && status.success();
                if !expected {
                    return Err(ended(name, status));
                }
            }
        }
        Ok(())
    }

    /// Whether the program has exited successfully.
    ///
    /// # Errors
    /// [`Failure::ProcessEnded`] if it exited with an error.
    pub fn exited_successfully(&mut self, name: &'static str) -> Result<bool, Failure> {
        let Some((_, child)) = self.running.iter_mut().find(|(n, _)| *n == name) else {
            return Ok(self.ended.iter().any(|(n, _)| *n == name));
        };
        match status(child)? {
            Some(status) if status.success() => Ok(true),
            Some(status) => Err(ended(name, status)),
            None => Ok(false),
        }
    }

    /// Sends a signal to a program.
    ///
    /// # Errors
    /// [`Failure::NoSuchProcess`] if the program is not a child.
    pub fn signal(&self, name: &'static str, signal: Signal) -> Result<(), Failure> {
        let Some((_, child)) = self.running.iter().find(|(n, _)| *n == name) else {
            return Err(Failure::NoSuchProcess { name });
        };
        send(child, signal);
        Ok(())
    }

    /// Restarts a program that was killed.
    ///
    /// # Errors
    /// The same as those of [`ChildProcesses::start`].
    pub fn restart(&mut self, program: &Program) -> Result<(), Failure> {
        if let Some(index) = self.running.iter().position(|(n, _)| *n == program.name) {
            kill(&mut self.running.remove(index).1);
        }
        self.start(program)
    }

    /// Name of the program whose trace is incomplete, if any.
    pub fn trace_ended(&self) -> Option<&'static str> {
        let mut ended = self.ended.iter();
        let found = ended.find(|(_, status)| status.code() == Some(FILE_CODE));
        found.map(|(name, _)| *name)
    }

    /// Terminates a program and waits for it while calling `poll` repeatedly, until `poll` fails; kills the program
    /// after the timeout `within`. Forwards a declaration of the operator that the arm is supported.
    ///
    /// # Errors
    /// The error of `poll`, after the program has exited.
    pub fn end(
        &mut self,
        name: &'static str,
        within: Duration,
        poll: &mut dyn FnMut() -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let Some(index) = self.running.iter().position(|(n, _)| *n == name) else {
            return Ok(());
        };
        let (name, mut child) = self.running.remove(index);
        if status(&mut child)?.is_none() {
            send(&child, Signal::TERM);
        }
        let start = Instant::now();
        let (mut done, mut declared) = (Ok(()), None::<Instant>);
        let status = loop {
            if let Some(status) = status(&mut child)? {
                break status;
            }
            // The program forgets a declaration that is older than its own shutdown.
            let is_due = declared.is_none_or(|last| last.elapsed() > DECLARE_INTERVAL);
            if support_is_declared() && is_due {
                declared = Some(Instant::now());
                send(&child, Signal::USR1);
            }
            if done.is_ok() {
                done = poll();
            }
            if start.elapsed() > within {
                kill(&mut child);
            }
            pause(POLL_INTERVAL);
        };
        if !status.success() {
            print_status(&format!("{name} exited ({status}); see its output above"));
        }
        self.ended.push((name, status));
        done
    }
}

impl Drop for ChildProcesses {
    fn drop(&mut self) {
        for (_, child) in &mut self.running {
            kill(child);
        }
    }
}

fn send(child: &Child, signal: Signal) {
    if let Some(pid) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
        // Ignore errors: the process may have exited already.
        let _ = kill_process(pid, signal);
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

/// File with the PID of the process that runs the system, for `supple stop`, and in its second line the system's arm; a lock
/// on it excludes a second process.
#[derive(Debug)]
pub struct Pidfile {
    domain: Domain,
    arm: String,
    path: PathBuf,
    locked: File,
}

impl Pidfile {
    /// Creates and locks the file for a system that this process runs with the arm of this name.
    ///
    /// # Errors
    /// [`Failure::AlreadyRunning`], [`Failure::File`].
    pub fn create(domain: &Domain, arm: &str) -> Result<Pidfile, Failure> {
        let path = pidfile_path(domain);
        let failed = |error: io::Error| Failure::file("write", &path, error);
        let start = Instant::now();
        loop {
            let mut options = OpenOptions::new();
            options.read(true).write(true).create(true).mode(0o600);
            let mut file = options.open(&path).map_err(failed)?;
            match flock(&file, FlockOperation::NonBlockingLockExclusive) {
                // Between fork and exec, a child shares the locks of its parent.
                Err(Errno::WOULDBLOCK) if start.elapsed() < FORK_LOCK_GRACE => {
                    pause(POLL_INTERVAL);
                    continue;
                }
                Err(Errno::WOULDBLOCK) => {
                    return Err(Failure::AlreadyRunning {
                        prefix: domain.prefix().to_owned(),
                        process: first_line(&path)
                            .and_then(|line| line.parse().ok())
                            .unwrap_or_default(),
                    });
                }
                locked => locked.map_err(|error| failed(error.into()))?,
            }
            // The file may have been removed and recreated meanwhile; then the lock is on the wrong file.
            let is_there = fs::metadata(&path)
                .is_ok_and(|there| file.metadata().is_ok_and(|mine| mine.ino() == there.ino()));
            if !is_there {
                continue;
            }
            file.set_len(0).map_err(failed)?;
            file.write_all(format!("{}\n{arm}\n", std::process::id()).as_bytes())
                .map_err(failed)?;
            return Ok(Pidfile {
                domain: domain.clone(),
                arm: arm.to_owned(),
                path,
                locked: file,
            });
        }
    }
}

impl Pidfile {
    /// Creates the file again if another program, such as one that cleans /tmp, has removed it, because `supple stop` needs it. If
    /// the folder is missing, the next call tries again.
    pub fn restore(&mut self) {
        let is_gone = |error: io::Error| error.kind() == io::ErrorKind::NotFound;
        if fs::symlink_metadata(&self.path).is_err_and(is_gone)
            && let Ok(mut replacement) = Pidfile::create(&self.domain, &self.arm)
        {
            // `replacement` now holds the old lock and is dropped; it must not remove the new file.
            std::mem::swap(&mut self.locked, &mut replacement.locked);
            replacement.path = PathBuf::new();
        }
    }
}

impl Drop for Pidfile {
    fn drop(&mut self) {
        // Readers detect a leftover file as stale. Remove it before releasing the lock.
        let _ = fs::remove_file(&self.path);
    }
}

fn pidfile_path(domain: &Domain) -> PathBuf {
    domain.folder().join(format!("{}.pid", domain.prefix()))
}

/// Terminates the `supple up` of a system; with `supported`, declares that its arm is supported. Returns false if there is none.
///
/// # Errors
/// [`Failure::File`].
pub fn stop_running(domain: &Domain, supported: bool) -> Result<bool, Failure> {
    let path = pidfile_path(domain);
    let Some(process) = running(&path) else {
        return Ok(false);
    };
    let declare = || {
        pause(DECLARE_DELAY);
        kill_process(process, Signal::USR1)
    };
    kill_process(process, Signal::TERM)
        .and_then(|()| if supported { declare() } else { Ok(()) })
        .map(|()| true)
        .map_err(|error| Failure::file("end the process of", &path, error.into()))
}

/// Returns the arm of a running system in the form for `--arm`; `None` if the system was not started by `supple up`.
pub fn running_arm(domain: &Domain) -> Option<String> {
    let path = pidfile_path(domain);
    running(&path)?;
    let text = fs::read_to_string(path).ok()?;
    text.lines().nth(1).map(str::to_owned)
}

/// Returns the PID of the running `supple up` from the file; `None` if the PID now belongs to another program.
fn running(path: &Path) -> Option<Pid> {
    let line = first_line(path)?;
    let process = Pid::from_raw(line.parse().ok()?)?;
    let name = fs::read_to_string(format!("/proc/{line}/comm")).ok()?;
    (name.trim() == "supple").then_some(process)
}

fn first_line(path: &Path) -> Option<String> {
    let text = fs::read_to_string(path).ok()?;
    text.lines().next().map(|line| line.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_removed_pidfile_is_created_again_and_locked() {
        let folder = tempfile::tempdir().expect("a folder");
        let domain = Domain::in_folder(&folder.path().join("run"), "pid").expect("a domain");
        let mut pidfile = Pidfile::create(&domain, "my arm").expect("created");
        let path = pidfile_path(&domain);
        fs::remove_file(&path).expect("removed");
        pidfile.restore();
        let text = fs::read_to_string(&path).expect("there again");
        assert_eq!(text, format!("{}\nmy arm\n", std::process::id()));
        let second = Pidfile::create(&domain, "wam4");
        assert!(matches!(second, Err(Failure::AlreadyRunning { .. })));
        drop(pidfile);
        assert!(!path.exists());
    }
}
