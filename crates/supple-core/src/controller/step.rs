//! One control cycle.

use super::activity::Activity;
use super::fault::Fault;
use super::mode::{Refusal, Request};
use super::output::{Input, Output};
use super::plausibility::Evidence;
use super::state::State;
use super::{Controller, checks, limiter};
use crate::config::{Config, Role};
use crate::dynamics::terms;
use crate::impedance::{SINGULAR_BELOW_M, Situation, Task, Torques, impedance};
use crate::math::{Vector, Vector3, abs, smooth_step};
use crate::ripple::compensation_nm;
use crate::trajectory::{JointReference, Reference};
use crate::workspace::Crossing;

/// From measurements to torques. Allocates nothing, locks nothing, logs nothing, reads no clock.
///
/// In order: the state is received and checked; the model is evaluated; the request is heard; motion
/// is checked against its limits; the external torque is observed; the torque of the activity is
/// computed and every term checked finite; then torque limit, rate limit and a last finite check.
pub fn step<const N: usize>(
    controller: &Controller<N>,
    state: &mut State<N>,
    input: &Input<N>,
) -> Output<N> {
    let config = controller.config();
    let (elapsed_s, sound) = match state.receive(config, input) {
        Ok(elapsed_s) => (elapsed_s, true),
        Err(fault) => {
            state.latch_fault(fault);
            (0.0, false)
        }
    };
    let velocity = state.estimator.velocity_rad_per_s;
    terms(&config.arm, &state.position, &velocity, &mut state.terms);
    let task = Task::new(&state.terms, &config.roles);
    if task.is_none() {
        state.latch_fault(Fault::MassMatrix);
    }
    state.follow_drives(input.drives_active);
    let refusal = input.request.as_ref().and_then(|request| match request {
        // A fault is not cleared in a cycle that would raise it.
        Request::Reset if !sound || task.is_none() => Some(Refusal::Mode { mode: state.mode() }),
        _ => state.request(controller, task.as_ref(), request).err(),
    });
    state.gains.elapsed_s += elapsed_s;
    state.advance_held(config, elapsed_s);
    state.end_breakaway(config);

    let tip_position = state.terms.base_from_tip.translation;
    let tip_velocity = state.terms.jacobian.fixed_rows::<3>(0) * velocity;
    let mut reference = state.reference(config);
    if let Err(fault) = state.check(config, &tip_velocity, reference.as_ref()) {
        state.latch_fault(fault);
        reference = None;
    }
    let external_force = match state.observe(config, task.as_ref(), reference.as_ref(), elapsed_s) {
        Ok(force_n) => force_n,
        Err((force_n, fault)) => {
            state.latch_fault(fault);
            reference = None;
            force_n
        }
    };
    if let Err(fault) = state.keep_within(config, &tip_velocity, &external_force) {
        state.latch_fault(fault);
        reference = None;
    }
    state.watch_the_stop(controller, &tip_velocity, elapsed_s);

    let mut torques = state.demand(
        controller,
        task.as_ref(),
        reference.as_ref(),
        input.tip_force_n,
    );
    if !(state.activity.is_limp() || state.fault.is_some() || state.is_stale(config)) {
        let tables = &config.ripple;
        torques.ripple = compensation_nm(tables, controller.motor_from_joint(), &state.position);
    }
    state.hand_over(config, &mut torques);
    let total = checks::total(&torques).unwrap_or_else(|fault| {
        state.latch_fault(fault);
        reference = None;
        torques = state.safe(controller);
        checks::total(&torques).unwrap_or_else(|_| {
            torques = Torques::zeros();
            Vector::zeros()
        })
    });
    if !state.drives_active {
        // Nothing carries it out: there is no rate to keep to, and the arm's weight is there when they come.
        state.torque = total;
    }
    let limited = limiter::limit(
        &config.limits,
        controller.motors(),
        &state.torque,
        &total,
        controller.torque_step_nm(state.fault.is_some()),
    );
    if !limited.finite {
        state.latch_fault(Fault::TorqueNotFinite { term: "total" });
    }
    state.torque = limited.torque_nm;
    state.update_fallback(controller);

    Output {
        cycle: input.cycle,
        torque_nm: limited.torque_nm,
        fallback_torque_nm: state.fallback,
        mode: state.mode(),
        mode_time_s: state.activity_s(config),
        limp: state.activity.is_limp(),
        fault: state.fault,
        safe_action: state.safe_action(),
        refusal,
        torques,
        torque_limited: limited.torque_limited,
        rate_limited: limited.rate_limited,
        position_rad: state.position,
        velocity_rad_per_s: velocity,
        tip_position_m: tip_position,
        tip_velocity_m_per_s: tip_velocity,
        reference,
        gains: state.gains.now(),
        external_torque_nm: state.observer.external_torque_nm(),
        external_force_n: external_force,
        force_against_n: state.latch.force_against_n(),
        contact_threshold_n: state.latch.threshold_n(),
        in_contact: state.latch.in_contact(),
        friction_share: state.latch.friction_share(),
        least_singular_value_m: task.map_or(0.0, |task| task.least_singular_value_m),
    }
}

