//! An arm with N joints, of which every third has an oblique axis, and full inertia tensors.

use supple_core::math::{Matrix3, Vector3};
use supple_core::{Arm, ArmError, Body, Friction, Joint, Pose};

/// The joint axes repeat z, y and an oblique axis; full inertia tensors; a tool.
pub fn arm<const N: usize>() -> Result<Arm<N>, ArmError> {
    let axes = [
        Vector3::new(0.0, 0.0, 1.0),
        Vector3::new(0.0, 1.0, 0.0),
        Vector3::new(0.6, 0.0, 0.8),
    ];
    let joints = core::array::from_fn(|i| {
        let scale = 1.0 / (1.0 + i as f64);
        Joint {
            parent_from_link: Pose::from_xyz_rpy([0.05, -0.02, 0.3], [0.2, -0.1, 0.3 * scale]),
            axis: axes[i % axes.len()],
            body: Body {
                mass_kg: 4.0 * scale,
                com_m: Vector3::new(0.01, -0.02, 0.12),
                inertia_kg_m2: Matrix3::new(
                    0.05, 0.002, -0.003, 0.002, 0.04, 0.001, -0.003, 0.001, 0.03,
                ) * scale,
            },
            armature_kg_m2: 0.05,
        }
    });
    let tip = Pose::from_xyz_rpy([0.0, 0.01, 0.2], [0.1, 0.2, 0.3]);
    let tool = Body::ball(0.3, 0.02, Vector3::new(0.0, 0.0, 0.01));
    Arm::new(&joints, tip, Some(tool), Vector3::new(0.0, 0.0, -9.81))
}

/// Friction of each joint, with the Stribeck effect.
pub fn friction() -> Friction {
    Friction {
        breakaway_nm: 0.6,
        stribeck_rad_per_s: 0.3,
        band_rad_per_s: 0.2,
        ..Friction::coulomb(1.5, 0.5)
    }
}
