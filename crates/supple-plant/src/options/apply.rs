//! How each option changes the configuration of a plant.

use super::PlantOptions;
use crate::actuators::{Ripple, TorqueRipple, motor_from_joint};
use crate::config::PlantConfig;
use crate::elasticity::Elasticity;
use crate::error::{PlantError, entry};
use crate::friction::{BRISTLE_DEFLECTION_RAD, BRISTLE_TIME_S, LuGre};
use crate::noise::Noise;
use crate::plant::with_payload;
use core::f64::consts::TAU;
use supple_core::nalgebra::Vector3;
use supple_core::{Arm, Matrix, Vector};

/// Harmonics of a motor's cogging, each with its share of the size.
const COGGING: [(u32, f64); 2] = [(2, 0.4), (6, 0.6)];
/// Harmonic of a motor's torque ripple.
const TORQUE_RIPPLE_HARMONIC: u32 = 6;
/// Periods of the friction over a revolution of a joint.
const FRICTION_PERIODS: f64 = 4.0;
/// Time constant of the warm-up if it is not given \[s\].
const WARM_UP_S: f64 = 600.0;

/// Random stream of each effect: effects draw independently from the same seed.
#[derive(Clone, Copy)]
enum RandomStream {
    Cogging = 16,
    TorqueRipple,
    Direction,
    Angle,
    Offset,
    TorqueConstant,
    Tilt,
    EncoderBias,
    HosePreload,
    Shortfall,
}

impl PlantOptions {
    /// Returns the plant `config` with these options. Signs and phases are drawn from the seed of the options, or else from the
    /// seed of the plant. Without options the plant is unchanged.
    ///
    /// # Errors
    /// [`PlantError`] if an option does not fit the arm.
    pub fn apply<const N: usize>(
        &self,
        config: PlantConfig<N>,
    ) -> Result<PlantConfig<N>, PlantError> {
        let mut config = config;
        config.hand.clone_from(&self.hand);
        let seed = self.seed.map_or(config.seed, u64::from);
        let noise = |draw: RandomStream| Noise::new(seed, draw as u64);
        let signs = |draw, size: f64| {
            let mut noise = noise(draw);
            Vector::from_fn(|_, _| if noise.uniform() < 0.5 { -size } else { size })
        };
        let phases = |draw| {
            let mut noise = noise(draw);
            Vector::from_fn(|_, _| TAU * noise.uniform())
        };
        let motor_from_joint =
            motor_from_joint(&config.actuators).ok_or(PlantError::Transmission)?;

        if let Some(kg) = self.tool_extra_kg.filter(|kg| *kg > 0.0) {
            let must = "such that the last link stays a physical body";
            config.arm = with_payload(&config.arm, kg, config.tip_radius_m)
                .or_else(|_| entry(false, "tool_extra_kg", kg, must).map(|()| config.arm))?;
        }
        if let Some(tilt_rad) = self.base_tilt_rad {
            let direction_rad = TAU * noise(RandomStream::Tilt).uniform();
            config.arm = tilted(&config.arm, tilt_rad, direction_rad).or_else(|_| {
                entry(false, "base_tilt_rad", tilt_rad, "finite").map(|()| config.arm)
            })?;
        }
        self.change_friction(&mut config, &motor_from_joint);
        let variation = &mut config.friction_variation;
        if let Some(fraction) = self.friction_angle_fraction {
            variation.angle_fraction = fraction;
            variation.periods_per_revolution = FRICTION_PERIODS;
            variation.phase_rad = phases(RandomStream::Angle);
        }
        if let Some(fraction) = self.friction_direction_fraction {
            variation.direction_fraction = signs(RandomStream::Direction, fraction);
        }
        variation.viscous_load_fraction = self.friction_load_fraction.unwrap_or(0.0);
        variation.gear_fraction = self.gear_friction_fraction.unwrap_or(0.0);
        variation.cold_dry_fraction = self.warm_up_dry_fraction.unwrap_or(0.0);
        variation.cold_viscous_fraction = self.warm_up_viscous_fraction.unwrap_or(0.0);
        variation.warm_up_s = self.warm_up_s.unwrap_or(WARM_UP_S);
        variation.warmed_s = self.warmed_s.unwrap_or(0.0);
        if let Some(stiffness) = self.cable_stiffness_nm_per_rad {
            config.elasticity = Some(Elasticity {
                stiffness_nm_per_rad: Vector::repeat(stiffness),
                damping_ratio: self.cable_damping_ratio.unwrap_or(0.0),
                backlash_rad: self.backlash_rad.unwrap_or(0.0),
            });
        }
        let bound_nm = self.small_joint_fraction.map_or_else(
            || Vector::repeat(f64::INFINITY),
            |fraction| config.joint_torque_nm * fraction,
        );
        let bounded = |size: f64| bound_nm.map(|bound| size.min(bound));
        config.hose.stiffness_nm_per_rad = bounded(self.hose_stiffness_nm_per_rad.unwrap_or(0.0));
        if let Some(preload_nm) = self.hose_preload_nm {
            let sign = signs(RandomStream::HosePreload, 1.0);
            config.hose.preload_nm = bounded(preload_nm).component_mul(&sign);
        }
        config.cycle_jitter = self.cycle_jitter_fraction.unwrap_or(0.0);

        let actuators = &mut config.actuators;
        if let Some(size_nm) = self.ripple_nm {
            let sizes_nm = bounded(size_nm);
            let cogging = cogging(
                &actuators.joint_from_motor,
                &sizes_nm,
                noise(RandomStream::Cogging),
            );
            actuators.ripple.extend(cogging);
        }
        if let Some(fraction) = self.torque_ripple_fraction {
            let phase_rad: Vector<N> = phases(RandomStream::TorqueRipple);
            actuators.torque_ripple = (0..N)
                .map(|motor| TorqueRipple {
                    motor,
                    harmonic: TORQUE_RIPPLE_HARMONIC,
                    fraction,
                    phase_rad: phase_rad[motor],
                })
                .collect();
        }
        if let Some(dead_zone_nm) = self.dead_zone_nm {
            actuators.dead_zone_nm = Vector::repeat(dead_zone_nm);
        }
        if let Some(offset_nm) = self.amplifier_offset_nm {
            actuators.offset_nm = signs(RandomStream::Offset, offset_nm);
        }
        if let Some(fraction) = self.torque_constant_fraction {
            actuators.torque_constant =
                signs(RandomStream::TorqueConstant, fraction).add_scalar(1.0);
        }
        if self.torque_shortfall_fraction.is_some() || self.torque_shortfall_spread.is_some() {
            let mean = self.torque_shortfall_fraction.unwrap_or(0.0);
            let spread = self.torque_shortfall_spread.unwrap_or(0.0);
            let mut noise = noise(RandomStream::Shortfall);
            let share = Vector::from_fn(|_, _| 1.0 - mean + spread * (2.0 * noise.uniform() - 1.0));
            actuators.torque_constant = actuators.torque_constant.component_mul(&share);
        }
        if let Some(bias_rad) = self.encoder_bias_rad {
            actuators.encoder_bias_rad = signs(RandomStream::EncoderBias, bias_rad);
        }
        if let Some(noise_rad) = self.encoder_noise_rad {
            actuators.encoder_noise_rad = Vector::repeat(noise_rad);
        }
        actuators.torque_delay_cycles += self.extra_delay_cycles.unwrap_or(0.0) as usize;
        Ok(config)
    }

