//! The person at the terminal: progress, and the question before the arm moves.

use std::io::{BufRead, IsTerminal};
use std::path::Path;
use supple_cli::console::{print_status, print_status_part};
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
        if !std::io::stdin().is_terminal() {
            return false;
        }
        print_status_part(format!(
            "is the space of {} free, and the emergency stop within reach? [y/N] ",
            drawing.display()
        ));
        let mut answer = String::new();
        let read = std::io::stdin().lock().read_line(&mut answer);
        read.is_ok() && matches!(answer.trim(), "y" | "Y" | "yes")
    }
}
