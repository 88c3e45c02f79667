//! Remedies of a log's columns, compared by how well the arm explains the log with each.

use super::explained::{Context, Explained, Grams};
use super::finding::{Finding, Problem};
use super::gravity::Gravities;
use crate::error::IdentError;
use crate::motion::Motion;
use core::f64::consts::{FRAC_PI_2, PI};

/// A change of a motion's columns that would undo an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Remedy {
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

impl Remedy {
    pub fn apply(&self, motion: &Motion) -> Motion {
        let mut m = motion.clone();
        let joints = m.q.ncols();
        match *self {
            Remedy::Angle(joint, factor) => {
                for j in joint.map_or(0..joints, |j| j..j + 1) {
                    for signal in [&mut m.q, &mut m.qd, &mut m.qdd] {
                        signal.column_mut(j).scale_mut(factor);
                    }
                }
            }
            Remedy::Zero(j, change) => m.q.column_mut(j).add_scalar_mut(change),
            Remedy::Torque(joint, factor) => {
                for j in joint.map_or(0..joints, |j| j..j + 1) {
                    m.tau.column_mut(j).scale_mut(factor);
                }
            }
            Remedy::SwapAngles(a, b) => {
                for signal in [&mut m.q, &mut m.qd, &mut m.qdd] {
                    signal.swap_columns(a, b);
                }
            }
            Remedy::SwapTorques(a, b) => m.tau.swap_columns(a, b),
            Remedy::SwapJoints(a, b) => {
                for signal in [&mut m.q, &mut m.qd, &mut m.qdd, &mut m.tau] {
                    signal.swap_columns(a, b);
                }
            }
            Remedy::Reverse => {
                for signal in [&mut m.q, &mut m.qd, &mut m.qdd, &mut m.tau] {
                    for j in 0..joints / 2 {
                        signal.swap_columns(j, joints - 1 - j);
                    }
                }
            }
            Remedy::Time(factor) => {
                m.qd /= factor;
                m.qdd /= factor * factor;
            }
        }
        m
    }

    /// Smallest gain in the score at which the remedy is accepted: small changes of a column may also make up for what
    /// the arm's model lacks.
    fn threshold(&self) -> f64 {
        match self {
            Remedy::Angle(_, f) if *f < 0.0 => 0.10,
            Remedy::Torque(_, f) if *f < 0.0 => 0.10,
            Remedy::SwapAngles(..) | Remedy::SwapTorques(..) | Remedy::SwapJoints(..) => 0.12,
            Remedy::Reverse | Remedy::Angle(None, _) => 0.12,
            Remedy::Time(_) => 0.04,
            Remedy::Zero(..) => 0.06,
            Remedy::Angle(..) => 0.04,
            Remedy::Torque(..) => 0.06,
        }
    }
}

/// A remedy with what it gains.
#[derive(Clone, Debug)]
pub(super) struct Tried {
    pub remedy: Remedy,
    pub after: Explained,
    pub gain: f64,
}

/// All remedies of the first round: those that need no search.
fn discrete(moving: &[usize]) -> Vec<Remedy> {
    let degrees = std::f64::consts::PI / 180.0;
    let mut all = vec![
        Remedy::Angle(None, degrees),
        Remedy::Angle(None, -1.0),
        Remedy::Torque(None, -1.0),
        Remedy::Reverse,
    ];
    for (i, &a) in moving.iter().enumerate() {
        all.push(Remedy::Angle(Some(a), -1.0));
        all.push(Remedy::Torque(Some(a), -1.0));
        all.push(Remedy::Angle(Some(a), degrees));
        for &b in &moving[i + 1..] {
            all.push(Remedy::SwapAngles(a, b));
            all.push(Remedy::SwapTorques(a, b));
            all.push(Remedy::SwapJoints(a, b));
        }
    }
    all
}

/// A remedy of one continuous quantity: start values and the step to refine them.
type Family = (fn(usize, f64) -> Remedy, &'static [f64], bool);

/// Families of remedies of a joint: the value is a factor (searched on a logarithmic scale) or an offset.
const FAMILIES: [Family; 3] = [
    (
        |j, f| Remedy::Angle(Some(j), f),
        &[0.01, 0.03, 0.1, 0.5, 0.8, 1.25, 2.0],
        true,
    ),
    (
        |j, f| Remedy::Torque(Some(j), f),
        &[0.01, 0.1, 0.4, 0.7, 1.5, 2.5, 10.0, 100.0],
        true,
    ),
    (
        |j, c| Remedy::Zero(j, c),
        &[-FRAC_PI_2, -0.5, -0.15, 0.15, 0.5, FRAC_PI_2, PI],
        false,
    ),
];

pub(super) struct Search<'a, const N: usize> {
    context: &'a Context<'a, N>,
    motion: &'a Motion,
    grams: Grams,
    given: Explained,
    before: f64,
}

