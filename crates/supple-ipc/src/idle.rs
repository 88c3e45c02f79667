//! The request for idle, on a way of its own: one datagram to the controller, one back.
//!
//! It takes no place of a reader or an operator, no shared memory and no lock, and waits in no queue: hung clients, a
//! full `/dev/shm` and a process that is stopped while it joins do not hold it up. All that ask at the same time ask for
//! the same, so that none has to be refused for want of room. The socket is in the system's folder, for its owner alone.

use crate::bell::failed;
use crate::domain::Domain;
use crate::error::IpcError;
use crate::message::{OperatorReply, Outcome, Text};
use crate::writer_identity::drawn;
use core::time::Duration;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use std::fs::{self, Permissions};
use std::io::{self, ErrorKind};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::path::PathBuf;
use std::time::Instant;
use supple_core::codes;
use supple_core::controller::Mode;

/// What a request begins with.
const REQUEST: &[u8; 8] = b"idle.v1\n";
/// Length of a request: that, and the number of the question.
const REQUEST_BYTES: usize = 16;
/// Length of an answer before its words: number of the question, cycle, outcome, mode.
const ANSWER_BYTES: usize = 18;
/// Askers that wait for an answer; of more, those that came first hear nothing, and what they asked for happens.
const ASKERS: usize = 64;
/// How long an asker waits before it asks again.
const ASK_AGAIN: Duration = Duration::from_millis(100);
/// How long it waits for room in the controller's socket.
const ROOM_AGAIN: Duration = Duration::from_millis(1);

fn path(domain: &Domain) -> PathBuf {
    let name = format!("{}.idle.socket", domain.prefix());
    domain.folder().join(name)
}

/// What became of a request for idle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IdleAnswer {
    /// Cycle in which it was heard.
    pub cycle: u64,
    /// What became of it.
    pub outcome: Outcome,
    /// Mode after it, if this version knows it.
    pub mode: Option<Mode>,
    /// Why not, where refused.
    pub words: String,
}

/// The controller's end.
#[derive(Debug)]
pub struct IdleServer {
    socket: UnixDatagram,
    path: PathBuf,
    askers: Vec<Asker>,
}

#[derive(Debug)]
struct Asker {
    address: SocketAddr,
    question: [u8; 8],
    /// In which look it came.
    look: u64,
}

impl IdleServer {
    /// Takes the controller's place. To be called by who has that of a [`ControllerLink`](crate::ControllerLink): the
    /// socket of another is replaced.
    ///
    /// # Errors
    /// [`IpcError::Folder`] where the socket cannot be made.
    pub fn new(domain: &Domain) -> Result<IdleServer, IpcError> {
        let path = path(domain);
        let made = || -> io::Result<UnixDatagram> {
            match fs::remove_file(&path) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
                _ => {}
            }
            let socket = UnixDatagram::bind(&path)?;
            fs::set_permissions(&path, Permissions::from_mode(0o600))?;
            // Nobody who does not read his answer holds up the others.
            socket.set_nonblocking(true)?;
            Ok(socket)
        };
        let socket = made().map_err(|error| IpcError::Folder {
            folder: domain.folder().to_owned(),
            cause: format!("{}: {error}", path.display()),
            remedy: "set XDG_RUNTIME_DIR to a folder with a short path that can be written",
        })?;
        Ok(IdleServer {
            socket,
            path,
            askers: Vec::with_capacity(ASKERS),
        })
    }

    /// Waits for requests at most for `timeout`, and takes in all that are there as those of look `look`. Gives whether
    /// there are any.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn look(&mut self, look: u64, timeout: Duration) -> Result<bool, IpcError> {
        let timeout = Timespec::try_from(timeout).unwrap_or_default();
        let mut waited = [PollFd::new(&self.socket, PollFlags::IN)];
        match poll(&mut waited, Some(&timeout)) {
            Ok(0) | Err(Errno::INTR) => return Ok(false),
            Ok(_) => {}
            Err(error) => return Err(failed("idle", &error.into())),
        }
        let mut asked = false;
        // More than wait at a time are not taken in one look.
        for _ in 0..ASKERS {
            let mut request = [0; REQUEST_BYTES + 1];
            match self.socket.recv_from(&mut request) {
                Ok((REQUEST_BYTES, address)) if request.starts_with(REQUEST) => {
                    let mut question = [0; 8];
                    question.copy_from_slice(&request[8..REQUEST_BYTES]);
                    if self.askers.len() == ASKERS {
                        self.askers.remove(0);
                    }
                    self.askers.push(Asker {
                        address,
                        question,
                        look,
                    });
                    asked = true;
                }
                // Something else: nobody's request.
                Ok(_) => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(failed("idle", &error)),
            }
        }
        Ok(asked)
    }

    /// Somebody waits for an answer.
    pub fn is_asked(&self) -> bool {
        !self.askers.is_empty()
    }

    /// Answers all who came in look `reply.sequence` or before.
    pub fn answer(&mut self, reply: &OperatorReply) {
        let words = reply.text.as_str().as_bytes();
        let mut answer = Vec::with_capacity(ANSWER_BYTES + words.len());
        self.askers.retain(|asker| {
            if asker.look > reply.sequence {
                return true;
            }
            answer.clear();
            answer.extend(asker.question);
            answer.extend(reply.cycle.to_le_bytes());
            answer.extend([reply.outcome, reply.mode]);
            answer.extend(words);
            // Who asked may have gone, or asks again.
            let _ = self.socket.send_to_addr(&answer, &asker.address);
            false
        });
    }
}

