//! Names of faults by their numbers, as telemetry has them.

/// In the order of [`supple_core::codes::FaultCode::kind`], from 1.
const NAMES: [&str; 21] = [
    "measurement_not_finite",
    "encoder_lost",
    "state_stale",
    "state_out_of_order",
    "joint_position",
    "joint_speed",
    "tip_speed",
    "tracking_error",
    "mass_matrix",
    "torque_not_finite",
    "encoder_jump",
    "joint_tracking_error",
    "joint_collision",
    "tip_collision",
    "encoder_stuck",
    "encoder_unreliable",
    "moves_against_torque",
    "unmodelled_load",
    "workspace",
    "zone_speed",
    "zone_force",
];

/// The name; none for no fault.
pub fn fault_name(kind: u8) -> Option<&'static str> {
    let index = usize::from(kind).checked_sub(1)?;
    Some(NAMES.get(index).copied().unwrap_or("unknown"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use supple_core::codes::FaultCode;
    use supple_core::controller::Fault;

    #[test]
    fn numbers_and_names_are_those_of_the_core() {
        let (joint, value, limit) = (1, 2.0, 1.0);
        for fault in [
            Fault::MeasurementNotFinite { joint: None },
            Fault::EncoderLost { joint },
            Fault::JointSpeed {
                joint,
                value_rad_per_s: value,
                limit_rad_per_s: limit,
            },
            Fault::TipSpeed {
                value_m_per_s: value,
                limit_m_per_s: limit,
            },
            Fault::TipCollision {
                value_n: value,
                limit_n: limit,
            },
            Fault::EncoderUnreliable { joint },
            Fault::UnmodelledLoad {
                value_n: value,
                limit_n: limit,
            },
            Fault::ZoneForce {
                value_n: value,
                limit_n: limit,
            },
        ] {
            let kind = FaultCode::new(Some(&fault)).kind;
            assert_eq!(fault_name(kind), Some(fault.name()));
        }
        assert_eq!(fault_name(0), None);
    }
}
