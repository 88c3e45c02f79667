//! Where the encoders are: on the motors. One that sticks shows wrong angles of all joints that its motor drives.

use crate::math::{Matrix, Vector};

/// The angles that the encoders see, each in radians of the joint that turns its motor most.
#[derive(Clone, Copy, Debug)]
pub struct Encoders<const N: usize> {
    from_joint: Matrix<N, N>,
    /// A motor drives more than one joint.
    coupled: bool,
    /// The joint that turns the motor of each encoder most.
    joint: [usize; N],
    /// Whether a motor (second index) drives a joint.
    drives: [[bool; N]; N],
}

impl<const N: usize> Encoders<N> {
    pub(super) fn new(joint_from_motor: &Matrix<N, N>, motor_from_joint: &Matrix<N, N>) -> Self {
        let drives = core::array::from_fn(|joint| {
            core::array::from_fn(|motor| joint_from_motor[(joint, motor)] != 0.0)
        });
        let coupled = (0..N).any(|motor| {
            let driven = drives.iter().filter(|of: &&[bool; N]| of[motor]);
            driven.count() > 1
        });
        if !coupled {
            // Each joint has a motor of its own, in whatever order.
            return Encoders {
                from_joint: Matrix::identity(),
                coupled,
                joint: core::array::from_fn(|i| i),
                drives: core::array::from_fn(|joint| core::array::from_fn(|i| i == joint)),
            };
        }
        let joint: [usize; N] =
            core::array::from_fn(|motor| motor_from_joint.row(motor).transpose().icamax());
        Encoders {
            from_joint: Matrix::from_fn(|motor, i| {
                motor_from_joint[(motor, i)] / motor_from_joint[(motor, joint[motor])]
            }),
            coupled,
            joint,
            drives,
        }
    }

    /// Angles or speeds of the encoders from those of the joints.
    pub(super) fn of_joints(&self, joints: &Vector<N>) -> Vector<N> {
        if self.coupled {
            self.from_joint * joints
        } else {
            *joints
        }
    }

    /// The same of one encoder.
    pub(super) fn of_joints_at(&self, encoder: usize, joints: &Vector<N>) -> f64 {
        (self.from_joint.row(encoder) * joints)[0]
    }

    /// The joint that turns the motor of an encoder most.
    pub(super) fn joint(&self, encoder: usize) -> usize {
        self.joint[encoder]
    }

    /// The encoders of the motors that drive a joint.
    pub(super) fn of(&self, joint: usize) -> impl Iterator<Item = usize> {
        let drives = self.drives[joint];
        (0..N).filter(move |encoder| drives[*encoder])
    }
}
