//! Conversion from the position of a motor to the angle of its joint.
//!
//! The encoder of the output shaft is absolute within one turn, and turns are counted in RAM: after a power-up the
//! position lies within half a turn of the zero. The position of a joint whose range extends more than half a
//! turn to one side may then be wrong by a whole turn. [`JointAngle::unwrapped`] adds the number of turns that brings the
//! angle within the joint's limits, or refuses the position.

use core::f64::consts::TAU;
use core::fmt;

/// Maximum position that is accepted \[rad\]: slightly more than a turn.
pub const MAX_POSITION_RAD: f64 = 6.5;
/// Number of turns that are tried in either direction.
const TURNS: i32 = 3;

/// Sign and offset between motor and joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointAngle {
    direction: f64,
    offset_rad: f64,
}

/// Reason why a start position is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PositionError {
    /// The position is not finite, or beyond [`MAX_POSITION_RAD`] after unwrapping.
    Implausible {
        /// Position of the motor \[rad\].
        found_rad: f64,
    },
    /// No whole number of turns brings the angle within the limits.
    Outside {
        /// Angle of the joint without added turns \[rad\].
        found_rad: f64,
        /// Lower limit \[rad\].
        lower_rad: f64,
        /// Upper limit \[rad\].
        upper_rad: f64,
    },
    /// Two numbers of turns bring the angle within the limits.
    Ambiguous {
        /// First possible angle \[rad\].
        first_rad: f64,
        /// Second possible angle \[rad\].
        second_rad: f64,
    },
}

impl fmt::Display for PositionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PositionError::Implausible { found_rad } => {
                write!(f, "position is {found_rad:.4} rad, which no joint can have")
            }
            PositionError::Outside {
                found_rad,
                lower_rad,
                upper_rad,
            } => write!(
                f,
                "angle is {found_rad:.4} rad, outside {lower_rad:.4} to {upper_rad:.4} rad by any number of turns: move the \
                 joint inside, or correct the motor's zero"
            ),
            PositionError::Ambiguous {
                first_rad,
                second_rad,
            } => write!(
                f,
                "angle is {first_rad:.4} or {second_rad:.4} rad: the limits span more than a turn; narrow them"
            ),
        }
    }
}

impl core::error::Error for PositionError {}

impl JointAngle {
    /// Creates the conversion. `direction` is 1 or -1; `offset_rad` is the angle of the joint at the motor's zero position.
    pub const fn new(direction: f64, offset_rad: f64) -> JointAngle {
        JointAngle {
            direction: if direction < 0.0 { -1.0 } else { 1.0 },
            offset_rad,
        }
    }

    /// Returns the angle of the joint at this motor position \[rad\].
    pub fn joint_rad(&self, motor_rad: f64) -> f64 {
        self.direction * motor_rad + self.offset_rad
    }

    /// Converts a torque or velocity from joint to motor, or from motor to joint.
    pub fn signed(&self, value: f64) -> f64 {
        self.direction * value
    }

    /// Returns the conversion with the number of turns added that brings `motor_rad` within the joint's limits. The angle may
    /// exceed the limits by `slack_rad`, because a joint may rest on its stop.
    ///
    /// # Errors
    /// [`PositionError`] with the reason.
    pub fn unwrapped(
        &self,
        motor_rad: f64,
        lower_rad: f64,
        upper_rad: f64,
        slack_rad: f64,
    ) -> Result<JointAngle, PositionError> {
        if !motor_rad.is_finite() {
            return Err(PositionError::Implausible {
                found_rad: motor_rad,
            });
        }
        let angle_rad = self.joint_rad(motor_rad);
        let mut found: Option<f64> = None;
        for turns in -TURNS..=TURNS {
            let candidate = angle_rad + f64::from(turns) * TAU;
            if candidate < lower_rad - slack_rad || candidate > upper_rad + slack_rad {
                continue;
            }
            if let Some(first_rad) = found {
                return Err(PositionError::Ambiguous {
                    first_rad,
                    second_rad: candidate,
                });
            }
            found = Some(candidate);
        }
        let Some(inside_rad) = found else {
            return Err(PositionError::Outside {
                found_rad: angle_rad,
                lower_rad,
                upper_rad,
            });
        };
        if inside_rad.abs() > MAX_POSITION_RAD {
            return Err(PositionError::Implausible {
                found_rad: inside_rad,
            });
        }
        Ok(JointAngle {
            offset_rad: self.offset_rad + (inside_rad - angle_rad),
            ..*self
        })
    }
}
