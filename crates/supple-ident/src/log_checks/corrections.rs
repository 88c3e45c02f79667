//! Corrections of a log's columns (sign, unit, order, zero, clock), compared by the residual of the fit to the corrected log.

use super::finding::{Finding, Problem};
use super::gravity::GravityComparison;
use super::weighted_fit::{FitContext, FitResult, GramMatrices};
use crate::error::IdentError;
use crate::motion::Motion;
use core::f64::consts::{FRAC_PI_2, PI};

/// A change of a motion's columns that corrects one kind of error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Correction {
    /// Multiplies the angle of one joint, or of all.
    Angle(Option<usize>, f64),
    /// Adds to the angle of a joint \[rad\].
    Zero(usize, f64),
    /// Multiplies the torque of one joint, or of all.
    Torque(Option<usize>, f64),
    /// Exchanges the angles of two joints.
    SwapAngles(usize, usize),
    /// Exchanges the torques of two joints.
    SwapTorques(usize, usize),
    /// Exchanges two joints.
    SwapJoints(usize, usize),
    /// Reverses the order of all joints.
    Reverse,
    /// Multiplies the times.
    Time(f64),
}

impl Correction {
    pub fn apply(&self, motion: &Motion) -> Motion {
        let mut m = motion.clone();
        let joints = m.q.ncols();
        match *self {
            Correction::Angle(joint, factor) => {
                for j in joint.map_or(0..joints, |j| j..j + 1) {
                    for signal in [&mut m.q, &mut m.qd, &mut m.qdd] {
                        signal.column_mut(j).scale_mut(factor);
                    }
                }
            }
            Correction::Zero(j, change) => m.q.column_mut(j).add_scalar_mut(change),
            Correction::Torque(joint, factor) => {
                for j in joint.map_or(0..joints, |j| j..j + 1) {
                    m.tau.column_mut(j).scale_mut(factor);
                }
            }
            Correction::SwapAngles(a, b) => {
                for signal in [&mut m.q, &mut m.qd, &mut m.qdd] {
                    signal.swap_columns(a, b);
                }
            }
            Correction::SwapTorques(a, b) => m.tau.swap_columns(a, b),
            Correction::SwapJoints(a, b) => {
                for signal in [&mut m.q, &mut m.qd, &mut m.qdd, &mut m.tau] {
                    signal.swap_columns(a, b);
                }
            }
            Correction::Reverse => {
                for signal in [&mut m.q, &mut m.qd, &mut m.qdd, &mut m.tau] {
                    for j in 0..joints / 2 {
                        signal.swap_columns(j, joints - 1 - j);
                    }
                }
            }
            Correction::Time(factor) => {
                m.qd /= factor;
                m.qdd /= factor * factor;
            }
        }
        m
    }

    /// Returns the minimum gain of the score at which the correction is accepted. It is not zero: a small change of a column can
    /// also compensate an error of the model.
    fn threshold(&self) -> f64 {
        match self {
            Correction::Angle(_, f) if *f < 0.0 => 0.10,
            Correction::Torque(_, f) if *f < 0.0 => 0.10,
            Correction::SwapAngles(..)
            | Correction::SwapTorques(..)
            | Correction::SwapJoints(..) => 0.12,
            Correction::Reverse | Correction::Angle(None, _) => 0.12,
            Correction::Time(_) => 0.04,
            Correction::Zero(..) => 0.06,
            Correction::Angle(..) => 0.04,
            Correction::Torque(..) => 0.06,
        }
    }
}

/// A correction, the fit to the corrected log, and the gain of its score over the fit to the log as given.
#[derive(Clone, Debug)]
pub(super) struct Trial {
    pub correction: Correction,
    pub after: FitResult,
    pub gain: f64,
}

/// Returns all corrections without a continuous parameter.
fn discrete(identified_joints: &[usize]) -> Vec<Correction> {
    let degrees = std::f64::consts::PI / 180.0;
    let mut all = vec![
        Correction::Angle(None, degrees),
        Correction::Angle(None, -1.0),
        Correction::Torque(None, -1.0),
        Correction::Reverse,
    ];
    for (i, &a) in identified_joints.iter().enumerate() {
        all.push(Correction::Angle(Some(a), -1.0));
        all.push(Correction::Torque(Some(a), -1.0));
        all.push(Correction::Angle(Some(a), degrees));
        for &b in &identified_joints[i + 1..] {
            all.push(Correction::SwapAngles(a, b));
            all.push(Correction::SwapTorques(a, b));
            all.push(Correction::SwapJoints(a, b));
        }
    }
    all
}

