//! The final three steps on a torque: torque limit, rate limit, finite check.
//!
//! Both limits scale along a straight line towards an allowed torque, so that each step preserves
//! the limits that the steps before it have satisfied. Motors that share joints (the differential
//! of shoulder pitch and roll) are scaled together; other motors are unaffected.

use crate::config::Limits;
use crate::math::{Matrix, Vector, abs, all_finite};

/// Groups of joints that share motors, directly or through other joints.
#[derive(Clone, Copy, Debug)]
pub struct MotorGroups<const N: usize> {
    motor_from_joint_torque: Matrix<N, N>,
    /// Smallest joint index of the group of each joint.
    joint_group: [usize; N],
    /// Smallest joint index of the group of each motor.
    motor_group: [usize; N],
}

impl<const N: usize> MotorGroups<N> {
    /// Groups of the transmission `m2jp` (joint angles from motor angles).
    pub fn new(joint_from_motor: &Matrix<N, N>) -> Self {
        let mut joint_group: [usize; N] = core::array::from_fn(|i| i);
        let mut motor_group = [usize::MAX; N];
        // N passes propagate the smallest index through any chain of coupled joints.
        for _ in 0..N {
            for motor in 0..N {
                for joint in 0..N {
                    if joint_from_motor[(joint, motor)] != 0.0 {
                        let min_index = motor_group[motor].min(joint_group[joint]);
                        motor_group[motor] = min_index;
                        joint_group[joint] = min_index;
                    }
                }
            }
        }
        MotorGroups {
            motor_from_joint_torque: joint_from_motor.transpose(),
            joint_group,
            motor_group,
        }
    }

    /// Returns the motor torques equivalent to the joint torques, `m2jp^T tau` \[N m\].
    pub fn motor_torque_nm(&self, torque_nm: &Vector<N>) -> Vector<N> {
        self.motor_from_joint_torque * torque_nm
    }
}

/// A limited torque, with flags for the limits that acted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitedTorque<const N: usize> {
    /// The torque \[N m\].
    pub torque_nm: Vector<N>,
    /// Whether a joint or motor limit acted.
    pub torque_limited: bool,
    /// Whether the rate limit acted.
    pub rate_limited: bool,
    /// Whether the torque was finite.
    pub finite: bool,
}

/// Applies torque limit, rate limit and finite check, in this order. The torque changes by at most
/// `step_nm` from the last one. A torque that is not finite becomes zero and clears `finite`.
pub fn limit<const N: usize>(
    limits: &Limits<N>,
    groups: &MotorGroups<N>,
    last_nm: &Vector<N>,
    demand_nm: &Vector<N>,
    step_nm: &Vector<N>,
) -> LimitedTorque<N> {
    let (allowed, torque_limited) = limit_torque(limits, groups, demand_nm);
    let (torque_nm, rate_limited) = limit_rate(groups, last_nm, &allowed, step_nm);
    let finite = all_finite(&torque_nm);
    LimitedTorque {
        torque_nm: if finite { torque_nm } else { Vector::zeros() },
        torque_limited,
        rate_limited,
        finite,
    }
}

/// Applies the joint limits individually, then the motor limits by scaling whole groups.
#[inline(always)]
pub fn limit_torque<const N: usize>(
    limits: &Limits<N>,
    groups: &MotorGroups<N>,
    demand_nm: &Vector<N>,
) -> (Vector<N>, bool) {
    let mut torque: Vector<N> = Vector::from_fn(|i, _| {
        demand_nm[i].clamp(-limits.joint_torque_nm[i], limits.joint_torque_nm[i])
    });
    let motors = groups.motor_torque_nm(&torque);
    let exceeds = |motor: usize| abs(motors[motor]) > limits.motor_torque_nm[motor];
    // Common case: no motor exceeds its limit, and no division is needed.
    if (0..N).fold(false, |any, motor| any | exceeds(motor)) {
        let mut scale = [1.0_f64; N];
        for motor in (0..N).filter(|motor| exceeds(*motor)) {
            let group = groups.motor_group[motor];
            scale[group] = scale[group].min(limits.motor_torque_nm[motor] / abs(motors[motor]));
        }
        for joint in 0..N {
            torque[joint] *= scale[groups.joint_group[joint]];
        }
    }
    (torque, torque != *demand_nm)
}

fn limit_rate<const N: usize>(
    groups: &MotorGroups<N>,
    last_nm: &Vector<N>,
    torque_nm: &Vector<N>,
    max_step_nm: &Vector<N>,
) -> (Vector<N>, bool) {
    let step = torque_nm - last_nm;
    let exceeds = |joint: usize| abs(step[joint]) > max_step_nm[joint];
    if !(0..N).fold(false, |any, joint| any | exceeds(joint)) {
        return (*torque_nm, false);
    }
    let mut share = [1.0_f64; N];
    for joint in (0..N).filter(|joint| exceeds(*joint)) {
        let group = groups.joint_group[joint];
        share[group] = share[group].min(max_step_nm[joint] / abs(step[joint]));
    }
    let limited = share.iter().any(|share| *share < 1.0);
    let torque = Vector::from_fn(|joint, _| match share[groups.joint_group[joint]] {
        share if share < 1.0 => last_nm[joint] + step[joint] * share,
        _ => torque_nm[joint],
    });
    (torque, limited)
}
