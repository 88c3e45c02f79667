//! Conversions between the engine's glam types and nalgebra.

use rapier3d_f64::math as glam;
use supple_core::Pose;
use supple_core::nalgebra::{Matrix3, Vector3};

pub fn to_glam_vector(v: &Vector3<f64>) -> glam::Vector {
    glam::Vector::new(v.x, v.y, v.z)
}

pub fn from_glam(v: &glam::Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

pub fn to_glam_matrix(m: &Matrix3<f64>) -> glam::Matrix {
    let column = |i: usize| glam::Vector::new(m[(0, i)], m[(1, i)], m[(2, i)]);
    glam::Matrix::from_cols(column(0), column(1), column(2))
}

pub fn to_glam_pose(pose: &Pose) -> glam::Pose {
    glam::Pose::from_parts(
        to_glam_vector(&pose.translation),
        glam::Rotation::from_mat3(&to_glam_matrix(&pose.rotation)),
    )
}

pub fn from_glam_pose(pose: &glam::Pose) -> Pose {
    let column = |axis: glam::Vector| from_glam(&(pose.rotation * axis));
    Pose {
        rotation: Matrix3::from_columns(&[
            column(glam::Vector::X),
            column(glam::Vector::Y),
            column(glam::Vector::Z),
        ]),
        translation: from_glam(&pose.translation),
    }
}