/// A correction with a continuous parameter: constructor from joint and value, start values, and whether the search is
/// logarithmic.
type SearchedCorrection = (fn(usize, f64) -> Correction, &'static [f64], bool);

/// Corrections of a joint with a continuous parameter: a factor (searched on a logarithmic scale) or an offset \[rad\].
const SEARCHED_CORRECTIONS: [SearchedCorrection; 3] = [
    (
        |j, f| Correction::Angle(Some(j), f),
        &[0.01, 0.03, 0.1, 0.5, 0.8, 1.25, 2.0],
        true,
    ),
    (
        |j, f| Correction::Torque(Some(j), f),
        &[0.01, 0.1, 0.4, 0.7, 1.5, 2.5, 10.0, 100.0],
        true,
    ),
    (
        |j, c| Correction::Zero(j, c),
        &[-FRAC_PI_2, -0.5, -0.15, 0.15, 0.5, FRAC_PI_2, PI],
        false,
    ),
];

pub(super) struct CorrectionSearch<'a, const N: usize> {
    context: &'a FitContext<'a, N>,
    motion: &'a Motion,
    grams: GramMatrices,
    given: FitResult,
    before: f64,
}

impl<'a, const N: usize> CorrectionSearch<'a, N> {
    pub fn new(
        context: &'a FitContext<'a, N>,
        motion: &'a Motion,
    ) -> Result<(Self, FitResult), IdentError> {
        let grams = context.grams(motion)?;
        let given = context.solve(&grams);
        let before = given.score();
        let search = CorrectionSearch {
            context,
            motion,
            grams,
            given: given.clone(),
            before,
        };
        Ok((search, given))
    }

    pub fn try_correction(&self, correction: Correction) -> Result<Trial, IdentError> {
        let identified_joints = self.context.columns.identified_joints();
        let after = match correction {
            Correction::Torque(Some(joint), factor) => {
                let row = identified_joints.binary_search(&joint).unwrap_or(0);
                self.context.solve(&self.grams.scaled(row, factor))
            }
            _ => self.context.fit(&correction.apply(self.motion))?,
        };
        Ok(Trial {
            correction,
            gain: self.before - after.score(),
            after,
        })
    }