impl<const N: usize> State<N> {
    fn reference(&self, config: &Config<N>) -> Option<Reference> {
        match &self.activity {
            Activity::Track(trajectory) => Some(trajectory.at(self.activity_s(config))),
            _ => None,
        }
    }

    fn check(
        &self,
        config: &Config<N>,
        tip_velocity: &Vector3<f64>,
        reference: Option<&Reference>,
    ) -> Result<(), Fault> {
        if self.activity.is_limp() || !self.drives_active {
            return Ok(());
        }
        let velocity = &self.estimator.velocity_rad_per_s;
        checks::motion(&config.limits, &self.position, velocity, tip_velocity)?;
        let wanted = self.wanted(config);
        checks::joint_tracking(&config.limits, &wanted, &self.position)?;
        match reference {
            Some(reference) => {
                let error = reference.position - self.terms.base_from_tip.translation;
                checks::tracking(config.limits.tracking_error_m, &error)
            }
            None => Ok(()),
        }
    }

    /// Where the stiff loop of each joint wants it, if one acts \[rad\].
    fn wanted(&self, config: &Config<N>) -> [Option<f64>; N] {
        if let Activity::Breakaway { ramp, from_rad } = &self.activity {
            return core::array::from_fn(|i| (i != ramp.joint).then_some(from_rad[i]));
        }
        if let Some(reference) = self.joint_reference(config) {
            return core::array::from_fn(|i| Some(reference.position_rad[i]));
        }
        core::array::from_fn(|i| (config.roles[i] != Role::Active).then_some(self.held[i]))
    }

    /// Observes the external torque and force, lets the contact latch see them, and holds them against what is
    /// plausible and allowed. The force is known in either case.
    fn observe(
        &mut self,
        config: &Config<N>,
        task: Option<&Task<N>>,
        reference: Option<&Reference>,
        elapsed_s: f64,
    ) -> Result<Vector3<f64>, (Vector3<f64>, Fault)> {
        if self.activity.is_limp() || !self.drives_active {
            // Motors may brake: nothing that the model knows balances.
            self.observer.reset();
            self.plausibility.pause(&self.terms.momentum);
            return Ok(Vector3::zeros());
        }
        let mut drive = Vector::zeros();
        if elapsed_s > 0.0 {
            let velocity = &self.estimator.velocity_rad_per_s;
            let friction: Vector<N> =
                Vector::from_fn(|i, _| config.friction[i].torque_nm(velocity[i]));
            drive = self.torque + self.terms.kinetic_gradient - self.terms.gravity - friction;
            let bandwidth = config.latch.observer_rad_per_s;
            self.observer
                .update(&self.terms.momentum, &drive, elapsed_s, bandwidth);
        }
        let external = self.observer.external_torque_nm();
        let Some(task) = task else {
            return Ok(Vector3::zeros());
        };
        let force = task.inverse.tr_mul(&external);
        let mut reference_rad_per_s = Vector::zeros();
        if let Some(reference) = self.joint_reference(config) {
            reference_rad_per_s = reference.velocity_rad_per_s;
        }
        if let Some(reference) = reference {
            self.latch.follow(&reference.velocity, elapsed_s);
            let along = task.inverse * self.latch.direction();
            let velocity = task.inverse * reference.velocity;
            let doubt_n = (0..N)
                .map(|i| {
                    let friction = &config.friction[i];
                    abs(along[i]) * friction.doubt_nm(velocity[i], config.latch.friction_error)
                })
                .sum();
            self.latch.decide(&config.latch, &force, doubt_n, elapsed_s);
            reference_rad_per_s = velocity;
        }
        let evidence = Evidence {
            reference_rad_per_s: &reference_rad_per_s,
            drive_nm: &drive,
            force_n: &force,
            regular: task.least_singular_value_m >= SINGULAR_BELOW_M,
            elapsed_s,
        };
        match self.weigh(config, &evidence) {
            Ok(()) => Ok(force),
            Err(fault) => Err((force, fault)),
        }
    }