    fn change_friction<const N: usize>(
        &self,
        config: &mut PlantConfig<N>,
        motor_from_joint: &Matrix<N, N>,
    ) {
        if let Some(change) = self.dry_friction_change {
            for friction in &mut config.friction {
                friction.coulomb_nm *= 1.0 + change;
                friction.breakaway_nm *= 1.0 + change;
                friction.stribeck_offset_nm *= 1.0 + change;
                friction.bristle_stiffness_nm_per_rad *= 1.0 + change;
                friction.bristle_damping_nm_s_per_rad *= 1.0 + change;
            }
        }
        if let Some(fraction) = self.friction_load_fraction {
            for friction in &mut config.friction {
                friction.load_fraction = fraction;
            }
        }
        if let Some(share) = self.motor_friction_share.filter(|share| *share > 0.0) {
            move_to_motors(config, motor_from_joint, share);
        }
        if let Some(factor) = self.bristle_stiffness_factor {
            let frictions = config.friction.iter_mut().chain(&mut config.motor_friction);
            for friction in frictions {
                friction.bristle_stiffness_nm_per_rad *= factor;
                friction.bristle_damping_nm_s_per_rad *= factor;
            }
        }
    }
}

/// Returns cogging of all motors with random phases; the amplitudes at each joint sum to its `size_nm`.
pub(crate) fn cogging<const N: usize>(
    joint_from_motor: &Matrix<N, N>,
    size_nm: &Vector<N>,
    mut noise: Noise,
) -> Vec<Ripple> {
    let mut lines = Vec::new();
    for motor in 0..N {
        // A torque of 1 N m at the motor is the inverse of the largest ratio at the joints.
        let ratios = joint_from_motor.column(motor).abs();
        let (joint, per_joint) = (ratios.imax(), ratios.max());
        for (harmonic, share) in COGGING {
            lines.push(Ripple {
                motor,
                harmonic,
                amplitude_nm: size_nm[joint] * share * per_joint,
                phase_rad: TAU * noise.uniform(),
            });
        }
    }
    lines
}

