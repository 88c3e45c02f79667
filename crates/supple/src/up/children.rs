//! Child processes of a system: starts, supervises and terminates the programs that are installed beside this one.

use super::plan::{CONTROLLER, Program};
use super::shared_processor::SharedProcessor;
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
#[derive(Debug)]
pub struct ChildProcesses {
    running: Vec<(&'static str, Child)>,
    /// Programs that have exited, with their exit status.
    ended: Vec<(&'static str, ExitStatus)>,
    /// File to which the processes write their standard error; without it, they use that of this process.
    reports: Option<File>,
    /// Processor on which all of them run; without it, on any.
    processor: Option<SharedProcessor>,
}

impl ChildProcesses {
    /// Creates the processes of a system, of which none runs yet. In virtual time they run on one processor.
    pub fn new(domain: &Domain, virtual_time: bool) -> ChildProcesses {
        ChildProcesses {
            running: Vec::new(),
            ended: Vec::new(),
            reports: None,
            processor: match virtual_time {
                true => SharedProcessor::take(domain),
                false => None,
            },
        }
    }

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
        if let Some(processor) = &self.processor {
            processor.bind(&child);
        }
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

/// Third line of the pidfile of a system that ends by holding its arm.
const HELD_UNTIL_SUPPORTED: &str = "held until supported";

/// File with the PID of the process that runs the system, for `supple stop`, in its second line the system's arm, and in a third line
/// whether the system ends by holding its arm; a lock on it excludes a second process.
#[derive(Debug)]
pub struct Pidfile {
    domain: Domain,
    arm: String,
    held_until_supported: bool,
    path: PathBuf,
    locked: File,
}

impl Pidfile {
    /// Creates and locks the file for a system that this process runs with the arm of this name; `held_until_supported` as in `supple up
    /// --hold-until-supported`.
    ///
    /// # Errors
    /// [`Failure::AlreadyRunning`], [`Failure::File`].
    pub fn create(
        domain: &Domain,
        arm: &str,
        held_until_supported: bool,
    ) -> Result<Pidfile, Failure> {
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
            let mut text = format!("{}\n{arm}\n", std::process::id());
            if held_until_supported {
                text += HELD_UNTIL_SUPPORTED;
                text.push('\n');
            }
            file.write_all(text.as_bytes()).map_err(failed)?;
            return Ok(Pidfile {
                domain: domain.clone(),
                arm: arm.to_owned(),
                held_until_supported,
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
            && let Ok(mut replacement) =
                Pidfile::create(&self.domain, &self.arm, self.held_until_supported)
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

/// A running `supple up`, or another command that runs a system.
#[derive(Debug)]
pub struct RunningSystem {
    pidfile: PathBuf,
    process: Pid,
    /// Arm in the form for `--arm`; `None` if the pidfile does not contain it.
    pub arm: Option<String>,
    /// Whether the arm is held at the end until somebody declares that it is supported.
    pub held_until_supported: bool,
}

impl RunningSystem {
    /// Returns the process that runs the system of this domain; `None` if there is none.
    pub fn of(domain: &Domain) -> Option<RunningSystem> {
        let pidfile = pidfile_path(domain);
        let text = fs::read_to_string(&pidfile).ok()?;
        let mut lines = text.lines();
        let process = Pid::from_raw(lines.next()?.trim().parse().ok()?)?;
        let system = RunningSystem {
            pidfile,
            process,
            arm: lines.next().map(str::to_owned),
            held_until_supported: lines.next() == Some(HELD_UNTIL_SUPPORTED),
        };
        system.runs().then_some(system)
    }

    /// Terminates the process; with `supported`, declares that the arm is supported.
    ///
    /// # Errors
    /// [`Failure::File`].
    pub fn terminate(&self, supported: bool) -> Result<(), Failure> {
        self.send(Signal::TERM)?;
        if supported {
            pause(DECLARE_DELAY);
            self.declare_supported()?;
        }
        Ok(())
    }

    /// Declares that the arm is supported.
    ///
    /// # Errors
    /// [`Failure::File`].
    pub fn declare_supported(&self) -> Result<(), Failure> {
        self.send(Signal::USR1)
    }

    /// Sends a signal, unless the process has ended.
    fn send(&self, signal: Signal) -> Result<(), Failure> {
        match kill_process(self.process, signal) {
            Err(Errno::SRCH) => Ok(()),
            sent => sent.map_err(|error| {
                Failure::file("signal the process of", &self.pidfile, error.into())
            }),
        }
    }

    /// Whether the process still runs; not if its PID now belongs to another program, and not if it has ended and its parent has not yet
    /// asked for its exit code.
    pub fn runs(&self) -> bool {
        let stat = format!("/proc/{}/stat", self.process.as_raw_nonzero());
        let Ok(stat) = fs::read_to_string(stat) else {
            return false;
        };
        // PID (name) state ...; a name may contain a parenthesis.
        let Some((before, after)) = stat.rsplit_once(") ") else {
            return false;
        };
        before.split_once('(').map(|(_, name)| name) == Some("supple") && !after.starts_with('Z')
    }
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
        let mut pidfile = Pidfile::create(&domain, "my arm", true).expect("created");
        let path = pidfile_path(&domain);
        fs::remove_file(&path).expect("removed");
        pidfile.restore();
        let text = fs::read_to_string(&path).expect("there again");
        let process = std::process::id();
        assert_eq!(text, format!("{process}\nmy arm\nheld until supported\n"));
        let second = Pidfile::create(&domain, "wam4", false);
        assert!(matches!(second, Err(Failure::AlreadyRunning { .. })));
        drop(pidfile);
        assert!(!path.exists());
    }
}
