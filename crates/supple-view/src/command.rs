//! Commands that the page and other viewers may send. A command becomes a request that the controller checks, or a button
//! press on the emulated pendant.

use crate::snapshot::Snapshot;
use serde::Deserialize;
use supple_core::Trajectory;
use supple_core::config::Gains;
use supple_core::controller::{CycleRecord, Request};
use supple_core::math::Vector3;

/// Default duration of the ramp to new gains \[s\].
const RAMP_S: f64 = 0.5;
/// Duration of the move with which compliant joints stop at the present pose \[s\].
const COMPLY_S: f64 = 0.5;

/// A command, as the service `/request` accepts it in JSON.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(tag = "request", rename_all = "snake_case", deny_unknown_fields)]
pub enum Command {
    /// Idle: no torque. It uses no queue.
    Idle,
    /// Gravity hold.
    GravityHold,
    /// Float, for guiding the arm by hand.
    Float,
    /// Compliant joints at the present pose.
    JointImpedance,
    /// The impedance law keeps the tip where it is.
    HoldTip,
    /// Clears the latched fault.
    Reset,
    /// Changes gains; an absent gain stays as it is.
    Gains {
        /// Stiffness for x, y, z \[N/m\].
        stiffness_n_per_m: Option<[f64; 3]>,
        /// Damping for x, y, z \[N s/m\].
        damping_n_s_per_m: Option<[f64; 3]>,
        /// Duration of the ramp to the new gains \[s\].
        ramp_s: Option<f64>,
    },
    /// Presses a button of the emulated pendant.
    Pendant {
        /// The button.
        button: Button,
    },
}

/// A button of the emulated pendant.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Button {
    /// Presses the emergency stop.
    EStop,
    /// Releases the emergency stop.
    Release,
    /// Shift-Idle.
    Idle,
    /// Shift-Activate.
    Activate,
}

impl Button {
    /// Returns the line that the socket of the pendant accepts.
    pub fn line(self) -> &'static str {
        match self {
            Button::EStop => "e-stop",
            Button::Release => "release",
            Button::Idle => "idle",
            Button::Activate => "activate",
        }
    }
}

/// The JSON schema of [`Command`].
pub const SCHEMA: &str = r#"{"type":"object","required":["request"],"properties":{
"request":{"enum":["idle","gravity_hold","float","joint_impedance","hold_tip","reset","gains","pendant"]},
"stiffness_n_per_m":{"type":"array","items":{"type":"number"}},
"damping_n_s_per_m":{"type":"array","items":{"type":"number"}},
"ramp_s":{"type":"number"},"button":{"enum":["e-stop","release","idle","activate"]}}}"#;

impl Command {
    /// Parses a command.
    ///
    /// # Errors
    /// The reason why the JSON is not a command.
    pub fn parse(json: &[u8]) -> Result<Command, String> {
        serde_json::from_slice(json).map_err(|error| format!("the request is invalid: {error}"))
    }

    /// Returns the request to the controller, given the latest cycle; `None` for idle and pendant commands, which do not go
    /// through the controller's queue.
    pub fn request<const N: usize>(&self, now: &CycleRecord<N>) -> Option<Request<N>> {
        Some(match *self {
            Command::Idle | Command::Pendant { .. } => return None,
            Command::GravityHold => Request::GravityHold,
            Command::Float => Request::Float,
            Command::Reset => Request::Reset,
            Command::JointImpedance => Request::JointImpedance {
                target_rad: now.position_rad,
                duration_s: COMPLY_S,
            },
            Command::HoldTip => Request::Track(Trajectory::Hold(now.tip_position_m.into())),
            Command::Gains {
                stiffness_n_per_m,
                damping_n_s_per_m,
                ramp_s,
            } => Request::Gains {
                gains: Gains {
                    stiffness_n_per_m: Vector3::from(
                        stiffness_n_per_m.unwrap_or(now.stiffness_n_per_m),
                    ),
                    damping_n_s_per_m: Vector3::from(
                        damping_n_s_per_m.unwrap_or(now.damping_n_s_per_m),
                    ),
                },
                ramp_s: ramp_s.unwrap_or(RAMP_S),
            },
        })
    }
}

/// Names of the parameters of the Foxglove protocol.
pub const PARAMETERS: [&str; 2] = ["stiffness_n_per_m", "damping_n_s_per_m"];

/// Returns the value of a parameter.
pub fn parameter(snapshot: &Snapshot, name: &str) -> Option<[f32; 3]> {
    match PARAMETERS.iter().position(|known| *known == name)? {
        0 => Some(snapshot.stiffness_n_per_m),
        _ => Some(snapshot.damping_n_s_per_m),
    }
}

/// Creates the command that sets parameters; a value is one number for all axes, or three numbers.
///
/// # Errors
/// The invalid parameter or value.
pub fn set_parameters(values: &[(String, serde_json::Value)]) -> Result<Command, String> {
    let (mut stiffness_n_per_m, mut damping_n_s_per_m) = (None, None);
    for (name, value) in values {
        let numbers = match value {
            serde_json::Value::Array(all) => all.iter().map(|v| v.as_f64()).collect(),
            one => vec![one.as_f64()],
        };
        let axes = match numbers[..] {
            [Some(all)] => [all; 3],
            [Some(x), Some(y), Some(z)] => [x, y, z],
            _ => {
                return Err(format!(
                    "{name} is {value}: give one number, or three numbers for x, y, z"
                ));
            }
        };
        match PARAMETERS.iter().position(|known| known == name) {
            Some(0) => stiffness_n_per_m = Some(axes),
            Some(_) => damping_n_s_per_m = Some(axes),
            None => {
                return Err(format!(
                    "the parameter {name} cannot be set: use stiffness_n_per_m or damping_n_s_per_m"
                ));
            }
        }
    }
    Ok(Command::Gains {
        stiffness_n_per_m,
        damping_n_s_per_m,
        ramp_s: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn unknown_commands_and_fields_are_rejected() {
        let parse = |text: &str| Command::parse(text.as_bytes());
        assert_eq!(parse(r#"{"request":"reset"}"#), Ok(Command::Reset));
        let pressed = Command::Pendant {
            button: Button::EStop,
        };
        assert_eq!(
            parse(r#"{"request":"pendant","button":"e-stop"}"#),
            Ok(pressed)
        );
        for wrong in [
            "",
            "{}",
            "[]",
            r#"{"request":"run"}"#,
            r#"{"request":"pendant","button":"x"}"#,
            r#"{"request":"gains","stiffness_n_per_m":5}"#,
            r#"{"request":"gains","K":[1,2,3]}"#,
        ] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_parameter_is_one_number_or_three_and_others_stay_unset() {
        let set = |name: &str, value| set_parameters(&[(name.to_owned(), value)]);
        let stiffness = |axes| {
            Ok(Command::Gains {
                stiffness_n_per_m: Some(axes),
                damping_n_s_per_m: None,
                ramp_s: None,
            })
        };
        assert_eq!(set(PARAMETERS[0], json!(8)), stiffness([8.0; 3]));
        assert_eq!(
            set(PARAMETERS[0], json!([8, 9.5, 10])),
            stiffness([8.0, 9.5, 10.0])
        );
        for wrong in [json!([1, 2]), json!("5"), json!(null), json!([1, 2, "x"])] {
            assert!(set(PARAMETERS[0], wrong.clone()).is_err(), "{wrong}");
        }
        assert!(set("mode", json!(1)).is_err());
    }
}
