//! Builds a plant configuration from an arm description.

use crate::actuators::{ActuatorModel, Ripple, TorqueRipple};
use crate::config::{ForceSensor, HardStops, PlantConfig};
use crate::friction::LuGre;
use supple_core::ripple::Harmonic;
use supple_core::{Matrix, Vector};
use supple_model::{Description, ModelError};

/// Time constant with which a shorted motor stops its own rotor if the motor constants are unknown \[s\]; the WAM's
/// motors have 1.8 to 2.0 ms.
const SHORTED_TIME_CONSTANT_S: f64 = 2e-3;

impl<const N: usize> PlantConfig<N> {
    /// Returns the plant of a description, in empty space: arm and tool, friction (with Stribeck effect and a load-dependent
    /// part, see [`LuGre::from_friction`]), motors with ripple, encoders, a torque delay of one cycle, hard stops
    /// and the radius of the tip. The force sensor is noiseless.
    ///
    /// # Errors
    /// [`ModelError::JointCount`] if the arm does not have `N` moving joints.
    pub fn from_description(description: &Description) -> Result<PlantConfig<N>, ModelError> {
        let control = description.config::<N>()?;
        let motors = description.motors();
        let counts = motors.counts_per_revolution.map_or(0.0, f64::from);
        let quantum = motors.torque_quantum_nm.as_deref();
        let braking = motors.braking_nm_s_per_rad.as_deref();
        let rotors_kg_m2 = control.joint_from_motor.transpose()
            * Matrix::from_diagonal(&control.arm.armature())
            * control.joint_from_motor;
        let ideal = PlantConfig::ideal(control.arm);
        let ripple = control
            .ripple
            .iter()
            .enumerate()
            .flat_map(|(motor, table)| {
                table.harmonics().iter().map(move |harmonic| Ripple {
                    motor,
                    harmonic: harmonic.harmonic,
                    amplitude_nm: libm::hypot(harmonic.sine_nm, harmonic.cosine_nm),
                    phase_rad: libm::atan2(harmonic.cosine_nm, harmonic.sine_nm),
                })
            });
        let torque_ripple = control
            .ripple
            .iter()
            .enumerate()
            .flat_map(|(motor, table)| {
                let scales = |line: &&Harmonic| line.sine_share != 0.0 || line.cosine_share != 0.0;
                let lines = table.harmonics().iter().filter(scales);
                lines.map(move |line| TorqueRipple {
                    motor,
                    harmonic: line.harmonic,
                    fraction: libm::hypot(line.sine_share, line.cosine_share),
                    phase_rad: libm::atan2(line.cosine_share, line.sine_share),
                })
            });
        Ok(PlantConfig {
            friction: control
                .friction
                .map(|friction| LuGre::from_friction(&friction)),
            joint_torque_nm: control.limits.joint_torque_nm,
            actuators: ActuatorModel {
                joint_from_motor: control.joint_from_motor,
                counts_per_motor_revolution: Vector::repeat(counts),
                motor_torque_quantum_nm: quantum
                    .map_or_else(Vector::zeros, Vector::from_column_slice),
                // The drives of motors on a bus carry the remainder.
                carries_remainder: description.bus().is_some(),
                braking_nm_s_per_rad: braking.map_or_else(
                    || rotors_kg_m2.diagonal() / SHORTED_TIME_CONSTANT_S,
                    Vector::from_column_slice,
                ),
                torque_delay_cycles: 1,
                ripple: ripple.collect(),
                torque_ripple: torque_ripple.collect(),
                ..ActuatorModel::direct()
            },
            stops: Some(HardStops::new(
                control.limits.position_lower_rad,
                control.limits.position_upper_rad,
            )),
            tip_radius_m: match description.tool() {
                Some(tool) => tool.cap_radius_m,
                None => ideal.tip_radius_m,
            },
            force_sensor: ForceSensor::default(),
            cycle_s: control.period_s,
            step_s: step_s(control.period_s, ideal.step_s),
            ..ideal
        })
    }
}

/// Returns the usual physics step \[s\], or the largest smaller step that divides the cycle.
fn step_s(cycle_s: f64, usual_s: f64) -> f64 {
    let steps = cycle_s / usual_s;
    if (steps - libm::rint(steps)).abs() < 1e-9 * steps {
        usual_s
    } else {
        cycle_s / libm::ceil(steps)
    }
}
