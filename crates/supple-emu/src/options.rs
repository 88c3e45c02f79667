//! What the process is told.

use crate::emulator::Emulator;
use crate::error::EmulatorError;
use crate::safety::Press;
use clap::Parser;
use std::path::PathBuf;
use supple_bus::Address;
use supple_plant::Injection;
use supple_realtime::{RealtimeOptions, Settings};

/// The arm seen from its bus, in the place of a real one.
///
/// It is powered up in the emergency stop, in its home pose, in a cradle until it is activated. Its
/// pendant is the socket `pendant` in the bus's folder: a line per connection, one of idle, activate,
/// e-stop, release, status, record, or a button with a time as in --press; the answer is a line of JSON.
#[derive(Clone, Debug, Parser)]
#[command(name = "supple-emu", version)]
pub struct Options {
    /// A WAM with 4 or 7 joints: a built-in arm, or the path of its TOML or of its folder.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Refuses an arm whose URDF holds what is not read, instead of a warning.
    #[arg(long)]
    pub strict: bool,
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
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = height)]
    pub block_m: Option<f64>,
    /// Presses a button at a time (s) after the start, or after the host first asks for torque
    /// (`activate@held+0.2`): idle, activate, e-stop or release. May be repeated.
    #[arg(long, value_name = "BUTTON@TIME", value_parser = press)]
    pub press: Vec<Later>,
    /// Puts a fault into the arm: KIND or KIND:key=value,... as in encoder-stuck:joint=1,at-s=2; see --help. May
    /// be repeated.
    #[arg(long, value_name = "SPEC", long_help = supple_plant::injection::HELP)]
    pub inject: Vec<Injection>,
    /// Writes what acts at the motors and on the tip, once a millisecond, as CSV.
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// Priority under SCHED_FIFO, above that of its host: a cable waits for nobody.
    #[arg(long, value_name = "1-99", default_value_t = 81, value_parser = clap::value_parser!(u8).range(1..=99))]
    pub priority: u8,
    #[command(flatten)]
    realtime: RealtimeOptions,
}

impl Options {
    /// It is to end with the process that started it.
    pub fn supervised(&self) -> bool {
        self.realtime.supervised
    }

    /// What to ask of the system.
    pub fn realtime(&self) -> Settings {
        self.realtime.settings(self.priority, self.virtual_time)
    }
}

fn height(text: &str) -> Result<f64, String> {
    let height = text.parse().ok();
    let height = height.filter(|m| (-10.0..=10.0).contains(m));
    height.ok_or_else(|| "give a height from -10 to 10 m".to_owned())
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

/// A button that will be pressed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Later {
    /// Which.
    pub press: Press,
    /// When \[s\].
    pub after_s: f64,
    /// After the host first asks for torque, not after the start.
    pub once_held: bool,
}

impl Later {
    /// Has it pressed; `start_ns` is the time of the start.
    pub fn plan<const N: usize>(&self, emulator: &mut Emulator<N>, start_ns: u64) {
        let after_ns = (self.after_s * 1e9).round() as u64;
        match self.once_held {
            true => emulator.press_once_held(after_ns, self.press),
            false => emulator.press_at(start_ns + after_ns, self.press),
        }
    }
}

/// The latest time of a press \[s\]: eleven days, far below the end of a clock that counts nanoseconds.
const LATEST_S: f64 = 1e6;

/// `BUTTON@SECONDS` or `BUTTON@held+SECONDS`.
pub(crate) fn press(text: &str) -> Result<Later, EmulatorError> {
    let parsed = text.split_once('@').and_then(|(name, time)| {
        let after_held = time.strip_prefix("held+");
        let after_s: f64 = after_held.unwrap_or(time).parse().ok()?;
        (0.0..=LATEST_S).contains(&after_s).then_some(Later {
            press: button(name)?,
            after_s,
            once_held: after_held.is_some(),
        })
    });
    parsed.ok_or_else(|| EmulatorError::Press {
        text: text.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_press_beyond_the_clock_is_refused() {
        for text in [
            "idle@1e300",
            "idle@held+1e300",
            "idle@1000001",
            "idle@-1",
            "idle@nan",
            "idle@inf",
        ] {
            let error = press(text).unwrap_err().to_string();
            assert!(error.contains(text) && error.contains("1e6"), "{error}");
        }
        assert_eq!(press("release@held+1e6").unwrap().after_s, 1e6);
    }
}
