//! Complete identification: checks, preparation, model selection, fit.
//!
//! Unset options of a [`Procedure`] are chosen by cross-validation within the logs ([`crate::select`]).

use crate::cancellation::Cancellation;
use crate::columns::{Columns, FrictionColumns};
use crate::delay::estimate_delay;
use crate::effects::Effects;
use crate::error::{IdentError, Warning, shape_error};
use crate::fit::{Fit, fit};
use crate::log::{Log, check_joint_list};
use crate::log_checks::{Consequence, Finding, Problem, check_log};
use crate::motion::{ExcludedInterval, Motion, Preparation};
use crate::options::{Options, Weights};
use crate::select::{
    band_candidates, compare, compare_effects, effects_candidates, friction_candidates,
    load_candidates, prior_candidates, weights_candidates,
};
use crate::selection_result::SelectionResult;
use crate::spikes::without_spikes;
use supple_core::{Arm, Friction};

/// Number of folds of the cross-validation.
const FOLDS: usize = 4;
/// Initial prior weight of the model selection.
const PRIOR: f64 = 100.0;

/// Estimation method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Ordinary least squares.
    Ols,
    /// Weighted least squares: each joint is weighted by its residual.
    Wls,
    /// Iteratively reweighted least squares: Huber weights against outliers.
    Irls,
    /// Weighted least squares with physically consistent links and dissipative friction; weights by
    /// cross-validation.
    #[default]
    Consistent,
}

/// Selection of the regressor's friction columns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum FrictionChoice {
    /// By cross-validation, with the table of its errors.
    #[default]
    Auto,
    /// The given columns.
    Columns(FrictionColumns),
}

/// Options of an identification.
#[derive(Clone, Debug, PartialEq)]
pub struct Procedure {
    /// Joints to identify, increasing; `None` for all. The others are held at their logged positions.
    pub identified_joints: Option<Vec<usize>>,
    /// Pairs of joints coupled by a gear: one motor turns with the sum of their angles.
    pub couplings: Vec<(usize, usize)>,
    /// Other effects of a real arm that are identified if cross-validation finds that they predict better; none by default.
    pub effects: Effects,
    /// Resampling, filter and decimation of the logs.
    pub preparation: Preparation,
    /// Estimation method.
    pub method: Method,
    /// Selection of the regressor's friction columns.
    pub friction: FrictionChoice,
    /// Whether to fit a rotor inertia for each identified joint; otherwise the nominal rotors are taken as known.
    pub rotor: bool,
    /// Prior standard deviation of each rotor inertia, relative to that of the nominal arm; `None`: unknown.
    pub rotor_deviation: Option<f64>,
    /// Samples of a joint slower than this are excluded from its rows \[rad/s\]; if the friction columns
    /// have a Stribeck effect, it is then fitted to them in a second stage.
    pub slow_rad_per_s: f64,
    /// Weight of the prior of a consistent fit, see [`crate::constrained_least_squares::Constraints::prior_weight`];
    /// `None` chooses by cross-validation.
    pub prior_weight: Option<f64>,
    /// Known standard deviation of the torque noise of each identified joint \[N m\]; it replaces the weights that the
    /// method would use.
    pub joint_noise_nm: Option<Vec<f64>>,
    /// Whether to estimate the delay of each log's torques ([`crate::estimate_delay`]) instead of using the delay of
    /// `preparation`.
    pub estimate_delay: bool,
    /// Whether to fit a log although [`crate::log_checks`] rejects it; the findings are then warnings.
    pub accept_wrong_logs: bool,
    /// Ends the identification early.
    pub cancellation: Cancellation,
}

impl Default for Procedure {
    /// Returns default options: all joints, cutoff of 8 Hz at the log's own rate, physically consistent, friction and prior by
    /// cross-validation, rotors identified, no sample excluded, delay of the torques estimated.
    fn default() -> Self {
        Procedure {
            identified_joints: None,
            couplings: Vec::new(),
            effects: Effects::default(),
            preparation: Preparation::default(),
            method: Method::Consistent,
            friction: FrictionChoice::Auto,
            rotor: true,
            rotor_deviation: None,
            slow_rad_per_s: 0.0,
            prior_weight: None,
            joint_noise_nm: None,
            estimate_delay: true,
            accept_wrong_logs: false,
            cancellation: Cancellation::default(),
        }
    }
}

