//! Idle requests through a separate socket: the client sends one datagram, the controller answers with one datagram.
//!
//! An idle request uses no reader or operator slot, no shared memory, no lock and no queue, so hung clients, a full
//! `/dev/shm` or a process stopped while it joins cannot block it. Simultaneous requests are identical and are merged,
//! so no request is refused for lack of space. Only the owner can open the socket, which is in the system's folder.

use crate::domain::Domain;
use crate::error::IpcError;
use crate::message::{OperatorReply, Outcome, Text};
use crate::wake::failed;
use crate::writer_identity::random_id;
use core::time::Duration;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use std::fs::{self, Permissions};
use std::io::{self, ErrorKind};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::path::{Path, PathBuf};
use std::time::Instant;
use supple_core::codes;
use supple_core::controller::Mode;

/// Header of a request.
const REQUEST_HEADER: &[u8; 8] = b"idle.v1\n";
/// Length of a request \[bytes\]: header and request id.
const REQUEST_BYTES: usize = 16;
/// Length of a reply without its text \[bytes\]: request id, cycle, outcome, mode.
const REPLY_HEADER_BYTES: usize = 18;
/// Maximum number of clients waiting for a reply. If more clients wait, the oldest one gets no reply, but the controller
/// still executes its request.
const MAX_PENDING_CLIENTS: usize = 64;
/// Time after which a client repeats its request.
const RETRY_INTERVAL: Duration = Duration::from_millis(100);
/// Time between attempts to send while the controller's receive buffer is full.
const SEND_RETRY_INTERVAL: Duration = Duration::from_millis(1);

/// Returns the path of the socket for idle requests.
pub fn idle_socket(domain: &Domain) -> PathBuf {
    let name = format!("{}.idle.socket", domain.prefix());
    domain.folder().join(name)
}

/// Result of an idle request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IdleAnswer {
    /// Cycle in which the controller received the request.
    pub cycle: u64,
    /// Whether the controller accepted it.
    pub outcome: Outcome,
    /// Mode after the request; `None` if this version does not know its code.
    pub mode: Option<Mode>,
    /// Reason for a refusal; empty otherwise.
    pub text: String,
}

/// Receives the idle requests in the controller's process.
#[derive(Debug)]
pub struct IdleServer {
    socket: UnixDatagram,
    path: PathBuf,
    pending: Vec<PendingClient>,
}

#[derive(Debug)]
struct PendingClient {
    address: SocketAddr,
    request_id: [u8; 8],
    /// Number of the receive call that read this request.
    batch: u64,
}

