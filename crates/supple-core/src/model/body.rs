//! Mass, centre of mass and inertia of a rigid body, and the check of their physical consistency.

use crate::math::linalg::symmetric_eigenvalues;
use crate::math::{Matrix3, Vector3, abs};
use crate::model::pose::Pose;
use core::fmt;

/// Relative tolerance for rounded inertias at the bound, such as the inertia of a thin plate.
const TRIANGLE_SLACK: f64 = 1e-6;

/// A rigid body in some frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Mass \[kg\].
    pub mass_kg: f64,
    /// Centre of mass \[m\].
    pub com_m: Vector3<f64>,
    /// Full inertia about the centre of mass, axes parallel to the frame \[kg m^2\].
    pub inertia_kg_m2: Matrix3<f64>,
}

/// Reason why a body is not physical, with the invalid value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BodyError {
    /// The mass is not a positive finite number \[kg\].
    Mass(f64),
    /// A coordinate of the centre of mass is not finite \[m\].
    CentreOfMass(f64),
    /// An entry of the inertia is not finite \[kg m^2\].
    InertiaEntry(f64),
    /// The inertia is not symmetric; the values are the two entries \[kg m^2\].
    Asymmetric(f64, f64),
    /// The smallest principal moment is not positive \[kg m^2\].
    NotPositive(f64),
    /// The largest principal moment exceeds the sum of the other two \[kg m^2\].
    Triangle {
        /// Largest principal moment.
        max_moment: f64,
        /// Sum of the other two.
        others: f64,
    },
}

impl fmt::Display for BodyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            BodyError::Mass(m) => write!(f, "mass is {m} kg, it must be positive and finite"),
            BodyError::CentreOfMass(c) => {
                write!(f, "centre of mass has an entry {c} m, it must be finite")
            }
            BodyError::InertiaEntry(i) => {
                write!(f, "inertia has an entry {i} kg m^2, it must be finite")
            }
            BodyError::Asymmetric(a, b) => write!(
                f,
                "inertia is not symmetric: {a} against {b} kg m^2 across the diagonal"
            ),
            BodyError::NotPositive(i) => write!(
                f,
                "smallest principal moment of inertia is {i} kg m^2, it must be positive"
            ),
            BodyError::Triangle { max_moment, others } => write!(
                f,
                "largest principal moment of inertia {max_moment} kg m^2 exceeds the sum of the \
                 other two, {others} kg m^2: physically impossible"
            ),
        }
    }
}

impl core::error::Error for BodyError {}

impl Body {
    /// Returns a solid ball (a point mass would have no inertia).
    ///
    /// `mass_kg` and `radius_m` are positive; the centre is at `com_m`.
    pub fn ball(mass_kg: f64, radius_m: f64, com_m: Vector3<f64>) -> Body {
        Body {
            mass_kg,
            com_m,
            inertia_kg_m2: Matrix3::identity() * (0.4 * mass_kg * radius_m * radius_m),
        }
    }

    /// Rejects physically inconsistent parameters.
    ///
    /// # Errors
    /// The first [`BodyError`] found, in the order of its variants.
    pub fn validate(&self) -> Result<(), BodyError> {
        if !(self.mass_kg > 0.0 && self.mass_kg.is_finite()) {
            return Err(BodyError::Mass(self.mass_kg));
        }
        if let Some(c) = self.com_m.iter().find(|c| !c.is_finite()) {
            return Err(BodyError::CentreOfMass(*c));
        }
        let inertia = &self.inertia_kg_m2;
        if let Some(i) = inertia.iter().find(|i| !i.is_finite()) {
            return Err(BodyError::InertiaEntry(*i));
        }
        let scale = inertia.iter().fold(0.0, |s: f64, i| s.max(abs(*i)));
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            let (upper, lower) = (inertia[(a, b)], inertia[(b, a)]);
            if abs(upper - lower) > 1e-9 * scale {
                return Err(BodyError::Asymmetric(upper, lower));
            }
        }
        if scale == 0.0 {
            return Err(BodyError::NotPositive(0.0));
        }
        // The inertia is normalised first, because the eigenvalue computation uses third powers of the entries.
        let [min_moment, mid_moment, max_moment] =
            symmetric_eigenvalues(&(inertia / scale)).map(|i| i * scale);
        if min_moment <= 0.0 {
            return Err(BodyError::NotPositive(min_moment));
        }
        if max_moment > (min_moment + mid_moment) * (1.0 + TRIANGLE_SLACK) {
            return Err(BodyError::Triangle {
                max_moment,
                others: min_moment + mid_moment,
            });
        }
        Ok(())
    }

    /// Returns the same body in frame `a`; `self` is given in frame `b`.
    pub fn expressed_in(&self, a_from_b: &Pose) -> Body {
        let r = &a_from_b.rotation;
        Body {
            mass_kg: self.mass_kg,
            com_m: a_from_b.transform_point(&self.com_m),
            inertia_kg_m2: r * self.inertia_kg_m2 * r.transpose(),
        }
    }

    /// Returns the body that consists of two rigidly connected bodies in the same frame.
    pub fn merged(&self, other: &Body) -> Body {
        let mass_kg = self.mass_kg + other.mass_kg;
        let com_m = (self.com_m * self.mass_kg + other.com_m * other.mass_kg) / mass_kg;
        let about = |b: &Body| b.inertia_kg_m2 + steiner(b.mass_kg, &(b.com_m - com_m));
        Body {
            mass_kg,
            com_m,
            inertia_kg_m2: about(self) + about(other),
        }
    }

    /// Returns the inertia about the origin of the frame \[kg m^2\].
    pub fn inertia_about_origin(&self) -> Matrix3<f64> {
        self.inertia_kg_m2 + steiner(self.mass_kg, &self.com_m)
    }
}

/// Returns the inertia about the origin of a point mass at `r`.
pub(crate) fn steiner(mass_kg: f64, r: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * r.dot(r) - r * r.transpose()) * mass_kg
}