    /// The borders and zones of the workspace.
    fn keep_within(
        &self,
        config: &Config<N>,
        tip_velocity: &Vector3<f64>,
        force_n: &Vector3<f64>,
    ) -> Result<(), Fault> {
        let workspace = &config.workspace;
        if workspace.is_unbounded() || self.activity.is_limp() || !self.drives_active {
            return Ok(());
        }
        let tip = self.terms.base_from_tip.translation;
        match workspace.crossing(&tip, tip_velocity, force_n) {
            None => Ok(()),
            Some(crossing) => Err(match crossing {
                Crossing::Border { index, beyond_m } => Fault::Workspace {
                    value_m: beyond_m,
                    border: index,
                },
                Crossing::Speed {
                    value_m_per_s,
                    limit_m_per_s,
                } => Fault::ZoneSpeed {
                    value_m_per_s,
                    limit_m_per_s,
                },
                Crossing::Force { value_n, limit_n } => Fault::ZoneForce { value_n, limit_n },
            }),
        }
    }

    /// Torque of the activity, term by term.
    fn demand(
        &self,
        controller: &Controller<N>,
        task: Option<&Task<N>>,
        reference: Option<&Reference>,
        tip_force_n: Option<Vector3<f64>>,
    ) -> Torques<N> {
        let config = controller.config();
        match (&self.activity, task, reference) {
            (Activity::Track(_), Some(task), Some(reference)) => {
                let tip = self.terms.base_from_tip.translation;
                let now = Situation {
                    reference,
                    spring_limit_n: config.workspace.spring_limit_n(&tip),
                    velocity_rad_per_s: &self.estimator.velocity_rad_per_s,
                    gains: &self.gains.now(),
                    tip_force_n,
                    friction_share: self.latch.friction_share(),
                };
                let (law, terms) = (&config.law, &self.terms);
                let mut torques =
                    impedance(law, &config.friction, &config.roles, terms, task, &now);
                self.guard(config, &mut torques);
                torques
            }
            (activity, ..) if activity.has_own_loops() => self.moving(controller),
            _ => self.safe(controller),
        }
    }

    /// Gravity hold with joint damping, the safe action, or nothing.
    fn safe(&self, controller: &Controller<N>) -> Torques<N> {
        let config = controller.config();
        if self.activity.is_limp() {
            return Torques::zeros();
        }
        if self.is_stale(config) || !self.drives_active {
            // Neither the velocity nor the distance from a set-point is known any more; or nothing more is wanted
            // of drives that come back.
            return Torques {
                gravity: self.terms.gravity,
                ..Torques::zeros()
            };
        }
        if self.fault.is_some() {
            return self.stopping(controller);
        }
        let velocity = &self.estimator.velocity_rad_per_s;
        let mut torques = Torques {
            gravity: self.terms.gravity,
            damping: -config.hold_damping_nm_s_per_rad.component_mul(velocity),
            ..Torques::zeros()
        };
        self.guard(config, &mut torques);
        torques
    }

    /// Where every joint should be, in the modes that move joints.
    fn joint_reference(&self, config: &Config<N>) -> Option<JointReference<N>> {
        let time_s = self.activity_s(config);
        match &self.activity {
            Activity::Move {
                from_rad,
                to_rad,
                duration_s,
            } => {
                let (x, rate, rate_rate) = smooth_step(time_s / duration_s);
                let way = to_rad - from_rad;
                Some(JointReference {
                    position_rad: from_rad + way * x,
                    velocity_rad_per_s: way * (rate / duration_s),
                    acceleration_rad_per_s2: way * (rate_rate / (duration_s * duration_s)),
                })
            }
            Activity::Excite(series) => Some(series.at(time_s)),
            Activity::Breakaway { from_rad, .. } => Some(JointReference {
                position_rad: *from_rad,
                velocity_rad_per_s: Vector::zeros(),
                acceleration_rad_per_s2: Vector::zeros(),
            }),
            _ => None,
        }
    }

