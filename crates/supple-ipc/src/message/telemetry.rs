//! Everything about one cycle of the controller: what a log, a status line or a person may want to know.

use super::{ArmState, MAX_DOF, OperatorRequest, Text, widened};
use iceoryx2::prelude::ZeroCopySend;
use supple_core::codes::{self, FaultCode, RequestCode, VALUES};
use supple_core::controller::Mode;
use supple_core::impedance::Torques;
use supple_core::math::Vector3;
use supple_core::{Input, Output, Reference};

/// One cycle of the controller, input, output and timing.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.Telemetry.v3")]
pub struct Telemetry {
    /// Number of the step since the controller started; a reader that sees a gap has lost records.
    pub step: u64,
    /// What the controller was given, with the report of the plant.
    pub state: ArmState,
    /// Arm states dropped since the start: of another writer than this system's plant, or of another arm.
    pub states_dropped: u64,
    /// The request that it heard in this cycle; of kind 0 where there was none.
    pub request: OperatorRequest,
    /// Time since the mode was entered \[s\].
    pub mode_time_s: f64,
    /// Joint torques sent \[N m\].
    pub torque_nm: [f64; MAX_DOF],
    /// Joint torques if the next answer does not come \[N m\].
    pub fallback_torque_nm: [f64; MAX_DOF],
    /// Terms whose sum was limited to `torque_nm`.
    pub terms: TermTorques,
    /// Angles used \[rad\].
    pub position_rad: [f64; MAX_DOF],
    /// Estimated joint velocities \[rad/s\].
    pub velocity_rad_per_s: [f64; MAX_DOF],
    /// Observed external torque \[N m\].
    pub external_torque_nm: [f64; MAX_DOF],
    /// Tip, base axes \[m\].
    pub tip_position_m: [f64; 3],
    /// Tip, base axes \[m/s\].
    pub tip_velocity_m_per_s: [f64; 3],
    /// Reference, base axes \[m\]; zero where there is none.
    pub reference_position_m: [f64; 3],
    /// Reference, base axes \[m/s\].
    pub reference_velocity_m_per_s: [f64; 3],
    /// Reference, base axes \[m/s^2\].
    pub reference_acceleration_m_per_s2: [f64; 3],
    /// `K` in force \[N/m\].
    pub stiffness_n_per_m: [f64; 3],
    /// `B` in force \[N s/m\].
    pub damping_n_s_per_m: [f64; 3],
    /// Observed force on the tip, base axes \[N\].
    pub external_force_n: [f64; 3],
    /// Observed force against the reference's motion \[N\].
    pub force_against_n: f64,
    /// Force against the reference's motion that latches contact now \[N\].
    pub contact_threshold_n: f64,
    /// Share of the friction feed-forward applied, 0 to 1.
    pub friction_share: f64,
    /// Least singular value of the active Jacobian \[m\].
    pub least_singular_value_m: f64,
    /// What broke the limit, of the latched fault.
    pub fault_value: f64,
    /// The limit that it broke.
    pub fault_limit: f64,
    /// Times of this cycle.
    pub timing: CycleTiming,
    /// The latched fault in words.
    pub fault_text: Text,
    /// Why the request was refused, in words.
    pub refusal_text: Text,
    /// Mode in force, a number of [`codes::MODES`].
    pub mode: u8,
    /// Kind of the latched fault, see [`FaultCode`]; 0 for none.
    pub fault: u8,
    /// Joint of the fault, or -1.
    pub fault_joint: i8,
    /// Kind of refusal, see [`codes::refusal`]; 0 for none.
    pub refusal: u8,
    /// 1 where a reference is there.
    pub has_reference: u8,
    /// 1 where contact is latched.
    pub in_contact: u8,
    /// 1 where a joint or motor torque limit cut the sum.
    pub torque_limited: u8,
    /// 1 where the torque-rate limit cut the sum.
    pub rate_limited: u8,
}

/// The terms of [`Torques`], N m.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.TermTorques.v1")]
#[expect(missing_docs, reason = "each field is that of Torques named alike")]
pub struct TermTorques {
    pub gravity: [f64; MAX_DOF],
    pub coriolis: [f64; MAX_DOF],
    pub friction: [f64; MAX_DOF],
    pub jacobian_rate: [f64; MAX_DOF],
    pub inertial: [f64; MAX_DOF],
    pub stiffness: [f64; MAX_DOF],
    pub damping: [f64; MAX_DOF],
    pub force: [f64; MAX_DOF],
    pub nullspace: [f64; MAX_DOF],
    pub joint_pd: [f64; MAX_DOF],
    pub soft_stop: [f64; MAX_DOF],
    pub ripple: [f64; MAX_DOF],
    pub handover: [f64; MAX_DOF],
}