/// Identifies an arm from one or several logs. Kinematics and undetermined parameters are those of `nominal`.
///
/// # Errors
/// An unusable log; [`IdentError::WrongLog`] with the findings; too little data; options out of range; singular data;
/// [`IdentError::Cancelled`].
pub fn identify<const N: usize>(
    nominal: &Arm<N>,
    logs: &[Log],
    procedure: &Procedure,
) -> Result<Fit<N>, IdentError> {
    let identified_joints = procedure.identified_joints(N)?;
    let (mut motions, mut warnings) = (Vec::new(), Vec::new());
    for log in logs {
        let (motion, motion_warnings) = procedure.prepare(nominal, log, &identified_joints)?;
        motions.push(motion);
        warnings.extend(motion_warnings);
    }
    let mut found = identify_motions(nominal, &motions, &identified_joints, procedure)?;
    warnings.append(&mut found.warnings);
    found.warnings = warnings;
    Ok(found)
}

/// Does the same as [`identify`], from prepared motions.
///
/// # Errors
/// As [`identify`].
pub fn identify_motions<const N: usize>(
    nominal: &Arm<N>,
    motions: &[Motion],
    identified_joints: &[usize],
    procedure: &Procedure,
) -> Result<Fit<N>, IdentError> {
    if motions.is_empty() {
        return Err(shape_error("logs", "at least one log", "none"));
    }
    let (procedure, effects) =
        procedure.with_chosen_effects(nominal, motions, identified_joints)?;
    let (options, choices) = procedure.options(nominal, motions, identified_joints)?;
    let mut found = fit(nominal, motions, identified_joints, &options)?;
    found.preparation = procedure.preparation;
    if procedure.estimate_delay {
        found.preparation.torque_delay_s = median_delay_s(motions);
    }
    found.choices = effects.into_iter().chain(choices).collect();
    found.warnings = found.result_warnings();
    Ok(found)
}

/// Returns the upper median of the torque delays of the fitted motions, used to prepare validation logs.
fn median_delay_s(motions: &[Motion]) -> f64 {
    let mut all: Vec<f64> = motions.iter().map(|m| m.torque_delay_s).collect();
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}

impl Procedure {
    /// Checks a log against the given arm ([`check_log`]) and prepares it. If a finding is limited to some intervals, these are
    /// excluded, with a warning.
    ///
    /// # Errors
    /// As [`Motion::prepare`]; [`IdentError::WrongLog`] with all findings.
    pub fn prepare<const N: usize>(
        &self,
        nominal: &Arm<N>,
        log: &Log,
        identified_joints: &[usize],
    ) -> Result<(Motion, Vec<Warning>), IdentError> {
        self.cancellation.check()?;
        let preparation = &self.preparation;
        let mut warnings = log.check_without_units(N, identified_joints, preparation.cutoff_hz)?;
        let cleaned = without_spikes(log);
        let log = match &cleaned {
            Some((cleaned, spikes)) => {
                warnings.extend(spikes.iter().cloned());
                cleaned
            }
            None => log,
        };
        let findings = check_log(
            nominal,
            log,
            identified_joints,
            &self.couplings,
            preparation,
            &self.cancellation,
        )?;
        let rejects = |f: &Finding| f.consequence == Consequence::Reject;
        if findings.iter().any(rejects) && !self.accept_wrong_logs {
            return Err(IdentError::WrongLog(findings));
        }
        let mut own = *preparation;
        if self.estimate_delay {
            let found = estimate_delay(
                nominal,
                log,
                identified_joints,
                &self.couplings,
                preparation,
                &self.cancellation,
            )?;
            own.torque_delay_s = found.delay_s;
        }
        let mut motion = Motion::from_checked_log(log, &own)?;
        for finding in findings {
            if finding.consequence == Consequence::Mask {
                let joint = match finding.problem {
                    Problem::Contact => None,
                    _ => finding.joints.first().copied(),
                };
                let intervals = finding.intervals_s.iter();
                motion
                    .excluded_intervals
                    .extend(intervals.map(|&(from_s, to_s)| ExcludedInterval {
                        joint,
                        from_s,
                        to_s,
                    }));
            }
            warnings.push(Warning {
                column: finding.column,
                problem: finding.evidence,
                remedy: finding.remedy,
            });
        }
        Ok((motion, warnings))
    }

    /// Returns the joints to identify of an arm with `dof` joints.
    ///
    /// # Errors
    /// [`IdentError::Shape`] for joints that do not exist.
    pub fn identified_joints(&self, dof: usize) -> Result<Vec<usize>, IdentError> {
        let identified_joints = self
            .identified_joints
            .clone()
            .unwrap_or_else(|| (0..dof).collect::<Vec<_>>());
        check_joint_list(dof, &identified_joints)?;
        Ok(identified_joints)
    }

