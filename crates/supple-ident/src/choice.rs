//! A choice between sets of options, with the held-out error of each.

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

/// One line of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// The candidate.
    pub candidate: Candidate,
    /// Its number of columns.
    pub columns: usize,
    /// `|tau - tau_hat| / |tau|` of each part, from a fit to the others; empty if the fit failed.
    pub parts: Vec<f64>,
    /// Error over all parts; infinite if the fit failed.
    pub total: f64,
}

/// All candidates and the chosen one.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Results in the order of the candidates.
    pub lines: Vec<Line>,
    /// Index of the chosen candidate.
    pub chosen: usize,
}

impl Table {
    /// Options of the chosen candidate.
    pub fn options(&self) -> &Options {
        &self.lines[self.chosen].candidate.options
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "  columns  held-out error  candidate")?;
        for (i, line) in self.lines.iter().enumerate() {
            let mark = if i == self.chosen { '*' } else { ' ' };
            let (total, name) = (100.0 * line.total, &line.candidate.name);
            writeln!(f, "{mark} {:7}  {total:12.3} %  {name}", line.columns)?;
        }
        Ok(())
    }
}

/// A cross-validated choice with its table of held-out errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// `effects`, `friction`, `load`, `band`, `prior` or `weights`.
    pub subject: &'static str,
    /// The candidates.
    pub table: Table,
}
