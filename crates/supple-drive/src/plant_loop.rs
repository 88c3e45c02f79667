//! The plant loop runs one cycle per period: it reads joint angles and sends torques.
//!
//! ```text
//! 0  request -> collect the replies -> publish -> wait for the answer -> safe action -> torques
//!    -> auxiliary poll, if it fits -> receive until the next period
//! ```
//!
//! The loop computes no torques, with one exception: if the controller is lost or requests no torque, the loop holds an
//! arm that falls without torque and lays it down. A cycle allocates no memory, writes no log
//! and, in real time, takes no lock.

use crate::budget::Overload;
use crate::drive::{Drive, LoweringMode, ReservedTimes, TipForce, TorqueOffBehaviour};
use crate::error::LoopError;
use crate::guard::{Action, GuardInput, SafeActionMachine, Stage, Torque};
use crate::hold_check::HoldCheck;
use crate::link::{ArmReport, Command, Counters, Drives, Link};
use crate::loss::LossReason;
use crate::stow::{StowConfig, Stowing};
use supple_core::controller::Mode;
use supple_core::drive_guard::DriveGuard;
use supple_core::dynamics::tip_pose;
use supple_core::{Arm, Config, Vector};

/// Configuration of the cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CycleConfig {
    /// Period \[ns\].
    pub period_ns: u64,
    /// Time reserved for the controller's answer \[ns\].
    pub answer_ns: u64,
}

/// The plant loop of an arm after start-up.
pub struct PlantLoop<const N: usize, D, L> {
    drive: D,
    link: L,
    arm: Arm<N>,
    cycle_config: CycleConfig,
    reserved: ReservedTimes,
    guard: SafeActionMachine,
    drive_guard: DriveGuard<N>,
    /// Holding and laying down; `None` for an arm whose motors brake without torque.
    stowing: Option<Stowing<N>>,
    /// Check of the motion of an arm that the loop holds.
    hold_check: HoldCheck<N>,
    period_s: f64,
    cycle: u64,
    /// Cycle of the last angles that the drive guard observed.
    observed_cycle: Option<u64>,
    next_period_ns: u64,
    /// Last joint angles for which all encoders replied \[rad\].
    last_pose_rad: Vector<N>,
    /// Time for which the bus had been busy at the start of this period \[ns\].
    busy_ns: u64,
    fallback_nm: Vector<N>,
    counters: Counters,
    shutting_down: bool,
    supported: bool,
}

impl<const N: usize, D: Drive<N>, L: Link<N>> PlantLoop<N, D, L> {
    /// Creates the plant loop of drives that have completed start-up. `stow` configures how an arm that falls without torque is
    /// held and laid down; it is ignored for other arms.
    ///
    /// # Errors
    /// [`Overload`] if the period is too short for the drives.
    pub fn new(
        drive: D,
        link: L,
        config: &Config<N>,
        cycle_config: CycleConfig,
        stow: Option<StowConfig<N>>,
    ) -> Result<PlantLoop<N, D, L>, Box<Overload>> {
        let budget = drive.budget();
        let budget = budget.off_bus_time("the controller's answer", cycle_config.answer_ns);
        budget.check(cycle_config.period_ns)?;
        let falls = drive.torque_off_behaviour() == TorqueOffBehaviour::Falls;
        let stowing = stow.filter(|_| falls);
        let guard = match (falls, &stowing) {
            (true, Some(stow)) => SafeActionMachine::falling((stow.hold_s.max(0.0) * 1e9) as u64),
            (true, None) => SafeActionMachine::falling(0),
            (false, _) => SafeActionMachine::new(),
        };
        Ok(PlantLoop {
            next_period_ns: drive.now_ns(),
            reserved: drive.reserved(),
            busy_ns: drive.counters().busy_ns,
            drive,
            link,
            arm: config.arm,
            drive_guard: DriveGuard::new(config),
            stowing: stowing.map(|stow| Stowing::new(config.arm, stow)),
            hold_check: HoldCheck::new(config.limits.joint_speed_rad_per_s),
            period_s: config.period_s,
            cycle_config,
            guard,
            cycle: 0,
            observed_cycle: None,
            last_pose_rad: Vector::zeros(),
            fallback_nm: Vector::zeros(),
            counters: Counters::default(),
            shutting_down: false,
            supported: false,
        })
    }

