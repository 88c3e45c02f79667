//! The plant of a described arm.

use crate::config::{ForceSensor, PlantConfig, Stops};
use crate::drive::{Drive, Ripple};
use crate::friction::LuGre;
use supple_core::{Matrix, Vector};
use supple_model::{Description, ModelError};

/// Time constant with which a shorted motor stops its own rotor where its constants are not known \[s\]: that of
/// the WAM's motors is 1.8 to 2.0 ms.
const SHORTED_S: f64 = 2e-3;

impl<const N: usize> PlantConfig<N> {
    /// The plant that a description describes, in empty space: its arm and tool, its friction (with a
    /// Stribeck dip and a loaded part, see [`LuGre::from_friction`]), its motors with their ripple, and
    /// encoders with a cycle of delay, its hard stops and its cap. The force sensor is noiseless.
    ///
    /// # Errors
    /// [`ModelError::JointCount`] if the arm has not `N` moving joints.
    pub fn from_description(description: &Description) -> Result<PlantConfig<N>, ModelError> {
        let told = description.config::<N>()?;
        let motors = description.motors();
        let counts = motors.counts_per_revolution.map_or(0.0, f64::from);
        let quantum = motors.torque_quantum_nm.as_deref();
        let braking = motors.braking_nm_s_per_rad.as_deref();
        let rotors_kg_m2 = told.joint_from_motor.transpose()
            * Matrix::from_diagonal(&told.arm.armature())
            * told.joint_from_motor;
        let ideal = PlantConfig::ideal(told.arm);
        let ripple = told.ripple.iter().enumerate().flat_map(|(motor, table)| {
            table.harmonics().iter().map(move |line| Ripple {
                motor,
                harmonic: line.harmonic,
                amplitude_nm: libm::hypot(line.sine_nm, line.cosine_nm),
                phase_rad: libm::atan2(line.cosine_nm, line.sine_nm),
            })
        });
        Ok(PlantConfig {
            friction: told
                .friction
                .map(|friction| LuGre::from_friction(&friction)),
            drive: Drive {
                joint_from_motor: told.joint_from_motor,
                counts_per_motor_revolution: Vector::repeat(counts),
                motor_torque_quantum_nm: quantum
                    .map_or_else(Vector::zeros, Vector::from_column_slice),
                braking_nm_s_per_rad: braking.map_or_else(
                    || rotors_kg_m2.diagonal() / SHORTED_S,
                    Vector::from_column_slice,
                ),
                torque_delay_cycles: 1,
                ripple: ripple.collect(),
                ..Drive::direct()
            },
            stops: Some(Stops::new(
                told.limits.position_lower_rad,
                told.limits.position_upper_rad,
            )),
            tip_radius_m: match description.tool() {
                Some(tool) => tool.cap_radius_m,
                None => ideal.tip_radius_m,
            },
            force_sensor: ForceSensor::default(),
            cycle_s: told.period_s,
            ..ideal
        })
    }
}
