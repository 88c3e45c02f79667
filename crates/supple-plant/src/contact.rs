//! Force between the tip and a surface: Hunt and Crossley along the normal, a bristle along the
//! surface.
//!
//! ```text
//! F = k d^(3/2) (1 + c d')   limited to zero or more
//! T = -k_t (s + t_t v)        |T| <= mu F, |s| <= mu F / k_t, s' = v while s is below that
//! ```
//!
//! `d` is the penetration, `d'` its rate, `v` the velocity along the surface, `s` the bristle. Hunt and
//! Crossley 1975, "Coefficient of restitution interpreted as damping in vibroimpact". Unlike an
//! impulse solver's, the force has a stiffness that depends neither on the step nor on the masses. It is valid
//! for a sphere on a flat surface, not for edges.

use serde::{Deserialize, Serialize};
use supple_core::nalgebra::Vector3;

/// Stiffness of the tangential bristle \[N/m\].
pub const TANGENTIAL_STIFFNESS_N_PER_M: f64 = 2e4;
/// Damping over stiffness of the tangential bristle \[s\].
pub const TANGENTIAL_TIME_S: f64 = 1e-3;

/// Contact properties of a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Name by which objects refer to it.
    pub name: String,
    /// `k` \[N/m^1.5\], positive.
    pub stiffness_n_per_m_1_5: f64,
    /// `c` \[s/m\], zero or more.
    pub dissipation_s_per_m: f64,
    /// `mu`, Coulomb friction coefficient, zero or more.
    pub friction: f64,
}

impl Material {
    /// Returns a hard cap on wood: 15 to 22 N through a 100 Hz filter and 4 ms of contact for 1.0 to 1.5 kg at
    /// 0.04 m/s.
    pub fn wood() -> Material {
        Material {
            name: "wood".to_owned(),
            stiffness_n_per_m_1_5: 1.4e8,
            dissipation_s_per_m: 40.0,
            friction: 0.3,
        }
    }

    /// Returns a hard cap on a rubber sheet: about 15 ms of contact.
    pub fn rubber() -> Material {
        Material {
            name: "rubber".to_owned(),
            stiffness_n_per_m_1_5: 4e6,
            dissipation_s_per_m: 40.0,
            friction: 0.8,
        }
    }

    /// Returns `F` \[N\] at penetration `depth_m` and rate `depth_rate_m_per_s`; zero without contact.
    pub fn normal_force_n(&self, depth_m: f64, depth_rate_m_per_s: f64) -> f64 {
        if depth_m <= 0.0 {
            return 0.0;
        }
        let elastic = self.stiffness_n_per_m_1_5 * depth_m * libm::sqrt(depth_m);
        (elastic * (1.0 + self.dissipation_s_per_m * depth_rate_m_per_s)).max(0.0)
    }
}

/// Contact state of the tip at a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Penetration \[m\], positive.
    pub depth_m: f64,
    /// Unit normal out of the surface, towards the tip, base axes.
    pub normal: Vector3<f64>,
    /// Point at which the force acts, base axes \[m\].
    pub point_m: Vector3<f64>,
    /// Velocity of the tip's surface relative to the object's at the point \[m/s\].
    pub velocity_m_per_s: Vector3<f64>,
}

/// Deflection of the tangential bristle, base axes \[m\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bristle(Vector3<f64>);

impl Bristle {
    /// Advances the bristle over `dt_s` and returns the force on the tip \[N\], base axes. Without contact (`None`)
    /// the deflection is reset.
    pub fn advance(
        &mut self,
        contact: Option<&Contact>,
        material: &Material,
        dt_s: f64,
    ) -> Vector3<f64> {
        let Some(contact) = contact else {
            self.0 = Vector3::zeros();
            return Vector3::zeros();
        };
        let normal = &contact.normal;
        let approach = -contact.velocity_m_per_s.dot(normal);
        let normal_n = material.normal_force_n(contact.depth_m, approach);
        let sliding = contact.velocity_m_per_s + normal * approach;
        let limit = material.friction * normal_n;
        let stretched = self.0 + sliding * dt_s;
        let stretched = stretched - normal * stretched.dot(normal);
        self.0 = clamped(&stretched, limit / TANGENTIAL_STIFFNESS_N_PER_M);
        let pull = (self.0 + sliding * TANGENTIAL_TIME_S) * TANGENTIAL_STIFFNESS_N_PER_M;
        let tangential = clamped(&pull, limit);
        normal * normal_n - tangential
    }
}

/// Returns `v`, scaled down to length `limit` if longer.
fn clamped(v: &Vector3<f64>, limit: f64) -> Vector3<f64> {
    let length = libm::sqrt(v.dot(v));
    if length > limit {
        v * (limit / length)
    } else {
        *v
    }
}