    /// Returns whether the gain has a maximum at the correction's factor: it must be greater than at half and at twice the
    /// factor. Without this check a factor near zero would be accepted: it removes a joint from the fit, which always reduces the
    /// residual.
    fn is_a_maximum(&self, trial: &Trial) -> Result<bool, IdentError> {
        // A joint's angle and torque also affect its neighbours: a correction that reduces one residual and increases another
        // corrects no error.
        let pairs = || self.given.relative.iter().zip(&trial.after.relative);
        let better = pairs()
            .filter(|(before, after)| **after < 0.96 * **before)
            .count();
        let worse = pairs().any(|(before, after)| *after > 1.05 * *before);
        let small = trial.gain < 0.15;
        if matches!(trial.correction, Correction::Time(_)) {
            let half = 2 * better >= self.given.relative.len();
            return Ok(half && !worse);
        }
        if small && (worse || better < 2) && !matches!(trial.correction, Correction::Zero(..)) {
            return Ok(false);
        }
        let beside = match trial.correction {
            Correction::Torque(joint, f) => [0.5, 2.0].map(|k| Correction::Torque(joint, k * f)),
            Correction::Angle(joint, f) => [0.5, 2.0].map(|k| Correction::Angle(joint, k * f)),
            _ => return Ok(true),
        };
        for correction in beside {
            if self.try_correction(correction)?.gain > 0.6 * trial.gain {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Runs a golden-section search between the neighbours of the best start value.
    fn refine(
        &self,
        make: &dyn Fn(f64) -> Correction,
        low: f64,
        high: f64,
        logarithmic: bool,
    ) -> Result<Trial, IdentError> {
        let value = |u: f64| if logarithmic { u.exp() } else { u };
        let (mut a, mut b) = if logarithmic {
            (low.ln(), high.ln())
        } else {
            (low, high)
        };
        let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
        let mut best: Option<Trial> = None;
        let (mut c, mut d) = (b - ratio * (b - a), a + ratio * (b - a));
        let (mut at_c, mut at_d) = (
            self.try_correction(make(value(c)))?,
            self.try_correction(make(value(d)))?,
        );
        for _ in 0..6 {
            if at_c.gain > at_d.gain {
                b = d;
                d = c;
                at_d = at_c.clone();
                c = b - ratio * (b - a);
                at_c = self.try_correction(make(value(c)))?;
            } else {
                a = c;
                c = d;
                at_c = at_d.clone();
                d = a + ratio * (b - a);
                at_d = self.try_correction(make(value(d)))?;
            }
            for trial in [&at_c, &at_d] {
                if best.as_ref().is_none_or(|best| trial.gain > best.gain) {
                    best = Some(trial.clone());
                }
            }
        }
        Ok(best.unwrap_or(at_c))
    }

    /// Returns the correction of all angles by a common factor: degrees, or a gear ratio that all joints share.
    fn common_factor(&self, degrees: &Trial) -> Result<Trial, IdentError> {
        let refined = self.refine(&|f| Correction::Angle(None, f), 0.004, 0.08, true)?;
        let better = refined.gain > degrees.gain + 0.02;
        Ok(if better { refined } else { degrees.clone() })
    }

    /// Tries all corrections without a continuous parameter, and for each kind with one its best value; returns the best first.
    pub fn best(&self, identified_joints: &[usize]) -> Result<Vec<Trial>, IdentError> {
        let mut all = Vec::new();
        for correction in discrete(identified_joints) {
            all.push(self.try_correction(correction)?);
        }
        for &joint in identified_joints {
            for (make, starts, logarithmic) in SEARCHED_CORRECTIONS {
                let make = |value: f64| make(joint, value);
                let trial = starts.iter().map(|v| self.try_correction(make(*v)));
                let trial = trial.collect::<Result<Vec<_>, _>>()?;
                let gains = trial.iter().map(|t| t.gain);
                let (at, gain) = gains.enumerate().fold((0, f64::MIN), |best, (i, gain)| {
                    if gain > best.1 { (i, gain) } else { best }
                });
                // The search refines a start value only if the residual is smaller with it.
                if gain <= 0.004 {
                    continue;
                }
                let neutral = if logarithmic { 1.0 } else { 0.0 };
                let mut grid: Vec<f64> = starts.iter().copied().chain([neutral]).collect();
                grid.sort_by(f64::total_cmp);
                let place = grid.iter().position(|v| *v == starts[at]).unwrap_or(0);
                let low = grid[place.saturating_sub(1)];
                let high = grid[(place + 1).min(grid.len() - 1)];
                let refined = self.refine(&make, low, high, logarithmic)?;
                let better = if refined.gain > gain {
                    refined
                } else {
                    trial[at].clone()
                };
                if self.is_a_maximum(&better)? {
                    all.push(better);
                }
            }
        }
        for (low, high) in [(0.4, 1.0), (1.0, 2.5)] {
            let trial = self.refine(&|f| Correction::Time(f), low, high, true)?;
            if self.is_a_maximum(&trial)? {
                all.push(trial);
            }
        }
        all.sort_by(|a, b| {
            (b.gain - b.correction.threshold()).total_cmp(&(a.gain - a.correction.threshold()))
        });
        Ok(all)
    }
}

/// Finds corrections that reduce the residual beyond their thresholds: one, or two in sequence.
pub(super) fn check<const N: usize>(
    context: &FitContext<'_, N>,
    motion: &Motion,
) -> Result<Vec<Finding>, IdentError> {
    let identified_joints = context.columns.identified_joints().to_vec();
    let mut motion = motion.clone();
    let mut findings = Vec::new();
    for _ in 0..2 {
        let (search, given) = CorrectionSearch::new(context, &motion)?;
        let trial = search.best(&identified_joints)?;
        let Some(best) = trial.first() else { break };
        if best.gain < best.correction.threshold() {
            findings.extend(zero(context, &motion)?);
            break;
        }
        let best = match best.correction {
            Correction::Angle(None, f) if f > 0.0 => search.common_factor(best)?,
            _ => best.clone(),
        };
        findings.push(finding(&best.correction, &given, &best.after));
        motion = best.correction.apply(&motion);
    }
    Ok(findings)
}

/// Finds a wrong zero of an angle by comparing the fitted gravity torques with those of the given arm: a constant error of an
/// angle changes the residual little, but rotates the links beyond that joint.
fn zero<const N: usize>(
    context: &FitContext<'_, N>,
    motion: &Motion,
) -> Result<Option<Finding>, IdentError> {
    let context = context.with_tight_prior()?;
    let (search, given) = CorrectionSearch::new(&context, motion)?;
    let given = &given;
    let gravities = GravityComparison::new(&context, motion, given);
    let Some((joint, by, before, after)) = gravities.zero() else {
        return Ok(None);
    };
    let trial = search.try_correction(Correction::Zero(joint, by))?;
    if trial.gain < 0.01 {
        return Ok(None);
    }
    let mut finding = finding(&trial.correction, given, &trial.after);
    finding.evidence += &format!(
        "; the correlation of the fitted gravity torques with those of the given arm is at least {before:.3}, and {after:.3} with \
         this correction"
    );
    Ok(Some(finding))
}

fn percent(relative: &[f64]) -> String {
    let all: Vec<String> = relative
        .iter()
        .map(|e| format!("{:.0}", 100.0 * e))
        .collect();
    all.join(", ")
}

fn finding(correction: &Correction, given: &FitResult, after: &FitResult) -> Finding {
    let better = format!(
        "the arm leaves {} % of the joints' torques unexplained, and {} % with this correction",
        percent(&given.relative),
        percent(&after.relative)
    );
    let degrees = (std::f64::consts::PI / 180.0).ln();
    match *correction {
        Correction::Angle(joint, f) if f < 0.0 => {
            let joints: Vec<usize> = joint.into_iter().collect();
            Finding::reject(
                Problem::AngleSign,
                &joints,
                "q",
                format!("has the wrong sign: {better}"),
                "change the sign of this angle (and of its velocity)",
            )
        }
        Correction::Angle(joint, f) if (f.ln() - degrees).abs() < 0.1 => {
            let joints: Vec<usize> = joint.into_iter().collect();
            Finding::reject(
                Problem::Degrees,
                &joints,
                "q",
                format!("is in degrees: {better}"),
                "give radians: multiply by pi / 180",
            )
        }
        Correction::Angle(joint, f) => {
            let joints: Vec<usize> = joint.into_iter().collect();
            Finding::reject(
                match joint {
                    None => Problem::MotorAngles,
                    Some(_) => Problem::AngleScale,
                },
                &joints,
                "q",
                format!(
                    "is {:.2} times too large, an angle of the motor, a wrong gear ratio or scale: {better}",
                    1.0 / f
                ),
                format!("give the angle of the joint: multiply by {f:.3}"),
            )
        }
        Correction::Zero(j, c) => Finding::reject(
            Problem::ZeroOffset,
            &[j],
            "q",
            format!("has another zero than the arm, {:.3} rad off: {better}", -c),
            format!("add {c:.3} rad, or correct the zero of the joint in the arm's URDF"),
        ),
        Correction::Torque(joint, f) if f < 0.0 => {
            let joints: Vec<usize> = joint.into_iter().collect();
            Finding::reject(
                Problem::TorqueSign,
                &joints,
                "tau",
                format!("has the wrong sign, its friction would drive the joint: {better}"),
                "change the sign of this torque",
            )
        }
        Correction::Torque(joint, f) => {
            let joints: Vec<usize> = joint.into_iter().collect();
            Finding::reject(
                Problem::TorqueScale,
                &joints,
                "tau",
                format!(
                    "is {:.2} times too large against the other joints, a wrong torque constant, gear ratio or scale: {better}",
                    1.0 / f
                ),
                format!("give N m at the joint: multiply by {f:.3}"),
            )
        }
        Correction::SwapAngles(a, b) => Finding::reject(
            Problem::Swapped,
            &[a, b],
            "q",
            format!("these angles are exchanged: {better}"),
            "exchange the two columns",
        ),
        Correction::SwapTorques(a, b) => Finding::reject(
            Problem::Swapped,
            &[a, b],
            "tau",
            format!("these torques are exchanged: {better}"),
            "exchange the two columns",
        ),
        Correction::SwapJoints(a, b) => Finding::reject(
            Problem::Swapped,
            &[a, b],
            "q and tau",
            format!("these joints are exchanged: {better}"),
            "give the joints in the order of the arm",
        ),
        Correction::Reverse => Finding::reject(
            Problem::Swapped,
            &[],
            "q and tau",
            format!("the joints are in reverse order: {better}"),
            "give the joints in the order of the arm",
        ),
        Correction::Time(f) => Finding::reject(
            Problem::TimeScale,
            &[],
            "t",
            if f < 1.0 {
                format!(
                    "the clock is {:.2} times too fast, gravity and inertia do not agree: {better}",
                    1.0 / f
                )
            } else {
                format!(
                    "the clock is {f:.2} times too slow, gravity and inertia do not agree: {better}"
                )
            },
            format!("multiply t by {f:.3}; check the unit and the source of the times"),
        ),
    }
}
