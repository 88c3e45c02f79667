//! The controller: a validated configuration and the constants derived from it.

use super::encoders::{EncoderStep, Encoders};
use super::estimator::EstimatorGains;
use super::limiter::MotorGroups;
use super::nullspace::nullspace_damping_nm_s_per_rad;
use super::plausibility::AgainstTorqueLimits;
use super::validate::{self, ConfigError};
use crate::config::{Config, RippleTable};
use crate::math::linalg::Cholesky;
use crate::math::{Matrix, Vector, sqrt};
use crate::model::learned::LearnedBounds;

/// A validated configuration and the constants derived from it.
#[derive(Clone, Copy, Debug)]
pub struct Controller<const N: usize> {
    pub(super) config: Config<N>,
    pub(super) groups: MotorGroups<N>,
    /// `j2mp`.
    pub(super) motor_from_joint: Matrix<N, N>,
    encoders: Encoders<N>,
    /// External torque on the motor of each encoder above which dry friction does not hold it \[N m\].
    stiction_limit_nm: Vector<N>,
    pub(super) delay_s: f64,
    /// Whether a motor has a ripple table.
    pub(super) has_ripple: bool,
    /// Whether a part of the ripple is proportional to the torque.
    pub(super) ripple_scales: bool,
    /// Whether the presliding travel of a joint is known.
    pub(super) has_presliding: bool,
    /// Whether the friction of a joint grows with its load.
    pub(super) has_load_friction: bool,
    /// Whether a joint is compliant between encoder and link.
    pub(super) has_compliance: bool,
    /// Gains of the estimator for one period.
    pub(super) one_period: EstimatorGains,
    encoder_step: EncoderStep,
    pub(super) torque_step_nm: Vector<N>,
    /// Weights of the squared external torques; the torques are large if the weighted sum exceeds one \[1/(N m)^2\].
    pub(super) large_torque_weight_per_nm2: Vector<N>,
    /// Minimum force of an unmodelled load times gravity \[N m/s^2\].
    load_n_m_per_s2: f64,
    against: AgainstTorqueLimits<N>,
    pub(super) stop_step_nm: Vector<N>,
    pub(super) nullspace_damping_nm_s_per_rad: Vector<N>,
    pub(super) learned_bounds: LearnedBounds<N>,
}

/// Maximum delay from a measurement to the resulting torque in cycles, with half a cycle for the
/// zero-order hold of the torque.
const DELAY_CYCLES: f64 = 3.5;

/// Time in which the safe action may ramp a joint from full torque to zero \[s\].
const STOP_TORQUE_S: f64 = 0.005;
/// Time constant `t_s` with which the safe action stops a motion, as a multiple of the delay.
const STOP_TIME_CONSTANT_DELAYS: f64 = 4.0;
/// Fraction of a joint's torque limit above which an external torque is large: errors of the friction model are smaller.
pub(super) const LARGE_TORQUE_SHARE: f64 = 0.05;

impl<const N: usize> Controller<N> {
    /// Validates a configuration and builds its controller.
    ///
    /// # Errors
    /// [`ConfigError`] names the entry, the joint and the value.
    pub fn new(config: Config<N>) -> Result<Self, ConfigError> {
        validate::validate(&config)?;
        let to_joint = &config.joint_from_motor;
        // Validation guarantees that the product is positive definite.
        let motor_from_joint = Cholesky::new(&(to_joint.transpose() * to_joint))
            .map_or_else(Matrix::identity, |square| {
                square.solve(&to_joint.transpose())
            });
        let delay_s = DELAY_CYCLES * config.period_s + 2.0 / config.estimator_rad_per_s;
        let limits = &config.limits;
        let encoders = Encoders::new(to_joint, &motor_from_joint);
        Ok(Controller {
            stiction_limit_nm: encoders.stiction_limit_nm(&config, &motor_from_joint),
            learned_bounds: LearnedBounds::new(&config.friction, &limits.joint_torque_nm),
            nullspace_damping_nm_s_per_rad: nullspace_damping_nm_s_per_rad(&config, delay_s),
            encoders,
            motor_from_joint,
            groups: MotorGroups::new(&config.joint_from_motor),
            delay_s,
            has_ripple: config
                .ripple
                .iter()
                .any(|table| !table.harmonics().is_empty()),
            ripple_scales: config.ripple.iter().any(RippleTable::scales_with_torque),
            has_presliding: config.friction.iter().any(|f| f.presliding_rad > 0.0),
            has_load_friction: config.friction.iter().any(|f| f.load_coefficient > 0.0),
            has_compliance: config.compliance_rad_per_nm != Vector::<N>::zeros(),
            one_period: EstimatorGains::new(config.period_s, config.estimator_rad_per_s),
            encoder_step: EncoderStep::new(
                config.estimator_rad_per_s,
                config.latch.observer_rad_per_s,
            ),
            torque_step_nm: config.limits.torque_rate_nm_per_s * config.period_s,
            large_torque_weight_per_nm2: limits.joint_torque_nm.map(|limit_nm| {
                let large_nm = LARGE_TORQUE_SHARE * limit_nm;
                1.0 / (large_nm * large_nm)
            }),
            load_n_m_per_s2: {
                let gravity = config.arm.gravity();
                config.plausible.load_n * sqrt(gravity.dot(&gravity))
            },
            against: AgainstTorqueLimits::new(&config),
            stop_step_nm: Vector::from_fn(|i, _| {
                let slow = config.limits.torque_rate_nm_per_s[i];
                let fast = config.limits.joint_torque_nm[i] / STOP_TORQUE_S;
                slow.max(fast) * config.period_s
            }),
            config,
        })
    }

