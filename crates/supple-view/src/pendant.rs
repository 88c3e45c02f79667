//! Client of the pendant of an emulated arm: a socket in the folder of the bus, which answers each text line with one line of
//! JSON.

use core::time::Duration;
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use supple_bus::Address;
use supple_ipc::Domain;

/// Name of the socket in the folder of the bus.
const SOCKET: &str = "pendant";
/// Timeout for a reply.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(2);

/// Returns the socket of the pendant of this system; `None` if the system has no emulated arm.
pub fn socket(domain: &Domain) -> Option<PathBuf> {
    let Ok(Address::Folder(folder)) = Address::of_system(domain.prefix()) else {
        return None;
    };
    Some(folder.join(SOCKET)).filter(|socket| socket.exists())
}

/// Presses a button of the pendant.
///
/// # Errors
/// The reason why the button could not be pressed.
pub fn press(domain: &Domain, line: &str) -> Result<(), String> {
    let socket = socket(domain).ok_or("this system has no emulated pendant")?;
    let exchange = || -> std::io::Result<String> {
        let mut stream = UnixStream::connect(&socket)?;
        stream.set_read_timeout(Some(ANSWER_TIMEOUT))?;
        stream.set_write_timeout(Some(ANSWER_TIMEOUT))?;
        writeln!(stream, "{line}")?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer)?;
        Ok(answer)
    };
    let answer = exchange().map_err(|error| format!("the pendant does not answer: {error}"))?;
    let answer: serde_json::Value = serde_json::from_str(&answer)
        .map_err(|error| format!("the pendant does not answer: {error}"))?;
    match answer.get("error") {
        Some(error) => Err(format!("the pendant refuses: {error}")),
        None => Ok(()),
    }
}