/// Returns the arm on a base that is tilted by `tilt_rad` about a horizontal axis at `direction_rad` from base x.
fn tilted<const N: usize>(
    arm: &Arm<N>,
    tilt_rad: f64,
    direction_rad: f64,
) -> Result<Arm<N>, supple_core::ArmError> {
    let (sin, cos) = (libm::sin(tilt_rad), libm::cos(tilt_rad));
    let axis = Vector3::new(libm::cos(direction_rad), libm::sin(direction_rad), 0.0);
    let g = arm.gravity();
    // Rodrigues' rotation formula.
    let turned = g * cos + axis.cross(&g) * sin + axis * (axis.dot(&g) * (1.0 - cos));
    Arm::from_links(*arm.links(), arm.armature(), arm.joint_from_tip(), turned)
}

/// Moves a share of the joints' friction to the motors, such that motion of one joint alone has the same friction.
///
/// With `R = m2jp^-1`, Coulomb friction `c` of the motors is `|R|^T c` at a joint that moves alone, viscous friction `b`
/// is the diagonal of `R^T diag(b) R`. Each motor gets `share` of the maximum friction that no joint exceeds.
fn move_to_motors<const N: usize>(
    config: &mut PlantConfig<N>,
    motor_from_joint: &Matrix<N, N>,
    share: f64,
) {
    let ratio = motor_from_joint.abs();
    let square = ratio.component_mul(&ratio);
    let allowed = |of: &dyn Fn(&LuGre) -> f64, weight: &Matrix<N, N>, motor: usize| {
        let joints =
            (0..N).filter(|joint| weight[(motor, *joint)] > 1e-9 * weight.row(motor).amax());
        let each = joints.map(|joint| of(&config.friction[joint]) / weight.column(joint).sum());
        share * each.fold(f64::INFINITY, f64::min)
    };
    let motors: [LuGre; N] = core::array::from_fn(|motor| {
        let coulomb_nm = allowed(&|f| f.coulomb_nm, &ratio, motor);
        let joint = ratio.row(motor).transpose().imax();
        let gear = ratio[(motor, joint)];
        let bristle = coulomb_nm / (BRISTLE_DEFLECTION_RAD * gear);
        let breakaway_factor = config.friction[joint].breakaway_nm
            / config.friction[joint].coulomb_nm.max(f64::MIN_POSITIVE);
        LuGre {
            viscous_nm_s_per_rad: allowed(&|f| f.viscous_nm_s_per_rad, &square, motor),
            viscous_asymmetry_nm_s_per_rad: 0.0,
            coulomb_nm,
            breakaway_nm: if coulomb_nm > 0.0 {
                coulomb_nm * breakaway_factor.max(1.0)
            } else {
                0.0
            },
            stribeck_rad_per_s: config.friction[joint].stribeck_rad_per_s * gear,
            offset_nm: 0.0,
            stribeck_offset_nm: 0.0,
            bristle_stiffness_nm_per_rad: bristle,
            bristle_damping_nm_s_per_rad: bristle * BRISTLE_TIME_S,
            load_fraction: 0.0,
        }
    });
    for (joint, friction) in config.friction.iter_mut().enumerate() {
        let (mut coulomb_nm, mut viscous) = (0.0, 0.0);
        for (motor, of) in motors.iter().enumerate() {
            coulomb_nm += ratio[(motor, joint)] * of.coulomb_nm;
            viscous += square[(motor, joint)] * of.viscous_nm_s_per_rad;
        }
        if friction.viscous_nm_s_per_rad > 0.0 {
            let left_nm_s_per_rad = (friction.viscous_nm_s_per_rad - viscous).max(0.0);
            friction.viscous_asymmetry_nm_s_per_rad *=
                left_nm_s_per_rad / friction.viscous_nm_s_per_rad;
            friction.viscous_nm_s_per_rad = left_nm_s_per_rad;
        }
        if friction.coulomb_nm > 0.0 {
            let left = (friction.coulomb_nm - coulomb_nm).max(0.0) / friction.coulomb_nm;
            friction.coulomb_nm *= left;
            friction.breakaway_nm *= left;
            friction.stribeck_offset_nm *= left;
            friction.bristle_stiffness_nm_per_rad *= left;
            friction.bristle_damping_nm_s_per_rad *= left;
        }
    }
    config.motor_friction = motors;
}