impl IdleServer {
    /// Creates the controller's socket and replaces an existing one. Only the process that holds the
    /// [`ControllerLink`](crate::ControllerLink) may call this.
    ///
    /// # Errors
    /// [`IpcError::Folder`] if the socket cannot be created.
    pub fn new(domain: &Domain) -> Result<IdleServer, IpcError> {
        let path = idle_socket(domain);
        let replaced = match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
            _ => bind(&path),
        };
        let socket = replaced.map_err(|error| IpcError::Folder {
            folder: domain.folder().to_owned(),
            cause: format!("{}: {error}", path.display()),
            remedy: "set XDG_RUNTIME_DIR to a folder with a short path that can be written",
        })?;
        Ok(IdleServer {
            socket,
            path,
            pending: Vec::with_capacity(MAX_PENDING_CLIENTS),
        })
    }

    /// Creates a new socket if another program, such as one that cleans /tmp, has removed the file of the socket, which no
    /// client could reach any more. Returns whether it created one.
    pub fn restore(&mut self) -> bool {
        let is_gone = |error: io::Error| error.kind() == ErrorKind::NotFound;
        if !fs::symlink_metadata(&self.path).is_err_and(is_gone) {
            return false;
        }
        // If this fails, for example because the folder is missing, the next call tries again.
        match bind(&self.path) {
            Ok(socket) => {
                self.socket = socket;
                true
            }
            Err(_) => false,
        }
    }

    /// Waits for requests for at most `timeout`, reads all pending requests, and labels them with the batch number `batch`.
    /// Returns whether any request arrived.
    ///
    /// # Errors
    /// [`IpcError::Service`] if the socket fails.
    pub fn receive_requests(&mut self, batch: u64, timeout: Duration) -> Result<bool, IpcError> {
        let timeout = Timespec::try_from(timeout).unwrap_or_default();
        let mut sockets = [PollFd::new(&self.socket, PollFlags::IN)];
        match poll(&mut sockets, Some(&timeout)) {
            Ok(0) | Err(Errno::INTR) => return Ok(false),
            Ok(_) => {}
            Err(error) => return Err(failed("idle", &error.into())),
        }
        let mut any = false;
        // One call reads at most as many requests as fit into `pending`; the next call reads the rest.
        for _ in 0..MAX_PENDING_CLIENTS {
            let mut request = [0; REQUEST_BYTES + 1];
            match self.socket.recv_from(&mut request) {
                Ok((REQUEST_BYTES, address)) if request.starts_with(REQUEST_HEADER) => {
                    let mut request_id = [0; 8];
                    request_id.copy_from_slice(&request[8..REQUEST_BYTES]);
                    if self.pending.len() == MAX_PENDING_CLIENTS {
                        self.pending.remove(0);
                    }
                    self.pending.push(PendingClient {
                        address,
                        request_id,
                        batch,
                    });
                    any = true;
                }
                // Datagrams that are not requests are ignored.
                Ok(_) => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(failed("idle", &error)),
            }
        }
        Ok(any)
    }

    /// Whether a client waits for a reply.
    pub fn has_pending(&self) -> bool {
        !self.pending.is_empty()
    }

    /// Sends `reply` to all clients whose batch number is at most `reply.sequence`.
    pub fn answer(&mut self, reply: &OperatorReply) {
        let text = reply.text.as_str().as_bytes();
        let mut datagram = Vec::with_capacity(REPLY_HEADER_BYTES + text.len());
        self.pending.retain(|client| {
            if client.batch > reply.sequence {
                return true;
            }
            datagram.clear();
            datagram.extend(client.request_id);
            datagram.extend(reply.cycle.to_le_bytes());
            datagram.extend([reply.outcome, reply.mode]);
            datagram.extend(text);
            // The client may have terminated; if it still waits, it repeats its request.
            let _ = self.socket.send_to_addr(&datagram, &client.address);
            false
        });
    }
}

fn bind(path: &Path) -> io::Result<UnixDatagram> {
    let socket = UnixDatagram::bind(path)?;
    fs::set_permissions(path, Permissions::from_mode(0o600))?;
    // Non-blocking: a client that does not read its reply must not delay the others.
    socket.set_nonblocking(true)?;
    Ok(socket)
}

impl Drop for IdleServer {
    fn drop(&mut self) {
        // If this fails, the next server removes the file.
        let _ = fs::remove_file(&self.path);
    }
}

/// Requests idle from the controller and waits for the reply for at most `timeout`; returns `None` if no reply arrived.
/// Uses no resource that other clients can exhaust.
///
/// # Errors
/// [`IpcError::Service`] if no socket can be created.
pub fn request_idle(domain: &Domain, timeout: Duration) -> Result<Option<IdleAnswer>, IpcError> {
    request_idle_at(&idle_socket(domain), timeout).map_err(|error| failed("idle", &error))
}

