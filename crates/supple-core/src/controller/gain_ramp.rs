//! Linear transitions between gains.

use crate::config::{Gains, JointGains};

/// Linear transition between two sets of gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GainRamp<G> {
    from: G,
    pub to: G,
    pub elapsed_s: f64,
    ramp_s: f64,
}

/// Gains between which a ramp interpolates.
pub(super) trait Interpolate: Copy {
    /// Returns the gains at the fraction `x` from `self` (0) to `to` (1).
    fn between(&self, to: &Self, x: f64) -> Self;
}

impl Interpolate for Gains {
    #[inline(always)]
    fn between(&self, to: &Self, x: f64) -> Self {
        Gains {
            stiffness_n_per_m: self.stiffness_n_per_m.lerp(&to.stiffness_n_per_m, x),
            damping_n_s_per_m: self.damping_n_s_per_m.lerp(&to.damping_n_s_per_m, x),
        }
    }
}

impl<const N: usize> Interpolate for JointGains<N> {
    #[inline(always)]
    fn between(&self, to: &Self, x: f64) -> Self {
        JointGains {
            stiffness_nm_per_rad: self.stiffness_nm_per_rad.lerp(&to.stiffness_nm_per_rad, x),
            damping_nm_s_per_rad: self.damping_nm_s_per_rad.lerp(&to.damping_nm_s_per_rad, x),
        }
    }
}

impl<G: Interpolate> GainRamp<G> {
    pub fn at_rest(gains: G) -> GainRamp<G> {
        GainRamp::new(gains, gains, 0.0)
    }

    /// Returns a ramp that starts now.
    pub fn new(from: G, to: G, ramp_s: f64) -> GainRamp<G> {
        GainRamp {
            from,
            to,
            elapsed_s: 0.0,
            ramp_s,
        }
    }

    /// Starts a ramp from the gains in force.
    pub fn change(&mut self, to: G, ramp_s: f64) {
        *self = GainRamp::new(self.current(), to, ramp_s);
    }

    /// Returns the gains in force.
    #[inline(always)]
    pub fn current(&self) -> G {
        if self.elapsed_s >= self.ramp_s {
            return self.to;
        }
        self.from.between(&self.to, self.elapsed_s / self.ramp_s)
    }
}

impl GainRamp<Gains> {
    /// Returns the upper bound, entry by entry, of the gains in force from now on.
    pub fn bound(&self) -> Gains {
        let (now, to) = (self.current(), &self.to);
        Gains {
            stiffness_n_per_m: now.stiffness_n_per_m.sup(&to.stiffness_n_per_m),
            damping_n_s_per_m: now.damping_n_s_per_m.sup(&to.damping_n_s_per_m),
        }
    }
}

impl<const N: usize> GainRamp<JointGains<N>> {
    /// Returns the upper bound, entry by entry, of the gains in force from now on.
    pub fn bound(&self) -> JointGains<N> {
        let (now, to) = (self.current(), &self.to);
        JointGains {
            stiffness_nm_per_rad: now.stiffness_nm_per_rad.sup(&to.stiffness_nm_per_rad),
            damping_nm_s_per_rad: now.damping_nm_s_per_rad.sup(&to.damping_nm_s_per_rad),
        }
    }
}
