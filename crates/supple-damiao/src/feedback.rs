//! Feedback: the answer of a motor to a command, a special frame or a feedback request.

use crate::frame::Frame;
use crate::ranges::Ranges;
use crate::status::Status;
use core::fmt;

/// State of a motor, as codes; [`Ranges`] convert them to SI units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Feedback {
    /// Whether the motor has torque.
    pub status: Status,
    /// Low four bits of the motor's id.
    pub motor: u8,
    /// Position, 16 bits.
    pub position: u16,
    /// Velocity, filtered by the motor, 12 bits.
    pub velocity: u16,
    /// Torque computed from the motor current, 12 bits; includes neither friction nor rotor inertia.
    pub torque: u16,
    /// Temperature of the amplifier \[degrees Celsius\]; 0 until the motor has measured it.
    pub mosfet_celsius: u8,
    /// Temperature of the winding \[degrees Celsius\]; 0 until the motor has measured it.
    pub winding_celsius: u8,
}

/// Error: the frame is not feedback of the expected motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeedbackError {
    /// The payload has this many bytes instead of eight.
    Length(usize),
    /// The first byte has the number of another motor.
    Motor {
        /// Found.
        found: u8,
        /// Low four bits of the expected id.
        expected: u8,
    },
}

impl fmt::Display for FeedbackError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FeedbackError::Length(found) => {
                write!(f, "feedback has {found} bytes, expected 8")
            }
            FeedbackError::Motor { found, expected } => write!(
                f,
                "feedback of motor {found} came with the reply id of motor {expected}"
            ),
        }
    }
}

impl core::error::Error for FeedbackError {}

impl Feedback {
    /// Parses a frame that does not answer a register request. The caller checks the arbitration id.
    ///
    /// # Errors
    /// [`FeedbackError::Length`] if the payload does not have eight bytes.
    pub fn parse(frame: &Frame) -> Result<Feedback, FeedbackError> {
        let Some(bytes) = frame.eight() else {
            return Err(FeedbackError::Length(frame.payload().len()));
        };
        let b = bytes.map(u16::from);
        Ok(Feedback {
            status: Status::from_code(bytes[0] >> 4),
            motor: bytes[0] & 0xF,
            position: b[1] << 8 | b[2],
            velocity: b[3] << 4 | b[4] >> 4,
            torque: (b[4] & 0xF) << 8 | b[5],
            mosfet_celsius: bytes[6],
            winding_celsius: bytes[7],
        })
    }

    /// Parses as [`Feedback::parse`] does, and accepts only feedback of the motor with `id`.
    ///
    /// # Errors
    /// [`FeedbackError`] for a frame of another motor or length.
    pub fn of_motor(frame: &Frame, id: u8) -> Result<Feedback, FeedbackError> {
        let feedback = Feedback::parse(frame)?;
        let (found, expected) = (feedback.motor, id & 0xF);
        match found == expected {
            true => Ok(feedback),
            false => Err(FeedbackError::Motor { found, expected }),
        }
    }

    /// Encodes the frame of a motor that replies with `reply_id`. Bits that exceed a field are dropped.
    pub fn emit(&self, reply_id: u16) -> Frame {
        let [p1, p0] = self.position.to_be_bytes();
        let [v, t] = [self.velocity & 0xFFF, self.torque & 0xFFF];
        Frame::of(
            reply_id,
            [
                self.status.code() << 4 | self.motor & 0xF,
                p1,
                p0,
                (v >> 4) as u8,
                ((v & 0xF) << 4 | t >> 8) as u8,
                (t & 0xFF) as u8,
                self.mosfet_celsius,
                self.winding_celsius,
            ],
        )
    }

    /// Position \[rad\].
    pub fn position_rad(&self, ranges: &Ranges) -> f64 {
        ranges.position().decode(self.position)
    }

    /// Velocity \[rad/s\], filtered by the motor and coarse; a controller computes the velocity from positions instead.
    pub fn velocity_rad_per_s(&self, ranges: &Ranges) -> f64 {
        ranges.velocity().decode(self.velocity)
    }

    /// Torque \[N m\].
    pub fn torque_nm(&self, ranges: &Ranges) -> f64 {
        ranges.torque().decode(self.torque)
    }

    /// The higher of both temperatures \[degrees Celsius\].
    pub fn hottest_celsius(&self) -> u8 {
        self.mosfet_celsius.max(self.winding_celsius)
    }
}
