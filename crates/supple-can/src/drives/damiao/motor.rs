//! State of one motor in the cycle: command, feedback and faults.

use supple_can_frame::{CanFrame, FrameFormat};
use supple_damiao::feedback::Feedback;
use supple_damiao::guard::{MotorFault as Found, MotorGuard};
use supple_damiao::inspection::TorqueRegisters;
use supple_damiao::mit::{KD, MitCodes};
use supple_damiao::position::JointAngle;
use supple_damiao::temperature::{TemperatureLevel, TemperatureLimits};
use supple_damiao::{Ranges, SpecialCommand, Status, TorqueShaper};
use supple_drive::MotorFault;

/// A motor that start-up has accepted.
#[derive(Clone, Copy, Debug)]
pub struct Motor {
    /// Id of the frames to the motor.
    pub id: u8,
    /// Id of the motor's replies.
    pub reply_id: u16,
    /// Ranges of position, velocity and torque that the motor reported.
    pub ranges: Ranges,
    /// Sign and offset between motor and joint angle, with the number of whole turns.
    pub angle: JointAngle,
    /// Ratio of the motor's torque to the commanded torque.
    pub torque_scale: f64,
    /// Maximum torque at the joint \[N m\].
    pub torque_limit_nm: f64,
    /// Temperature limits.
    pub thermal: TemperatureLimits,
    /// Registers that state its torque over current.
    pub torque_registers: TorqueRegisters,
}

/// A motor with its state in the cycle.
#[derive(Clone, Copy, Debug)]
pub(super) struct MotorInCycle {
    motor: Motor,
    period_s: f64,
    shaper: TorqueShaper,
    guard: MotorGuard,
    /// Feedback of this cycle.
    feedback: Option<Feedback>,
    /// Number of replies in this cycle.
    replies: u32,
    /// Whether the previous cycle had more than one reply; the first such cycle may be due to a late reply.
    had_many_replies: bool,
    last_status: Option<Status>,
    fault: Option<MotorFault>,
    sent: Option<CanFrame>,
}

impl MotorInCycle {
    pub(super) fn new(motor: Motor, period_s: f64) -> MotorInCycle {
        MotorInCycle {
            guard: MotorGuard::new(motor.id, motor.ranges, motor.thermal, period_s),
            motor,
            period_s,
            shaper: TorqueShaper::new(),
            feedback: None,
            replies: 0,
            had_many_replies: false,
            last_status: None,
            fault: None,
            sent: None,
        }
    }

    pub(super) fn reply_id(&self) -> u16 {
        self.motor.reply_id
    }

    pub(super) fn feedback(&self) -> Option<&Feedback> {
        self.feedback.as_ref()
    }

    /// Status in the last feedback.
    pub(super) fn status(&self) -> Option<Status> {
        self.last_status
    }

    pub(super) fn fault(&self) -> Option<MotorFault> {
        self.fault
    }

    /// Temperature \[degrees Celsius\], and the fraction of the torque limit that it allows, if it is above the
    /// warning limit and below that of a fault.
    pub(super) fn warning(&self) -> Option<(u8, f64)> {
        let warns = matches!(
            self.guard.heat(),
            TemperatureLevel::Warning | TemperatureLevel::Derating
        );
        warns.then(|| (self.guard.celsius(), self.guard.torque_share()))
    }

    pub(super) fn sent(&self) -> Option<&CanFrame> {
        self.sent.as_ref()
    }

    /// Returns the angle of the joint in this cycle \[rad\]; `None` without a reply, or if the angle is known to be wrong.
    pub(super) fn joint_rad(&self) -> Option<f64> {
        if matches!(
            self.fault,
            Some(MotorFault::PositionJump | MotorFault::TwoMotors)
        ) {
            return None;
        }
        let feedback = self.feedback?;
        let motor_rad = feedback.position_rad(&self.motor.ranges);
        Some(self.motor.angle.joint_rad(motor_rad))
    }

    /// Clears the faults and the command state before the motor is enabled.
    pub(super) fn begin(&mut self) {
        *self = MotorInCycle {
            last_status: self.last_status,
            ..MotorInCycle::new(self.motor, self.period_s)
        };
    }