    /// Returns the procedure with the effects that cross-validation selects (none, all without the compliance, or all) and the
    /// result of the selection; `None` for the result if the procedure has no effects.
    ///
    /// # Errors
    /// As [`identify_motions`].
    pub(crate) fn with_chosen_effects<const N: usize>(
        &self,
        nominal: &Arm<N>,
        motions: &[Motion],
        identified_joints: &[usize],
    ) -> Result<(Procedure, Option<SelectionResult>), IdentError> {
        // A tilt acts on all joints, so it is identified only together with all joints.
        let effects = Effects {
            tilt: self.effects.tilt && identified_joints.len() == N,
            ..self.effects.clone()
        };
        if effects == Effects::default() {
            let none = Procedure {
                effects,
                ..self.clone()
            };
            return Ok((none, None));
        }
        // Friction and prior are selected after the effects; all candidates here use the same ones.
        let before = Procedure {
            friction: match self.friction {
                FrictionChoice::Auto => {
                    FrictionChoice::Columns(FrictionColumns::COULOMB_AND_OFFSET)
                }
                columns => columns,
            },
            prior_weight: self.prior_weight.or(Some(PRIOR)),
            ..self.clone()
        };
        let (options, _) = before.options(nominal, motions, identified_joints)?;
        let candidates = effects_candidates(&options, &effects);
        let table = compare_effects(nominal, motions, identified_joints, &candidates, FOLDS)?;
        let chosen = Procedure {
            effects: table.options().effects.clone(),
            ..self.clone()
        };
        let choice = SelectionResult {
            subject: "effects",
            table,
        };
        Ok((chosen, Some(choice)))
    }

    /// Returns complete options and the selections that led to them.
    pub(crate) fn options<const N: usize>(
        &self,
        nominal: &Arm<N>,
        motions: &[Motion],
        identified_joints: &[usize],
    ) -> Result<(Options, Vec<SelectionResult>), IdentError> {
        let consistent = self.method == Method::Consistent;
        let auto = self.friction == FrictionChoice::Auto;
        let mut options = Options {
            rotor: self.rotor,
            friction: match self.friction {
                FrictionChoice::Auto => FrictionColumns::COULOMB_AND_OFFSET,
                FrictionChoice::Columns(columns) => columns,
            },
            couplings: self.couplings.clone(),
            effects: self.effects.clone(),
            slow_rad_per_s: self.slow_rad_per_s,
            weights: match (&self.joint_noise_nm, self.method) {
                (Some(noise), _) => Weights::Given(noise.clone()),
                (None, Method::Ols) => Weights::Equal,
                (None, Method::Irls) => Weights::Huber,
                (None, Method::Wls | Method::Consistent) => Weights::ByJointResidual,
            },
            consistent_prior_weight: consistent.then(|| self.prior_weight.unwrap_or(PRIOR)),
            rotor_deviation: self.rotor_deviation,
            cancellation: self.cancellation.clone(),
        };
        // Rejects invalid columns before the cross-validation.
        Columns::new(
            N,
            identified_joints,
            options.rotor,
            options.friction,
            &options.couplings,
        )?;
        let prior = consistent && self.prior_weight.is_none();
        let weights = consistent && auto && self.joint_noise_nm.is_none();
        type Candidates = fn(&Options) -> Vec<crate::select::Candidate>;
        let steps: [(&'static str, bool, Candidates); 5] = [
            ("friction", auto, friction_candidates),
            ("load", auto, load_candidates),
            ("band", auto, band_candidates),
            ("prior", prior, prior_candidates),
            ("weights", weights, weights_candidates),
        ];
        let mut choices = Vec::new();
        for (subject, enabled, candidates) in steps {
            let candidates = candidates(&options);
            if enabled && !candidates.is_empty() {
                let table = compare(nominal, motions, identified_joints, &candidates, FOLDS)?;
                options = table.options().clone();
                choices.push(SelectionResult { subject, table });
            }
        }
        Ok((options, choices))
    }
}

impl<const N: usize> Fit<N> {
    /// Warnings about the result itself.
    fn result_warnings(&self) -> Vec<Warning> {
        let mut warnings = Vec::new();
        if self.base.condition > 1e3 {
            warnings.push(Warning {
                column: "q".to_owned(),
                problem: format!(
                    "the condition number of the scaled regressor is {:.0}",
                    self.base.condition
                ),
                remedy: "excite all joints at once: design a trajectory for this arm".to_owned(),
            });
        }
        warnings
    }

    /// Returns the friction of every joint: identified where the joint was identified, from `known` for the others.
    pub fn friction_with(&self, known: &[Friction]) -> [Friction; N] {
        let found = self.friction();
        let identified_joints = self.columns.identified_joints();
        core::array::from_fn(|j| {
            if identified_joints.contains(&j) {
                found[j]
            } else {
                known.get(j).copied().unwrap_or(Friction::NONE)
            }
        })
    }
}