    /// Returns the maximum delay from a motion to the resulting torque \[s\]: 3.5 cycles plus the lag of the
    /// velocity estimate.
    pub fn delay_s(&self) -> f64 {
        self.delay_s
    }

    pub(super) fn has_ripple(&self) -> bool {
        self.has_ripple
    }

    pub(super) fn ripple_scales(&self) -> bool {
        self.ripple_scales
    }

    pub(super) fn has_presliding(&self) -> bool {
        self.has_presliding
    }

    pub(super) fn has_load_friction(&self) -> bool {
        self.has_load_friction
    }

    pub(super) fn has_compliance(&self) -> bool {
        self.has_compliance
    }

    /// Returns the time constant `t_s` with which the safe action stops a motion \[s\].
    pub fn stop_s(&self) -> f64 {
        STOP_TIME_CONSTANT_DELAYS * self.delay_s
    }

    /// Returns the gains of the estimator after this number of periods. The common case of one period needs no exponential.
    pub(super) fn estimator_gains(&self, periods: u64) -> EstimatorGains {
        match periods {
            1 => self.one_period,
            _ => EstimatorGains::new(
                periods as f64 * self.config.period_s,
                self.config.estimator_rad_per_s,
            ),
        }
    }

    /// Returns the effect of an encoder's resolution step on the estimates.
    pub(super) fn encoder_step(&self) -> &EncoderStep {
        &self.encoder_step
    }

    /// Returns the damping of each joint in the null space of the position task \[N m s/rad\]: the damping of the law, or for
    /// light joints, such as the last ones of a wrist, the maximum that the delay allows.
    pub fn nullspace_damping_nm_s_per_rad(&self) -> &Vector<N> {
        &self.nullspace_damping_nm_s_per_rad
    }

    /// Returns the maximum change of joint torque per cycle \[N m\]: from the rate limit, or with `stopping` from the
    /// larger of the rate limit and the rate of the safe action.
    pub fn torque_step_nm(&self, stopping: bool) -> &Vector<N> {
        if stopping {
            &self.stop_step_nm
        } else {
            &self.torque_step_nm
        }
    }

    /// Bounds of the learned parameters.
    pub fn learned_bounds(&self) -> &LearnedBounds<N> {
        &self.learned_bounds
    }

    /// Returns the configuration.
    pub fn config(&self) -> &Config<N> {
        &self.config
    }

    /// Returns `j2mp`: motor angles from joint angles.
    pub fn motor_from_joint(&self) -> &Matrix<N, N> {
        &self.motor_from_joint
    }

    /// Returns the scalar product of force and gravity above which a force on the tip may be an unmodelled load \[N m/s^2\].
    pub(super) fn load_n_m_per_s2(&self) -> f64 {
        self.load_n_m_per_s2
    }

    /// Returns the limits of a motion against its torque.
    pub(super) fn against_torque_limits(&self) -> &AgainstTorqueLimits<N> {
        &self.against
    }

    /// Returns the coupling between encoders and joints.
    pub(super) fn encoders(&self) -> &Encoders<N> {
        &self.encoders
    }

    /// Returns the external torque on the motor of each encoder above which dry friction does not hold it \[N m\].
    pub(super) fn stiction_limit_nm(&self) -> &Vector<N> {
        &self.stiction_limit_nm
    }

    /// Returns the coupling between motors and joints.
    pub fn motors(&self) -> &MotorGroups<N> {
        &self.groups
    }
}
