//! What goes into a step and what comes out.

use super::fault::{Fault, SafeAction};
use super::mode::{Mode, Refusal, Request};
use crate::config::Gains;
use crate::impedance::Torques;
use crate::math::{Vector, Vector3};
use crate::trajectory::Reference;

/// Measurements and wishes of one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input<const N: usize> {
    /// Number of the cycle in which the state was measured; one more each period.
    pub cycle: u64,
    /// Joint angles \[rad\]; `None` where the encoder did not answer.
    pub position_rad: [Option<f64>; N],
    /// Measured force on the tip, base axes \[N\]; used only with a chosen apparent inertia.
    pub tip_force_n: Option<Vector3<f64>>,
    /// The motors carry out the torques that they are sent. Where they do not, the controller holds gravity at the
    /// pose that the arm is in, ready for their return.
    pub drives_active: bool,
    /// What is asked for, if anything.
    pub request: Option<Request<N>>,
}

/// Torques of one cycle and everything that led to them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output<const N: usize> {
    /// Cycle of the state that this answers.
    pub cycle: u64,
    /// Joint torques to send \[N m\].
    pub torque_nm: Vector<N>,
    /// Joint torques to send if the next answer does not come: gravity at the last trusted pose, zero
    /// in idle \[N m\].
    pub fallback_torque_nm: Vector<N>,
    /// Mode in force.
    pub mode: Mode,
    /// Time since the mode was entered \[s\].
    pub mode_time_s: f64,
    /// No torque is wanted: idle, or a fault in which there must be none.
    pub limp: bool,
    /// Latched fault.
    pub fault: Option<Fault>,
    /// What is done about it now; braking, where the arm did not come to rest otherwise.
    pub safe_action: Option<SafeAction>,
    /// Why this cycle's request was refused.
    pub refusal: Option<Refusal>,
    /// Terms whose sum was limited to `torque_nm`.
    pub torques: Torques<N>,
    /// A joint or motor torque limit cut the sum.
    pub torque_limited: bool,
    /// The torque-rate limit cut the sum.
    pub rate_limited: bool,
    /// Angles used: measured, or coasted over a lost reply \[rad\].
    pub position_rad: Vector<N>,
    /// Estimated joint velocities \[rad/s\].
    pub velocity_rad_per_s: Vector<N>,
    /// Tip, base axes \[m\].
    pub tip_position_m: Vector3<f64>,
    /// Tip, base axes \[m/s\].
    pub tip_velocity_m_per_s: Vector3<f64>,
    /// Where the tip should be; `None` where no tip trajectory runs.
    pub reference: Option<Reference>,
    /// Gains in force.
    pub gains: Gains,
    /// Observed external torque \[N m\].
    pub external_torque_nm: Vector<N>,
    /// Observed force on the tip, base axes \[N\].
    pub external_force_n: Vector3<f64>,
    /// Observed force against the reference's motion \[N\].
    pub force_against_n: f64,
    /// Force against the reference's motion that latches contact now \[N\].
    pub contact_threshold_n: f64,
    /// Contact is latched.
    pub in_contact: bool,
    /// Share of the friction feed-forward applied, 0 to 1.
    pub friction_share: f64,
    /// Least singular value of the active joints' linear Jacobian \[m\].
    pub least_singular_value_m: f64,
}