    fn prepare(&mut self, frame: CanFrame) -> CanFrame {
        self.feedback = None;
        self.replies = 0;
        self.sent = Some(frame);
        frame
    }

    /// Returns a special frame that begins the cycle.
    pub(super) fn special(&mut self, special: SpecialCommand, format: FrameFormat) -> CanFrame {
        self.prepare(special.emit(self.motor.id).on_bus(format))
    }

    /// Returns the command that begins the cycle: a joint torque \[N m\] and the damping that the motor adds itself
    /// \[N m s/rad\]. The stiffness of the motor is always zero.
    pub(super) fn command(
        &mut self,
        joint_nm: f64,
        damping_nm_s_per_rad: f64,
        format: FrameFormat,
    ) -> CanFrame {
        let motor = &self.motor;
        // The shaper and rounding add one step of the code at most: it stays within the limit.
        let step_nm = motor.ranges.torque().step() * motor.torque_scale;
        let limit_nm = (motor.torque_limit_nm * self.guard.torque_share() - step_nm).max(0.0);
        let joint_nm = joint_nm.clamp(-limit_nm, limit_nm);
        let motor_nm = motor.angle.signed(joint_nm) / motor.torque_scale;
        let ranges = &motor.ranges;
        // A torque that is not a number becomes zero.
        let torque = self.shaper.encode(motor_nm, ranges).unwrap_or_else(|_| {
            let zero = TorqueShaper::new().encode(0.0, ranges);
            zero.unwrap_or(0x800)
        });
        let codes = MitCodes {
            position: ranges.position().encode(0.0, "position").unwrap_or(0x8000),
            velocity: ranges.velocity().encode(0.0, "velocity").unwrap_or(0x800),
            kp: 0,
            kd: KD.encode(damping_nm_s_per_rad, "kd").unwrap_or(0),
            torque,
        };
        let frame = codes.emit(motor.id).on_bus(format);
        self.prepare(frame)
    }

    /// Processes a frame with this motor's reply id.
    pub(super) fn handle(&mut self, frame: &supple_damiao::Frame) {
        if let Ok(feedback) = Feedback::parse(frame) {
            self.feedback = Some(feedback);
            self.last_status = Some(feedback.status);
            self.replies += 1;
        }
    }

    /// Checks the replies of a cycle in which the motor should be enabled, and records a fault.
    pub(super) fn check_replies(&mut self) {
        let many = self.replies > 1;
        // The reply to the previous cycle may be late; two replies in two cycles mean that two motors have this id.
        let replies = if many && !self.had_many_replies {
            1
        } else {
            self.replies
        };
        self.had_many_replies = many;
        match self.guard.cycle(self.feedback.as_ref(), replies) {
            // The plant loop counts missing replies.
            Ok(()) | Err(Found::Silent { .. }) => {}
            Err(found) => self.fault = Some(drive_fault(&found)),
        }
    }

    /// Records the fault of a motor that cannot be enabled.
    pub(super) fn record_enable_fault(&mut self) {
        let status = self.last_status.unwrap_or(Status::Disabled);
        self.fault = Some(fault_of_status(status));
    }
}

fn drive_fault(found: &Found) -> MotorFault {
    match *found {
        Found::Error(status) => fault_of_status(status),
        Found::Disabled | Found::Silent { .. } => MotorFault::Disabled,
        Found::Hot { .. } => MotorFault::Hot,
        // The cycle reads no register: a changed range appears as a position jump.
        Found::PositionJump { .. } | Found::RegisterChanged { .. } => MotorFault::PositionJump,
        Found::ForeignFeedback { .. } | Found::TwoAnswers => MotorFault::TwoMotors,
    }
}

fn fault_of_status(status: Status) -> MotorFault {
    match status {
        Status::Disabled | Status::Enabled => MotorFault::Disabled,
        Status::OverVoltage => MotorFault::OverVoltage,
        Status::UnderVoltage => MotorFault::UnderVoltage,
        Status::OverCurrent => MotorFault::OverCurrent,
        Status::MosfetHot => MotorFault::HotDriver,
        Status::WindingHot => MotorFault::HotWinding,
        Status::CommunicationLost => MotorFault::CommunicationLost,
        Status::Overload => MotorFault::Overload,
        Status::Unknown(code) => MotorFault::Unknown(code),
    }
}
