//! Bumpless change of activity: the torque goes on from where it was, and the difference is blended out.
//!
//! A change blends out the torque before it less that of the new law, within `handover_s`, with the shape of a
//! minimum-jerk motion. What then still acts of earlier changes also decays exponentially in every cycle, so that requests
//! that follow one another faster than that cannot keep a torque alive. A mode that is entered again within [`REPEATED_CYCLES`] has
//! no difference of its own: it would be the law's own reaction of the last cycles, and holding that back delays stiff
//! loops.
//!
//! At a reset only the soft stops, which a fault leaves out, come back within `handover_s`. The torque of the safe action is
//! `-p / t_s`: blended out slowly it would push an arm that it has stopped. It decays with `t_s` or faster, so that its
//! impulse is at most the momentum that is left.

use crate::law::torques::Torques;
use crate::math::{Vector, smooth_step};

/// Cycles within which the same mode is entered again without a difference.
pub(super) const REPEATED_CYCLES: u64 = 10;

/// From what an activity takes over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HandoverFrom {
    /// From the torque of the last cycle.
    LastTorque,
    /// From the same mode, which has hardly begun.
    SameMode,
    /// From the safe action of a fault.
    Stopping,
}

/// The remainders of torques before changes of activity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Handover<const N: usize> {
    /// A change in this cycle, whose difference is not known yet.
    pending: Option<HandoverFrom>,
    /// Something acts.
    active: bool,
    /// Difference at the last change \[N m\].
    difference_nm: Vector<N>,
    /// What still acts of earlier changes \[N m\].
    earlier_nm: Vector<N>,
    /// What acted in the last cycle \[N m\].
    last_nm: Vector<N>,
    /// Part of earlier remainders that ends in a cycle.
    decay: f64,
    /// The last change was in the last cycle.
    just_begun: bool,
}

impl<const N: usize> Handover<N> {
    /// Nothing to blend out.
    pub fn none() -> Handover<N> {
        Handover {
            pending: None,
            active: false,
            difference_nm: Vector::zeros(),
            earlier_nm: Vector::zeros(),
            last_nm: Vector::zeros(),
            decay: 0.0,
            just_begun: false,
        }
    }

    /// What acts if nothing is to be blended out: zeros.
    pub fn ended(&self) -> Option<&Vector<N>> {
        (!self.active).then_some(&self.difference_nm)
    }

    /// Notes a change of activity.
    pub fn begin(&mut self, from: HandoverFrom) {
        self.pending = Some(from);
        self.active = true;
        self.earlier_nm = self.last_nm;
    }

    /// The remainder in this cycle \[N m\]. `share` is the time since the change over `handover_s`, `cycle_share` the period over
    /// it, `stop_share` the period over `t_s`; `torque_nm` acted in the last cycle, `torques` are those of the new law.
    #[inline(always)]
    pub fn blend(
        &mut self,
        torque_nm: &Vector<N>,
        torques: &Torques<N>,
        share: f64,
        cycle_share: f64,
        stop_share: f64,
    ) -> Vector<N> {
        let begins = self.pending == Some(HandoverFrom::LastTorque);
        // The first of several changes makes no jump at all.
        if !begins || self.just_begun {
            self.earlier_nm *= (1.0 - self.decay).max(0.0);
        }
        self.just_begun = begins;
        // Until all has ended the decay becomes no slower.
        let decay = match self.pending {
            Some(HandoverFrom::Stopping) => cycle_share.max(stop_share),
            _ => cycle_share,
        };
        self.decay = self.decay.max(decay);
        match self.pending.take() {
            Some(HandoverFrom::LastTorque) => {
                self.difference_nm = torque_nm - self.last_nm - torques.total();
            }
            Some(HandoverFrom::SameMode) => self.difference_nm = Vector::zeros(),
            Some(HandoverFrom::Stopping) => {
                self.difference_nm = -torques.soft_stop;
                self.earlier_nm = torque_nm - torques.total() - self.difference_nm;
            }
            None => {}
        }
        if share >= 1.0 {
            *self = Handover {
                // Zeros with the sign that blending leads to.
                difference_nm: self.difference_nm * 0.0,
                ..Handover::none()
            };
            return self.difference_nm;
        }
        let (blended, ..) = smooth_step(share);
        self.last_nm = (self.difference_nm + self.earlier_nm) * (1.0 - blended);
        self.last_nm
    }
}
