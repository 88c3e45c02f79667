//! Modes, faults and refusals as numbers: the constants of `msg/ControllerState.msg`.

use supple_core::controller::{Fault, Mode, Refusal};

/// Each at the place of its number.
pub(crate) const MODES: [Mode; 8] = [
    Mode::Idle,
    Mode::GravityHold,
    Mode::Move,
    Mode::Track,
    Mode::Probe,
    Mode::Fault,
    Mode::Excite,
    Mode::Breakaway,
];

/// Kind, joint (-1 for none), value and limit.
pub(crate) fn fault(fault: &Fault) -> (u8, i8, f64, f64) {
    let index = |joint: usize| i8::try_from(joint).unwrap_or(i8::MAX);
    match *fault {
        Fault::MeasurementNotFinite { joint } => (1, joint.map_or(-1, index), 0.0, 0.0),
        Fault::EncoderLost { joint } => (2, index(joint), 0.0, 0.0),
        Fault::StateStale { cycles, limit } => (3, -1, cycles as f64, f64::from(limit)),
        Fault::StateOutOfOrder { last, received } => (4, -1, received as f64, last as f64),
        Fault::JointPosition {
            joint,
            value_rad,
            limit_rad,
        } => (5, index(joint), value_rad, limit_rad),
        Fault::JointSpeed {
            joint,
            value_rad_per_s,
            limit_rad_per_s,
        } => (6, index(joint), value_rad_per_s, limit_rad_per_s),
        Fault::TipSpeed {
            value_m_per_s,
            limit_m_per_s,
        } => (7, -1, value_m_per_s, limit_m_per_s),
        Fault::TrackingError { value_m, limit_m } => (8, -1, value_m, limit_m),
        Fault::MassMatrix => (9, -1, 0.0, 0.0),
        Fault::TorqueNotFinite { .. } => (10, -1, 0.0, 0.0),
        Fault::EncoderJump {
            joint,
            value_rad,
            limit_rad,
        } => (11, index(joint), value_rad, limit_rad),
        Fault::JointTrackingError {
            joint,
            value_rad,
            limit_rad,
        } => (12, index(joint), value_rad, limit_rad),
    }
}

pub(crate) fn refusal(refusal: &Refusal) -> u8 {
    match refusal {
        Refusal::Mode { .. } => 1,
        Refusal::Value { .. } => 2,
        Refusal::Unreachable { .. } => 3,
        Refusal::TooFast { .. } => 4,
        Refusal::FarFromStart { .. } => 5,
        Refusal::Trajectory(_) => 6,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Value of a constant in the message definition.
    fn constant(name: &str) -> Option<u8> {
        let definition = include_str!("../msg/ControllerState.msg");
        let line = format!("uint8 {name}=");
        let value = definition.lines().find_map(|l| l.strip_prefix(&line))?;
        value.parse().ok()
    }

    #[test]
    fn modes_are_numbered_as_the_definition_says() {
        for mode in MODES {
            let name = format!("MODE_{}", mode.name().to_uppercase());
            assert_eq!(constant(&name), Some(mode as u8), "{name}");
            assert_eq!(MODES[mode as usize], mode);
        }
    }

    #[test]
    fn faults_are_numbered_as_the_definition_says() {
        let (value, limit, joint) = (2.5, 1.5, 3);
        let faults = [
            (
                Fault::MeasurementNotFinite { joint: Some(3) },
                (3, 0.0, 0.0),
            ),
            (Fault::MeasurementNotFinite { joint: None }, (-1, 0.0, 0.0)),
            (Fault::EncoderLost { joint }, (3, 0.0, 0.0)),
            (
                Fault::StateStale {
                    cycles: 9,
                    limit: 4,
                },
                (-1, 9.0, 4.0),
            ),
            (
                Fault::StateOutOfOrder {
                    last: 9,
                    received: 4,
                },
                (-1, 4.0, 9.0),
            ),
            (
                Fault::JointPosition {
                    joint,
                    value_rad: value,
                    limit_rad: limit,
                },
                (3, value, limit),
            ),
            (
                Fault::JointSpeed {
                    joint,
                    value_rad_per_s: value,
                    limit_rad_per_s: limit,
                },
                (3, value, limit),
            ),
            (
                Fault::TipSpeed {
                    value_m_per_s: value,
                    limit_m_per_s: limit,
                },
                (-1, value, limit),
            ),
            (
                Fault::TrackingError {
                    value_m: value,
                    limit_m: limit,
                },
                (-1, value, limit),
            ),
            (Fault::MassMatrix, (-1, 0.0, 0.0)),
            (Fault::TorqueNotFinite { term: "force" }, (-1, 0.0, 0.0)),
            (
                Fault::EncoderJump {
                    joint,
                    value_rad: value,
                    limit_rad: limit,
                },
                (3, value, limit),
            ),
            (
                Fault::JointTrackingError {
                    joint,
                    value_rad: value,
                    limit_rad: limit,
                },
                (3, value, limit),
            ),
        ];
        for (fault, (joint, value, limit)) in faults {
            let name = format!("FAULT_{}", fault.name().to_uppercase());
            let code = constant(&name).unwrap_or_else(|| panic!("{name} is not defined"));
            assert_eq!(super::fault(&fault), (code, joint, value, limit), "{name}");
        }
    }

    #[test]
    fn refusals_are_numbered_as_the_definition_says() {
        let refusals = [
            ("MODE", Refusal::Mode { mode: Mode::Idle }),
            (
                "FAR_FROM_START",
                Refusal::FarFromStart {
                    distance_m: 1.0,
                    limit_m: 0.1,
                },
            ),
            (
                "UNREACHABLE",
                Refusal::Unreachable {
                    joint: 0,
                    value_rad: 9.0,
                },
            ),
        ];
        for (name, refusal) in refusals {
            let code = constant(&format!("REFUSAL_{name}"));
            assert_eq!(code, Some(super::refusal(&refusal)), "{name}");
        }
    }
}
