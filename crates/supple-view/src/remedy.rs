//! Remedy for each kind of fault, as a sentence for the operator.

use supple_core::codes::fault_kind as fault;

/// Returns the remedy for a kind of fault, see [`fault_kind`](supple_core::codes::fault_kind).
pub fn remedy(kind: u8) -> &'static str {
    match kind {
        fault::MEASUREMENT_NOT_FINITE => {
            "Check the sensor and its cable; the arm brakes until the sensor reports finite values again."
        }
        fault::ENCODER_LOST | fault::ENCODER_UNRELIABLE => {
            "Check the bus and the cable of this joint; on a busy machine replies also come too late (supple doctor). Then reset and \
             enter gravity hold."
        }
        fault::STATE_STALE => {
            "The plant sent no states: check its process and the load of the machine (supple doctor), then reset."
        }
        fault::STATE_OUT_OF_ORDER => {
            "A second plant writes states, or the plant restarted: end the other plant, then reset."
        }
        fault::JOINT_POSITION => {
            "Reset, enter float and guide the joint away from its stop by hand."
        }
        fault::JOINT_SPEED | fault::TIP_SPEED => "Reset, then request a slower motion.",
        fault::TRACKING_ERROR => {
            "Something held the tip back, or the model is wrong: clear the way, or raise the stiffness; then reset and \
             move to the start again."
        }
        fault::ROTATION_ERROR => {
            "The tip could not turn as requested: clear the way, or raise the rotational stiffness; then reset."
        }
        fault::MASS_MATRIX => "The arm's description is invalid: check its inertias.",
        fault::TORQUE_NOT_FINITE => {
            "This is a bug in supple, or an invalid description: keep the log and report it."
        }
        fault::ENCODER_JUMP | fault::ENCODER_STUCK | fault::ENCODER_UNMOVED => {
            "Check the encoder of this joint and its cable before the arm moves again, then reset."
        }
        fault::JOINT_TRACKING_ERROR => {
            "The joint did not follow its move: check for an obstacle, the drives and the payload; then reset."
        }
        fault::JOINT_COLLISION | fault::TIP_COLLISION => {
            "The arm touched an object: remove the object, or request a contact mode; then reset."
        }
        fault::MOVES_AGAINST_TORQUE => {
            "The joint moves against its torque: check the sign of its torque and of its encoder."
        }
        fault::OSCILLATION => {
            "The loop is unstable: lower the gains, or measure the delay of the loop and enter it; then reset."
        }
        fault::UNMODELLED_LOAD => {
            "The arm carries a load that its model lacks: remove the load or add it to the model; then reset."
        }
        fault::WORKSPACE => "Reset, enter float and guide the tip back into its workspace.",
        fault::ZONE_SPEED => "Reset, then request a slower motion in this zone.",
        fault::ZONE_FORCE => {
            "The contact force in this zone was too high: remove the object that the tip touched, then reset."
        }
        fault::SINGULAR => {
            "Reset, then move the arm away from the singular pose before the pose mode."
        }
        _ => "See docs/safety.md; remove the cause, then reset.",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_has_a_specific_remedy() {
        let general = remedy(u8::MAX);
        let faults = fault::ALL.iter().filter(|code| code.number != fault::NONE);
        for code in faults {
            assert_ne!(remedy(code.number), general, "{}", code.name);
        }
    }
}