fn request_idle_at(path: &Path, timeout: Duration) -> io::Result<Option<IdleAnswer>> {
    let start = Instant::now();
    let request_id = random_id()?;
    // The abstract address needs no disk space and cannot be guessed. A connected socket receives only from its peer.
    let address = SocketAddr::from_abstract_name(format!("supple-idle-{request_id:016x}"))?;
    let request_id = request_id.to_le_bytes();
    let socket = UnixDatagram::bind_addr(&address)?;
    socket.set_nonblocking(true)?;
    let mut request = [0; REQUEST_BYTES];
    request[..8].copy_from_slice(REQUEST_HEADER);
    request[8..].copy_from_slice(&request_id);
    loop {
        let sent = socket.connect(path).and_then(|()| socket.send(&request));
        let wait = match sent {
            Ok(_) => RETRY_INTERVAL,
            Err(error) => match error.kind() {
                // The receive buffer is full of identical requests, so the controller will enter idle; retry to get a reply.
                ErrorKind::WouldBlock => SEND_RETRY_INTERVAL,
                ErrorKind::NotFound | ErrorKind::ConnectionRefused | ErrorKind::NotConnected => {
                    return Ok(None);
                }
                _ => return Err(error),
            },
        };
        let remaining = timeout.saturating_sub(start.elapsed());
        if let Some(reply) = receive_reply(&socket, &request_id, wait.min(remaining))? {
            return Ok(Some(reply));
        }
        if start.elapsed() >= timeout {
            return Ok(None);
        }
    }
}

/// Whether a process receives idle requests, even if it does not answer them.
pub fn idle_socket_is_open(domain: &Domain) -> bool {
    UnixDatagram::unbound().is_ok_and(|socket| socket.connect(idle_socket(domain)).is_ok())
}

