//! Drives of an arm with Damiao motors: the torque command is also the request for the motor state. A cycle begins with the
//! torque commands that the controller computed in the previous cycle; the replies carry the state. The state is therefore
//! fresh when the controller receives it, and a torque acts one period after it was computed.
//!
//! ```text
//! disabled --(gravity hold requests torque)--> enable --> starting --(all enabled)--> enabled
//! enabled or starting --(lowered, or a motor that cannot be enabled)--> disabling --(all disabled)--> disabled
//! ```
//!
//! In the cycle that enables the motors, each motor receives the enable frame instead of a command; from the next cycle
//! on, the torque is gravity compensation. This drive never clears an error, sets a zero position or writes a register.

use super::motor::{Motor, MotorInCycle};
use supple_bus::Bus;
use supple_can_frame::timing::FrameLayout;
use supple_can_frame::{BitRates, FrameFormat};
use supple_core::Vector;
use supple_core::controller::Mode;
use supple_damiao::{Frame, SpecialCommand, Status};
use supple_drive::{
    Budget, BusPort, Command, Drive, DriveCounters, DriveState, Drives, LoopError, LossReason,
    LoweringMode, Reading, Received, ReservedTimes, TemperatureWarning, TorqueOffBehaviour,
};

/// Number of cycles within which all motors must confirm that they are enabled.
const STARTING_CYCLES: u32 = 20;
/// Number of cycles after which the enable frame is repeated.
const ENABLE_AGAIN_CYCLES: u32 = 5;
/// Payload of every frame \[bytes\].
const BYTES: u8 = 8;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Power {
    Disabled,
    /// The motors are being enabled, for this number of cycles.
    Starting(u32),
    Enabled,
    Disabling,
}

/// The Damiao motors of an arm, with their bus, after start-up.
pub struct Damiao<const N: usize, B> {
    port: BusPort<B>,
    format: FrameFormat,
    motors: [MotorInCycle; N],
    power: Power,
    torque_nm: Vector<N>,
    damping_nm_s_per_rad: Vector<N>,
    /// Whether the motors remain disabled after a loss, until the controller requests no torque.
    latched: bool,
}

impl<const N: usize, B: Bus> Damiao<N, B> {
    /// Creates the drives of an arm whose motors are disabled and whose cycles take `period_s`.
    pub fn new(bus: B, rates: BitRates, motors: [Motor; N], period_s: f64) -> Damiao<N, B> {
        Damiao {
            port: BusPort::new(bus, rates),
            format: rates.fastest_format(),
            motors: motors.map(|motor| MotorInCycle::new(motor, period_s)),
            power: Power::Disabled,
            torque_nm: Vector::zeros(),
            damping_nm_s_per_rad: Vector::zeros(),
            latched: false,
        }
    }

    /// Keeps the motors disabled until the controller requests no torque, as after a loss.
    pub fn latch(&mut self) {
        self.latched = true;
    }

    /// The bus.
    pub fn bus(&self) -> &B {
        self.port.bus()
    }

    /// The bus.
    pub fn bus_mut(&mut self) -> &mut B {
        self.port.bus_mut()
    }