impl<'a, const N: usize> Search<'a, N> {
    pub fn new(
        context: &'a Context<'a, N>,
        motion: &'a Motion,
    ) -> Result<(Self, Explained), IdentError> {
        let grams = context.grams(motion)?;
        let given = context.solve(&grams);
        let before = given.score();
        let search = Search {
            context,
            motion,
            grams,
            given: given.clone(),
            before,
        };
        Ok((search, given))
    }

    pub fn try_one(&self, remedy: Remedy) -> Result<Tried, IdentError> {
        let moving = self.context.columns.moving();
        let after = match remedy {
            Remedy::Torque(Some(joint), factor) => {
                let row = moving.binary_search(&joint).unwrap_or(0);
                self.context.solve(&self.grams.scaled(row, factor))
            }
            _ => self.context.explain(&remedy.apply(self.motion))?,
        };
        Ok(Tried {
            remedy,
            gain: self.before - after.score(),
            after,
        })
    }

    /// Whether a factor is determined from both sides. A torque times zero, or an angle times zero, frees the fit of a
    /// joint and so always helps a little; a true factor is better than half and twice of it.
    fn is_a_peak(&self, tried: &Tried) -> Result<bool, IdentError> {
        // A joint's angle and torque also act on its neighbours: one that only trades one residual for another is no error.
        let pairs = || self.given.relative.iter().zip(&tried.after.relative);
        let better = pairs()
            .filter(|(before, after)| **after < 0.96 * **before)
            .count();
        let worse = pairs().any(|(before, after)| *after > 1.05 * *before);
        let small = tried.gain < 0.15;
        if matches!(tried.remedy, Remedy::Time(_)) {
            let half = 2 * better >= self.given.relative.len();
            return Ok(half && !worse);
        }
        if small && (worse || better < 2) && !matches!(tried.remedy, Remedy::Zero(..)) {
            return Ok(false);
        }
        let beside = match tried.remedy {
            Remedy::Torque(joint, f) => [0.5, 2.0].map(|k| Remedy::Torque(joint, k * f)),
            Remedy::Angle(joint, f) => [0.5, 2.0].map(|k| Remedy::Angle(joint, k * f)),
            _ => return Ok(true),
        };
        for remedy in beside {
            if self.try_one(remedy)?.gain > 0.6 * tried.gain {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Golden-section search between the neighbours of the best start value.
    fn refine(
        &self,
        make: &dyn Fn(f64) -> Remedy,
        low: f64,
        high: f64,
        logarithmic: bool,
    ) -> Result<Tried, IdentError> {
        let value = |u: f64| if logarithmic { u.exp() } else { u };
        let (mut a, mut b) = if logarithmic {
            (low.ln(), high.ln())
        } else {
            (low, high)
        };
        let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
        let mut best: Option<Tried> = None;
        let (mut c, mut d) = (b - ratio * (b - a), a + ratio * (b - a));
        let (mut at_c, mut at_d) = (self.try_one(make(value(c)))?, self.try_one(make(value(d)))?);
        for _ in 0..6 {
            if at_c.gain > at_d.gain {
                b = d;
                d = c;
                at_d = at_c.clone();
                c = b - ratio * (b - a);
                at_c = self.try_one(make(value(c)))?;
            } else {
                a = c;
                c = d;
                at_c = at_d.clone();
                d = a + ratio * (b - a);
                at_d = self.try_one(make(value(d)))?;
            }
            for tried in [&at_c, &at_d] {
                if best.as_ref().is_none_or(|best| tried.gain > best.gain) {
                    best = Some(tried.clone());
                }
            }
        }
        Ok(best.unwrap_or(at_c))
    }

    /// The factor common to all angles: degrees, or the ratio of the gears if it is the same for all.
    fn common_factor(&self, degrees: &Tried) -> Result<Tried, IdentError> {
        let refined = self.refine(&|f| Remedy::Angle(None, f), 0.004, 0.08, true)?;
        let better = refined.gain > degrees.gain + 0.02;
        Ok(if better { refined } else { degrees.clone() })
    }

    /// The best remedy among all, and the best of each other kind for comparison.
    pub fn best(&self, moving: &[usize]) -> Result<Vec<Tried>, IdentError> {
        let mut all = Vec::new();
        for remedy in discrete(moving) {
            all.push(self.try_one(remedy)?);
        }
        for &joint in moving {
            for (make, starts, logarithmic) in FAMILIES {
                let make = |value: f64| make(joint, value);
                let tried = starts.iter().map(|v| self.try_one(make(*v)));
                let tried = tried.collect::<Result<Vec<_>, _>>()?;
                let gains = tried.iter().map(|t| t.gain);
                let (at, gain) = gains.enumerate().fold((0, f64::MIN), |best, (i, gain)| {
                    if gain > best.1 { (i, gain) } else { best }
                });
                // A remedy that is far off can be refined only if it already helps.
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
                    tried[at].clone()
                };
                if self.is_a_peak(&better)? {
                    all.push(better);
                }
            }
        }
        for (low, high) in [(0.4, 1.0), (1.0, 2.5)] {
            let tried = self.refine(&|f| Remedy::Time(f), low, high, true)?;
            if self.is_a_peak(&tried)? {
                all.push(tried);
            }
        }
        all.sort_by(|a, b| {
            (b.gain - b.remedy.threshold()).total_cmp(&(a.gain - a.remedy.threshold()))
        });
        Ok(all)
    }
}

/// Looks for remedies until none explains the log much better.
pub(super) fn check<const N: usize>(
    context: &Context<'_, N>,
    motion: &Motion,
) -> Result<Vec<Finding>, IdentError> {
    let moving = context.columns.moving().to_vec();
    let mut motion = motion.clone();
    let mut findings = Vec::new();
    for _ in 0..2 {
        let (search, given) = Search::new(context, &motion)?;
        let tried = search.best(&moving)?;
        let Some(best) = tried.first() else { break };
        if best.gain < best.remedy.threshold() {
            findings.extend(zero(context, &motion)?);
            break;
        }
        let best = match best.remedy {
            Remedy::Angle(None, f) if f > 0.0 => search.common_factor(best)?,
            _ => best.clone(),
        };
        findings.push(finding(&best.remedy, &given, &best.after));
        motion = best.remedy.apply(&motion);
    }
    Ok(findings)
}

/// A zero that the weight of the given arm shows: a constant error of an angle changes few torques, but it turns the arm
/// about that joint.
fn zero<const N: usize>(
    context: &Context<'_, N>,
    motion: &Motion,
) -> Result<Option<Finding>, IdentError> {
    let context = context.believing_the_arm()?;
    let (search, given) = Search::new(&context, motion)?;
    let given = &given;
    let gravities = Gravities::new(&context, motion, given);
    let Some((joint, by, before, after)) = gravities.zero() else {
        return Ok(None);
    };
    let tried = search.try_one(Remedy::Zero(joint, by))?;
    if tried.gain < 0.01 {
        return Ok(None);
    }
    let mut finding = finding(&tried.remedy, given, &tried.after);
    finding.evidence += &format!(
        "; the correlation of the weight that is held with that of the given arm is {before:.3} at least, and {after:.3} with \
         it"
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

fn finding(remedy: &Remedy, given: &Explained, after: &Explained) -> Finding {
    let better = format!(
        "the arm leaves {} % of the joints' torques unexplained, and {} % with this remedy",
        percent(&given.relative),
        percent(&after.relative)
    );
    let degrees = (std::f64::consts::PI / 180.0).ln();
    match *remedy {
        Remedy::Angle(joint, f) if f < 0.0 => {
            let joints: Vec<usize> = joint.into_iter().collect();
            Finding::stop(
                Problem::AngleSign,
                &joints,
                "q",
                format!("has the wrong sign: {better}"),
                "change the sign of this angle (and of its velocity)",
            )
        }
        Remedy::Angle(joint, f) if (f.ln() - degrees).abs() < 0.1 => {
            let joints: Vec<usize> = joint.into_iter().collect();
            Finding::stop(
                Problem::Degrees,
                &joints,
                "q",
                format!("is in degrees: {better}"),
                "give radians: multiply by pi / 180",
            )
        }
        Remedy::Angle(joint, f) => {
            let joints: Vec<usize> = joint.into_iter().collect();
            Finding::stop(
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
        Remedy::Zero(j, c) => Finding::stop(
            Problem::ZeroOffset,
            &[j],
            "q",
            format!("has another zero than the arm, {:.3} rad off: {better}", -c),
            format!("add {c:.3} rad, or correct the zero of the joint in the arm's URDF"),
        ),
        Remedy::Torque(joint, f) if f < 0.0 => {
            let joints: Vec<usize> = joint.into_iter().collect();
            Finding::stop(
                Problem::TorqueSign,
                &joints,
                "tau",
                format!("has the wrong sign, its friction would drive the joint: {better}"),
                "change the sign of this torque",
            )
        }
        Remedy::Torque(joint, f) => {
            let joints: Vec<usize> = joint.into_iter().collect();
            Finding::stop(
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
        Remedy::SwapAngles(a, b) => Finding::stop(
            Problem::Swapped,
            &[a, b],
            "q",
            format!("these angles are exchanged: {better}"),
            "exchange the two columns",
        ),
        Remedy::SwapTorques(a, b) => Finding::stop(
            Problem::Swapped,
            &[a, b],
            "tau",
            format!("these torques are exchanged: {better}"),
            "exchange the two columns",
        ),
        Remedy::SwapJoints(a, b) => Finding::stop(
            Problem::Swapped,
            &[a, b],
            "q and tau",
            format!("these joints are exchanged: {better}"),
            "give the joints in the order of the arm",
        ),
        Remedy::Reverse => Finding::stop(
            Problem::Swapped,
            &[],
            "q and tau",
            format!("the joints are in reverse order: {better}"),
            "give the joints in the order of the arm",
        ),
        Remedy::Time(f) => Finding::stop(
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
