//! What the process is told.

use crate::error::EmulatorError;
use crate::safety::Press;
use clap::Parser;
use std::path::PathBuf;
use supple_bus::Address;

/// The arm seen from its bus, in the place of a real one.
///
/// It is powered up in the emergency stop, in its home pose, in a cradle until it is activated. Its
/// pendant is the socket `pendant` in the bus's folder: a line per connection, one of idle, activate,
/// e-stop, release, status or record; the answer is a line of JSON.
#[derive(Clone, Debug, Parser)]
#[command(name = "supple-emu", version)]
pub struct Options {
    /// A WAM with 4 or 7 joints: a built-in arm, or the path of its TOML or of its folder.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Which system this belongs to, where no bus is given.
    #[arg(
        long,
        value_name = "NAME",
        env = "SUPPLE_PREFIX",
        default_value = "supple"
    )]
    pub prefix: String,
    /// can:NAME or unix:FOLDER; sockets of the system of the prefix if not given.
    #[arg(long, value_name = "BUS")]
    pub bus: Option<Address>,
    /// The host advances the time; on sockets only.
    #[arg(long)]
    pub virtual_time: bool,
    /// Positions are known and the pucks are awake, as when another program has run before.
    #[arg(long)]
    pub zeroed: bool,
    /// Without a force/torque sensor.
    #[arg(long)]
    pub no_sensor: bool,
    /// A block of wood whose face is at this height above the base frame (m), beneath the whole reach.
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub block_m: Option<f64>,
    /// Presses a button at a time (s) after the start: idle, activate, e-stop or release. May be repeated.
    #[arg(long, value_name = "BUTTON@SECONDS", value_parser = press)]
    pub press: Vec<(Press, f64)>,
    /// Writes what acts at the motors and on the tip, once a millisecond, as CSV.
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// Ends when the process that started it ends.
    #[arg(long, hide = true)]
    pub supervised: bool,
}

/// A button by its name on the command line and on the socket.
pub(crate) fn button(name: &str) -> Option<Press> {
    match name {
        "idle" => Some(Press::Idle),
        "activate" => Some(Press::Activate),
        "e-stop" => Some(Press::EStop),
        "release" => Some(Press::Release),
        _ => None,
    }
}

fn press(text: &str) -> Result<(Press, f64), EmulatorError> {
    let parsed = text.split_once('@').and_then(|(name, seconds)| {
        let seconds: f64 = seconds.parse().ok()?;
        (seconds >= 0.0 && seconds.is_finite()).then_some((button(name)?, seconds))
    });
    parsed.ok_or_else(|| EmulatorError::Press {
        text: text.to_owned(),
    })
}
