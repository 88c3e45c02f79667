//! Command-line options.

use crate::damiao::Misbehaviour;
use crate::emulator::Emulator;
use crate::error::EmulatorError;
use crate::safety::ButtonPress;
use clap::Parser;
use supple_bus::Address;
use supple_plant::SimulationArgs;
use supple_process::ProcessOptions;

/// Emulates an arm on its bus, instead of a real one.
///
/// A WAM starts in the emergency stop, in its home pose, held by a cradle until it is activated. Its pendant is the
/// socket `pendant` in the bus's folder. It accepts one line per connection: idle, activate, e-stop, release,
/// status, record, or a button with a time as in --press; the answer is a line of JSON. An arm with `[bus]` has no
/// pendant; see --start. The arm is a WAM with 4 or 7 joints, or has `[bus]` in its TOML.
#[derive(Clone, Debug, Parser)]
#[command(name = "supple-emu", version)]
pub struct Options {
    /// What all periodic programs have.
    #[command(flatten)]
    pub process: ProcessOptions,
    /// The simulated arm.
    #[command(flatten)]
    pub simulation: SimulationArgs,
    /// can:NAME or unix:FOLDER; default: the sockets of the system with the prefix.
    #[arg(long, value_name = "BUS")]
    pub bus: Option<Address>,
    /// Positions are known and the pucks are awake, as after a run of another program.
    #[arg(long)]
    pub zeroed: bool,
    /// Without a force/torque sensor.
    #[arg(long)]
    pub no_sensor: bool,
    /// Presses a button (idle, activate, e-stop or release) at a time (s) after the start, or after the host
    /// first commands torque (`activate@held+0.2`). May be repeated.
    #[arg(long, value_name = "BUTTON@TIME", value_parser = press)]
    pub press: Vec<ScheduledPress>,
    /// Lets a motor or the bus misbehave (arms with `[bus]`): KIND:motor=K,..., for example error:motor=2,code=B,at-s=1;
    /// see --help. May be repeated.
    #[arg(long, value_name = "SPEC", long_help = crate::damiao::HELP)]
    pub misbehave: Vec<Misbehaviour>,
    /// Obeys frames that write a motor's flash (arms with `[bus]`); without it they end the emulation.
    #[arg(long)]
    pub allow_flash: bool,
    /// Where the arm starts (arms with `[bus]`): in its home pose, supported until all motors are enabled, or in the pose
    /// in which it stays without torque.
    #[arg(long, value_name = "POSE", value_enum, default_value_t = StartPose::Home)]
    pub start: StartPose,
    /// Priority under SCHED_FIFO; above that of the host, because a real bus does not wait for a process.
    #[arg(long, value_name = "1-99", default_value_t = 81, value_parser = clap::value_parser!(u8).range(1..=99))]
    pub priority: u8,
}

/// Where an arm without brakes starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum StartPose {
    /// The home pose, supported until all motors are enabled.
    Home,
    /// The pose in which it stays without torque.
    Stow,
}

/// Parses the name of a button on the command line or the socket.
pub(crate) fn button(name: &str) -> Option<ButtonPress> {
    match name {
        "idle" => Some(ButtonPress::Idle),
        "activate" => Some(ButtonPress::Activate),
        "e-stop" => Some(ButtonPress::EStop),
        "release" => Some(ButtonPress::Release),
        _ => None,
    }
}

/// A scheduled button press.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScheduledPress {
    /// The button.
    pub press: ButtonPress,
    /// Delay \[s\].
    pub after_s: f64,
    /// Whether the delay counts from the host's first torque instead of the start.
    pub after_first_torque: bool,
}

impl ScheduledPress {
    /// Schedules the button press; `start_ns` is the time of the start.
    pub fn schedule<const N: usize>(&self, emulator: &mut Emulator<N>, start_ns: u64) {
        let after_ns = (self.after_s * 1e9).round() as u64;
        match self.after_first_torque {
            true => emulator.press_after_first_torque(after_ns, self.press),
            false => emulator.press_at(start_ns + after_ns, self.press),
        }
    }
}

/// Maximum delay of a press \[s\]: eleven days, far below the range of a nanosecond clock.
const LATEST_S: f64 = 1e6;

/// Parses `BUTTON@SECONDS` or `BUTTON@held+SECONDS`.
pub(crate) fn press(text: &str) -> Result<ScheduledPress, EmulatorError> {
    let parsed = text.split_once('@').and_then(|(name, time)| {
        let after_held = time.strip_prefix("held+");
        let after_s: f64 = after_held.unwrap_or(time).parse().ok()?;
        (0.0..=LATEST_S)
            .contains(&after_s)
            .then_some(ScheduledPress {
                press: button(name)?,
                after_s,
                after_first_torque: after_held.is_some(),
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
    fn a_press_outside_the_time_range_is_rejected() {
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
