//! The live page of a running system or of a log, and a server of the Foxglove WebSocket protocol.
//!
//! The page is served by a separate process, which `supple view` and `supple up --view` start. It reads telemetry like any
//! other client and sends requests like any other operator. It runs at a lower priority (nice 10), polls shared memory and
//! never makes the controller wait; a browser that hangs has no effect on the control loop.
//!
//! The page is embedded in the program and loads nothing from other servers. The server listens on 127.0.0.1 only, and
//! accepts only requests with the token in the URL (`http.rs`).
//!
//! ```text
//!  telemetry --> live (one thread) --> hub --> viewer (a thread each) --> browser, Lichtblick
//!  requests  <--                   <-- hub <--
//! ```

#![forbid(unsafe_code)]

mod calls;
mod command;
mod error;
mod http;
mod hub;
mod info;
mod live;
mod page;
mod pendant;
mod protocol;
mod remedy;
mod replay;
mod server;
mod snapshot;
mod token;
mod viewer;

pub use error::ViewError;

use http::AccessCheck;
use hub::Hub;
use live::LiveConnection;
use serde::Serialize;
use server::ServedContent;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use supple_ipc::Domain;
use supple_model::{Description, with_dof};
use supple_realtime::{Stop, pause};
use token::Token;

/// Increment of the niceness of the process.
const NICENESS: i32 = 10;
/// Interval at which a shutdown request is checked.
const POLL_INTERVAL: core::time::Duration = core::time::Duration::from_millis(20);

/// Source of the data to show.
#[derive(Clone, Debug)]
pub enum Source {
    /// A running system.
    System {
        /// Namespace of the system.
        domain: Box<Domain>,
        /// Description of the arm.
        description: Box<Description>,
    },
    /// A log.
    Log(PathBuf),
}

/// Options of the page.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Draw a block with its top face at this height \[m\].
    pub block_m: Option<f64>,
    /// Port on 127.0.0.1; 0 for a free one.
    pub port: u16,
    /// Accept no requests.
    pub read_only: bool,
    /// Origins of other web viewers that may connect if they have the URL, such as `http://localhost:8080`.
    pub allow_origin: Vec<String>,
}

/// URLs of the page. Both contain the token.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Addresses {
    /// URL of the page.
    pub url: String,
    /// URL for viewers of the Foxglove protocol.
    pub foxglove_url: String,
}

/// Serves the page until a shutdown is requested; `announce` receives its URLs once it can be opened.
///
/// # Errors
/// [`ViewError`] with the reason why the page cannot be served.
pub fn run(
    source: &Source,
    options: &Options,
    stop: &Stop,
    announce: impl FnOnce(&Addresses),
) -> Result<(), ViewError> {
    // If this fails, the process keeps its priority.
    let _ = rustix::process::nice(NICENESS);
    match source {
        Source::Log(log) => {
            announce(&start(options, shown_log(log, options)?)?);
            while !stop.shutdown_requested() {
                pause(POLL_INTERVAL);
            }
            Ok(())
        }
        Source::System {
            domain,
            description,
        } => {
            with_dof!(description.dof(), N => run_live::<N>(domain, description, options, stop, announce))?
        }
    }
}

fn shown_log(log: &std::path::Path, options: &Options) -> Result<ServedContent, ViewError> {
    let replay = replay::read(log)?;
    let title = log.file_name().unwrap_or(log.as_os_str());
    let subject = info::PageContent {
        description: &replay.description,
        title: title.to_string_lossy().into_owned(),
        log: Some(serde_json::json!({
            "experiment": replay.experiment,
            "interval_s": replay.interval_s,
            "incomplete": replay.incomplete,
        })),
        block_m: options.block_m,
        commands: false,
        pendant: false,
    };
    Ok(ServedContent {
        hub: Arc::new(Hub::new(Vec::new())),
        domain: None,
        name: subject.title.clone(),
        info: info::info(&subject)?,
        log: Some(serde_json::to_vec(&replay.snapshots)?),
    })
}

fn run_live<const N: usize>(
    domain: &Domain,
    description: &Description,
    options: &Options,
    stop: &Stop,
    announce: impl FnOnce(&Addresses),
) -> Result<(), ViewError> {
    let hub = Arc::new(Hub::new(info::channels(description)?));
    let commands: Receiver<_> = match options.read_only {
        true => channel().1,
        false => hub.accept_commands(),
    };
    let subject = info::PageContent {
        description,
        title: domain.prefix().to_owned(),
        log: None,
        block_m: options.block_m,
        commands: !options.read_only,
        pendant: pendant::socket(domain).is_some(),
    };
    let shown = ServedContent {
        name: format!("supple {}", domain.prefix()),
        info: info::info(&subject)?,
        domain: Some(domain.clone()),
        hub: hub.clone(),
        log: None,
    };
    let mut live = LiveConnection::<N>::new(domain, description, &hub, !options.read_only)?;
    announce(&start(options, shown)?);
    live.run(&commands, stop)
}

/// Starts the server in a separate thread.
fn start(options: &Options, shown: ServedContent) -> Result<Addresses, ViewError> {
    let port = options.port;
    let failed = |error| ViewError::Listen { port, error };
    let (listener, port) = server::listen(port).map_err(failed)?;
    let token = Token::new().map_err(failed)?;
    let access = Arc::new(AccessCheck::new(token, port, &options.allow_origin));
    let addresses = Addresses {
        url: access.url(),
        foxglove_url: access.websocket_url(),
    };
    let shown = Arc::new(shown);
    let server = std::thread::Builder::new().name("server".to_owned());
    let started = server.spawn(move || server::run(&listener, &access, &shown));
    started.map_err(failed)?;
    Ok(addresses)
}
