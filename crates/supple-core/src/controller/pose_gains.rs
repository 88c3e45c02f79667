//! Gains of the track pose mode: matrices about the axes of the base or of the tip, with ramps between them.
//!
//! The matrices are positive semi-definite, and so is every linear interpolation between two of them: during a ramp no
//! stiffness and no damping is negative. A ramp that raises the stiffness adds energy, as with any gains.

use super::gain_ramp::{GainRamp, Interpolate};
use crate::config::{Gains, RotationalGains};
use crate::law::target::PoseGains;
use crate::math::{Matrix3, Vector3};

/// Axes about which the matrices of [`GainMatrices`] are given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GainAxes {
    /// Axes of the base.
    Base,
    /// Axes of the tip's reference. The matrices turn with the reference, not with the measured tip, because a stiffness that
    /// follows the measured orientation would have no potential.
    Tip,
}

/// Directions of the tip to which [`GainMatrices`] apply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GainPart {
    /// Along the axes: stiffness \[N/m\], damping \[N s/m\].
    Linear,
    /// About the axes: stiffness \[N m/rad\], damping \[N m s/rad\].
    Rotational,
}

/// Stiffness and damping in three directions: symmetric, positive semi-definite matrices in the units of a [`GainPart`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GainMatrices {
    /// Stiffness.
    pub stiffness: Matrix3<f64>,
    /// Damping.
    pub damping: Matrix3<f64>,
}

impl GainMatrices {
    /// Returns the diagonal matrices.
    pub fn diagonal(stiffness: &Vector3<f64>, damping: &Vector3<f64>) -> GainMatrices {
        GainMatrices {
            stiffness: Matrix3::from_diagonal(stiffness),
            damping: Matrix3::from_diagonal(damping),
        }
    }

    /// Returns the symmetric matrix with the elements xx, yy, zz, yz, zx, xy.
    pub fn symmetric([xx, yy, zz, yz, zx, xy]: [f64; 6]) -> Matrix3<f64> {
        Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz)
    }

    /// Returns the same gains about other axes; `rotation` maps coordinates in the present axes to the new axes.
    fn rotated(&self, rotation: &Matrix3<f64>) -> GainMatrices {
        GainMatrices {
            stiffness: rotation * self.stiffness * rotation.transpose(),
            damping: rotation * self.damping * rotation.transpose(),
        }
    }
}

impl Interpolate for GainMatrices {
    fn between(&self, to: &Self, x: f64) -> Self {
        let between = |a: f64, b: f64| x * b + (1.0 - x) * a;
        GainMatrices {
            stiffness: self.stiffness.zip_map(&to.stiffness, between),
            damping: self.damping.zip_map(&to.damping, between),
        }
    }
}

/// Gain matrices in force, with their axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MatrixRamp {
    ramp: GainRamp<GainMatrices>,
    axes: GainAxes,
}

impl MatrixRamp {
    fn at_rest(stiffness: &Vector3<f64>, damping: &Vector3<f64>) -> MatrixRamp {
        MatrixRamp {
            ramp: GainRamp::at_rest(GainMatrices::diagonal(stiffness, damping)),
            axes: GainAxes::Base,
        }
    }

    /// Starts a ramp from the gains in force; `base_from_tip` is the orientation of the tip's reference.
    pub fn change(
        &mut self,
        to: &GainMatrices,
        axes: GainAxes,
        ramp_s: f64,
        base_from_tip: &Matrix3<f64>,
    ) {
        let current = self.ramp.current();
        let from = match (self.axes, axes) {
            (GainAxes::Base, GainAxes::Tip) => current.rotated(&base_from_tip.transpose()),
            (GainAxes::Tip, GainAxes::Base) => current.rotated(base_from_tip),
            _ => current,
        };
        *self = MatrixRamp {
            ramp: GainRamp::new(from, *to, ramp_s),
            axes,
        };
    }

    /// Returns the gains in force, about the base axes.
    pub fn in_base(&self, base_from_tip: &Matrix3<f64>) -> GainMatrices {
        in_base(&self.ramp.current(), self.axes, base_from_tip)
    }

    /// Returns the damping in force and at the end of the ramp, about the base axes. A convex bound, such as that of the fastest
    /// damping rate, has its maximum over the ramp at one of these two.
    pub fn damping_at_ramp_ends(&self, base_from_tip: &Matrix3<f64>) -> [Matrix3<f64>; 2] {
        [self.ramp.current(), self.ramp.to]
            .map(|gains| in_base(&gains, self.axes, base_from_tip).damping)
    }

    /// Diagonals of the matrices in force, about their own axes.
    #[inline(always)]
    pub fn diagonals(&self) -> (Vector3<f64>, Vector3<f64>) {
        let current = self.ramp.current();
        (current.stiffness.diagonal(), current.damping.diagonal())
    }
}

/// Returns the gain matrices about the base axes.
pub(super) fn in_base(
    gains: &GainMatrices,
    axes: GainAxes,
    base_from_tip: &Matrix3<f64>,
) -> GainMatrices {
    match axes {
        GainAxes::Base => *gains,
        GainAxes::Tip => gains.rotated(base_from_tip),
    }
}

/// Gain ramps of the track pose mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PoseGainRamps {
    pub linear: MatrixRamp,
    pub rotational: MatrixRamp,
}

impl PoseGainRamps {
    pub fn at_rest(linear: &Gains, rotational: &RotationalGains) -> PoseGainRamps {
        PoseGainRamps {
            linear: MatrixRamp::at_rest(&linear.stiffness_n_per_m, &linear.damping_n_s_per_m),
            rotational: MatrixRamp::at_rest(
                &rotational.stiffness_nm_per_rad,
                &rotational.damping_nm_s_per_rad,
            ),
        }
    }

    #[inline(always)]
    pub fn advance(&mut self, elapsed_s: f64) {
        self.linear.ramp.elapsed_s += elapsed_s;
        self.rotational.ramp.elapsed_s += elapsed_s;
    }

    pub fn of(&mut self, part: GainPart) -> &mut MatrixRamp {
        match part {
            GainPart::Linear => &mut self.linear,
            GainPart::Rotational => &mut self.rotational,
        }
    }

    /// Returns the gains in force, about the base axes.
    pub fn in_base(&self, base_from_tip: &Matrix3<f64>) -> PoseGains {
        let linear = self.linear.in_base(base_from_tip);
        let rotational = self.rotational.in_base(base_from_tip);
        PoseGains {
            stiffness_n_per_m: linear.stiffness,
            damping_n_s_per_m: linear.damping,
            stiffness_nm_per_rad: rotational.stiffness,
            damping_nm_s_per_rad: rotational.damping,
        }
    }

    /// Diagonals of the linear matrices in force, about their own axes.
    #[inline(always)]
    pub fn linear_diagonal(&self) -> Gains {
        let (stiffness_n_per_m, damping_n_s_per_m) = self.linear.diagonals();
        Gains {
            stiffness_n_per_m,
            damping_n_s_per_m,
        }
    }

    /// Diagonals of the rotational matrices in force, about their own axes.
    #[inline(always)]
    pub fn rotational_diagonal(&self) -> RotationalGains {
        let (stiffness_nm_per_rad, damping_nm_s_per_rad) = self.rotational.diagonals();
        RotationalGains {
            stiffness_nm_per_rad,
            damping_nm_s_per_rad,
        }
    }
}
