//! One control cycle.

use super::activity::Activity;
use super::fault::{Fault, SafeAction};
use super::mode::{Refusal, Request};
use super::output::{Input, Orientation, Output};
use super::state::State;
use super::{Controller, checks, limiter};
use crate::dynamics::terms;
use crate::law::impedance::{Task, Torques};
use crate::math::Vector;
use crate::model::ripple::compensation_nm;

/// Computes the torques of one cycle from its measurements. Allocates nothing, locks nothing, logs
/// nothing, reads no clock.
///
/// In order: receives and checks the state; evaluates the model; handles the request; checks the
/// motion limits; estimates the external torque; computes the torque terms and checks that all are
/// finite; applies the torque limit and the rate limit; checks once more that the result is finite.
pub fn step<const N: usize>(
    controller: &Controller<N>,
    state: &mut State<N>,
    input: &Input<N>,
) -> Output<N> {
    let config = controller.config();
    let (elapsed_s, state_valid) = match state.receive(controller, input) {
        Ok(elapsed_s) => (elapsed_s, true),
        Err(fault) => {
            state.latch_fault(controller, fault);
            (0.0, false)
        }
    };
    let velocity = state.estimator.velocity_rad_per_s;
    terms(&config.arm, &state.position, &velocity, &mut state.terms);
    if controller.has_load_friction() {
        state.update_friction(config);
    }
    let task = Task::new(&state.terms, &config.roles);
    if task.is_none() {
        state.latch_fault(controller, Fault::MassMatrix);
    }
    state.update_drives(input.drives_active);
    state.update_position_limits(config, elapsed_s);
    let refusal = input.request.as_ref().and_then(|request| match request {
        // A fault is not cleared in a cycle that would raise it again.
        Request::Reset if !state_valid || task.is_none() => {
            Some(Refusal::Mode { mode: state.mode() })
        }
        _ => state.request(controller, task.as_ref(), request).err(),
    });
    state.gains.elapsed_s += elapsed_s;
    state.joint_gains.elapsed_s += elapsed_s;
    state.advance_pose_gains(elapsed_s);
    state.update_held_setpoints(controller, elapsed_s);
    if let Err(fault) = state.end_breakaway(config) {
        state.latch_fault(controller, fault);
    }

    let tip_position = state.terms.base_from_tip.translation;
    let tip_velocity = state.terms.jacobian.fixed_rows::<3>(0) * velocity;
    let mut reference = state.reference(config);
    if let Err(fault) = state.check(config, &tip_velocity, reference.as_ref()) {
        state.latch_fault(controller, fault);
        reference = None;
    }
    let pose = state
        .pose_cycle(config, reference.as_ref())
        .unwrap_or_else(|fault| {
            state.latch_fault(controller, fault);
            reference = None;
            None
        });
    let learned = state.learned_at_pose(config, reference.as_ref(), elapsed_s);
    let observed = state.observe(
        controller,
        task.as_ref(),
        reference.as_ref(),
        pose.as_ref(),
        learned.as_ref(),
        elapsed_s,
    );
    let external_force = match observed {
        Ok(force_n) => force_n,
        Err((force_n, fault)) => {
            state.latch_fault(controller, fault);
            reference = None;
            force_n
        }
    };
    if let Err(fault) = state.check_workspace(config, task.as_ref(), &tip_velocity, &external_force)
    {
        state.latch_fault(controller, fault);
        reference = None;
    }
    state.supervise_stop(controller, &tip_velocity, elapsed_s);
    if config.law.measured_stribeck {
        state.update_stribeck_velocity(elapsed_s);
    }
    if controller.has_presliding() {
        let tracking = task.as_ref().zip(reference.as_ref());
        state.update_dry_direction(controller, tracking, pose.is_some(), elapsed_s);
    }

    let mut torques = state.activity_torques(
        controller,
        task.as_ref(),
        reference.as_ref(),
        pose.as_ref(),
        input.tip_force_n,
    );
    if !(state.activity.is_torque_off() || state.fault.is_some() || state.is_stale(config)) {
        state.add_joint_loops_and_stops(controller, &mut torques);
        if controller.has_ripple() {
            // The torque changes little within a cycle, so the last torque is accurate enough.
            let motor_nm = match controller.ripple_scales() {
                true => config.joint_from_motor.tr_mul(&state.torque),
                false => Vector::zeros(),
            };
            let (tables, to_motors) = (&config.ripple, controller.motor_from_joint());
            torques.ripple = compensation_nm(tables, to_motors, &state.position, &motor_nm);
        }
        if let Some(learned) = &learned {
            torques.learned = state.learned_torques(
                controller,
                task.as_ref(),
                reference.as_ref(),
                pose.as_ref(),
                learned,
                &torques,
            );
        }
    }
    state.blend_torque(controller, &mut torques);
    let total = checks::total(&torques).unwrap_or_else(|fault| {
        reference = None;
        state.replace_torques(controller, fault, &mut torques)
    });
    if !state.drives_active {
        // The drives are idle: reset the rate limiter, so that gravity compensation is complete
        // when they become active.
        state.torque = limiter::limit_torque(&config.limits, controller.motors(), &total).0;
    }
    let limited = limiter::limit(
        &config.limits,
        controller.motors(),
        &state.torque,
        &total,
        controller.torque_step_nm(state.fault.is_some()),
    );
    if !limited.finite {
        state.latch_fault(controller, Fault::TorqueNotFinite { term: "total" });
    }
    state.torque = limited.torque_nm;
    state.ripple = torques.ripple;
    state.update_fallback(controller);

    Output {
        cycle: input.cycle,
        torque_nm: limited.torque_nm,
        fallback_torque_nm: state.fallback,
        mode: state.mode(),
        mode_time_s: state.activity_s(config),
        torque_off: state.activity.is_torque_off(),
        fault: state.fault,
        safe_action: state.safe_action(),
        refusal,
        torque_limited: limited.torque_limited,
        rate_limited: limited.rate_limited,
        position_rad: state.position,
        velocity_rad_per_s: velocity,
        tip_position_m: tip_position,
        tip_velocity_m_per_s: tip_velocity,
        reference,
        orientation: reference.and(pose.as_ref().map(Orientation::new)),
        gains: state.tip_gains(),
        joint_gains: state.joint_gains.current(),
        rotational_gains: state.rotational_gains(config),
        learned: state.learned.current.parameters,
        learning: state.learned.on,
        external_torque_nm: state.observer.external_torque_nm(),
        external_force_n: external_force,
        force_against_n: state.latch.force_against_n(),
        contact_threshold_n: state.latch.threshold_n(),
        in_contact: state.latch.in_contact(),
        friction_share: state.latch.friction_share(),
        min_singular_value_m: task.map_or(0.0, |task| task.min_singular_value_m),
        // Last, so that they are copied once.
        torques,
    }
}

impl<const N: usize> State<N> {
    /// Latches the fault of torques that are not finite, replaces them by the torques of the safe action, and returns their sum.
    #[cold]
    #[inline(never)]
    fn replace_torques(
        &mut self,
        controller: &Controller<N>,
        fault: Fault,
        torques: &mut Torques<N>,
    ) -> Vector<N> {
        self.latch_fault(controller, fault);
        *torques = self.safe_torques(controller);
        checks::total(torques).unwrap_or_else(|_| {
            // Not even the safe action can be computed.
            self.activity = Activity::Fault(SafeAction::Brake);
            *torques = Torques::zeros();
            Vector::zeros()
        })
    }
}
