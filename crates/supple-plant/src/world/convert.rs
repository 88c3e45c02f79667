//! Between the engine's vectors and nalgebra's.

use rapier3d_f64::math as glam;
use supple_core::Pose;
use supple_core::nalgebra::{Matrix3, Vector3};

pub fn vector(v: &Vector3<f64>) -> glam::Vector {
    glam::Vector::new(v.x, v.y, v.z)
}

pub fn back(v: &glam::Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

pub fn matrix(m: &Matrix3<f64>) -> glam::Matrix {
    let column = |i: usize| glam::Vector::new(m[(0, i)], m[(1, i)], m[(2, i)]);
    glam::Matrix::from_cols(column(0), column(1), column(2))
}

pub fn pose_of(pose: &Pose) -> glam::Pose {
    glam::Pose::from_parts(
        vector(&pose.translation),
        glam::Rotation::from_mat3(&matrix(&pose.rotation)),
    )
}

pub fn pose_back(pose: &glam::Pose) -> Pose {
    let column = |axis: glam::Vector| back(&(pose.rotation * axis));
    Pose {
        rotation: Matrix3::from_columns(&[
            column(glam::Vector::X),
            column(glam::Vector::Y),
            column(glam::Vector::Z),
        ]),
        translation: back(&pose.translation),
    }
}
