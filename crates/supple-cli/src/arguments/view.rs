//! Arguments of `supple view`; the program `supple-view` accepts the same.

use crate::range::between;
use clap::{Args, Subcommand};
use std::path::PathBuf;

/// Command of the program `supple-view`.
#[derive(Clone, Debug, Subcommand)]
pub enum ViewCommand {
    /// Show a running system or a log in a browser.
    View(ViewArgs),
}

/// Arguments of `view`.
#[derive(Clone, Debug, Args)]
pub struct ViewArgs {
    /// Replay this log with a time slider. Default: show a running system.
    #[arg(value_name = "LOG")]
    pub log: Option<PathBuf>,
    /// Prefix of the system. Default: SUPPLE_PREFIX or `supple`.
    #[arg(long, value_name = "NAME", conflicts_with = "log")]
    pub prefix: Option<String>,
    /// The arm of the running system. A log contains its arm.
    #[arg(
        long,
        value_name = "NAME|PATH",
        default_value = "wam4",
        conflicts_with = "log"
    )]
    pub arm: String,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// Draw a block, its top face at this height above the base frame (m).
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = between(-10.0, 10.0))]
    pub block_m: Option<f64>,
    /// Port on 127.0.0.1. Default: a free one.
    #[arg(
        long,
        value_name = "PORT",
        default_value_t = 0,
        hide_default_value = true
    )]
    pub port: u16,
    /// Accept no requests: the page shows, it does not command.
    #[arg(long)]
    pub read_only: bool,
    /// Also accept the page of another viewer, such as Lichtblick at http://localhost:8080, if it has the URL of this
    /// one. May be repeated.
    #[arg(long, value_name = "ORIGIN")]
    pub allow_origin: Vec<String>,
    /// End with the process that started this one.
    #[arg(long, hide = true)]
    pub supervised: bool,
    /// Print the URL as JSON.
    #[arg(long)]
    pub json: bool,
}
