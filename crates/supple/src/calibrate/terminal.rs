//! The person at the terminal: progress, and the question before the arm moves.

use std::path::Path;
use supple_cli::console::{confirms, print_status};
use supple_experiment::procedure::{Operator, Sweep};

/// Standard error for progress, standard input for the answer.
pub struct Terminal {
    /// Whether the swept space is confirmed beforehand.
    pub yes: bool,
    /// No progress.
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
        confirms(&format!(
            "is the space of {} free, and the emergency stop within reach?",
            drawing.display()
        ))
    }
}
