//! Result of a selection between sets of options, with the held-out error of each.

use crate::options::Options;
use std::fmt;

/// Relative difference of two errors below which it does not matter, even if it is the same in all folds: with a few folds, chance
/// gives a richer model such an advantage in one of six selections.
const TIE: f64 = 0.001;

/// Relative difference of two errors above which one is worse, however much the folds differ: the mean of a single fold that cannot be
/// predicted is as large as its standard error.
const WORSE: f64 = 0.05;

/// A named set of options.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Name in the table.
    pub name: String,
    /// The options.
    pub options: Options,
    /// Of candidates with the same number of columns that predict equally well, the one with the smallest rank is chosen.
    pub rank: usize,
}

/// Result of one candidate.
#[derive(Clone, Debug, PartialEq)]
pub struct CandidateResult {
    /// The candidate.
    pub candidate: Candidate,
    /// Number of columns of its regressor.
    pub columns: usize,
    /// Error of each fold, from a fit to the others: the residual of each joint divided by the geometric mean of the deviations of its
    /// torque and of all torques, root mean square over the joints; empty if the fit failed.
    pub folds: Vec<f64>,
    /// Root mean square over all folds; infinite if the fit failed.
    pub total: f64,
    /// `|tau - tau_hat| / |tau|` of all joints and folds; infinite if the fit failed.
    pub relative: f64,
}

impl CandidateResult {
    /// Returns whether this candidate predicts as well as `best` does: the mean difference of their squared errors is at most its
    /// standard error over the folds, or their errors differ by less than 0.1 %; never if they differ by more than 5 %.
    pub fn is_as_good_as(&self, best: &CandidateResult) -> bool {
        let differences: Vec<f64> = self
            .folds
            .iter()
            .zip(&best.folds)
            .map(|(a, b)| a * a - b * b)
            .collect();
        let n = differences.len() as f64;
        if n < 2.0 {
            return false;
        }
        let mean = differences.iter().sum::<f64>() / n;
        let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let within = mean <= (variance / n).sqrt() && self.total <= best.total * (1.0 + WORSE);
        within || self.total <= best.total * (1.0 + TIE)
    }
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
        writeln!(f, "  columns  held-out error  of all torques  candidate")?;
        for (i, line) in self.candidates.iter().enumerate() {
            let mark = if i == self.chosen { '*' } else { ' ' };
            let (total, relative) = (100.0 * line.total, 100.0 * line.relative);
            let name = &line.candidate.name;
            writeln!(
                f,
                "{mark} {:7}  {total:12.3} %  {relative:12.3} %  {name}",
                line.columns
            )?;
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
