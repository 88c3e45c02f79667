//! Options of a calibration, its files, and the operator who is asked.

use super::progress::StepName;
use super::sweep::Sweep;
use std::path::PathBuf;

/// Time of learning before the second error of the sinusoid is measured \[s\].
pub const LEARNING_S: f64 = 24.0;

/// Remedy for a fault in the first gravity hold.
pub(crate) const HOLD_REMEDY: &str = "check signs and units of the torques, the order of joints, the mounting of the base and the masses of the \
     description: the arm must stay where it is in gravity hold";

/// Remedy for drives that became inactive during a motion.
pub(crate) const DRIVES_REMEDY: &str = "see what their process has written before this: an operator or the safety module made them idle, \
     or torques came too late (use real-time priority and a machine that does nothing else)";

/// Folder of the logs, within the folder of the results.
pub const LOGS: &str = "logs";

/// Folder of the model of the first pass, within the folder of the results.
pub const FIRST_MODEL: &str = "first";

/// Folder of the identified model with the parameters learned in the sinusoid, within the folder of the results.
pub const LEARNED_MODEL: &str = "learned";

/// Drawing of the swept space.
pub const DRAWING: &str = "sweep.svg";

/// Options of the procedure.
#[derive(Clone, Debug, PartialEq)]
pub struct ProcedureOptions {
    /// Existing folder of the results; logs are in its folder [`LOGS`].
    pub out: PathBuf,
    /// Seed of the designs.
    pub seed: u64,
    /// Number of candidates of the design.
    pub candidates: usize,
    /// Duration of the warm-up \[s\].
    pub warm_up_s: f64,
    /// Whether an arm that falls without torque also runs at constant speeds, for torque ripple; others always do.
    pub ripple_runs: bool,
    /// Mass of a weight with which the arm moves at the end, to fix the torque scales \[kg\]; `None` leaves that step out.
    pub weight_kg: Option<f64>,
    /// Whether to continue after the last finished step.
    pub resume: bool,
    /// The last step to perform; `None` for all.
    pub until: Option<StepName>,
}

impl ProcedureOptions {
    /// Creates options with seed 0, 600 candidates, and a warm-up of 7 s.
    pub fn new(out: PathBuf) -> ProcedureOptions {
        ProcedureOptions {
            out,
            seed: 0,
            candidates: 600,
            warm_up_s: 7.0,
            ripple_runs: false,
            weight_kg: None,
            resume: false,
            until: None,
        }
    }
}

/// The person at the arm.
pub trait Operator {
    /// Receives one line of text about the present step.
    fn progress(&mut self, text: &str);

    /// Asks whether the arm may sweep this space, which the file `drawing` depicts.
    fn confirms(&mut self, sweep: &Sweep, drawing: &std::path::Path) -> bool;

    /// Asks for a weight of this mass \[kg\] on the last link of the arm, which is without torque; returns whether it is there.
    fn attaches_weight(&mut self, weight_kg: f64) -> bool;
}
