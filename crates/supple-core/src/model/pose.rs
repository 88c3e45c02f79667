//! Rigid transforms, named by their target and source frames: `base_from_tip` maps tip coordinates
//! to base coordinates.

use crate::math::{Matrix3, Vector3, abs, atan2, sin_cos, sqrt};
use core::ops::Mul;

/// Rotation and translation of frame `b` in frame `a`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Columns are the axes of `b` in coordinates of `a`.
    pub rotation: Matrix3<f64>,
    /// Origin of `b` in coordinates of `a` \[m\].
    pub translation: Vector3<f64>,
}

impl Pose {
    /// The identity.
    pub const IDENTITY: Pose = Pose {
        rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        translation: Vector3::new(0.0, 0.0, 0.0),
    };

    /// Returns the pose of a URDF `<origin xyz rpy>`: fixed-axis roll, pitch, yaw \[rad\], that is `Rz(yaw)
    /// Ry(pitch) Rx(roll)`.
    pub fn from_xyz_rpy(xyz_m: [f64; 3], rpy_rad: [f64; 3]) -> Pose {
        let ((sr, cr), (sp, cp), (sy, cy)) = (
            sin_cos(rpy_rad[0]),
            sin_cos(rpy_rad[1]),
            sin_cos(rpy_rad[2]),
        );
        #[rustfmt::skip]
        let rotation = Matrix3::new(
            cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,
            sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,
            -sp,     cp * sr,                cp * cr,
        );
        Pose {
            rotation,
            translation: Vector3::from(xyz_m),
        }
    }

    /// Returns the pure translation \[m\].
    pub fn from_translation(translation: Vector3<f64>) -> Pose {
        Pose {
            translation,
            ..Pose::IDENTITY
        }
    }

    /// Returns the rotation about the origin that maps z onto the unit vector `axis`; bit-exact identity if
    /// `axis` is z.
    pub fn z_onto(axis: &Vector3<f64>) -> Pose {
        if axis.x == 0.0 && axis.y == 0.0 && axis.z > 0.0 {
            return Pose::IDENTITY;
        }
        // The less aligned of x and y is never nearly parallel to `axis`.
        let helper = if abs(axis.x) <= abs(axis.y) {
            Vector3::new(1.0, 0.0, 0.0)
        } else {
            Vector3::new(0.0, 1.0, 0.0)
        };
        let y = axis.cross(&helper);
        let y = y / crate::math::sqrt(y.dot(&y));
        let x = y.cross(axis);
        Pose {
            rotation: Matrix3::from_columns(&[x, y, *axis]),
            translation: Vector3::zeros(),
        }
    }

    /// Returns `b_from_a` of this `a_from_b`.
    pub fn inverse(&self) -> Pose {
        let rotation = self.rotation.transpose();
        Pose {
            rotation,
            translation: -(rotation * self.translation),
        }
    }

    /// Coordinates in `a` of a point given in `b` \[m\].
    pub fn transform_point(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point + self.translation
    }
}

/// Axis times angle of a rotation \[rad\], the angle from 0 to pi.
pub fn rotation_vector(rotation: &Matrix3<f64>) -> Vector3<f64> {
    let r = rotation;
    // A quaternion, not normalised, from the greatest of its entries (Shepperd, 1978).
    let trace = r.trace();
    let (real, imaginary) = if trace >= r.m11.max(r.m22).max(r.m33) {
        let twist = Vector3::new(r.m32 - r.m23, r.m13 - r.m31, r.m21 - r.m12);
        (1.0 + trace, twist)
    } else if r.m11 >= r.m22.max(r.m33) {
        let x = 1.0 + r.m11 - r.m22 - r.m33;
        (r.m32 - r.m23, Vector3::new(x, r.m12 + r.m21, r.m13 + r.m31))
    } else if r.m22 >= r.m33 {
        let y = 1.0 + r.m22 - r.m11 - r.m33;
        (r.m13 - r.m31, Vector3::new(r.m12 + r.m21, y, r.m23 + r.m32))
    } else {
        let z = 1.0 + r.m33 - r.m11 - r.m22;
        (r.m21 - r.m12, Vector3::new(r.m13 + r.m31, r.m23 + r.m32, z))
    };
    let length = sqrt(imaginary.dot(&imaginary));
    if length == 0.0 {
        return Vector3::zeros();
    }
    let angle = 2.0 * atan2(length, abs(real));
    imaginary * (angle / length).copysign(real)
}

impl Mul for Pose {
    type Output = Pose;
    fn mul(self, b_from_c: Pose) -> Pose {
        Pose {
            rotation: self.rotation * b_from_c.rotation,
            translation: self.transform_point(&b_from_c.translation),
        }
    }
}
