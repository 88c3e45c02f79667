//! `supple view`: serves the live page, see `supple_view`.

use crate::operate::arm_of;
use clap::Args;
use std::path::{Path, PathBuf};
use supple_cli::arguments::UrdfArgs;
use supple_cli::arms;
use supple_cli::console::{print_json, print_line, print_status};
use supple_cli::exit::Failure;
use supple_cli::interrupt;
use supple_cli::range::between;
use supple_ipc::{Domain, idle_socket_is_open};
use supple_realtime::die_with_parent;
use supple_view::{Addresses, Options, Source, ViewError};

/// Arguments of `view`.
#[derive(Clone, Debug, Args)]
pub struct ViewArgs {
    /// Replay this log with a time slider. Default: show a running system.
    #[arg(value_name = "LOG")]
    pub log: Option<PathBuf>,
    /// Prefix of the system. Default: SUPPLE_PREFIX or `supple`.
    #[arg(long, value_name = "NAME", conflicts_with = "log")]
    pub prefix: Option<String>,
    /// The arm of the running system. Default: the arm of its `supple up`, otherwise wam4. A log contains its arm.
    #[arg(long, value_name = "NAME|PATH", conflicts_with = "log")]
    pub arm: Option<String>,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Draw a block, its top face at this height above the base frame (m).
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = between(-10.0, 10.0))]
    pub block_m: Option<f64>,
    /// Port on 127.0.0.1. Default: a free port.
    #[arg(
        long,
        value_name = "PORT",
        default_value_t = 0,
        hide_default_value = true
    )]
    pub port: u16,
    /// Accept no requests: the page only shows data.
    #[arg(long)]
    pub read_only: bool,
    /// Also accept the page of another viewer, such as Lichtblick at http://localhost:8080, if it has the URL of
    /// this page. May be repeated.
    #[arg(long, value_name = "ORIGIN")]
    pub allow_origin: Vec<String>,
    /// End this process when the process that started it ends.
    #[arg(long, hide = true)]
    pub supervised: bool,
    /// Print the URLs as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Runs `supple view` until it is interrupted.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &ViewArgs) -> Result<(), Failure> {
    if args.supervised {
        die_with_parent();
    }
    let stop = interrupt::shutdown_on_interrupt();
    let source = match &args.log {
        Some(log) => Source::Log(log.clone()),
        None => {
            let domain = Domain::new(args.prefix.as_deref()).map_err(Failure::system)?;
            if !args.supervised && !idle_socket_is_open(&domain) {
                print_status(&format!(
                    "no system runs with prefix {}: the page waits for `supple up`",
                    domain.prefix()
                ));
            }
            let arm = arm_of(&domain, args.arm.as_deref(), &args.urdf);
            Source::System {
                domain: Box::new(domain),
                description: Box::new(arms::find(&arm, args.strict)?),
            }
        }
    };
    let options = Options {
        block_m: args.block_m,
        port: args.port,
        read_only: args.read_only,
        allow_origin: args.allow_origin.clone(),
    };
    supple_view::run(&source, &options, &stop, |addresses| {
        // A closed pipe does not end the page.
        let _ = print(addresses, args.json);
    })
    .map_err(failure)
}

fn print(addresses: &Addresses, json: bool) -> Result<(), Failure> {
    if json {
        return print_json(addresses);
    }
    print_line(&format!("page      {}", addresses.url))?;
    print_line(&format!("foxglove  {}", addresses.foxglove_url))?;
    print_status("the URLs contain a secret: everyone who has them can command the arm");
    Ok(())
}

fn failure(error: ViewError) -> Failure {
    match error {
        ViewError::Model(error) => error.into(),
        ViewError::Log(error) => error.into(),
        ViewError::Listen { port, error } => {
            let address = format!("127.0.0.1:{port}");
            Failure::file("listen on", Path::new(&address), error)
        }
        error => Failure::system(error),
    }
}