impl Drop for IdleServer {
    fn drop(&mut self) {
        // The next one removes what is left.
        let _ = fs::remove_file(&self.path);
    }
}

/// Asks the controller of a system for idle, and waits for its answer at most for `timeout`; `None` where none came.
/// Takes nothing that others may have used up.
///
/// # Errors
/// [`IpcError::Service`] where the system gives no socket.
pub fn ask_for_idle(domain: &Domain, timeout: Duration) -> Result<Option<IdleAnswer>, IpcError> {
    asked(&path(domain), timeout).map_err(|error| failed("idle", &error))
}

fn asked(path: &std::path::Path, timeout: Duration) -> io::Result<Option<IdleAnswer>> {
    let start = Instant::now();
    let question = drawn()?;
    // An address without a file: it needs no room on a disk, and nobody knows it before. A socket that is connected
    // takes from its peer alone.
    let address = SocketAddr::from_abstract_name(format!("supple-idle-{question:016x}"))?;
    let question = question.to_le_bytes();
    let socket = UnixDatagram::bind_addr(&address)?;
    socket.set_nonblocking(true)?;
    let mut request = [0; REQUEST_BYTES];
    request[..8].copy_from_slice(REQUEST);
    request[8..].copy_from_slice(&question);
    loop {
        let sent = socket.connect(path).and_then(|()| socket.send(&request));
        let wait = match sent {
            Ok(_) => ASK_AGAIN,
            Err(error) => match error.kind() {
                // Others ask too: what is wanted happens, but this one wants to hear of it.
                ErrorKind::WouldBlock => ROOM_AGAIN,
                ErrorKind::NotFound | ErrorKind::ConnectionRefused | ErrorKind::NotConnected => {
                    return Ok(None);
                }
                _ => return Err(error),
            },
        };
        let left = timeout.saturating_sub(start.elapsed());
        if let Some(answer) = heard(&socket, &question, wait.min(left))? {
            return Ok(Some(answer));
        }
        if start.elapsed() >= timeout {
            return Ok(None);
        }
    }
}

