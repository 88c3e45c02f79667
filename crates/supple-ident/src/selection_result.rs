//! Result of a selection between sets of options, with the held-out error of each.

use crate::options::Options;
use std::fmt;

/// A named set of options.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Name in the table.
    pub name: String,
    /// The options.
    pub options: Options,
}

/// Result of one candidate.
#[derive(Clone, Debug, PartialEq)]
pub struct CandidateResult {
    /// The candidate.
    pub candidate: Candidate,
    /// Number of columns of its regressor.
    pub columns: usize,
    /// `|tau - tau_hat| / |tau|` of each part, from a fit to the others; empty if the fit failed.
    pub parts: Vec<f64>,
    /// Error over all parts; infinite if the fit failed.
    pub total: f64,
}

/// Results of all candidates, and the selected one.
#[derive(Clone, Debug, PartialEq)]
pub struct SelectionTable {
    /// Results in the order of the candidates.
    pub candidates: Vec<CandidateResult>,
    /// Index of the chosen candidate.
    pub chosen: usize,
}

impl SelectionTable {
    /// Options of the chosen candidate.
    pub fn options(&self) -> &Options {
        &self.candidates[self.chosen].candidate.options
    }
}

impl fmt::Display for SelectionTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "  columns  held-out error  candidate")?;
        for (i, line) in self.candidates.iter().enumerate() {
            let mark = if i == self.chosen { '*' } else { ' ' };
            let (total, name) = (100.0 * line.total, &line.candidate.name);
            writeln!(f, "{mark} {:7}  {total:12.3} %  {name}", line.columns)?;
        }
        Ok(())
    }
}

/// A selection by cross-validation, with its table of held-out errors.
#[derive(Clone, Debug, PartialEq)]
pub struct SelectionResult {
    /// Name of the option: `effects`, `friction`, `load`, `band`, `prior` or `weights`.
    pub subject: &'static str,
    /// Results of the candidates.
    pub table: SelectionTable,
}
