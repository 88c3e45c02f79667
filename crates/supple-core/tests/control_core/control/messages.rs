//! Messages of the faults (joint, value, limit) and their safe actions.

use std::collections::BTreeSet;
use supple_core::controller::{Fault, SafeAction};

/// Faults, the fragments that their messages must contain, and their safe actions.
fn faults() -> [(Fault, &'static [&'static str], SafeAction); 14] {
    use SafeAction::{Brake, Stop};
    [
        (
            Fault::MeasurementNotFinite { joint: Some(2) },
            &["joint 2", "not a finite number"],
            Brake,
        ),
        (
            Fault::MeasurementNotFinite { joint: None },
            &["tip force", "not a finite number"],
            Stop,
        ),
        (
            Fault::EncoderLost { joint: 3 },
            &["joint 3", "encoder"],
            Brake,
        ),
        (
            Fault::StateStale {
                cycles: 7,
                limit: 2,
            },
            &["7 cycles", "2 are tolerated"],
            Stop,
        ),
        (
            Fault::StateOutOfOrder {
                last: 41,
                received: 12,
            },
            &["12 came after 41"],
            Stop,
        ),
        (
            Fault::JointPosition {
                joint: 1,
                value_rad: 2.0625,
                limit_rad: 2.0,
            },
            &["joint 1", "2.0625 rad", "2.0000 rad"],
            Stop,
        ),
        (
            Fault::JointSpeed {
                joint: 0,
                value_rad_per_s: 2.25,
                limit_rad_per_s: 2.0,
            },
            &["joint 0", "2.250 rad/s", "2.000 rad/s"],
            Stop,
        ),
        (
            Fault::TipSpeed {
                value_m_per_s: 1.25,
                limit_m_per_s: 1.0,
            },
            &["1.250 m/s", "1.000 m/s"],
            Stop,
        ),
        (
            Fault::TrackingError {
                value_m: 0.375,
                limit_m: 0.25,
            },
            &["0.375 m", "0.250 m"],
            Stop,
        ),
        (
            Fault::EncoderJump {
                joint: 3,
                value_rad: 0.5,
                limit_rad: 0.0625,
            },
            &["joint 3", "0.5000 rad", "0.0625 rad"],
            Brake,
        ),
        (
            Fault::JointTrackingError {
                joint: 2,
                value_rad: 0.25,
                limit_rad: 0.125,
            },
            &["joint 2", "0.2500 rad", "0.1250 rad"],
            Stop,
        ),
        (Fault::MassMatrix, &["mass matrix"], Brake),
        (
            Fault::Oscillation {
                joint: 2,
                value_rad_per_s: 0.375,
                limit_rad_per_s: 0.25,
            },
            &["joint 2", "0.375 rad/s", "0.250 rad/s", "late"],
            Brake,
        ),
        (
            Fault::TorqueNotFinite { term: "damping" },
            &["damping", "not a finite number"],
            Stop,
        ),
    ]
}

#[test]
fn messages_name_joint_value_and_limit() {
    for (fault, words, _) in faults() {
        let message = fault.to_string();
        for word in words {
            assert!(message.contains(word), "{message:?} does not say {word:?}");
        }
    }
}

#[test]
fn only_faults_of_angles_or_model_remove_gravity() {
    for (fault, _, action) in faults() {
        assert_eq!(fault.safe_action(), action, "{fault}");
    }
}

#[test]
fn fault_names_are_distinct() {
    let names: BTreeSet<_> = faults().iter().map(|(fault, ..)| fault.name()).collect();
    // The two faults of measurements share one name.
    assert_eq!(names.len(), faults().len() - 1);
}
