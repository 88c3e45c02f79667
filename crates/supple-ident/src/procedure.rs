//! From logs to a model in one call: check, prepare, choose, fit.
//!
//! What is left open in a [`Procedure`] is chosen by predicting parts of the logs from the others
//! ([`crate::select`]); nothing but these logs decides.

use crate::columns::{Columns, FrictionColumns};
use crate::error::{IdentError, Warning, shape_error};
use crate::fit::{Fit, Options, Weights, fit};
use crate::log::{Log, check_moving};
use crate::motion::{Motion, Preparation};
use crate::select::{
    Table, band_candidates, compare, friction_candidates, load_candidates, prior_candidates,
    weights_candidates,
};
use supple_core::{Arm, Friction};

/// Parts of a log of which each is predicted from the others.
const PARTS: usize = 4;
/// Prior weight from which the choice starts.
const PRIOR: f64 = 100.0;

/// How the columns are solved for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Ordinary least squares.
    Ols,
    /// Weighted least squares: each joint by its own residual.
    Wls,
    /// Iteratively reweighted least squares: single samples far out count less (Huber).
    Irls,
    /// Weighted, with every link a body that can be and friction that takes energy; weights by
    /// cross-validation.
    #[default]
    Consistent,
}

/// Friction columns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum FrictionChoice {
    /// By cross-validation, with the table that shows why.
    #[default]
    Auto,
    /// These.
    Columns(FrictionColumns),
}

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Procedure {
    /// Joints to identify, increasing; `None` for all. The others are held where the log has them.
    pub moving: Option<Vec<usize>>,
    /// Pairs of joints whose sum turns a motor.
    pub couplings: Vec<(usize, usize)>,
    /// Grid, filter, decimation.
    pub preparation: Preparation,
    /// Solver.
    pub method: Method,
    /// Friction.
    pub friction: FrictionChoice,
    /// A rotor inertia for each moving joint; without, the model's rotors are taken as known.
    pub rotor: bool,
    /// Samples of a joint slower than this are left out of its rows \[rad/s\]; a Stribeck dip is then
    /// fitted from them in a second stage.
    pub slow_rad_per_s: f64,
    /// Weight of the prior of a consistent fit, see [`crate::consistent::Constraints::prior_weight`];
    /// `None` chooses by cross-validation.
    pub prior_weight: Option<f64>,
    /// Stated noise of each moving joint \[N m\], in place of weights found from residuals.
    pub joint_noise_nm: Option<Vec<f64>>,
}

impl Default for Procedure {
    /// All joints, 8 Hz at the log's own rate, physically consistent, friction and prior by
    /// cross-validation, rotors identified, no sample left out.
    fn default() -> Self {
        Procedure {
            moving: None,
            couplings: Vec::new(),
            preparation: Preparation::default(),
            method: Method::Consistent,
            friction: FrictionChoice::Auto,
            rotor: true,
            slow_rad_per_s: 0.0,
            prior_weight: None,
            joint_noise_nm: None,
        }
    }
}

/// What was chosen, and the table of held-out errors that decided it.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// `friction`, `load`, `band`, `prior` or `weights`.
    pub of: &'static str,
    /// The candidates.
    pub table: Table,
}

/// Identifies an arm from one log or several. Kinematics, and what the data leave open, are those of
/// `nominal`.
///
/// # Errors
/// What [`Log::check`] refuses; too little data; options out of range; singular data.
pub fn identify<const N: usize>(
    nominal: &Arm<N>,
    logs: &[Log],
    procedure: &Procedure,
) -> Result<Fit<N>, IdentError> {
    let moving = procedure.moving_joints(N)?;
    let (mut motions, mut warnings) = (Vec::new(), Vec::new());
    for log in logs {
        let (motion, doubts) = Motion::prepare(log, N, &moving, &procedure.preparation)?;
        motions.push(motion);
        warnings.extend(doubts);
    }
    let mut found = identify_motions(nominal, &motions, &moving, procedure)?;
    warnings.append(&mut found.warnings);
    found.warnings = warnings;
    Ok(found)
}

/// As [`identify`], from motions that were prepared before.
///
/// # Errors
/// As [`identify`].
pub fn identify_motions<const N: usize>(
    nominal: &Arm<N>,
    motions: &[Motion],
    moving: &[usize],
    procedure: &Procedure,
) -> Result<Fit<N>, IdentError> {
    if motions.is_empty() {
        return Err(shape_error("logs", "at least one log", "none"));
    }
    let (options, choices) = procedure.options(nominal, motions, moving)?;
    let mut found = fit(nominal, motions, moving, &options)?;
    found.preparation = procedure.preparation;
    found.choices = choices;
    found.warnings = found.doubts();
    Ok(found)
}

impl Procedure {
    /// The moving joints of an arm of `dof`.
    ///
    /// # Errors
    /// [`IdentError::Shape`] for joints that do not exist.
    pub fn moving_joints(&self, dof: usize) -> Result<Vec<usize>, IdentError> {
        let moving = self
            .moving
            .clone()
            .unwrap_or_else(|| (0..dof).collect::<Vec<_>>());
        check_moving(dof, &moving)?;
        Ok(moving)
    }

    /// Options with everything chosen, and how.
    pub(crate) fn options<const N: usize>(
        &self,
        nominal: &Arm<N>,
        motions: &[Motion],
        moving: &[usize],
    ) -> Result<(Options, Vec<Choice>), IdentError> {
        let consistent = self.method == Method::Consistent;
        let auto = self.friction == FrictionChoice::Auto;
        let mut options = Options {
            rotor: self.rotor,
            friction: match self.friction {
                FrictionChoice::Auto => FrictionColumns::OFFSET,
                FrictionChoice::Columns(columns) => columns,
            },
            couplings: self.couplings.clone(),
            slow_rad_per_s: self.slow_rad_per_s,
            weights: match (&self.joint_noise_nm, self.method) {
                (Some(noise), _) => Weights::Given(noise.clone()),
                (None, Method::Ols) => Weights::Equal,
                (None, Method::Irls) => Weights::Huber,
                (None, Method::Wls | Method::Consistent) => Weights::Noise,
            },
            consistent: consistent.then(|| self.prior_weight.unwrap_or(PRIOR)),
        };
        // Refuses wrong columns before any table is made of them.
        Columns::new(
            N,
            moving,
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
        for (of, wanted, candidates) in steps {
            let candidates = candidates(&options);
            if wanted && !candidates.is_empty() {
                let table = compare(nominal, motions, moving, &candidates, PARTS)?;
                options = table.options().clone();
                choices.push(Choice { of, table });
            }
        }
        Ok((options, choices))
    }
}

impl<const N: usize> Fit<N> {
    /// What is doubtful about the result itself.
    fn doubts(&self) -> Vec<Warning> {
        let mut doubts = Vec::new();
        if self.base.condition > 1e3 {
            doubts.push(Warning {
                column: "q".to_owned(),
                problem: format!(
                    "the condition number of the scaled regressor is {:.0}",
                    self.base.condition
                ),
                remedy: "excite all joints at once: design a trajectory for this arm",
            });
        }
        doubts
    }

    /// Friction of every joint: the one found for moving joints, `known` for the others.
    pub fn friction_with(&self, known: &[Friction]) -> [Friction; N] {
        let found = self.friction();
        let moving = self.columns.moving();
        core::array::from_fn(|j| {
            if moving.contains(&j) {
                found[j]
            } else {
                known.get(j).copied().unwrap_or(Friction::NONE)
            }
        })
    }
}
