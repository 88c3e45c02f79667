//! Tests of the access check: token, host, origin, and bytes that are not a request.

use crate::client::{Client, get, get_url, split};
use crate::controller::System;
use std::io::{Read, Write};
use std::net::TcpStream;
use supple_view::Options;

#[test]
fn page_data_and_commands_require_the_token() {
    let (system, addresses) = System::start(Options::default());
    system.step();
    let (address, path) = split(&addresses.url);
    assert!(address.starts_with("127.0.0.1:"));
    let host = format!("Host: {address}\r\n");
    for name in ["", "page.js", "page.css", "info.json", "licences.txt"] {
        assert_eq!(
            get_url(&format!("{}{name}", addresses.url)).0,
            200,
            "{name}"
        );
        assert_eq!(get(&address, &format!("/{name}"), &host).0, 403, "{name}");
    }
    // A wrong token of the right length.
    let guess = format!("/{}/", "0".repeat(path.len() - 2));
    assert_eq!(get(&address, &guess, &host).0, 403);
    assert_eq!(get(&address, &format!("{guess}ws"), &host).0, 403);
    let wrong = format!("ws://{address}{guess}ws");
    assert_eq!(Client::connect(&wrong, "").err(), Some(403));
    assert_eq!(get_url(&format!("{}log.json", addresses.url)).0, 404);
}

#[test]
fn another_site_in_the_same_browser_cannot_connect() {
    let (_system, addresses) = System::start(Options {
        allow_origin: vec!["http://localhost:8080".to_owned()],
        ..Options::default()
    });
    let (address, path) = split(&addresses.url);
    // A request to another name that resolves to 127.0.0.1 reaches the port, but contains that name as host.
    let port = address.split(':').nth(1).expect("a port");
    let rebound = format!("Host: evil.example:{port}\r\n");
    assert_eq!(get(&address, &path, &rebound).0, 403);
    for (origin, accepted) in [
        (format!("http://{address}"), true),
        ("http://localhost:8080".to_owned(), true),
        ("https://evil.example".to_owned(), false),
        ("null".to_owned(), false),
    ] {
        let header = format!("Origin: {origin}\r\n");
        let connected = Client::connect(&addresses.foxglove_url, &header);
        assert_eq!(connected.err(), (!accepted).then_some(403), "{origin}");
    }
}

#[test]
fn invalid_bytes_end_only_their_connection() {
    let (_system, addresses) = System::start(Options::default());
    let (address, _) = split(&addresses.url);
    let long = [b"GET /".to_vec(), vec![b'a'; 20_000]].concat();
    for bytes in [
        &b"\x16\x03\x01\x02\x00"[..],
        b"GET\r\n\r\n",
        b"\0\0\0\0\r\n\r\n",
        &long,
    ] {
        let mut stream = TcpStream::connect(&address).expect("a server");
        // The server may close the connection before all bytes are sent.
        let _ = stream.write_all(bytes);
        let _ = stream.shutdown(std::net::Shutdown::Write);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        assert!(!answer.starts_with(b"HTTP/1.1 200"), "{bytes:?}");
    }
    assert_eq!(get_url(&addresses.url).0, 200);
}
