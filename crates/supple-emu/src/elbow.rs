//! Points of the arm that the safety module monitors: the elbow and a point of the forearm.
//!
//! The module uses the WAM's kinematics without a tool: the elbow is 550 mm from the shoulder and 45 mm to the side, the
//! other point 350 mm beyond the elbow. With the joint angles `q1` to `q4`:
//!
//! ```text
//! elbow   = Rz(q1) Ry(q2) Rz(q3) (0.045, 0, 0.55)
//! forearm = elbow + Rz(q1) Ry(q2) Rz(q3) Ry(q4) (-0.045, 0, 0.35)
//! ```
//!
//! Source: the user's manual's table of link lengths.

use supple_core::Pose;
use supple_core::nalgebra::Vector3;

const SHOULDER_TO_ELBOW_M: Vector3<f64> = Vector3::new(0.045, 0.0, 0.55);
const ELBOW_TO_FOREARM_M: Vector3<f64> = Vector3::new(-0.045, 0.0, 0.35);

/// Returns both points relative to the shoulder \[m\] at the first four joint angles \[rad\].
pub fn monitored_points_m(q: &[f64; 4]) -> [Vector3<f64>; 2] {
    let rotation = |roll: [f64; 3]| Pose::from_xyz_rpy([0.0; 3], roll).rotation;
    let upper = rotation([0.0, q[1], q[0]]) * rotation([0.0, 0.0, q[2]]);
    let elbow = upper * SHOULDER_TO_ELBOW_M;
    let forearm = elbow + upper * rotation([0.0, q[3], 0.0]) * ELBOW_TO_FOREARM_M;
    [elbow, forearm]
}

#[cfg(test)]
mod tests {
    use super::*;
    use supple_core::dynamics::joint_poses;
    use supple_model::Description;

    /// Compares with the arm's description, which uses another frame convention.
    #[test]
    fn the_elbow_matches_the_described_arm() {
        let config = Description::asset("wam4").unwrap().config::<4>().unwrap();
        for q in [
            [0.0, 0.0, 0.0, 0.0],
            [0.3, -0.7, 0.9, 1.4],
            [-1.2, 1.1, -0.4, 2.2],
        ] {
            let poses = joint_poses(&config.arm, &q.into());
            let shoulder = poses[1].translation;
            let [elbow, forearm] = monitored_points_m(&q);
            assert!((poses[3].translation - shoulder - elbow).norm() < 1e-6);
            assert!(((forearm - elbow).norm() - ELBOW_TO_FOREARM_M.norm()).abs() < 1e-12);
        }
    }
}
