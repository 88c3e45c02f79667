//! Arms and small controllers for several tests.
#![allow(dead_code)]

use supple_core::dynamics::{gravity, jacobian, rnea, tip_pose};
use supple_core::nalgebra::{Matrix3, SMatrix, UnitQuaternion, Vector3};
use supple_core::{Arm, Body, Joint, Pose, Vector};
use supple_plant::noise::Noise;
use supple_plant::{FixedBlock, Plant, PlantConfig, Scene};

pub const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

fn dh(alpha: f64, a: f64, d: f64) -> Pose {
    let alpha = Pose::from_xyz_rpy([a, 0.0, 0.0], [alpha, 0.0, 0.0]);
    Pose::from_translation(Vector3::new(0.0, 0.0, d)) * alpha
}

fn body(mass_kg: f64, com: [f64; 3], diagonal: [f64; 3], [xy, xz, yz]: [f64; 3]) -> Body {
    let [x, y, z] = diagonal;
    Body {
        mass_kg,
        com_m: Vector3::from(com),
        inertia_kg_m2: Matrix3::new(x, xy, xz, xy, y, yz, xz, yz, z),
    }
}

/// The four-joint whole-arm manipulator with Barrett's inertias and rotors, and a 0.3 kg tool.
pub fn wam4() -> Arm<4> {
    wam4_from(ROTORS, DOWN)
}

/// [`wam4`] with other rotor inertias \[kg m^2\].
pub fn wam4_with(armature: [f64; 4]) -> Arm<4> {
    wam4_from(armature, DOWN)
}

/// [`wam4`] under another gravity \[m/s^2\].
pub fn wam4_in(gravity: Vector3<f64>) -> Arm<4> {
    wam4_from(ROTORS, gravity)
}

const ROTORS: [f64; 4] = [0.2052, 0.1888, 0.0669, 0.0346];

fn wam4_from(armature: [f64; 4], gravity: Vector3<f64>) -> Arm<4> {
    let half = core::f64::consts::FRAC_PI_2;
    let frames = [
        dh(-half, 0.0, 0.0),
        dh(half, 0.0, 0.0),
        dh(-half, 0.045, 0.55),
        dh(half, -0.045, 0.0),
    ];
    let bodies = [
        body(
            10.7677,
            [-0.00443, 0.12189, -0.00066],
            [0.13488033, 0.11328369, 0.0904633],
            [-0.00213041, -0.00012485, 0.00068555],
        ),
        body(
            3.8749,
            [-0.00237, 0.03106, 0.01542],
            [0.02140958, 0.01377875, 0.01558906],
            [0.00027172, 0.00002461, -0.0018192],
        ),
        body(
            1.8023,
            [-0.03826, 0.20751, 0.00003],
            [0.05911077, 0.0032455, 0.05927043],
            [-0.00249612, 0.00000738, -0.00001767],
        ),
        body(
            1.0651,
            [0.01095, -0.00003, 0.14054],
            [0.01848577, 0.01891658, 0.00197517],
            [0.00000219, -0.00160868, 0.00000515],
        ),
    ];
    let joints = core::array::from_fn(|i| Joint {
        parent_from_link: if i == 0 {
            Pose::IDENTITY
        } else {
            frames[i - 1]
        },
        axis: Vector3::z(),
        body: bodies[i].expressed_in(&frames[i]),
        armature_kg_m2: armature[i],
    });
    let tip = frames[3] * Pose::from_translation(Vector3::new(0.0, 0.0, 0.41));
    let tool = Body::ball(0.3, 0.03, Vector3::new(0.0, 0.0, -0.03));
    Arm::new(&joints, tip, Some(tool), gravity).unwrap()
}

