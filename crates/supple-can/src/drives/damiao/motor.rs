//! One motor in the cycle: its command, its feedback, its faults.

use supple_can_frame::{CanFrame, FrameFormat};
use supple_damiao::feedback::Feedback;
use supple_damiao::guard::{MotorFault as Found, MotorGuard};
use supple_damiao::mit::{KD, MitCodes};
use supple_damiao::position::JointAngle;
use supple_damiao::temperature::Thermal;
use supple_damiao::{Ranges, Special, Status, TorqueShaper};
use supple_drive::MotorFault;

/// A motor that start-up has accepted.
#[derive(Clone, Copy, Debug)]
pub struct Motor {
    /// Id that it listens to.
    pub id: u8,
    /// Id of its replies.
    pub reply_id: u16,
    /// Ranges that it reported.
    pub ranges: Ranges,
    /// Sign and offset of its joint, with whole turns.
    pub angle: JointAngle,
    /// Its torque over the commanded one.
    pub torque_scale: f64,
    /// Greatest torque at its joint \[N m\].
    pub torque_limit_nm: f64,
    /// Temperatures.
    pub thermal: Thermal,
}

/// A motor with its state in the cycle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Running {
    motor: Motor,
    period_s: f64,
    shaper: TorqueShaper,
    guard: MotorGuard,
    /// Feedback of this cycle, and the number of replies in it.
    feedback: Option<Feedback>,
    answers: u32,
    /// The last cycle had more than one answer: a late one may explain the first such cycle.
    many_answers: bool,
    last_status: Option<Status>,
    fault: Option<MotorFault>,
    sent: Option<CanFrame>,
}

impl Running {
    pub(super) fn new(motor: Motor, period_s: f64) -> Running {
        Running {
            guard: MotorGuard::new(motor.id, motor.ranges, motor.thermal, period_s),
            motor,
            period_s,
            shaper: TorqueShaper::new(),
            feedback: None,
            answers: 0,
            many_answers: false,
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

    pub(super) fn sent(&self) -> Option<&CanFrame> {
        self.sent.as_ref()
    }

    /// Angle of the joint in this cycle \[rad\]; none where it is known to be wrong.
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

    /// Begins a period in which the motor is meant to be enabled: earlier faults are forgotten.
    pub(super) fn begin(&mut self) {
        *self = Running {
            last_status: self.last_status,
            ..Running::new(self.motor, self.period_s)
        };
    }

    fn prepare(&mut self, frame: CanFrame) -> CanFrame {
        self.feedback = None;
        self.answers = 0;
        self.sent = Some(frame);
        frame
    }

    /// A special frame that opens the cycle.
    pub(super) fn special(&mut self, special: Special, format: FrameFormat) -> CanFrame {
        self.prepare(special.emit(self.motor.id).on_bus(format))
    }

    /// The command that opens the cycle: a joint torque \[N m\] and the motor's own damping \[N m s/rad\]. Its own
    /// stiffness is always zero.
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
        // A torque that is not a number is none.
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

    /// Takes a frame with this motor's reply id.
    pub(super) fn handle(&mut self, frame: &supple_damiao::Frame) {
        if let Ok(feedback) = Feedback::parse(frame) {
            self.feedback = Some(feedback);
            self.last_status = Some(feedback.status);
            self.answers += 1;
        }
    }

    /// Judges a cycle in which the motor was meant to be enabled.
    pub(super) fn judge(&mut self) {
        let many = self.answers > 1;
        // The reply to the previous cycle may have come late; twice in a row two motors answer.
        let answers = if many && !self.many_answers {
            1
        } else {
            self.answers
        };
        self.many_answers = many;
        match self.guard.cycle(self.feedback.as_ref(), answers) {
            // A silent motor is counted by the plant loop.
            Ok(()) | Err(Found::Silent { .. }) => {}
            Err(found) => self.fault = Some(named(&found)),
        }
    }

    /// Notes a motor that cannot be enabled.
    pub(super) fn refuse(&mut self) {
        let status = self.last_status.unwrap_or(Status::Disabled);
        self.fault = Some(of_status(status));
    }
}

fn named(found: &Found) -> MotorFault {
    match *found {
        Found::Error(status) => of_status(status),
        Found::Disabled | Found::Silent { .. } => MotorFault::Disabled,
        Found::Hot { .. } => MotorFault::Hot,
        // No register is read in the cycle: a changed range shows as a jump.
        Found::PositionJump { .. } | Found::RegisterChanged { .. } => MotorFault::PositionJump,
        Found::ForeignFeedback { .. } | Found::TwoAnswers => MotorFault::TwoMotors,
    }
}

fn of_status(status: Status) -> MotorFault {
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
