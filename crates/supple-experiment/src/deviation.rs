//! Deviations of an arm from the model of its controller that arise after the identification.

use crate::error::ExperimentError;
use nalgebra::Vector4;
use supple_core::math::Vector3;
use supple_core::nalgebra::Rotation3;
use supple_core::{Arm, Link};
use supple_ident::learn::with_payload;
use supple_plant::{LuGre, PlantConfig};

/// A deviation of the plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Deviation {
    /// None.
    None,
    /// Dry and viscous friction of all joints, relative.
    Friction(f64),
    /// Torque constant of all motors, relative. The plant's torques are exact; instead its inertias, weights and friction
    /// grow by the factor by which the command falls short, which gives the same motion in free space.
    TorqueConstant(f64),
    /// A point mass at the tip \[kg\].
    Payload(f64),
    /// The base is turned about its axes x and y \[rad\].
    Tilt(f64, f64),
}

impl Deviation {
    /// Changes the plant.
    ///
    /// # Errors
    /// If the arm becomes unphysical.
    pub fn apply<const N: usize>(self, plant: &mut PlantConfig<N>) -> Result<(), ExperimentError> {
        let arm = &plant.arm;
        let rebuilt = |links: [Link; N], factor: f64, gravity| {
            Arm::from_links(
                links,
                arm.armature() * factor,
                arm.joint_from_tip(),
                gravity,
            )
        };
        match self {
            Deviation::None => {}
            Deviation::Friction(change) => scale_friction(&mut plant.friction, 1.0 + change),
            Deviation::TorqueConstant(change) => {
                let factor = 1.0 / (1.0 + change);
                let mut links = *arm.links();
                for link in &mut links {
                    link.mass *= factor;
                    link.first_moment *= factor;
                    link.inertia *= factor;
                }
                plant.arm = rebuilt(links, factor, arm.gravity())?;
                scale_friction(&mut plant.friction, factor);
            }
            Deviation::Payload(mass_kg) => {
                let tip_m = arm.link_from_joint(N - 1) * arm.joint_from_tip().translation;
                let payload = Vector4::new(
                    mass_kg,
                    mass_kg * tip_m.x,
                    mass_kg * tip_m.y,
                    mass_kg * tip_m.z,
                );
                plant.arm = with_payload(arm, Some(&payload))?;
            }
            Deviation::Tilt(x_rad, y_rad) => {
                // If the base rotates, gravity rotates in the opposite direction in base axes.
                let turn = Rotation3::from_scaled_axis(Vector3::new(-x_rad, -y_rad, 0.0));
                plant.arm = rebuilt(*arm.links(), 1.0, turn * arm.gravity())?;
            }
        }
        Ok(())
    }
}

fn scale_friction<const N: usize>(friction: &mut [LuGre; N], factor: f64) {
    for friction in friction {
        friction.viscous_nm_s_per_rad *= factor;
        friction.viscous_asymmetry_nm_s_per_rad *= factor;
        friction.coulomb_nm *= factor;
        friction.breakaway_nm *= factor;
        friction.bristle_stiffness_nm_per_rad *= factor;
        friction.bristle_damping_nm_s_per_rad *= factor;
        friction.offset_nm *= factor;
        friction.stribeck_offset_nm *= factor;
    }
}
