//! HTTP requests of a browser: parses their heads, checks access, and writes responses.
//!
//! Three checks apply to every request. The URL must contain the token. `Host` must be this server, so that a name of
//! another site that resolves to 127.0.0.1 (DNS rebinding) is rejected. `Origin`, which a browser always sends with a
//! WebSocket, must be this page or an origin that the user allowed.

use crate::token::Token;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Timeout for receiving a complete head.
const HEAD_TIMEOUT: Duration = Duration::from_secs(5);
/// Maximum length of a request's head \[bytes\].
const MAX_HEAD_BYTES: usize = 8192;
/// Maximum number of headers of a request.
const MAX_HEADERS: usize = 64;
/// Origin of a viewer that is an installed program.
const PROGRAM_ORIGIN: &str = "file://";

/// The head of a request.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RequestHead {
    /// Method, such as `GET`.
    pub method: String,
    /// Path with the query.
    pub path: String,
    /// Names in lower case, with their values.
    headers: Vec<(String, String)>,
    /// Data after the head.
    pub rest: Vec<u8>,
}

impl RequestHead {
    /// Reads a head; returns `None` if the peer does not send a valid one.
    ///
    /// # Errors
    /// If the connection fails.
    pub fn read(stream: &mut TcpStream) -> io::Result<Option<RequestHead>> {
        let mut bytes = Vec::new();
        let mut part = [0; 2048];
        let start = Instant::now();
        while bytes.len() < MAX_HEAD_BYTES {
            let left = HEAD_TIMEOUT.saturating_sub(start.elapsed());
            if left.is_zero() {
                return Ok(None);
            }
            stream.set_read_timeout(Some(left))?;
            let count = stream.read(&mut part)?;
            if count == 0 {
                return Ok(None);
            }
            bytes.extend_from_slice(&part[..count]);
            match RequestHead::parse(&bytes) {
                Ok(None) => {}
                parsed => return Ok(parsed.ok().flatten()),
            }
        }
        Ok(None)
    }

    /// Parses a head; returns `None` if it is not complete yet.
    ///
    /// # Errors
    /// The reason why the head is not valid.
    pub fn parse(bytes: &[u8]) -> Result<Option<RequestHead>, httparse::Error> {
        let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
        let mut request = httparse::Request::new(&mut headers);
        let length = match request.parse(bytes)? {
            httparse::Status::Complete(length) => length,
            httparse::Status::Partial => return Ok(None),
        };
        let header = |header: &httparse::Header<'_>| {
            let value = String::from_utf8_lossy(header.value).trim().to_owned();
            (header.name.to_ascii_lowercase(), value)
        };
        Ok(Some(RequestHead {
            method: request.method.unwrap_or_default().to_owned(),
            path: request.path.unwrap_or_default().to_owned(),
            headers: request.headers.iter().map(header).collect(),
            rest: bytes[length..].to_vec(),
        }))
    }

    /// Returns the value of a header that occurs once; `name` is in lower case.
    pub fn header(&self, name: &str) -> Option<&str> {
        let mut values = self.headers.iter().filter(|(found, _)| found == name);
        let (_, value) = values.next()?;
        values.next().is_none().then_some(value)
    }

    fn has(&self, name: &str) -> bool {
        self.headers.iter().any(|(found, _)| found == name)
    }
}

/// Access check of requests.
pub struct AccessCheck {
    token: Token,
    port: u16,
    origins: Vec<String>,
}

/// Reason why a request is rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rejected {
    /// The method is not GET.
    Method,
    /// The URL lacks the token.
    Token,
    /// `Host` is not this server.
    Host,
    /// `Origin` is the page of another site.
    Origin,
}

impl Rejected {
    /// Status line and explanation.
    pub fn answer(self) -> (&'static str, &'static str) {
        match self {
            Rejected::Method => (
                "405 Method Not Allowed",
                "Only the method GET is allowed.\n",
            ),
            Rejected::Token => (
                "403 Forbidden",
                "The URL lacks its token: open the URL that supple printed.\n",
            ),
            Rejected::Host => (
                "403 Forbidden",
                "The host is not this server: use 127.0.0.1 or localhost.\n",
            ),
            Rejected::Origin => (
                "403 Forbidden",
                "This origin is not allowed: start supple with --allow-origin ORIGIN.\n",
            ),
        }
    }
}

impl AccessCheck {
    /// Creates the check for a server on this port of the loopback interface.
    pub fn new(token: Token, port: u16, origins: &[String]) -> AccessCheck {
        let origins = origins.iter().map(|o| o.trim_end_matches('/').to_owned());
        AccessCheck {
            token,
            port,
            origins: origins.collect(),
        }
    }

