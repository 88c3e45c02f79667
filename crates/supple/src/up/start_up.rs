//! Start-up sequence from process start to tracking.
//!
//! ```text
//! joining --first state--> gravity hold --drives active--> following
//!                              |
//!                              +-- an arm on a bus waits here for its pendant
//! any of them --mode of another operator, or a fault--> ended
//! ```
//!
//! If another operator requests a mode during the sequence, it ends: it sends no further request and presses no button. The
//! controller refuses the first gravity hold if idle was accepted before, and the approach if the arm is idle.

use super::plan::Plan;
use crate::cli::{PlantKind, UpArgs, UpTrajectory};
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
    /// No arm state has been received.
    Joining,
    /// The controller has been in gravity hold since this cycle; the drives are not active yet.
    GravityHold(u64),
    /// Activation was requested: the emulated pendant was pressed, or the operator was prompted.
    ActivationRequested,
    /// The approach and the trajectory were requested.
    Following,
    /// The arm tracks, or all requests were scheduled in advance.
    Done,
    /// Another operator requested a mode, or a fault latched.
    Ended,
}

/// Action of the start-up sequence in a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Action {
    None,
    /// Requests gravity hold.
    Hold,
    /// Presses the pendant, or asks the operator to do so.
    Activate,
    /// Requests approach and trajectory.
    Follow,
    /// Ends the sequence.
    End,
}

impl Stage {
    /// Returns the action in a cycle with this mode and these drives.
    fn action(self, cycle: u64, mode: Option<Mode>, active: bool, period_s: f64) -> Action {
        let is_foreign = match self {
            // The refusal reports the fault.
            Stage::Joining => !matches!(
                mode,
                None | Some(Mode::Idle | Mode::GravityHold | Mode::Fault)
            ),
            // This telemetry is of a cycle before the request.
            Stage::GravityHold(since) if cycle < since => return Action::None,
            Stage::GravityHold(_) | Stage::ActivationRequested => mode != Some(Mode::GravityHold),
            Stage::Following => !matches!(
                mode,
                Some(Mode::GravityHold | Mode::Move | Mode::Track | Mode::Probe)
            ),
            Stage::Done | Stage::Ended => return Action::None,
        };
        match self {
            _ if is_foreign => Action::End,
            Stage::Joining => Action::Hold,
            Stage::GravityHold(_) | Stage::ActivationRequested if active => Action::Follow,
            Stage::GravityHold(since) if cycle >= since + cycles_of(GRAVITY_HOLD_S, period_s) => {
                Action::Activate
            }
            _ => Action::None,
        }
    }
}

/// Start-up sequence of a system.
#[derive(Debug)]
pub struct StartUp {
    stage: Stage,
    pendant: Option<Pendant>,
    plant: PlantKind,
    track: UpTrajectory,
    /// Whether a process was restarted, so that requests before the restart are ignored.
    is_restart: bool,
    /// Whether the arm has no pendant, so that its drives become active when gravity hold requests torque.
    without_pendant: bool,
    /// Whether to begin learning with gravity hold.
    learn: bool,
    period_s: f64,
    /// Whether the drives were active while the controller requested torque.
    was_active: bool,
    /// Whether the drives had no power; true at the start.
    was_off: bool,
}

/// Number of cycles in a time \[s\], rounded.
pub fn cycles_of(time_s: f64, period_s: f64) -> u64 {
    (time_s / period_s).round() as u64
}

impl StartUp {
    /// Creates the sequence for these processes.
    pub fn new(plan: &Plan, args: &UpArgs, period_s: f64) -> StartUp {
        StartUp {
            stage: Stage::Joining,
            pendant: plan.pendant.clone(),
            plant: args.plant,
            track: args.track,
            is_restart: false,
            without_pendant: plan.lays_down,
            learn: args.learn,
            period_s,
            was_active: false,
            was_off: true,
        }
    }

    /// Creates the sequence after the restart of a process; the caller has requested idle before.
    pub fn after_restart(plan: &Plan, args: &UpArgs, period_s: f64) -> StartUp {
        StartUp {
            is_restart: true,
            ..StartUp::new(plan, args, period_s)
        }
    }

    /// Whether another operator requested a mode, or a fault latched, before the arm tracked.
    pub fn is_ended(&self) -> bool {
        self.stage == Stage::Ended
    }

    /// Whether the sequence is complete, or was scheduled completely in advance.
    pub fn is_done(&self) -> bool {
        self.stage == Stage::Done
    }

