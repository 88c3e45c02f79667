//! Listens on 127.0.0.1 and serves every connection in a separate thread.

use crate::http::{AccessCheck, Rejected, RequestHead, respond};
use crate::hub::Hub;
use crate::page::FILES;
use crate::protocol::SUBPROTOCOLS;
use crate::viewer::{Context, serve};
use core::time::Duration;
use std::io::{self, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use supple_ipc::Domain;

/// Maximum number of simultaneous connections.
const MAX_CONNECTIONS: usize = 32;
/// Timeout for writing a response to a peer.
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);
/// GUID with which the key of a WebSocket is hashed (RFC 6455, section 1.3).
const WEBSOCKET_ID: &[u8] = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11";

/// Content that the server serves.
pub struct ServedContent {
    /// State shared by the threads.
    pub hub: Arc<Hub>,
    /// The running system; `None` for a log.
    pub domain: Option<Domain>,
    /// Name of the running system or of the log.
    pub name: String,
    /// Description for the page, as JSON.
    pub info: Vec<u8>,
    /// Snapshots of a log, as JSON; `None` for a running system.
    pub log: Option<Vec<u8>>,
}

/// Opens the port on the loopback interface; 0 for a free one.
///
/// # Errors
/// If the port is in use.
pub fn listen(port: u16) -> io::Result<(TcpListener, u16)> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
    let port = listener.local_addr()?.port();
    Ok((listener, port))
}

/// Serves connections until the process ends.
pub fn run(listener: &TcpListener, access: &Arc<AccessCheck>, shown: &Arc<ServedContent>) {
    let open = Arc::new(AtomicUsize::new(0));
    let session = std::process::id().to_string();
    static CONNECTIONS: AtomicU64 = AtomicU64::new(0);
    for stream in listener.incoming() {
        let Ok(stream) = stream else {
            supple_realtime::pause(Duration::from_millis(50));
            continue;
        };
        if open.fetch_add(1, Ordering::AcqRel) >= MAX_CONNECTIONS {
            open.fetch_sub(1, Ordering::AcqRel);
            continue;
        }
        let (access, shown, session) = (access.clone(), shown.clone(), session.clone());
        let id = CONNECTIONS.fetch_add(1, Ordering::Relaxed);
        let count = open.clone();
        let started = std::thread::Builder::new()
            .name("connection".to_owned())
            .spawn(move || {
                // A peer that disconnects is no error of this program.
                let _ = handle(stream, &access, &shown, &session, id);
                count.fetch_sub(1, Ordering::AcqRel);
            });
        if started.is_err() {
            open.fetch_sub(1, Ordering::AcqRel);
        }
    }
}

fn handle(
    mut stream: TcpStream,
    access: &AccessCheck,
    shown: &ServedContent,
    session: &str,
    id: u64,
) -> io::Result<()> {
    stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
    let Some(head) = RequestHead::read(&mut stream)? else {
        return respond(
            &mut stream,
            "400 Bad Request",
            "text/plain",
            b"Invalid request.\n",
        );
    };
    let path = match access.check(&head) {
        Ok(path) => path,
        Err(rejected) => return reject(&mut stream, rejected),
    };
    match path {
        "ws" => return websocket(stream, &head, shown, session, id),
        "info.json" => respond(&mut stream, "200 OK", "application/json", &shown.info)?,
        "log.json" if shown.log.is_some() => {
            let log = shown.log.as_deref().unwrap_or_default();
            respond(&mut stream, "200 OK", "application/json", log)?;
        }
        path => match FILES.iter().find(|file| file.name == path) {
            Some(file) => respond(&mut stream, "200 OK", file.media_type, file.bytes)?,
            None => respond(
                &mut stream,
                "404 Not Found",
                "text/plain",
                b"This page does not exist.\n",
            )?,
        },
    }
    stream.shutdown(Shutdown::Write)
}

fn reject(stream: &mut TcpStream, rejected: Rejected) -> io::Result<()> {
    let (status, text) = rejected.answer();
    respond(stream, status, "text/plain", text.as_bytes())
}

fn websocket(
    mut stream: TcpStream,
    head: &RequestHead,
    shown: &ServedContent,
    session: &str,
    id: u64,
) -> io::Result<()> {
    let is = |name: &str, value: &str| {
        let found = head.header(name).unwrap_or_default();
        found
            .split(',')
            .any(|part| part.trim().eq_ignore_ascii_case(value))
    };
    let offered = |protocol: &&&str| {
        let offered = head.header("sec-websocket-protocol").unwrap_or_default();
        offered.split(',').any(|part| part.trim() == **protocol)
    };
    let upgrade = is("upgrade", "websocket") && is("connection", "upgrade");
    let (Some(key), true, Some(protocol)) = (
        head.header("sec-websocket-key"),
        upgrade && is("sec-websocket-version", "13"),
        SUBPROTOCOLS.iter().find(offered),
    ) else {
        let text = format!("A WebSocket with the subprotocol {}.\n", SUBPROTOCOLS[0]);
        return respond(
            &mut stream,
            "400 Bad Request",
            "text/plain",
            text.as_bytes(),
        );
    };
    write!(
        stream,
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Accept: {}\r\nSec-WebSocket-Protocol: {protocol}\r\n\r\n",
        accept_key(key)
    )?;
    let viewer = shown.hub.join(id);
    let context = Context {
        hub: &shown.hub,
        domain: shown.domain.as_ref(),
        name: &shown.name,
        session,
    };
    // A viewer may disconnect at any time.
    let _ = serve(&context, &viewer, stream, head.rest.clone());
    shown.hub.leave(id);
    Ok(())
}

/// Returns the value of `Sec-WebSocket-Accept` for the key of a WebSocket.
fn accept_key(key: &str) -> String {
    let mut digest = sha1_smol::Sha1::new();
    digest.update(key.as_bytes());
    digest.update(WEBSOCKET_ID);
    data_encoding::BASE64.encode(&digest.digest().bytes())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_accept_key_equals_the_example_of_the_standard() {
        // RFC 6455, section 1.3.
        let key = super::accept_key("dGhlIHNhbXBsZSBub25jZQ==");
        assert_eq!(key, "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
    }
}