    /// Returns the URL of the page.
    pub fn url(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.token.as_str())
    }

    /// Returns the URL for viewers of the Foxglove protocol.
    pub fn websocket_url(&self) -> String {
        format!("ws://127.0.0.1:{}/{}/ws", self.port, self.token.as_str())
    }

    /// Checks a request; returns the path after the token.
    ///
    /// # Errors
    /// [`Rejected`] with the reason.
    pub fn check<'a>(&self, head: &'a RequestHead) -> Result<&'a str, Rejected> {
        if head.method != "GET" {
            return Err(Rejected::Method);
        }
        let own = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        let is_own = |host: &str| own.iter().any(|name| name == host);
        if !head.header("host").is_some_and(is_own) {
            return Err(Rejected::Host);
        }
        if head.has("origin") {
            let allowed = |origin: &str| {
                origin == PROGRAM_ORIGIN
                    || origin.strip_prefix("http://").is_some_and(is_own)
                    || self.origins.iter().any(|allowed| allowed == origin)
            };
            if !head.header("origin").is_some_and(allowed) {
                return Err(Rejected::Origin);
            }
        }
        let path = head.path.split(['?', '#']).next().unwrap_or_default();
        let path = path.strip_prefix('/').ok_or(Rejected::Token)?;
        let (token, rest) = path.split_once('/').unwrap_or((path, ""));
        match self.token.matches(token) {
            true => Ok(rest),
            false => Err(Rejected::Token),
        }
    }
}

/// Writes a response and closes the connection.
///
/// # Errors
/// If the connection fails.
pub fn respond(
    stream: &mut TcpStream,
    status: &str,
    media_type: &str,
    body: &[u8],
) -> io::Result<()> {
    // The policy allows content from this server only, and no other site may show the page in a frame.
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: {media_type}\r\nContent-Length: {}\r\nConnection: close\r\n\
         Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\n\
         Referrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n\
         Content-Security-Policy: default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; \
         connect-src 'self' ws://127.0.0.1:* ws://localhost:*; frame-ancestors 'none'; base-uri 'none'; form-action 'none'\r\n\r\n",
        body.len()
    )?;
    stream.write_all(body)?;
    stream.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn access() -> (AccessCheck, String) {
        let token = Token::new().expect("random numbers");
        let text = token.as_str().to_owned();
        let allowed = ["http://localhost:8080/".to_owned()];
        (AccessCheck::new(token, 4000, &allowed), text)
    }

    fn head(method: &str, path: &str, headers: &str) -> RequestHead {
        let text = format!("{method} {path} HTTP/1.1\r\n{headers}\r\n");
        let parsed = RequestHead::parse(text.as_bytes()).expect("valid");
        parsed.expect("complete")
    }

    #[test]
    fn only_requests_with_token_and_own_host_and_origin_are_accepted() {
        let (access, token) = access();
        let check = |path: &str, headers: &str| {
            let head = head("GET", path, headers);
            access.check(&head).map(str::to_owned)
        };
        let own = "Host: 127.0.0.1:4000\r\n";
        assert_eq!(check(&format!("/{token}/"), own), Ok(String::new()));
        assert_eq!(check(&format!("/{token}/ws?x=1"), own), Ok("ws".to_owned()));
        for path in [
            "/",
            "/ws",
            "/page.js",
            &format!("/{}0/", &token[1..]),
            &format!("//{token}/"),
        ] {
            assert_eq!(check(path, own), Err(Rejected::Token), "{path}");
        }
        let path = format!("/{token}/ws");
        for host in ["evil.example:4000", "127.0.0.1", "127.0.0.1:4001", ""] {
            let rejected = check(&path, &format!("Host: {host}\r\n"));
            assert_eq!(rejected, Err(Rejected::Host), "{host}");
        }
        assert_eq!(check(&path, ""), Err(Rejected::Host));
        assert_eq!(
            check(&path, "Host: 127.0.0.1:4000\r\nHost: a\r\n"),
            Err(Rejected::Host)
        );
        for (origin, allowed) in [
            ("http://127.0.0.1:4000", true),
            ("http://localhost:4000", true),
            ("http://localhost:8080", true),
            ("file://", true),
            ("http://localhost:8081", false),
            ("https://evil.example", false),
            ("null", false),
            ("", false),
        ] {
            let checked = check(&path, &format!("{own}Origin: {origin}\r\n"));
            let expected = if allowed {
                Ok("ws".to_owned())
            } else {
                Err(Rejected::Origin)
            };
            assert_eq!(checked, expected, "{origin}");
        }
        assert_eq!(
            access.check(&head("POST", &path, own)),
            Err(Rejected::Method)
        );
    }

    #[test]
    fn a_truncated_head_is_incomplete_and_invalid_bytes_are_rejected() {
        let whole = b"GET / HTTP/1.1\r\nHost: a\r\n\r\nrest";
        let parsed = RequestHead::parse(whole).expect("valid").expect("complete");
        assert_eq!(parsed.rest, b"rest");
        for end in 0..whole.len() - 4 {
            assert_eq!(RequestHead::parse(&whole[..end]), Ok(None), "{end}");
        }
        assert!(RequestHead::parse(b"\x00\x01\x02").is_err());
    }
}