    /// Returns the bus.
    pub fn into_bus(self) -> B {
        self.port.into_bus()
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<(), LoopError> {
        while self.receive(until_ns, u32::MAX)? {}
        Ok(())
    }

    fn receive(&mut self, until_ns: u64, frames: u32) -> Result<bool, LoopError> {
        match self.port.receive(until_ns, frames)? {
            Received::Nothing => return Ok(false),
            Received::Other => {}
            Received::Frame(frame) => {
                if let Ok(frame) = Frame::of_bus(&frame) {
                    let mut motors = self.motors.iter_mut();
                    if let Some(motor) = motors.find(|motor| motor.reply_id() == frame.id()) {
                        motor.handle(&frame);
                    }
                }
            }
        }
        Ok(true)
    }

    fn missing_replies(&self) -> u32 {
        let missing = self
            .motors
            .iter()
            .filter(|motor| motor.feedback().is_none());
        missing.count() as u32
    }

    fn all(&self, status: Status) -> bool {
        self.motors
            .iter()
            .all(|motor| motor.status() == Some(status))
    }

    /// Whether an enabled motor replied in this cycle.
    fn any_enabled(&self) -> bool {
        let mut replies = self.motors.iter().filter_map(MotorInCycle::feedback);
        replies.any(|feedback| feedback.status == Status::Enabled)
    }

    /// Checks the replies of this cycle: updates the power state and the faults of the motors.
    fn check_replies(&mut self) {
        match self.power {
            // A motor that missed its disable frame receives another one.
            Power::Disabled if self.any_enabled() => self.power = Power::Disabling,
            Power::Disabled => {}
            Power::Starting(_) if self.all(Status::Enabled) => {
                self.power = Power::Enabled;
            }
            Power::Starting(cycles) if cycles > STARTING_CYCLES => {
                let stuck = |motor: &&mut MotorInCycle| motor.status() != Some(Status::Enabled);
                self.motors
                    .iter_mut()
                    .filter(stuck)
                    .for_each(MotorInCycle::record_enable_fault);
                self.latched = true;
                self.power = Power::Disabling;
            }
            Power::Starting(_) => {}
            Power::Enabled => self.motors.iter_mut().for_each(MotorInCycle::check_replies),
            // A motor that does not confirm receives a disable frame in every cycle; its watchdog ends its torque.
            Power::Disabling if !self.any_enabled() => self.power = Power::Disabled,
            Power::Disabling => {}
        }
    }
}

/// Lists the frames of a period: a command and a reply of each motor.
pub fn budget(rates: BitRates, joints: usize) -> Budget {
    let layout = FrameLayout::standard(rates.fastest_format(), BYTES);
    Budget::new(rates, joints)
        .frames("commands", joints, layout)
        .frames("replies", joints, layout)
}

impl<const N: usize, B: Bus> Drive<N> for Damiao<N, B> {
    fn now_ns(&self) -> u64 {
        self.port.bus().now_ns()
    }

    fn monotonic_ns(&self, time_ns: u64) -> u64 {
        self.port.bus().monotonic_ns(time_ns)
    }

    fn clock_stall_ns(&self) -> u64 {
        self.port.bus().clock_stall_ns()
    }

    fn torque_off_behaviour(&self) -> TorqueOffBehaviour {
        TorqueOffBehaviour::Falls
    }

    /// Reserves no time for torques: they are sent at the start of the next cycle.
    fn reserved(&self) -> ReservedTimes {
        ReservedTimes {
            states_ns: self.budget().min_period_ns(),
            torques_ns: 0,
        }
    }

    fn budget(&self) -> Budget {
        budget(self.port.rates(), N)
    }

    fn request(&mut self) -> Result<(), LoopError> {
        let special = match &mut self.power {
            Power::Disabled | Power::Enabled => None,
            Power::Disabling => Some(SpecialCommand::Disable),
            Power::Starting(cycles) => {
                *cycles += 1;
                (*cycles % ENABLE_AGAIN_CYCLES == 1).then_some(SpecialCommand::Enable)
            }
        };
        let disabled = self.power == Power::Disabled;
        for (joint, motor) in self.motors.iter_mut().enumerate() {
            let enabled = motor.status() == Some(Status::Enabled);
            let frame = match special {
                Some(SpecialCommand::Enable) if enabled => None,
                // The motor has not confirmed that it is disabled: a command would reset its watchdog.
                None if disabled && enabled => Some(SpecialCommand::Disable),
                special => special,
            };
            let frame = match frame {
                Some(special) => motor.special(special, self.format),
                None => {
                    let damping = self.damping_nm_s_per_rad[joint];
                    motor.command(self.torque_nm[joint], damping, self.format)
                }
            };
            self.port.send(&frame)?;
        }
        Ok(())
    }