/// Times of one cycle of the controller, by the monotonic clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.CycleTiming.v1")]
pub struct CycleTiming {
    /// Since the previous step began \[ns\]; 0 in the first.
    pub period_ns: u64,
    /// From the measurement to the beginning of the step \[ns\]; 0 in virtual time.
    pub latency_ns: u64,
    /// From there until its torques are known, with a look for requests \[ns\].
    pub step_ns: u64,
}

impl TermTorques {
    fn new<const N: usize>(torques: &Torques<N>) -> TermTorques {
        let wide = |torque: &supple_core::Vector<N>| widened::<N>(torque.as_slice());
        TermTorques {
            gravity: wide(&torques.gravity),
            coriolis: wide(&torques.coriolis),
            friction: wide(&torques.friction),
            jacobian_rate: wide(&torques.jacobian_rate),
            inertial: wide(&torques.inertial),
            stiffness: wide(&torques.stiffness),
            damping: wide(&torques.damping),
            force: wide(&torques.force),
            nullspace: wide(&torques.nullspace),
            joint_pd: wide(&torques.joint_pd),
            soft_stop: wide(&torques.soft_stop),
            ripple: wide(&torques.ripple),
            handover: wide(&torques.handover),
        }
    }
}

impl Telemetry {
    /// Of one step.
    pub fn new<const N: usize>(
        step: u64,
        state: &ArmState,
        input: &Input<N>,
        output: &Output<N>,
        timing: CycleTiming,
    ) -> Telemetry {
        let vector = |v: &Vector3<f64>| -> [f64; 3] { (*v).into() };
        let wide = |v: &supple_core::Vector<N>| widened::<N>(v.as_slice());
        let reference = output
            .reference
            .unwrap_or_else(|| Reference::at_rest(Vector3::zeros()));
        let fault = FaultCode::new(output.fault.as_ref());
        let request = RequestCode::new(input.request.as_ref());
        Telemetry {
            step,
            state: *state,
            states_dropped: 0,
            request: OperatorRequest {
                operator: 0,
                sequence: 0,
                at_cycle: 0,
                values: request.values,
                dof: N as u8,
                kind: request.kind,
                trajectory: request.trajectory,
                count: request.count,
                has_at_cycle: 0,
                reserved: [0; 3],
            },
            mode_time_s: output.mode_time_s,
            torque_nm: wide(&output.torque_nm),
            fallback_torque_nm: wide(&output.fallback_torque_nm),
            terms: TermTorques::new(&output.torques),
            position_rad: wide(&output.position_rad),
            velocity_rad_per_s: wide(&output.velocity_rad_per_s),
            external_torque_nm: wide(&output.external_torque_nm),
            tip_position_m: vector(&output.tip_position_m),
            tip_velocity_m_per_s: vector(&output.tip_velocity_m_per_s),
            reference_position_m: vector(&reference.position),
            reference_velocity_m_per_s: vector(&reference.velocity),
            reference_acceleration_m_per_s2: vector(&reference.acceleration),
            stiffness_n_per_m: vector(&output.gains.stiffness_n_per_m),
            damping_n_s_per_m: vector(&output.gains.damping_n_s_per_m),
            external_force_n: vector(&output.external_force_n),
            force_against_n: output.force_against_n,
            contact_threshold_n: output.contact_threshold_n,
            friction_share: output.friction_share,
            least_singular_value_m: output.least_singular_value_m,
            fault_value: fault.value,
            fault_limit: fault.limit,
            timing,
            fault_text: output.fault.map_or(Text::EMPTY, |fault| Text::of(&fault)),
            refusal_text: output
                .refusal
                .map_or(Text::EMPTY, |refusal| Text::of(&refusal)),
            mode: output.mode as u8,
            fault: fault.kind,
            fault_joint: fault.joint,
            refusal: codes::refusal(output.refusal.as_ref()),
            has_reference: u8::from(output.reference.is_some()),
            in_contact: u8::from(output.in_contact),
            torque_limited: u8::from(output.torque_limited),
            rate_limited: u8::from(output.rate_limited),
        }
    }

    /// Mode in force, if this version knows it.
    pub fn mode(&self) -> Option<Mode> {
        codes::mode(self.mode)
    }

    /// Distance of the tip from its reference \[m\]; `None` where there is no reference.
    pub fn tip_error_m(&self) -> Option<f64> {
        let error = Vector3::from(self.reference_position_m) - Vector3::from(self.tip_position_m);
        (self.has_reference != 0).then(|| error.norm())
    }

    /// The request of this cycle as numbers.
    pub fn request(&self) -> RequestCode {
        let request = &self.request;
        RequestCode {
            kind: request.kind,
            trajectory: request.trajectory,
            count: request.count.min(VALUES as u8),
            values: request.values,
        }
    }
}
