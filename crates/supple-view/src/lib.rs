//! The live page of a running system or of a log, and a server of the Foxglove WebSocket protocol.
//!
//! A process of its own, which `supple view` and `supple up --view` start: it reads telemetry like any other client and
//! sends requests like any other operator. It runs at the lowest priority, polls shared memory and never makes the
//! controller wait; without it, or with a browser that hangs, the loop is the same.
//!
//! The page is embedded and asks no other server for anything. Everything is served on 127.0.0.1 alone, and only to
//! those who know the token in the URL ([`http`]).
//!
//! ```text
//!  telemetry --> live (one thread) --> hub --> viewer (a thread each) --> browser, Lichtblick
//!  requests  <--                   <-- hub <--
//! ```

#![forbid(unsafe_code)]

mod command;
mod frame;
pub mod http;
mod hub;
mod info;
mod live;
mod page;
mod pendant;
mod protocol;
mod remedy;
mod replay;
mod server;
mod token;
mod viewer;

use clap::Parser;
use http::Gate;
use hub::Hub;
use live::Live;
use serde::Serialize;
use server::Shown;
use std::net::TcpListener;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use supple_cli::arguments::{ViewArgs, ViewCommand};
use supple_cli::console::{print_json, print_line, print_status};
use supple_cli::exit::{CODES, Failure};
use supple_cli::{arms, console, interrupt};
use supple_ipc::Domain;
use supple_model::with_dof;
use supple_realtime::{Stop, die_with_parent, pause};
use token::Token;

/// Steps of niceness that the process takes: whatever else wants the processor comes first.
const NICENESS: i32 = 10;

/// The live page. The program `supple` has this command too.
#[derive(Debug, Parser)]
#[command(version, after_help = CODES, arg_required_else_help = true)]
struct Cli {
    /// Command to run.
    #[command(subcommand)]
    command: ViewCommand,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Addresses {
    url: String,
    foxglove_url: String,
}

/// Runs the program: parses its arguments and returns its exit code.
pub fn run() -> ExitCode {
    let Cli {
        command: ViewCommand::View(args),
    } = Cli::parse();
    interrupt::install();
    console::exit_code(view(&args), args.json)
}

fn view(args: &ViewArgs) -> Result<(), Failure> {
    if args.supervised {
        die_with_parent();
    }
    let stop = interrupt::shutdown_on_interrupt();
    // Without the permission it runs as it is.
    let _ = rustix::process::nice(NICENESS);
    match &args.log {
        Some(log) => show_log(args, log, &stop),
        None => show_system(args, &stop),
    }
}

fn show_log(args: &ViewArgs, log: &Path, stop: &Stop) -> Result<(), Failure> {
    let replay = replay::read(log)?;
    let title = log.file_name().unwrap_or(log.as_os_str());
    let subject = info::Subject {
        description: &replay.description,
        title: title.to_string_lossy().into_owned(),
        log: Some(serde_json::json!({
            "experiment": replay.experiment,
            "interval_s": replay.interval_s,
            "incomplete": replay.incomplete,
        })),
        block_m: args.block_m,
        commands: false,
        pendant: false,
    };
    let frames = serde_json::to_vec(&replay.frames)
        .map_err(|error| Failure::ReportGeneration(error.to_string()))?;
    let shown = Shown {
        hub: Arc::new(Hub::new(Vec::new())),
        domain: None,
        name: subject.title.clone(),
        info: info::info(&subject)?,
        log: Some(frames),
    };
    start(args, shown)?;
    while !stop.shutdown_requested() {
        pause(core::time::Duration::from_millis(50));
    }
    Ok(())
}

fn show_system(args: &ViewArgs, stop: &Stop) -> Result<(), Failure> {
    let description = arms::find(&args.arm, args.strict)?;
    let domain = Domain::new(args.prefix.as_deref()).map_err(Failure::system)?;
    let hub = Arc::new(Hub::new(info::channels(&description)?));
    let commands = hub_commands(&hub, args.read_only);
    let subject = info::Subject {
        description: &description,
        title: domain.prefix().to_owned(),
        log: None,
        block_m: args.block_m,
        commands: !args.read_only,
        pendant: pendant::socket(&domain).is_some(),
    };
    let shown = Shown {
        name: format!("supple {}", domain.prefix()),
        info: info::info(&subject)?,
        domain: Some(domain.clone()),
        hub: hub.clone(),
        log: None,
    };
    with_dof!(description.dof(), N => {
        let mut live = Live::<N>::new(&domain, &description, &hub, !args.read_only)?;
        start(args, shown)?;
        live.run(&commands, stop)
    })?
}

/// The end at which commands arrive; if none are accepted nothing does.
fn hub_commands(hub: &Hub, read_only: bool) -> std::sync::mpsc::Receiver<hub::Pending> {
    match read_only {
        true => std::sync::mpsc::channel().1,
        false => hub.accept_commands(),
    }
}

/// Serves in a thread of its own, and prints the addresses.
fn start(args: &ViewArgs, shown: Shown) -> Result<(), Failure> {
    let failed = |error: std::io::Error| {
        let address = format!("127.0.0.1:{}", args.port);
        Failure::file("listen on", Path::new(&address), error)
    };
    let (listener, port): (TcpListener, u16) = server::listen(args.port).map_err(failed)?;
    let gate = Arc::new(Gate::new(Token::new()?, port, &args.allow_origin));
    let addresses = Addresses {
        url: gate.url(),
        foxglove_url: gate.websocket_url(),
    };
    let shown = Arc::new(shown);
    let server = std::thread::Builder::new().name("server".to_owned());
    let started = server.spawn(move || server::run(&listener, &gate, &shown));
    started.map_err(failed)?;
    match args.json {
        true => print_json(&addresses)?,
        false => print_line(&format!("page      {}", addresses.url))?,
    }
    if !args.json {
        print_line(&format!("foxglove  {}", addresses.foxglove_url))?;
        print_status("the URLs contain a secret: whoever knows them commands the arm");
    }
    Ok(())
}
