//! Interaction with the operator on the terminal: progress, and the question before the arm moves.

use std::path::Path;
use supple_cli::console::{confirm, print_status};
use supple_experiment::procedure::{Operator, Sweep};

/// Operator on the terminal: writes progress to standard error and reads the answer from standard input.
pub struct Terminal {
    /// Whether the swept space has been confirmed on the command line.
    pub yes: bool,
    /// Whether to print no progress.
    pub quiet: bool,
}

impl Operator for Terminal {
    fn progress(&mut self, text: &str) {
        if !self.quiet {
            print_status(text);
        }
    }

    fn confirms(&mut self, _: &Sweep, drawing: &Path) -> bool {
        if self.yes {
            return true;
        }
        confirm(&format!(
            "is the space of {} free, and the emergency stop within reach?",
            drawing.display()
        ))
    }

    fn attaches_weight(&mut self, weight_kg: f64) -> bool {
        confirm(&format!(
            "the arm is without torque: is the weight of {weight_kg} kg attached to its last link, as firmly as a tool?"
        ))
    }
}