/// The answer to a question, waited for.
fn heard(
    socket: &UnixDatagram,
    question: &[u8; 8],
    timeout: Duration,
) -> io::Result<Option<IdleAnswer>> {
    let timeout = Timespec::try_from(timeout).unwrap_or_default();
    match poll(&mut [PollFd::new(socket, PollFlags::IN)], Some(&timeout)) {
        Err(error) if error != Errno::INTR => return Err(error.into()),
        _ => {}
    }
    let mut answer = [0; 512];
    loop {
        match socket.recv(&mut answer) {
            Ok(length) => {
                if let Some(answer) = read(&answer[..length], question) {
                    return Ok(Some(answer));
                }
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            // A controller that has gone meanwhile: the next attempt finds nobody.
            Err(_) => return Ok(None),
        }
    }
}

fn read(answer: &[u8], question: &[u8; 8]) -> Option<IdleAnswer> {
    let (head, words) = answer.split_at_checked(ANSWER_BYTES)?;
    if !head.starts_with(question) {
        return None;
    }
    let cycle = head[8..16].try_into().ok()?;
    Some(IdleAnswer {
        cycle: u64::from_le_bytes(cycle),
        outcome: Outcome::from_code(head[16]),
        mode: codes::mode(head[17]),
        words: String::from_utf8_lossy(words).into_owned(),
    })
}

/// A reply to all who asked for idle in a look or before.
pub fn idle_reply(
    look: u64,
    cycle: u64,
    mode: Mode,
    outcome: Outcome,
    text: Text,
) -> OperatorReply {
    OperatorReply {
        operator: 0,
        sequence: look,
        cycle,
        text,
        outcome: outcome as u8,
        mode: mode as u8,
        reserved: [0; 6],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOON: Duration = Duration::from_secs(60);

    fn system() -> (tempfile::TempDir, Domain) {
        let folder = tempfile::tempdir().expect("a folder");
        let domain = Domain::within(&folder.path().join("run"), "idle").expect("a domain");
        (folder, domain)
    }

    #[test]
    fn many_who_ask_at_once_all_hear_the_answer() {
        let (_folder, domain) = system();
        let mut server = IdleServer::new(&domain).expect("a server");
        std::thread::scope(|scope| {
            let askers: Vec<_> = (0..ASKERS)
                .map(|_| scope.spawn(|| ask_for_idle(&domain, SOON)))
                .collect();
            let mut look = 0;
            while askers.iter().any(|asker| !asker.is_finished()) {
                look += 1;
                server.look(look, Duration::from_millis(1)).expect("read");
                let words = Text::of(&"no");
                server.answer(&idle_reply(look, 7, Mode::Idle, Outcome::Refused, words));
            }
            for asker in askers {
                let answer = asker.join().expect("no panic").expect("asked");
                let expected = IdleAnswer {
                    cycle: 7,
                    outcome: Outcome::Refused,
                    mode: Some(Mode::Idle),
                    words: "no".to_owned(),
                };
                assert_eq!(answer, Some(expected));
            }
        });
        assert!(!server.is_asked());
    }

    #[test]
    fn who_came_after_the_look_that_was_answered_waits_on() {
        let (_folder, domain) = system();
        let mut server = IdleServer::new(&domain).expect("a server");
        let nobody_answers = ask_for_idle(&domain, Duration::from_millis(1));
        assert_eq!(nobody_answers.expect("asked"), None);
        assert!(server.look(5, SOON).expect("read"));
        server.answer(&idle_reply(
            4,
            1,
            Mode::Idle,
            Outcome::Accepted,
            Text::EMPTY,
        ));
        assert!(server.is_asked());
        server.answer(&idle_reply(
            5,
            1,
            Mode::Idle,
            Outcome::Accepted,
            Text::EMPTY,
        ));
        assert!(!server.is_asked());
    }

    #[test]
    fn what_is_no_request_asks_for_nothing() {
        let (_folder, domain) = system();
        let mut server = IdleServer::new(&domain).expect("a server");
        let stranger = UnixDatagram::unbound().expect("a socket");
        for bytes in [&b""[..], b"idle", &[0xff; 16], &[b'i'; 400]] {
            stranger.send_to(bytes, path(&domain)).expect("sent");
        }
        assert!(!server.look(1, SOON).expect("read"));
        assert!(!server.is_asked());
    }

    #[test]
    fn without_a_controller_there_is_no_answer_and_no_waiting() {
        let (_folder, domain) = system();
        assert_eq!(ask_for_idle(&domain, SOON).expect("asked"), None);
        drop(IdleServer::new(&domain).expect("a server"));
        assert_eq!(ask_for_idle(&domain, SOON).expect("asked"), None);
    }

    #[test]
    fn the_socket_is_the_owners_alone() {
        let (_folder, domain) = system();
        let _server = IdleServer::new(&domain).expect("a server");
        let about = fs::metadata(path(&domain)).expect("there");
        assert_eq!(about.permissions().mode() & 0o777, 0o600);
    }
}