    /// Ends the sequence and prints how to continue.
    fn end(&mut self, cause: &str, in_fault: bool) {
        self.stage = Stage::Ended;
        let track = match self.track {
            UpTrajectory::Sinusoid => "track sinusoid",
            UpTrajectory::Arc => "track arc",
            UpTrajectory::Quadrant => "track quadrant",
            UpTrajectory::Probe => "probe",
        };
        let reset = if in_fault { "`supple reset`, " } else { "" };
        let activate = match (&self.pendant, self.plant) {
            (Some(_), _) => "`supple pendant activate`, ",
            (None, PlantKind::Can) if !self.without_pendant => "Shift-Activate on the pendant, ",
            _ => "",
        };
        print_status(&format!(
            "start-up ends here, {cause}. The system keeps running; `supple up` sends no further requests. To continue: \
             {reset}`supple mode gravity-hold`, {activate}then `supple {track}`"
        ));
    }

    /// Returns a message for the operator if the drives have become idle although the controller requests torque, for example
    /// after a stall of this machine. Returns it once for each loss.
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
                    "emergency stop: the motors have no power. To continue: `supple pendant release`, `supple pendant idle`, \
                     `supple pendant cradle`, `supple at-home`, `supple reset` after a fault, `supple mode gravity-hold`, `supple pendant activate`"
                }
                None => {
                    "emergency stop: the motors have no power. To continue: release the button, press Shift-Idle, move the arm to its \
                     home pose, `supple at-home`, `supple reset` after a fault, `supple mode gravity-hold`, then press Shift-Activate"
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
                "the drives became idle. To activate them again: `supple mode gravity-hold`, then press Shift-Activate on the pendant"
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
        self.stage = Stage::Done;
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
        let record = telemetry.record();
        let mode = record.mode();
        if self.stage == Stage::Following && matches!(mode, Some(Mode::Track | Mode::Probe)) {
            self.stage = Stage::Done;
        }
        match self.stage.action(cycle, mode, active, self.period_s) {
            Action::None => {}
            Action::Hold => self.hold(record.fault != 0, session)?,
            Action::Activate => {
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
            Action::Follow => {
                let position = core::array::from_fn(|i| record.position_rad[i]);
                let start = cycle + cycles_of(SETTLE_S, self.period_s);
                self.stage = Stage::Following;
                session.follow(approach, &position.into(), Some(start))?;
            }
            Action::End if record.fault != 0 => {
                self.end(&format!("with a fault: {}", record.fault_text), true);
            }
            Action::End => {
                let name = mode.map_or("unknown", |mode| mode.name());
                let cause = format!("because mode {name} was requested meanwhile");
                self.end(&cause, false);
            }
        }
        Ok(())
    }

    /// Requests gravity hold and, if selected, learning.
    fn hold<const N: usize>(
        &mut self,
        in_fault: bool,
        session: &mut OperatorSession<N>,
    ) -> Result<(), Failure> {
        let held = match self.is_restart {
            true => session.send_request(&Request::GravityHold, None),
            false => session.send_first_request(&Request::GravityHold),
        };
        match held {
            Ok(reply) => self.stage = Stage::GravityHold(reply.cycle),
            Err(Failure::Refused { reason }) if !in_fault => {
                self.end(
                    &format!("because gravity hold was refused: {reason}"),
                    false,
                );
                return Ok(());
            }
            Err(failure) => return Err(failure),
        }
        if self.learn {
            let learn = Request::Learning(LearningSwitch::On);
            session.send_request(&learn, None)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 1e-3;

    fn action(stage: Stage, cycle: u64, mode: Mode, active: bool) -> Action {
        stage.action(cycle, Some(mode), active, PERIOD_S)
    }

    #[test]
    fn the_arm_is_held_activated_and_moved() {
        let held = Stage::GravityHold(10);
        assert_eq!(action(Stage::Joining, 3, Mode::Idle, false), Action::Hold);
        assert_eq!(action(held, 9, Mode::Idle, false), Action::None);
        assert_eq!(action(held, 10, Mode::GravityHold, false), Action::None);
        assert_eq!(
            action(held, 210, Mode::GravityHold, false),
            Action::Activate
        );
        for stage in [held, Stage::ActivationRequested] {
            assert_eq!(action(stage, 211, Mode::GravityHold, true), Action::Follow);
        }
        for mode in [Mode::GravityHold, Mode::Move, Mode::Track, Mode::Probe] {
            assert_eq!(action(Stage::Following, 300, mode, true), Action::None);
        }
    }

    /// Another requested mode, or a fault, ends the sequence before a button is pressed or a request is sent.
    #[test]
    fn another_mode_ends_the_start_up() {
        for mode in [
            Mode::Idle,
            Mode::Fault,
            Mode::Float,
            Mode::JointImpedance,
            Mode::Breakaway,
        ] {
            for active in [false, true] {
                for stage in [
                    Stage::GravityHold(10),
                    Stage::ActivationRequested,
                    Stage::Following,
                ] {
                    for cycle in [10, 500] {
                        assert_eq!(action(stage, cycle, mode, active), Action::End);
                    }
                }
                for stage in [Stage::Done, Stage::Ended] {
                    assert_eq!(action(stage, 500, mode, active), Action::None);
                }
            }
        }
        assert_eq!(action(Stage::Joining, 3, Mode::Float, false), Action::End);
    }
}