    /// Ends normal operation from the next cycle on, because the program is about to end.
    pub fn begin_shutdown(&mut self) {
        self.shutting_down = true;
    }

    /// Makes a shutdown hold an arm that falls without torque until [`PlantLoop::declare_supported`], instead of laying it down.
    pub fn hold_until_supported(&mut self) {
        self.guard.hold_until_supported();
    }

    /// Declares that the operator supports the arm, which is held at shutdown until then if so configured.
    pub fn declare_supported(&mut self) {
        self.supported = true;
    }

    /// Counters of the cycle.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// State machine of the safe action.
    pub fn guard(&self) -> &SafeActionMachine {
        &self.guard
    }

    /// State of the drives, as last known.
    pub fn drives(&self) -> Drives {
        self.drive.state().drives
    }

    /// Number of the next cycle.
    pub fn cycle_number(&self) -> u64 {
        self.cycle
    }

    /// The drives.
    pub fn drive(&self) -> &D {
        &self.drive
    }

    /// The drives.
    pub fn drive_mut(&mut self) -> &mut D {
        &mut self.drive
    }

    /// Link to the controller.
    pub fn link_mut(&mut self) -> &mut L {
        &mut self.link
    }

    /// Returns the drives and the link to the controller after the last cycle.
    pub fn into_parts(self) -> (D, L) {
        (self.drive, self.link)
    }

    /// Runs one cycle, up to the start of the next period.
    ///
    /// # Errors
    /// If the bus itself or the link to the controller fails. Faults on the bus are handled.
    pub fn run(&mut self) -> Result<Action, LoopError> {
        let start_ns = self.start_period()?;
        self.drive.request()?;
        self.link.announce()?;
        // Replies after this time would leave too little of the period for the answer and the torques.
        let reserved_ns = self.reserved.torques_ns + self.cycle_config.answer_ns;
        let until_ns = start_ns + self.cycle_config.period_ns - reserved_ns;
        let missing = self.drive.collect(until_ns)?;
        let report = self.arm_report(start_ns);
        let published_ns = self.drive.now_ns();
        self.link.publish(&report)?;
        let command = self.wait_for_answer(start_ns, published_ns)?;
        let periods = report.cycle - self.observed_cycle.unwrap_or(report.cycle);
        self.observed_cycle = Some(report.cycle);
        self.drive_guard.observe(&report.position_rad, periods);
        if let Some(stowing) = &mut self.stowing {
            stowing.observe(&report.position_rad);
        }
        match self.drive_guard.velocity_rad_per_s() {
            Some(velocity) if self.guard.holds() => {
                let elapsed_s = periods as f64 * self.period_s;
                self.hold_check.observe(&velocity, elapsed_s);
                if !matches!(self.guard.stage(), Stage::Damping(..)) {
                    self.hold_check.reset_runaway();
                }
            }
            _ => self.hold_check.reset(),
        }
        let allowed =
            !self.shutting_down && matches!(self.guard.stage(), Stage::Resting | Stage::Active);
        if self.drive.operate(command.as_ref(), allowed) {
            let torque_nm = command.map_or(Vector::zeros(), |command| command.torque_nm);
            self.drive_guard.reset_rate_limit(&torque_nm);
        }
        let state = self.drive.state();
        let active = state.drives == Drives::Active;
        let drive_guard_check = self
            .drive_guard
            .check_command(command.as_ref().map(Command::drive).as_ref(), active);
        let now_ns = self.drive.now_ns();
        let input = GuardInput {
            now_ns,
            answer: command.map(|command| command.wants_torque),
            drive_guard_loss: drive_guard_check.err().map(LossReason::from),
            hold_loss: self
                .hold_check
                .accelerated_joint()
                .map(LossReason::OverspeedInHold),
            missing,
            unsent: state.unsent,
            bus_off: state.bus_off,
            drives: state.drives,
            drive_loss: state.loss,
            shutting_down: self.shutting_down,
            supported: self.supported,
        };
        let lies = self.has_stowed(now_ns);
        let action = self.guard.cycle(&input, lies);
        self.send_torques(&action, command.as_ref(), now_ns)?;
        self.drive.poll(self.next_period_ns, action.lower)?;
        self.drive.drain(self.next_period_ns)?;
        self.copy_counts();
        Ok(action)
    }

