//! Bumpless change of activity: the torque continues from its last value, and the difference to the new law is blended out.
//!
//! At a change, the handover adds the difference between the last torque and the torque of the new law, and blends it out within
//! `handover_s` along a minimum-jerk curve. Remainders of earlier changes also decay exponentially in every cycle, so that
//! requests in quick succession cannot sustain a torque. If the same mode is entered again within [`REPEATED_CYCLES`], the
//! handover adds no difference: it would be the law's own reaction of the last cycles, and delaying that reaction destabilises
//! stiff loops.
//!
//! At a reset only the torque of the soft stops, which a fault switches off, returns within `handover_s`. The torque of the safe
//! action is `-p / t_s`: blended out slowly it would push an arm that it has already stopped. It decays with `t_s` or faster, so
//! that its impulse is at most the remaining momentum.

use crate::law::torques::Torques;
use crate::math::{Vector, smooth_step};

/// Cycles within which entering the same mode again adds no difference.
pub(super) const REPEATED_CYCLES: u64 = 10;

/// Source of the torque from which a new activity takes over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HandoverFrom {
    /// Torque of the last cycle.
    LastTorque,
    /// The same mode, which has just begun.
    SameMode,
    /// Safe action of a fault.
    Stopping,
}

/// Torque remainders of earlier activities, which are blended out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Handover<const N: usize> {
    /// A change in this cycle whose torque difference is not computed yet.
    pending: Option<HandoverFrom>,
    /// Whether a remainder acts.
    active: bool,
    /// Difference at the last change \[N m\].
    difference_nm: Vector<N>,
    /// Remainder of earlier changes \[N m\].
    earlier_nm: Vector<N>,
    /// Total remainder in the last cycle \[N m\].
    last_nm: Vector<N>,
    /// Fraction by which earlier remainders decay in a cycle.
    decay: f64,
    /// Whether the last change was in the last cycle.
    just_begun: bool,
}

impl<const N: usize> Handover<N> {
    /// Returns a handover without remainder.
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

    /// Returns the remainder, a vector of zeros, if nothing is being blended out; otherwise `None`.
    pub fn zeros_if_finished(&self) -> Option<&Vector<N>> {
        (!self.active).then_some(&self.difference_nm)
    }

    /// Registers a change of activity; [`Handover::blend`] of the same cycle computes its difference.
    pub fn begin(&mut self, from: HandoverFrom) {
        self.pending = Some(from);
        self.active = true;
        self.earlier_nm = self.last_nm;
    }

    /// Returns the remainder in this cycle \[N m\]. `torque_nm` is the torque of the last cycle, `torques` are the terms of the
    /// new law, `share` is the time since the change over `handover_s`, `cycle_share` the period over `handover_s`, and
    /// `stop_share` the period over `t_s`.
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
        // The first of several changes causes no jump.
        if !begins || self.just_begun {
            self.earlier_nm *= (1.0 - self.decay).max(0.0);
        }
        self.just_begun = begins;
        // The decay may become faster, but not slower, until all remainders have ended.
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
                // Zeros with the sign that blending gives.
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
