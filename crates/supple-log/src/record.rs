//! One step of the controller as the log holds it: `msg/ControllerState.msg`, without its header.
//!
//! A [`Record`] is made from an input and an output and gives the input back to the last bit. Faults
//! and refusals are a code with their numbers and words, so that a log of a later version with a fault
//! that this one does not know can still be read.

use crate::cdr::array;
use serde::{Deserialize, Serialize};
use supple_core::codes::{self, FaultCode, RequestCode};
use supple_core::controller::Mode;
use supple_core::impedance::Torques;
use supple_core::math::Vector3;
use supple_core::{Input, Output};

/// One step of the controller. Joints in order, vectors as x, y, z in base axes, SI units. Where a
/// `has_x` is false there was no x and its entries are zero.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(
    missing_docs,
    reason = "each field is that of Input or Output named alike"
)]
pub struct Record<const N: usize> {
    /// Number of this step since the controller started; a gap means that the log has lost records.
    pub step: u64,
    pub input_cycle: u64,
    #[serde(with = "array")]
    pub has_measured_position: [bool; N],
    #[serde(with = "array")]
    pub measured_position_rad: [f64; N],
    pub has_tip_force: bool,
    pub tip_force_n: [f64; 3],
    /// Kind of request, 0 for none; see [`Record::input`].
    pub request: u8,
    /// Kind of trajectory asked for, 0 for none.
    pub trajectory: u8,
    /// What the request carries.
    pub request_values: Vec<f64>,
    pub cycle: u64,
    /// See [`Record::mode`].
    pub mode: u8,
    pub mode_time_s: f64,
    #[serde(with = "array")]
    pub torque_nm: [f64; N],
    #[serde(with = "array")]
    pub fallback_torque_nm: [f64; N],
    pub torques: TorqueTerms<N>,
    pub torque_limited: bool,
    pub rate_limited: bool,
    #[serde(with = "array")]
    pub position_rad: [f64; N],
    #[serde(with = "array")]
    pub velocity_rad_per_s: [f64; N],
    pub tip_position_m: [f64; 3],
    pub tip_velocity_m_per_s: [f64; 3],
    pub has_reference: bool,
    pub reference_position_m: [f64; 3],
    pub reference_velocity_m_per_s: [f64; 3],
    pub reference_acceleration_m_per_s2: [f64; 3],
    pub stiffness_n_per_m: [f64; 3],
    pub damping_n_s_per_m: [f64; 3],
    #[serde(with = "array")]
    pub external_torque_nm: [f64; N],
    pub external_force_n: [f64; 3],
    pub force_against_n: f64,
    pub contact_threshold_n: f64,
    pub in_contact: bool,
    pub friction_share: f64,
    pub least_singular_value_m: f64,
    /// Kind of the latched fault, 0 for none.
    pub fault: u8,
    /// Its joint, counted from 0, or -1.
    pub fault_joint: i8,
    /// The value that broke the limit.
    pub fault_value: f64,
    /// The limit.
    pub fault_limit: f64,
    /// The fault in words.
    pub fault_text: String,
    /// Kind of refusal of this cycle's request, 0 for none.
    pub refusal: u8,
    /// The refusal in words.
    pub refusal_text: String,
    /// The motors carried out torques; logs from before this was known say that they did.
    pub drives_active: bool,
}

/// The terms of [`Torques`] \[N m\].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "each field is that of Torques named alike")]
pub struct TorqueTerms<const N: usize> {
    #[serde(with = "array")]
    pub gravity: [f64; N],
    #[serde(with = "array")]
    pub coriolis: [f64; N],
    #[serde(with = "array")]
    pub friction: [f64; N],
    #[serde(with = "array")]
    pub jacobian_rate: [f64; N],
    #[serde(with = "array")]
    pub inertial: [f64; N],
    #[serde(with = "array")]
    pub stiffness: [f64; N],
    #[serde(with = "array")]
    pub damping: [f64; N],
    #[serde(with = "array")]
    pub force: [f64; N],
    #[serde(with = "array")]
    pub nullspace: [f64; N],
    #[serde(with = "array")]
    pub joint_pd: [f64; N],
    #[serde(with = "array")]
    pub soft_stop: [f64; N],
    #[serde(with = "array")]
    pub ripple: [f64; N],
    #[serde(with = "array")]
    pub handover: [f64; N],
}