/// Waits for the reply to a request.
fn receive_reply(
    socket: &UnixDatagram,
    request_id: &[u8; 8],
    timeout: Duration,
) -> io::Result<Option<IdleAnswer>> {
    let timeout = Timespec::try_from(timeout).unwrap_or_default();
    match poll(&mut [PollFd::new(socket, PollFlags::IN)], Some(&timeout)) {
        Err(error) if error != Errno::INTR => return Err(error.into()),
        _ => {}
    }
    let mut datagram = [0; 512];
    loop {
        match socket.recv(&mut datagram) {
            Ok(length) => {
                if let Some(reply) = decode_reply(&datagram[..length], request_id) {
                    return Ok(Some(reply));
                }
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            // No reply has arrived yet, or the controller has terminated and the next attempt to connect fails.
            Err(_) => return Ok(None),
        }
    }
}

fn decode_reply(datagram: &[u8], request_id: &[u8; 8]) -> Option<IdleAnswer> {
    let (header, text) = datagram.split_at_checked(REPLY_HEADER_BYTES)?;
    if !header.starts_with(request_id) {
        return None;
    }
    let cycle = header[8..16].try_into().ok()?;
    Some(IdleAnswer {
        cycle: u64::from_le_bytes(cycle),
        outcome: Outcome::from_code(header[16]),
        mode: codes::mode(header[17]),
        text: String::from_utf8_lossy(text).into_owned(),
    })
}

/// Creates the reply to all idle requests up to a batch number.
pub fn idle_reply(
    batch: u64,
    cycle: u64,
    mode: Mode,
    outcome: Outcome,
    text: Text,
) -> OperatorReply {
    OperatorReply {
        operator: 0,
        sequence: batch,
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

    const TIMEOUT: Duration = Duration::from_secs(60);

    fn system() -> (tempfile::TempDir, Domain) {
        let folder = tempfile::tempdir().expect("a folder");
        let domain = Domain::in_folder(&folder.path().join("run"), "idle").expect("a domain");
        (folder, domain)
    }

    #[test]
    fn simultaneous_clients_all_get_the_reply() {
        let (_folder, domain) = system();
        let mut server = IdleServer::new(&domain).expect("a server");
        std::thread::scope(|scope| {
            let clients: Vec<_> = (0..MAX_PENDING_CLIENTS)
                .map(|_| scope.spawn(|| request_idle(&domain, TIMEOUT)))
                .collect();
            let mut batch = 0;
            while clients.iter().any(|client| !client.is_finished()) {
                batch += 1;
                server
                    .receive_requests(batch, Duration::from_millis(1))
                    .expect("read");
                let text = Text::of(&"no");
                server.answer(&idle_reply(batch, 7, Mode::Idle, Outcome::Refused, text));
            }
            for client in clients {
                let answer = client.join().expect("no panic").expect("requested");
                let expected = IdleAnswer {
                    cycle: 7,
                    outcome: Outcome::Refused,
                    mode: Some(Mode::Idle),
                    text: "no".to_owned(),
                };
                assert_eq!(answer, Some(expected));
            }
        });
        assert!(!server.has_pending());
    }

    #[test]
    fn clients_of_a_later_batch_keep_waiting() {
        let (_folder, domain) = system();
        let mut server = IdleServer::new(&domain).expect("a server");
        let without_server = request_idle(&domain, Duration::from_millis(1));
        assert_eq!(without_server.expect("requested"), None);
        assert!(server.receive_requests(5, TIMEOUT).expect("read"));
        server.answer(&idle_reply(
            4,
            1,
            Mode::Idle,
            Outcome::Accepted,
            Text::EMPTY,
        ));
        assert!(server.has_pending());
        server.answer(&idle_reply(
            5,
            1,
            Mode::Idle,
            Outcome::Accepted,
            Text::EMPTY,
        ));
        assert!(!server.has_pending());
    }

    #[test]
    fn invalid_datagrams_are_ignored() {
        let (_folder, domain) = system();
        let mut server = IdleServer::new(&domain).expect("a server");
        let sender = UnixDatagram::unbound().expect("a socket");
        for bytes in [&b""[..], b"idle", &[0xff; 16], &[b'i'; 400]] {
            sender.send_to(bytes, idle_socket(&domain)).expect("sent");
        }
        assert!(!server.receive_requests(1, TIMEOUT).expect("read"));
        assert!(!server.has_pending());
    }

    #[test]
    fn without_a_controller_the_idle_request_returns_at_once() {
        let (_folder, domain) = system();
        assert_eq!(request_idle(&domain, TIMEOUT).expect("requested"), None);
        drop(IdleServer::new(&domain).expect("a server"));
        assert_eq!(request_idle(&domain, TIMEOUT).expect("requested"), None);
    }

    #[test]
    fn restore_creates_a_new_socket_if_its_file_is_removed() {
        let (_folder, domain) = system();
        let mut server = IdleServer::new(&domain).expect("a server");
        assert!(!server.restore(), "the file exists");
        fs::remove_file(idle_socket(&domain)).expect("removed");
        assert!(!idle_socket_is_open(&domain));
        assert!(server.restore());
        assert!(idle_socket_is_open(&domain));
        let metadata = fs::metadata(idle_socket(&domain)).expect("there");
        assert_eq!(metadata.permissions().mode() & 0o777, 0o600);
        assert!(!server.restore());
        let without_answer = request_idle(&domain, Duration::from_millis(1));
        assert_eq!(without_answer.expect("requested"), None);
        assert!(server.receive_requests(1, TIMEOUT).expect("read"));
    }

    /// The server does not replace a file that another program has created at the path of the socket.
    #[test]
    fn restore_keeps_a_foreign_file_at_the_path_of_the_socket() {
        let (_folder, domain) = system();
        let mut server = IdleServer::new(&domain).expect("a server");
        fs::remove_file(idle_socket(&domain)).expect("removed");
        fs::write(idle_socket(&domain), "other").expect("written");
        assert!(!server.restore());
        assert!(!idle_socket_is_open(&domain));
        assert_eq!(request_idle(&domain, TIMEOUT).expect("requested"), None);
    }

    #[test]
    fn only_the_owner_can_open_the_socket() {
        let (_folder, domain) = system();
        let _server = IdleServer::new(&domain).expect("a server");
        let metadata = fs::metadata(idle_socket(&domain)).expect("there");
        assert_eq!(metadata.permissions().mode() & 0o777, 0o600);
    }
}