    fn collect(&mut self, until_ns: u64) -> Result<u8, LoopError> {
        loop {
            let missing = self.missing_replies();
            if missing == 0 || !self.receive(until_ns, missing)? {
                break;
            }
        }
        let mut missing = 0;
        for (index, motor) in self.motors.iter().enumerate() {
            if motor.feedback().is_none() {
                self.port.count_lost_replies(1);
                let sent = motor.sent();
                let confirmed = sent.is_some_and(|frame| !self.port.is_unconfirmed(frame));
                missing |= u8::from(confirmed) << index;
            }
        }
        self.check_replies();
        Ok(missing)
    }

    fn reading(&self) -> Reading<N> {
        Reading {
            position_rad: core::array::from_fn(|joint| self.motors[joint].joint_rad()),
            tip_force: None,
        }
    }

    fn temperature_warning(&self, motor: usize) -> Option<TemperatureWarning> {
        let motor = self.motors.get(motor)?;
        let warning = motor.warning().filter(|_| self.power == Power::Enabled);
        warning.map(|(celsius, torque_share)| TemperatureWarning {
            celsius,
            torque_share,
        })
    }

    fn state(&self) -> DriveState {
        let drives = match self.power {
            Power::Enabled => Drives::Active,
            // The drives stay active while a motor still has torque, so that the loop continues to end it.
            Power::Disabling => Drives::Active,
            Power::Starting(_) => Drives::Idle,
            Power::Disabled if self.motors_replied() => Drives::Idle,
            Power::Disabled => Drives::Off,
        };
        let mut faults = self.motors.iter().enumerate();
        let loss = faults.find_map(|(index, motor)| {
            let fault = motor.fault()?;
            Some(LossReason::Motor(index, fault))
        });
        DriveState {
            drives,
            unsent: self.port.frames_lost(),
            bus_off: self.port.bus_off(),
            loss,
        }
    }

    fn operate(&mut self, command: Option<&Command<N>>, allowed: bool) -> bool {
        let holds =
            |command: &Command<N>| command.mode == Some(Mode::GravityHold) && command.wants_torque;
        if matches!(self.power, Power::Starting(_)) && !(allowed && command.is_none_or(holds)) {
            // The controller requests no torque: motors that are being enabled are disabled.
            self.power = Power::Disabling;
            return false;
        }
        let Some(command) = command else {
            return false;
        };
        self.latched &= command.wants_torque;
        let holding = holds(command);
        let idle = self.power == Power::Disabled && self.all(Status::Disabled);
        if !(allowed && holding && idle && !self.latched && self.missing_replies() == 0) {
            return false;
        }
        self.motors.iter_mut().for_each(MotorInCycle::begin);
        self.power = Power::Starting(0);
        true
    }

    fn send_torques(
        &mut self,
        torque_nm: &Vector<N>,
        damping_nm_s_per_rad: &Vector<N>,
    ) -> Result<(), LoopError> {
        self.torque_nm = *torque_nm;
        self.damping_nm_s_per_rad = *damping_nm_s_per_rad;
        Ok(())
    }

    fn lower(&mut self, _: LoweringMode, reason: LossReason) -> Result<(), LoopError> {
        self.latched |= reason != LossReason::TorqueNotWanted;
        self.power = Power::Disabling;
        Ok(())
    }

    fn drain(&mut self, next_period_ns: u64) -> Result<(), LoopError> {
        self.receive_until(next_period_ns)?;
        self.port.end_cycle();
        Ok(())
    }

    fn skip(&mut self, _: u64, next_period_ns: u64) -> Result<(), LoopError> {
        self.receive_until(next_period_ns)
    }

    fn motors_replied(&self) -> bool {
        self.missing_replies() < N as u32
    }

    fn counters(&self) -> DriveCounters {
        self.port.counters()
    }
}