impl<const N: usize> Record<N> {
    /// Of one step. `step` is its number since the controller started.
    pub fn new(step: u64, input: &Input<N>, output: &Output<N>) -> Self {
        let request = RequestCode::new(input.request.as_ref());
        let fault = FaultCode::new(output.fault.as_ref());
        let vector = |v: Vector3<f64>| -> [f64; 3] { v.into() };
        let reference = |of: fn(&supple_core::Reference) -> Vector3<f64>| {
            output
                .reference
                .as_ref()
                .map_or([0.0; 3], |r| vector(of(r)))
        };
        Record {
            step,
            input_cycle: input.cycle,
            has_measured_position: input.position_rad.map(|position| position.is_some()),
            measured_position_rad: input.position_rad.map(Option::unwrap_or_default),
            has_tip_force: input.tip_force_n.is_some(),
            tip_force_n: input.tip_force_n.map_or([0.0; 3], vector),
            request: request.kind,
            trajectory: request.trajectory,
            request_values: request.values().to_vec(),
            cycle: output.cycle,
            mode: output.mode as u8,
            mode_time_s: output.mode_time_s,
            torque_nm: output.torque_nm.into(),
            fallback_torque_nm: output.fallback_torque_nm.into(),
            torques: TorqueTerms::new(&output.torques),
            torque_limited: output.torque_limited,
            rate_limited: output.rate_limited,
            position_rad: output.position_rad.into(),
            velocity_rad_per_s: output.velocity_rad_per_s.into(),
            tip_position_m: vector(output.tip_position_m),
            tip_velocity_m_per_s: vector(output.tip_velocity_m_per_s),
            has_reference: output.reference.is_some(),
            reference_position_m: reference(|r| r.position),
            reference_velocity_m_per_s: reference(|r| r.velocity),
            reference_acceleration_m_per_s2: reference(|r| r.acceleration),
            stiffness_n_per_m: vector(output.gains.stiffness_n_per_m),
            damping_n_s_per_m: vector(output.gains.damping_n_s_per_m),
            external_torque_nm: output.external_torque_nm.into(),
            external_force_n: vector(output.external_force_n),
            force_against_n: output.force_against_n,
            contact_threshold_n: output.contact_threshold_n,
            in_contact: output.in_contact,
            friction_share: output.friction_share,
            least_singular_value_m: output.least_singular_value_m,
            fault: fault.kind,
            fault_joint: fault.joint,
            fault_value: fault.value,
            fault_limit: fault.limit,
            fault_text: output.fault.map_or_else(String::new, |f| f.to_string()),
            refusal: codes::refusal(output.refusal.as_ref()),
            refusal_text: output.refusal.map_or_else(String::new, |r| r.to_string()),
            drives_active: input.drives_active,
        }
    }

    /// What the controller was given, to the last bit.
    ///
    /// # Errors
    /// A request that this version does not know, in words.
    pub fn input(&self) -> Result<Input<N>, String> {
        let position =
            |i: usize| self.has_measured_position[i].then_some(self.measured_position_rad[i]);
        let request = RequestCode::from_parts(self.request, self.trajectory, &self.request_values)
            .and_then(|code| code.request())
            .map_err(|error| error.to_string())?;
        Ok(Input {
            cycle: self.input_cycle,
            position_rad: core::array::from_fn(position),
            tip_force_n: self.has_tip_force.then(|| Vector3::from(self.tip_force_n)),
            drives_active: self.drives_active,
            request,
        })
    }

    /// Mode in force; `None` if this version does not know it.
    pub fn mode(&self) -> Option<Mode> {
        codes::mode(self.mode)
    }
}

impl<const N: usize> TorqueTerms<N> {
    fn new(torques: &Torques<N>) -> Self {
        TorqueTerms {
            gravity: torques.gravity.into(),
            coriolis: torques.coriolis.into(),
            friction: torques.friction.into(),
            jacobian_rate: torques.jacobian_rate.into(),
            inertial: torques.inertial.into(),
            stiffness: torques.stiffness.into(),
            damping: torques.damping.into(),
            force: torques.force.into(),
            nullspace: torques.nullspace.into(),
            joint_pd: torques.joint_pd.into(),
            soft_stop: torques.soft_stop.into(),
            ripple: torques.ripple.into(),
            handover: torques.handover.into(),
        }
    }
}
