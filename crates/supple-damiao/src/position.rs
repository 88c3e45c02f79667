//! From a motor's position to its joint's angle.
//!
//! The encoder of the output shaft is absolute within one turn, and turns are counted in RAM: after a power-up the
//! position lies within half a turn of the zero. A joint with more than half a turn on one side can then start a
//! whole turn off. [`JointAngle::unwrapped`] adds the turns that lead into the joint's limits, or refuses.

use core::f64::consts::TAU;
use core::fmt;

/// Greatest position that is accepted \[rad\]: a turn and a little.
pub const MAX_POSITION_RAD: f64 = 6.5;
/// Turns that are tried to either side.
const TURNS: i32 = 3;

/// Sign and offset between motor and joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointAngle {
    direction: f64,
    offset_rad: f64,
}

/// Why a start position is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PositionError {
    /// Not finite, or beyond [`MAX_POSITION_RAD`] after unwrapping.
    Implausible {
        /// Position of the motor \[rad\].
        found_rad: f64,
    },
    /// No whole number of turns leads into the limits.
    Outside {
        /// Angle of the joint without added turns \[rad\].
        found_rad: f64,
        /// Lower limit \[rad\].
        lower_rad: f64,
        /// Upper limit \[rad\].
        upper_rad: f64,
    },
    /// Two numbers of turns lead into the limits.
    Ambiguous {
        /// One angle \[rad\].
        first_rad: f64,
        /// The other \[rad\].
        second_rad: f64,
    },
}

impl fmt::Display for PositionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PositionError::Implausible { found_rad } => {
                write!(f, "position is {found_rad:.4} rad, beyond any joint")
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
    /// `direction` is 1 or -1; `offset_rad` is the joint's angle where the motor's position is zero.
    pub const fn new(direction: f64, offset_rad: f64) -> JointAngle {
        JointAngle {
            direction: if direction < 0.0 { -1.0 } else { 1.0 },
            offset_rad,
        }
    }

    /// Angle of the joint \[rad\].
    pub fn joint_rad(&self, motor_rad: f64) -> f64 {
        self.direction * motor_rad + self.offset_rad
    }

    /// Torque or velocity of the motor for one of the joint, and back.
    pub fn signed(&self, value: f64) -> f64 {
        self.direction * value
    }

    /// The same with the turns added that bring `motor_rad` into the joint's limits. `slack_rad` is allowed outside of
    /// them: a joint that rests on its stop.
    ///
    /// # Errors
    /// [`PositionError`].
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