    /// The reference of the joints with the model and a stiff loop; a joint that is ramped has neither
    /// loop nor friction but the ramp.
    fn moving(&self, controller: &Controller<N>) -> Torques<N> {
        let config = controller.config();
        let Some(reference) = self.joint_reference(config) else {
            return self.safe(controller);
        };
        let gains = &config.move_gains;
        let position_error = reference.position_rad - self.position;
        let velocity = reference.velocity_rad_per_s;
        let velocity_error = velocity - self.estimator.velocity_rad_per_s;
        let mut torques = Torques {
            gravity: self.terms.gravity,
            coriolis: self.terms.coriolis_gravity - self.terms.gravity,
            friction: Vector::from_fn(|i, _| config.friction[i].torque_nm(velocity[i])),
            inertial: self.terms.mass_matrix * reference.acceleration_rad_per_s2,
            joint_pd: gains.stiffness_nm_per_rad.component_mul(&position_error)
                + gains.damping_nm_s_per_rad.component_mul(&velocity_error),
            ..Torques::zeros()
        };
        if let Activity::Breakaway { ramp, .. } = &self.activity {
            torques.friction[ramp.joint] = ramp.rate_nm_per_s * self.activity_s(config);
            torques.joint_pd[ramp.joint] = 0.0;
        }
        self.guard(config, &mut torques);
        torques
    }

    /// Leaves the breakaway mode for gravity hold once its joint has moved or the ramp has reached its
    /// limit.
    fn end_breakaway(&mut self, config: &Config<N>) {
        let Activity::Breakaway { ramp, from_rad } = self.activity else {
            return;
        };
        let moved = abs(self.position[ramp.joint] - from_rad[ramp.joint]);
        let torque = abs(ramp.rate_nm_per_s) * self.activity_s(config);
        if moved >= ramp.stop_rad || torque >= ramp.limit_nm {
            self.enter(Activity::GravityHold);
        }
    }

    /// Adds what runs beside every activity: the loops of held joints and the soft stops.
    fn guard(&self, config: &Config<N>, torques: &mut Torques<N>) {
        let velocity = &self.estimator.velocity_rad_per_s;
        if !self.activity.has_own_loops() {
            for (joint, role) in config.roles.iter().enumerate() {
                if let Role::Held {
                    stiffness_nm_per_rad,
                    damping_nm_s_per_rad,
                    ..
                } = role
                {
                    torques.joint_pd[joint] += stiffness_nm_per_rad
                        * (self.held[joint] - self.position[joint])
                        - damping_nm_s_per_rad * velocity[joint];
                    torques.damping[joint] = 0.0;
                }
            }
        }
        torques.soft_stop = checks::soft_stop(&config.limits, &self.position, velocity);
        if !config.workspace.is_unbounded() {
            let jacobian = self.terms.jacobian.fixed_rows::<3>(0);
            let tip = self.terms.base_from_tip.translation;
            let force = config.workspace.soft_force(&tip, &(jacobian * velocity));
            torques.soft_stop += jacobian.tr_mul(&force);
        }
    }

    /// Blends out, over `handover_s`, what the torque was more than it is now when the activity began.
    fn hand_over(&mut self, config: &Config<N>, torques: &mut Torques<N>) {
        if self.handover_pending {
            self.handover_pending = false;
            self.handover = self.torque - torques.total();
        }
        if self.fault.is_some() {
            self.handover = Vector::zeros();
        }
        let (blended, ..) = smooth_step(self.activity_s(config) / config.handover_s);
        torques.handover = self.handover * (1.0 - blended);
    }

    /// Gravity at the last trusted pose, within the torque limits; nothing where poses are not trusted.
    fn update_fallback(&mut self, controller: &Controller<N>) {
        if self.activity.is_limp() {
            self.fallback = Vector::zeros();
        } else if self.missing.iter().all(|missed| *missed == 0) {
            let limits = &controller.config().limits;
            let (gravity, _) =
                limiter::limit_torque(limits, controller.motors(), &self.terms.gravity);
            if crate::math::all_finite(&gravity) {
                self.fallback = gravity;
            }
        }
    }
}
