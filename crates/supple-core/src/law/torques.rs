//! The terms of the joint torque. The list below declares each term once; the struct, its names, and its fields in records
//! and logs are derived from the list.

use crate::math::Vector;
use crate::record::{Pack, Recorded, Shape, Term, Unpack};

macro_rules! torque_terms {
    ($($(#[doc = $doc:literal])+ $term:ident,)*) => {
        /// The terms whose sum, once limited, is the joint torque \[N m\].
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Torques<const N: usize> {
            $($(#[doc = $doc])+ pub $term: Vector<N>,)*
        }

        /// Names and descriptions of the terms, in the order of the fields.
        pub const TERMS: &[Term] = &[
            $(Term {
                name: stringify!($term),
                description: concat!($($doc, "\n"),+),
            },)*
        ];

        impl<const N: usize> Torques<N> {
            /// No torque.
            #[inline(always)]
            pub fn zeros() -> Self {
                Torques { $($term: Vector::zeros(),)* }
            }

            /// Returns every term with its name, in the order of the fields.
            pub fn named(&self) -> [(&'static str, &Vector<N>); TERMS.len()] {
                [$((stringify!($term), &self.$term),)*]
            }
        }

        impl<const N: usize> Recorded<N> for Torques<N> {
            const SHAPE: Shape = Shape::Terms(TERMS);

            fn pack(&self, to: &mut Pack<'_>) {
                $(self.$term.pack(to);)*
            }

            fn unpack(from: &mut Unpack<'_>) -> Self {
                Torques { $($term: Vector::unpack(from),)* }
            }
        }
    };
}

torque_terms! {
    /// Gravity `G`.
    gravity,
    /// Coriolis and centrifugal torque `C qd`.
    coriolis,
    /// Friction feed-forward `D`, its dry part scaled by `friction_share`; in the breakaway mode the ramp of its joint.
    friction,
    /// `-H J^-1 J' qd`.
    jacobian_rate,
    /// Inertial feed-forward `M Xo''`, mapped to the joints; in the move and excite modes `H qdd` of their reference.
    inertial,
    /// `K (Xo - X)`, mapped to the joints.
    stiffness,
    /// `B (Xo' - X')`, mapped to the joints; joint damping in gravity hold; damping of the momentum in a fault.
    damping,
    /// Contribution of the measured tip force; zero unless an apparent inertia is chosen.
    force,
    /// Damping of motion that does not move the tip.
    nullspace,
    /// Stiff loops of held joints, and of all joints in the move, excite and breakaway modes; for the joint of a ramp
    /// the torque that held it before.
    joint_pd,
    /// Spring-dampers before the hard stops, and at the borders of the workspace.
    soft_stop,
    /// Compensation of the motors' torque ripple.
    ripple,
    /// What was learned of the model while the arm moved: payload, tilt, offsets, friction, torque scale and map.
    learned,
    /// Remainder of the torque before the last change of mode, blended out.
    handover,
}

impl<const N: usize> Torques<N> {
    /// Returns the sum of all terms \[N m\].
    #[inline(always)]
    pub fn total(&self) -> Vector<N> {
        let mut sum = Vector::zeros();
        for (_, term) in self.named() {
            sum += term;
        }
        sum
    }

    /// Returns the sum of stiffness and damping, the PD torque of the paper \[N m\].
    pub fn feedback(&self) -> Vector<N> {
        self.stiffness + self.damping
    }
}