    /// Copies the counters of the drives.
    fn copy_counts(&mut self) {
        let counters = self.drive.counters();
        self.counters.tx_lost = counters.tx_lost;
        self.counters.replies_lost = counters.replies_lost;
        self.counters.overruns = counters.overruns;
    }

    /// Starts the next period; returns its start \[ns\]. Skips periods that are over, and a period whose remaining time is too
    /// short for replies, answer and torques. Replies of a skipped period do not count as missing.
    fn start_period(&mut self) -> Result<u64, LoopError> {
        let now_ns = self.drive.now_ns();
        let period_ns = self.cycle_config.period_ns;
        let late_ns = now_ns.saturating_sub(self.next_period_ns);
        let skipped = late_ns / period_ns + u64::from(late_ns % period_ns > self.slack_ns());
        if skipped > 0 {
            self.cycle += skipped;
            self.next_period_ns += skipped * period_ns;
            self.counters.skipped += skipped;
            self.drive.skip(skipped, self.next_period_ns)?;
        }
        self.counters.wake_ns = late_ns;
        self.counters.cycles += 1;
        let busy_ns = self.drive.counters().busy_ns;
        self.counters.bus_load = (busy_ns - self.busy_ns) as f64 / period_ns as f64;
        self.busy_ns = busy_ns;
        self.counters.clock_stall_ns = self.drive.clock_stall_ns();
        let start_ns = self.next_period_ns;
        self.next_period_ns += period_ns;
        Ok(start_ns)
    }

    /// Maximum delay of a cycle's start that leaves time for replies, answer and torques \[ns\].
    fn slack_ns(&self) -> u64 {
        let reserved_ns = self.reserved.states_ns + self.reserved.torques_ns;
        let needed_ns = reserved_ns + self.cycle_config.answer_ns;
        self.cycle_config.period_ns.saturating_sub(needed_ns)
    }

    fn arm_report(&mut self, start_ns: u64) -> ArmReport<N> {
        let reading = self.drive.reading();
        let position_rad = reading.position_rad;
        if position_rad.iter().all(Option::is_some) {
            self.last_pose_rad = Vector::from(position_rad.map(Option::unwrap_or_default));
        }
        let tip_force_n = reading.tip_force.map(|force| match force {
            TipForce::Base(force_n) => force_n,
            TipForce::Tip(force_n) => tip_pose(&self.arm, &self.last_pose_rad).rotation * force_n,
        });
        self.copy_counts();
        ArmReport {
            cycle: self.cycle,
            stamp_ns: self.drive.monotonic_ns(start_ns),
            position_rad,
            tip_force_n,
            drives: self.drives_for_controller(),
            counters: self.counters,
        }
    }

    /// Returns the state of the drives that is reported to the controller: while this loop holds the arm or lays it down, the
    /// drives do not apply the controller's torques and are reported as held.
    fn drives_for_controller(&self) -> Drives {
        match self.drives() {
            Drives::Active if self.guard.holds() => Drives::Held,
            drives => drives,
        }
    }

