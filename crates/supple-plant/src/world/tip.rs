//! Motion of the tip and forces on it.

use supple_core::nalgebra::Vector3;

/// Motion of the spherical tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TipMotion {
    pub center_m: Vector3<f64>,
    pub linear_m_per_s: Vector3<f64>,
    pub angular_rad_per_s: Vector3<f64>,
}

/// A force on the tip and the moment it has about the tip's centre.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TipForce {
    pub force_n: Vector3<f64>,
    pub moment_nm: Vector3<f64>,
    pub depth_m: f64,
}
