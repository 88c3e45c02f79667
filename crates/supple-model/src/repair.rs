//! Replaces inertial data that no rigid body has by those of the nearest rigid body.
//!
//! A body has a positive mass and a positive definite second moment of mass `S = tr(I) / 2 - I` about its centre of mass
//! (Wensing, Kim and Slotine, RA-L 3(1) 2018), which is the same as positive principal moments that satisfy the triangle
//! inequality. The nearest body has the same mass and centre of mass, and eigenvalues of `S` that are raised to a small positive
//! number: the projection onto the consistent matrices in the Frobenius norm.

use crate::error::{Finding, Reporter};
use nalgebra::SymmetricEigen;
use supple_core::math::Matrix3;
use supple_core::{Body, BodyError};

/// Minimum second moment of mass along an axis, as a fraction of the greatest.
const MIN_SHARE: f64 = 1e-3;
/// Radius of the ball whose inertia a body without usable inertia receives \[m\].
const BALL_RADIUS_M: f64 = 0.02;

/// Returns the nearest body; `None` without a mass. `body` is about its centre of mass.
pub(crate) fn nearest(body: &Body) -> Option<Body> {
    let numbers = body.inertia_kg_m2.iter().chain(body.com_m.iter());
    if body.mass_kg <= 0.0 || !body.mass_kg.is_finite() || numbers.clone().any(|x| !x.is_finite()) {
        return None;
    }
    let inertia = 0.5 * (body.inertia_kg_m2 + body.inertia_kg_m2.transpose());
    let moments = Matrix3::from_diagonal_element(0.5 * inertia.trace()) - inertia;
    let eigen = SymmetricEigen::new(moments);
    let max = eigen.eigenvalues.max();
    if max <= 0.0 {
        return Some(Body::ball(body.mass_kg, BALL_RADIUS_M, body.com_m));
    }
    let raised = eigen.eigenvalues.map(|moment| moment.max(MIN_SHARE * max));
    let moments =
        eigen.eigenvectors * Matrix3::from_diagonal(&raised) * eigen.eigenvectors.transpose();
    let moments = 0.5 * (moments + moments.transpose());
    let inertia_kg_m2 = Matrix3::from_diagonal_element(moments.trace()) - moments;
    let nearest = Body {
        inertia_kg_m2,
        ..*body
    };
    nearest.validate().is_ok().then_some(nearest)
}

/// Returns the warning that names the replaced and the new values.
pub(crate) fn finding(
    report: Reporter<'_>,
    link: &str,
    body: &Body,
    nearest: Option<&Body>,
    error: &BodyError,
) -> Finding {
    let numbers = |body: &Body| {
        let i = &body.inertia_kg_m2;
        format!(
            "mass {} kg, inertia (xx, yy, zz, xy, xz, yz) {:.4e}, {:.4e}, {:.4e}, {:.4e}, {:.4e}, {:.4e} kg m^2",
            body.mass_kg,
            i[(0, 0)],
            i[(1, 1)],
            i[(2, 2)],
            i[(0, 1)],
            i[(0, 2)],
            i[(1, 2)]
        )
    };
    let problem = match nearest {
        Some(nearest) => format!(
            "{error}; the nearest inertia that a rigid body has is used instead, {}",
            numbers(nearest)
        ),
        None => format!("{error}; the link counts as massless"),
    };
    Finding {
        file: report.file.to_owned(),
        element: format!("link `{link}` <inertial>"),
        problem,
        value: numbers(body),
        remedy: "correct the URDF, or identify the arm".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::nearest;
    use supple_core::Body;
    use supple_core::math::{Matrix3, Vector3};

    fn body(moments: [f64; 3]) -> Body {
        Body {
            mass_kg: 2.0,
            com_m: Vector3::zeros(),
            inertia_kg_m2: Matrix3::from_diagonal(&Vector3::from(moments)),
        }
    }

    /// If the moments violate the triangle inequality, the greatest is reduced by the amount by which the others increase.
    #[test]
    fn the_nearest_body_is_consistent_and_near() {
        for moments in [[1.0, 1.0, 3.0], [0.1, 0.0, 0.0], [0.7, 0.1, -0.2]] {
            let found = nearest(&body(moments)).expect("a body");
            found.validate().expect("consistent");
            assert_eq!(found.mass_kg, 2.0);
            // Projecting the second moments moves no principal moment by more than the sum of what they were lowered by.
            let half: f64 = moments.iter().sum::<f64>() / 2.0;
            let raised: f64 = moments.iter().map(|i| (i - half).max(0.0)).sum();
            let slack = 0.01 * half.abs();
            for (axis, moment) in moments.iter().enumerate() {
                let change = (found.inertia_kg_m2[(axis, axis)] - moment).abs();
                assert!(
                    change <= raised + slack,
                    "{moments:?}, axis {axis}: {change}"
                );
            }
        }
        // A consistent body is unchanged.
        let sound = body([1.0, 1.2, 1.5]);
        assert!((nearest(&sound).unwrap().inertia_kg_m2 - sound.inertia_kg_m2).norm() < 1e-12);
        // A body without a mass cannot be repaired.
        assert!(
            nearest(&Body {
                mass_kg: 0.0,
                ..sound
            })
            .is_none()
        );
        assert!(nearest(&body([f64::NAN, 1.0, 1.0])).is_none());
        // A body without inertia becomes a ball.
        nearest(&body([0.0; 3])).unwrap().validate().unwrap();
    }
}
