//! Start-up sequence from process start to tracking.
//!
//! ```text
//! joining --first state--> gravity hold --drives active--> following
//!                              |
//!                              +-- an arm on a bus waits here for its pendant
//! ```

use super::plan::Plan;
use crate::cli::{PlantKind, UpArgs};
use crate::operate::{Approach, OperatorSession, Pendant};
use supple_cli::console::print_status;
use supple_cli::exit::Failure;
use supple_core::controller::{LearningSwitch, Mode, Request};
use supple_ipc::message::{Drives, Telemetry};

/// Gravity hold before the approach to the start pose \[s\].
const SETTLE_S: f64 = 0.1;
/// Gravity hold before the pendant is pressed \[s\].
pub const GRAVITY_HOLD_S: f64 = 0.2;
/// Maximum time from pressing the pendant until the controller receives that the drives are active \[s\].
const ACTIVATION_S: f64 = 0.1;

/// Time at which the approach may begin in virtual time, for a simulated and for an emulated arm \[s\].
pub const START_S: [f64; 2] = [SETTLE_S, SETTLE_S + GRAVITY_HOLD_S + ACTIVATION_S];

/// Stage of the start-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// No arm state received yet.
    Joining,
    /// Gravity hold since this cycle; the drives are not active yet.
    GravityHold(u64),
    /// Activation was requested: the emulated pendant was pressed, or the operator was prompted.
    ActivationRequested,
    /// The approach and the trajectory were requested.
    Following,
}

/// Start-up sequence of a system.
#[derive(Debug)]
pub struct Stages {
    stage: Stage,
    pendant: Option<Pendant>,
    plant: PlantKind,
    /// The arm has no pendant: its drives become active when gravity hold requests torque.
    without_pendant: bool,
    /// Learning begins with gravity hold.
    learn: bool,
    period_s: f64,
    /// The drives were active while torque was wanted.
    was_active: bool,
    /// The drives had no power; so it is at the start.
    was_off: bool,
}

/// Number of cycles in a time \[s\], rounded.
pub fn cycles_of(time_s: f64, period_s: f64) -> u64 {
    (time_s / period_s).round() as u64
}

impl Stages {
    /// Starts the sequence of these processes.
    pub fn new(plan: &Plan, args: &UpArgs, period_s: f64) -> Stages {
        Stages {
            stage: Stage::Joining,
            pendant: plan.pendant.clone(),
            plant: args.plant,
            without_pendant: plan.lays_down,
            learn: args.learn,
            period_s,
            was_active: false,
            was_off: true,
        }
    }

    /// What the operator sees when the drives have become idle although the controller wants torque, as after a stall of
    /// this machine: once for each time.
    fn lost_drives(&mut self, telemetry: &Telemetry) -> Option<&'static str> {
        let wants_torque = !matches!(
            telemetry.record().mode(),
            Some(Mode::Idle | Mode::Fault) | None
        );
        let active = telemetry.state.drives() == Drives::Active;
        let lost = wants_torque && self.was_active && !active;
        self.was_active = active && wants_torque;
        let stopped = telemetry.state.drives() == Drives::Off && !self.was_off;
        self.was_off = telemetry.state.drives() == Drives::Off;
        if stopped && !self.without_pendant {
            return Some(match self.pendant {
                Some(_) => {
                    "emergency stop: the motors have no power. To go on: `supple pendant release`, `supple pendant idle`, \
                     `supple reset` after a fault, `supple mode gravity-hold`, `supple pendant activate`"
                }
                None => {
                    "emergency stop: the motors have no power. To go on: release the button, press Shift-Idle, \
                     `supple reset` after a fault, `supple mode gravity-hold`, then press Shift-Activate"
                }
            });
        }
        lost.then_some(match self.plant {
            _ if self.without_pendant => {
                "the arm is laid down, then its motors are disabled; the reason is above. To activate them again: \
                 `supple reset` after a fault, `supple mode idle`, then `supple mode gravity-hold`"
            }
            PlantKind::Sim => {
                "the drives became idle and brake: the controller did not answer in time. To activate them again: \
                 `supple mode idle`, then `supple mode gravity-hold`"
            }
            PlantKind::Emu => {
                "the drives became idle and brake. To activate them again: `supple mode gravity-hold`, then \
                 `supple pendant activate`"
            }
            PlantKind::Can => {
                "the drives became idle. To activate them again: `supple mode gravity-hold`, then the arm's pendant"
            }
        })
    }

    /// Schedules the start-up in advance, as virtual time requires: the emulated arm presses the pendant at fixed
    /// times. Returns the first cycle in which the approach may begin.
    ///
    /// # Errors
    /// [`Failure::Pendant`].
    pub fn plan(&mut self) -> Result<u64, Failure> {
        let start_s = START_S[usize::from(self.pendant.is_some())];
        if let Some(pendant) = &self.pendant {
            pendant.press(&format!("activate@held+{GRAVITY_HOLD_S}"))?;
        }
        self.stage = Stage::Following;
        Ok(cycles_of(start_s, self.period_s))
    }

    /// Sends the next request or button press when it is due.
    ///
    /// # Errors
    /// If the controller refuses a request or the pendant does not answer.
    pub fn advance<const N: usize>(
        &mut self,
        telemetry: &Telemetry,
        session: &mut OperatorSession<N>,
        approach: &Approach<N>,
    ) -> Result<(), Failure> {
        let cycle = telemetry.state.cycle;
        let active = telemetry.state.drives() == Drives::Active;
        if let Some(text) = self.lost_drives(telemetry) {
            print_status(text);
        }
        match self.stage {
            Stage::Joining => {
                session.send_request(&Request::GravityHold, None)?;
                if self.learn {
                    let learn = Request::Learning(LearningSwitch::On);
                    session.send_request(&learn, None)?;
                }
                self.stage = Stage::GravityHold(cycle);
            }
            Stage::GravityHold(_) | Stage::ActivationRequested if active => {
                let position = core::array::from_fn(|i| telemetry.record().position_rad[i]);
                let start = cycle + cycles_of(SETTLE_S, self.period_s);
                session.follow(approach, &position.into(), Some(start))?;
                self.stage = Stage::Following;
            }
            Stage::GravityHold(since)
                if cycle >= since + cycles_of(GRAVITY_HOLD_S, self.period_s) =>
            {
                match &self.pendant {
                    Some(pendant) => pendant.press("activate")?,
                    None if self.plant == PlantKind::Can && !self.without_pendant => {
                        print_status(
                            "the controller is in gravity hold: press Shift-Activate on the pendant",
                        );
                    }
                    None => {}
                }
                self.stage = Stage::ActivationRequested;
            }
            Stage::GravityHold(_) | Stage::ActivationRequested | Stage::Following => {}
        }
        Ok(())
    }
}