/// A chain of random, physically consistent bodies on random axes.
pub fn random_arm<const N: usize>(seed: u64) -> Arm<N> {
    let mut noise = Noise::new(seed, 77);
    let joints = core::array::from_fn(|i| {
        let mut draw =
            |scale: f64| Vector3::new(noise.normal(), noise.normal(), noise.normal()) * scale;
        let (turn, axis, com) = (draw(1.0), draw(1.0).normalize(), draw(0.05));
        let (offset, spin, half) = (draw(0.2), draw(1.0), draw(0.08));
        let mass_kg = 1.0 + 2.0 * noise.uniform();
        let rotation = UnitQuaternion::from_scaled_axis(spin).to_rotation_matrix();
        // A rotated solid cuboid.
        let h = half.map(|x| x.abs() + 0.02);
        let (x, y, z) = (h.x * h.x, h.y * h.y, h.z * h.z);
        let principal = Vector3::new(y + z, z + x, x + y) * (mass_kg / 3.0);
        let r = rotation.matrix();
        Joint {
            parent_from_link: Pose {
                rotation: *UnitQuaternion::from_scaled_axis(turn)
                    .to_rotation_matrix()
                    .matrix(),
                translation: if i == 0 { Vector3::zeros() } else { offset },
            },
            axis,
            body: Body {
                mass_kg,
                com_m: com,
                inertia_kg_m2: r * Matrix3::from_diagonal(&principal) * r.transpose(),
            },
            armature_kg_m2: 0.1 * noise.uniform(),
        }
    });
    let tip = Pose::from_translation(Vector3::new(0.1, 0.05, 0.2));
    Arm::new(&joints, tip, None, DOWN).unwrap()
}

/// Shoulder pitch and elbow that put the tip of [`wam4`] at `x`, `z` with base and roll at zero.
pub fn wam4_at(arm: &Arm<4>, x: f64, z: f64) -> Vector<4> {
    let mut q = Vector::from([0.0, 0.8, 0.0, 1.4]);
    for _ in 0..50 {
        let p = tip_pose(arm, &q).translation;
        let j = jacobian(arm, &q);
        let a = SMatrix::<f64, 2, 2>::new(j[(0, 1)], j[(0, 3)], j[(2, 1)], j[(2, 3)]);
        let e = Vector::<2>::from([x - p.x, z - p.z]);
        let step = a.try_inverse().unwrap() * e;
        q[1] += step[0];
        q[3] += step[1];
    }
    let p = tip_pose(arm, &q).translation;
    assert!((p.x - x).abs() < 1e-12 && (p.z - z).abs() < 1e-12 && p.y.abs() < 1e-12);
    q
}

/// Joint torques of a spring and a damper that pull the tip to `target`, `J^T (k (target - x) - b x')`, plus the
/// model's gravity and Coriolis torques; a spring and a damper hold joint 3 at zero.
pub fn tip_spring(plant: &Plant<4>, target: &Vector3<f64>, k: f64, b: f64) -> Vector<4> {
    let (arm, truth) = (&plant.config().arm, plant.truth());
    let (q, qd) = (truth.position_rad, truth.velocity_rad_per_s);
    let force = (target - truth.tip_position_m) * k - truth.tip_velocity_m_per_s * b;
    let j = jacobian(arm, &q);
    let mut tau = rnea(arm, &q, &qd, &Vector::zeros()) + j.fixed_rows::<3>(0).transpose() * force;
    tau[2] -= 200.0 * q[2] + 10.0 * qd[2];
    tau
}

/// Gravity torque `G`.
pub fn weight(plant: &Plant<4>) -> Vector<4> {
    gravity(&plant.config().arm, &plant.truth().position_rad)
}

/// A wooden block, the centre of its top at the height of the base frame, under the tip of an arm that reaches
/// forwards.
pub fn block() -> Scene {
    Scene {
        fixed_blocks: vec![FixedBlock::wooden(
            "block",
            Vector3::new(0.72, 0.0, 0.0),
            [0.3, 0.6, 0.1],
        )],
        ..Scene::default()
    }
}

/// A plant with the tip above the face of the block, moving down. The caller commands the torques.
pub fn above_block(height_m: f64, speed_m_per_s: f64, step_s: f64) -> Plant<4> {
    let arm = wam4();
    let config = PlantConfig {
        scene: block(),
        step_s,
        ..PlantConfig::ideal(arm)
    };
    let q = wam4_at(&arm, 0.72, config.tip_radius_m + height_m);
    Plant::new(config, q, descent(&arm, &q, speed_m_per_s)).unwrap()
}

/// Joint velocities of shoulder pitch and elbow that move the tip straight down.
pub fn descent(arm: &Arm<4>, q: &Vector<4>, speed_m_per_s: f64) -> Vector<4> {
    let j = jacobian(arm, q);
    let a = SMatrix::<f64, 2, 2>::new(j[(0, 1)], j[(0, 3)], j[(2, 1)], j[(2, 3)]);
    let qd = a.try_inverse().unwrap() * Vector::<2>::from([0.0, -speed_m_per_s]);
    Vector::from([0.0, qd[0], 0.0, qd[1]])
}
