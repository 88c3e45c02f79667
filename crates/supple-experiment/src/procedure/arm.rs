//! Interface between the procedure and an arm: the arm loads models, performs motions and logs them.
//!
//! [`super::InProcessArm`] is the simulated arm in this process; the program `supple` has one for systems of processes.

use super::error::ProcedureError;
use super::options::{DRIVES_REMEDY, HOLD_REMEDY};
use crate::request_sequence::{Recording, Step};
use supple_core::Vector;
use supple_model::{Description, MotorConstants};

/// An arm with its controller.
pub trait MotionArm<const N: usize> {
    /// Error of the arm or of its processes.
    type Error: From<ProcedureError>;

    /// Runs the controller with this model from now on. The drives are idle meanwhile, and the motors brake or the arm is
    /// laid down; afterwards the drives are active, and the arm is in gravity hold.
    ///
    /// # Errors
    /// If the controller cannot be started with this model, or the drives do not become active.
    fn load(&mut self, model: &Description) -> Result<(), Self::Error>;

    /// Returns the reason of the controller if this error is a refused request.
    fn refusal(error: &Self::Error) -> Option<&str>;

    /// Returns the present joint angles \[rad\].
    ///
    /// # Errors
    /// If the arm sends no state.
    fn position_rad(&mut self) -> Result<Vector<N>, Self::Error>;

    /// Performs the steps in order and writes `<name>.mcap`, which is complete even if a fault stops the motion. After a fault
    /// the arm stays in its safe action.
    ///
    /// # Errors
    /// A refused request; a process or a log that is lost.
    fn perform(&mut self, name: &str, steps: &[Step<N>]) -> Result<PerformedMotion, Self::Error>;

    /// Clears the fault of a stopped motion; afterwards the arm is held as after [`MotionArm::load`].
    ///
    /// # Errors
    /// If the fault persists.
    fn recover(&mut self) -> Result<(), Self::Error>;

    /// Returns the description with the parameters that the controller has learned since the model was loaded; `None` if it has
    /// learned none.
    ///
    /// # Errors
    /// If what was learned cannot be read.
    fn learned(&mut self) -> Result<Option<Description>, Self::Error>;

    /// Ends the torque of the arm and gives it a weight of this mass \[kg\] at its tip: a simulated arm by itself, any other by
    /// `attach`, which returns whether the weight is there. A model must be loaded afterwards.
    ///
    /// # Errors
    /// If the arm cannot be stopped, or `attach` returns that there is no weight.
    fn take_weight(
        &mut self,
        weight_kg: f64,
        attach: &mut dyn FnMut() -> bool,
    ) -> Result<(), Self::Error>;

    /// Returns what the registers of the arm's motors state, once a model has been loaded; empty for motors without such registers.
    fn motors(&mut self) -> Vec<MotorConstants> {
        Vec::new()
    }

    /// Runs `work` while the arm stays in its mode.
    ///
    /// # Errors
    /// If the system is lost meanwhile.
    fn meanwhile<T: Send>(&mut self, work: impl FnOnce() -> T + Send) -> Result<T, Self::Error>;
}

/// Motion that an arm has performed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PerformedMotion {
    /// Data of each recorded step, in order; a fault may have ended the last step early.
    pub motions: Vec<Motion>,
    /// Time in modes that move joints \[s\].
    pub moved_s: f64,
    /// The fault that ended the motion.
    pub stopped: Option<Stopped>,
}

/// Recorded data of one step.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Time, angles and commanded torques while the step's mode was in force.
    pub recording: Recording,
    /// Distance of the tip from its reference, one value for each cycle that has a reference \[m\]: of the true tip in
    /// the simulated arm of this process, otherwise by the encoders.
    pub tip_error_m: Vec<f64>,
    /// Number of contacts that the controller reported.
    pub contacts: usize,
}

/// A fault that stopped a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Stopped {
    /// Index of the step.
    pub step: usize,
    /// The fault in words.
    pub fault: String,
    /// The cause of the fault.
    pub cause: StopCause,
}

/// Cause of a stop of a motion.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum StopCause {
    /// A fault that contact causes: a collision, or a joint that is held back.
    Contact,
    /// The drives became inactive: an operator, the safety module, or torques that came too late.
    Drives,
    /// Any other fault.
    Other,
}

impl StopCause {
    /// Returns the cause for a fault of the controller.
    pub fn of_fault(by_contact: bool) -> StopCause {
        match by_contact {
            true => StopCause::Contact,
            false => StopCause::Other,
        }
    }

    /// Returns the remedy, for callers that have no special remedy for contact.
    pub(crate) fn remedy(self) -> &'static str {
        match self {
            StopCause::Drives => DRIVES_REMEDY,
            StopCause::Contact | StopCause::Other => HOLD_REMEDY,
        }
    }
}

impl Motion {
    /// Creates a collector for the data of a step.
    pub fn collector<const N: usize>() -> Collector<N> {
        Collector::default()
    }
}

/// Collects the cycles of a step.
#[derive(Clone, Debug, Default)]
pub struct Collector<const N: usize> {
    rows: Vec<(f64, Vector<N>, Vector<N>)>,
    tip_error_m: Vec<f64>,
    contacts: usize,
    in_contact: bool,
}

impl<const N: usize> Collector<N> {
    /// Adds a cycle: time \[s\], angles \[rad\], commanded torques without ripple compensation \[N m\], distance of the tip
    /// from its reference \[m\].
    pub fn add(
        &mut self,
        time_s: f64,
        position_rad: Vector<N>,
        torque_nm: Vector<N>,
        tip_error_m: Option<f64>,
        in_contact: bool,
    ) {
        self.rows.push((time_s, position_rad, torque_nm));
        self.tip_error_m.extend(tip_error_m);
        self.contacts += usize::from(in_contact && !self.in_contact);
        self.in_contact = in_contact;
    }

    /// Returns the data of the step.
    pub fn finish(self) -> Motion {
        Motion {
            recording: Recording::of(&self.rows),
            tip_error_m: self.tip_error_m,
            contacts: self.contacts,
        }
    }
}