    fn wait_for_answer(
        &mut self,
        start_ns: u64,
        published_ns: u64,
    ) -> Result<Option<Command<N>>, LoopError> {
        let until_ns = start_ns + self.cycle_config.period_ns - self.reserved.torques_ns;
        let wait_ns = until_ns.saturating_sub(self.drive.now_ns());
        let answer = self.link.answer(self.cycle, wait_ns)?;
        self.cycle += 1;
        self.counters.late_answers += answer.late;
        // A command that is not finite counts as a missing answer: the last fallback torque is applied.
        let command = answer.command.filter(Command::is_finite);
        self.counters.unusable += u64::from(answer.command.is_some() && command.is_none());
        match &command {
            Some(command) => {
                self.fallback_nm = command.fallback_torque_nm;
                self.counters.round_trip_ns = self.drive.now_ns().saturating_sub(published_ns);
            }
            None => {
                self.counters.missed += u64::from(self.drives() == Drives::Active);
                if self.guard.stage() == Stage::Resting {
                    // The arm may move before the motors are activated, so the old fallback torque is not valid.
                    self.fallback_nm = Vector::zeros();
                }
                self.counters.round_trip_ns = 0;
            }
        }
        Ok(command)
    }

    /// Whether an arm that is being laid down has arrived, the torque of a supported arm has faded, or an arm that is damped
    /// stands still or is not slowed.
    fn has_stowed(&self, now_ns: u64) -> bool {
        match (self.guard.stage(), &self.stowing) {
            (Stage::Stowing(_, since_ns), Some(stowing)) => {
                stowing.has_ended((now_ns - since_ns) as f64 * 1e-9)
            }
            (Stage::Releasing(_, since_ns), Some(stowing)) => {
                stowing.has_released((now_ns - since_ns) as f64 * 1e-9)
            }
            (Stage::Stowing(..) | Stage::Releasing(..), None) => true,
            (Stage::Damping(..), _) => {
                self.hold_check.stands_still() || self.hold_check.runs_away()
            }
            _ => false,
        }
    }

    /// Sends the torques, and ends them if the action requires it.
    fn send_torques(
        &mut self,
        action: &Action,
        command: Option<&Command<N>>,
        now_ns: u64,
    ) -> Result<(), LoopError> {
        let mut damping_nm_s_per_rad = Vector::zeros();
        let (wanted_nm, stopping) = match (action.torque, command) {
            (Torque::Command, Some(command)) => (command.torque_nm, command.fault),
            (Torque::Fallback, _) => (self.fallback_nm, true),
            (Torque::Hold | Torque::Stow | Torque::Release, _) => match &mut self.stowing {
                Some(stowing) => {
                    damping_nm_s_per_rad = stowing.config().damping_nm_s_per_rad;
                    let torque_nm = match self.guard.stage() {
                        Stage::Stowing(_, since_ns) => {
                            stowing.stow_nm((now_ns - since_ns) as f64 * 1e-9)
                        }
                        Stage::Releasing(_, since_ns) => {
                            stowing.release_nm((now_ns - since_ns) as f64 * 1e-9)
                        }
                        _ => {
                            stowing.reset();
                            stowing.hold_nm()
                        }
                    };
                    // At the start of holding, the torque may leave the controller's last torque as fast as a fallback torque may.
                    (torque_nm, action.torque == Torque::Hold)
                }
                None => (self.fallback_nm, true),
            },
            (Torque::Damp, _) => {
                if let Some(stowing) = &self.stowing {
                    damping_nm_s_per_rad = stowing.config().damping_nm_s_per_rad;
                }
                (Vector::zeros(), true)
            }
            (Torque::Command | Torque::None, _) => (Vector::zeros(), true),
        };
        let torque_nm = if self.drives() == Drives::Active && action.torque != Torque::None {
            self.drive_guard.limited_nm(&wanted_nm, stopping)
        } else {
            // The motors become active some cycles before this program receives their state. Until then it sends the torque of
            // gravity hold, within the limits, and zero in all other modes.
            let in_gravity_hold =
                command.is_some_and(|command| command.mode == Some(Mode::GravityHold));
            let activation_nm = if in_gravity_hold {
                wanted_nm
            } else {
                Vector::zeros()
            };
            self.drive_guard.reset_rate_limit(&activation_nm)
        };
        self.drive.send_torques(&torque_nm, &damping_nm_s_per_rad)?;
        if let (true, Stage::Lowering(reason, _)) = (action.lower, self.guard.stage()) {
            let how = if action.idle_motors {
                LoweringMode::Forced
            } else {
                LoweringMode::Regular
            };
            self.drive.lower(how, reason)?;
        }
        Ok(())
    }
}
