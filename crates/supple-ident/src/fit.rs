//! Fits a model to prepared motions, and its statistics.

use crate::base_parameters::{BaseParameters, RANK_TOLERANCE};
use crate::columns::{Column, Columns};
use crate::effect_rows;
use crate::error::{IdentError, Warning, shape_error};
use crate::estimate::{noise_nm, weighted};
use crate::fit_stage::{FitStage, StageSolution};
use crate::joint_rows::JointRows;
use crate::model;
use crate::motion::{Motion, Preparation};
pub use crate::options::{Options, Weights};
use crate::qr_reduction::ReducedSystem;
use crate::random::Random;
use crate::regressor::{joint_rows, rows_under_load};
use crate::selection_result::SelectionResult;
use crate::slow_motion::fit_stribeck;
use nalgebra::DVector;
use supple_core::dynamics::{regressor, regressor_times};
use supple_core::friction::LoadTorque;
use supple_core::learned::LearnedTerms;
use supple_core::{Arm, Config, Friction, Vector};

/// Minimum number of samples of a joint.
const MIN_ROWS: usize = 20;

/// Number of fixed-point passes of a prediction for a motor whose friction depends on its own torque.
const LOAD_PASSES: usize = 4;

/// An identified model.
#[derive(Clone, Debug)]
pub struct Fit<const N: usize> {
    /// Regressor columns.
    pub columns: Columns,
    /// Parameter of each column.
    pub x: DVector<f64>,
    /// Combinations that the data determine, with rank and condition number.
    pub base: BaseParameters,
    /// Standard deviation of each base parameter.
    pub base_std: DVector<f64>,
    /// RMS residual of each identified joint \[N m\].
    pub noise_nm: Vec<f64>,
    /// Upper bound on the distance of the objective from its optimum, for a consistent fit.
    pub optimality_gap: Option<f64>,
    /// `|tau - tau_hat| / |tau|` over the fitted samples.
    pub training_relative: f64,
    /// Preparation of validation logs.
    pub preparation: Preparation,
    /// Options selected by cross-validation, in order.
    pub choices: Vec<SelectionResult>,
    /// Warnings.
    pub warnings: Vec<Warning>,
    /// Load \[N m\] of each identified joint at which load-dependent friction best matches load-independent
    /// friction over the fitted samples; zero without load columns.
    pub load_nm: Vec<f64>,
    /// Travel of each joint of the arm over which its dry friction reverses after a reversal of motion \[rad\]; zero if the
    /// data do not determine it, see [`crate::presliding_rad`].
    pub presliding_rad: Vec<f64>,
    /// Standard deviation of the weighted residuals, corrected for the correlation that the filter introduces.
    spread: f64,
    nominal: Arm<N>,
}

/// Fits `motions` of an arm, for the joints `identified_joints`. Undetermined parameters are regularised
/// towards `nominal`.
///
/// # Errors
/// Invalid columns or shapes; errors of the solver.
pub fn fit<const N: usize>(
    nominal: &Arm<N>,
    motions: &[Motion],
    identified_joints: &[usize],
    options: &Options,
) -> Result<Fit<N>, IdentError> {
    let columns = Columns::new(
        N,
        identified_joints,
        options.rotor,
        options.friction,
        &options.couplings,
    )?
    .with_effects(&options.effects);
    let parts = motions
        .iter()
        .map(|motion| joint_rows(nominal, &columns, motion));
    let parts = parts.collect::<Result<Vec<_>, _>>()?;
    let independent_fraction = motions
        .iter()
        .map(|m| m.independent_fraction)
        .fold(1.0, f64::min);
    fit_rows(nominal, columns, &parts, independent_fraction, options)
}

/// Does the same as [`fit`], from given rows: for each part of the data, one [`JointRows`] per identified joint.
///
/// # Errors
/// As [`fit`].
pub fn fit_rows<const N: usize>(
    nominal: &Arm<N>,
    columns: Columns,
    parts: &[Vec<JointRows>],
    independent_fraction: f64,
    options: &Options,
) -> Result<Fit<N>, IdentError> {
    options.cancellation.check()?;
    let second_stage =
        options.slow_rad_per_s > 0.0 && options.friction.stribeck_rad_per_s.is_some();
    let used: Vec<usize> = (0..columns.len())
        .filter(|i| !(second_stage && columns.list()[*i].is_of_slow_motion()))
        .collect();
    let stage = FitStage {
        columns: &columns,
        used: &used,
        parts,
        options,
        nominal: model::prior(nominal, &columns).select_rows(&used),
        links: model::link_parameters::<N>(&model::prior(nominal, &columns)).to_vec(),
    };
    let blocks = stage.blocks(None);
    // A joint with too few rows has undetermined friction and rotor inertia; reject it.
    for (block, joint) in blocks.iter().zip(columns.identified_joints()) {
        if block.rows() < MIN_ROWS {
            let slow = options.slow_rad_per_s;
            return Err(IdentError::Log {
                column: format!("q[{joint}]"),
                problem: format!("has {} samples faster than {slow} rad/s", block.rows()),
                remedy: "move the joint faster, lower slow_rad_per_s, or leave it out of the moving joints",
            });
        }
    }
    let rows: usize = blocks.iter().map(ReducedSystem::rows).sum();
    if rows < used.len() {
        return Err(shape_error(
            "log",
            format!("at least {} rows above slow_rad_per_s", used.len()),
            format!("{rows}"),
        ));
    }
    let StageSolution {
        x: solution,
        blocks,
        noise_nm: noise,
        optimality_gap,
    } = stage.solve(&blocks)?;
    let stacked = weighted(&blocks, &noise, used.len());
    let base = BaseParameters::from_regressor(&stacked.a(), RANK_TOLERANCE)?;
    let freedom = (rows - base.rank().min(rows - 1)) as f64 * independent_fraction;
    let spread = (stacked.error_squared(&solution) / freedom.max(1.0)).sqrt();
    let base_std = base.standard_deviations(spread);
    let mut x = DVector::zeros(columns.len());
    used.iter()
        .enumerate()
        .for_each(|(k, i)| x[*i] = solution[k]);
    if second_stage {
        fit_stribeck(&columns, parts, &mut x);
    }
    let error: f64 = blocks.iter().map(|b| b.error_squared(&solution)).sum();
    let torque: f64 = blocks.iter().map(ReducedSystem::torque_squared).sum();
    Ok(Fit {
        training_relative: (error / torque).sqrt(),
        preparation: Preparation::default(),
        choices: Vec::new(),
        warnings: Vec::new(),
        spread,
        base: base.renumbered(&used),
        base_std,
        noise_nm: noise_nm(&blocks, &solution),
        load_nm: load_torques_nm(&columns, parts),
        presliding_rad: vec![0.0; N],
        columns,
        x,
        optimality_gap,
        nominal: *nominal,
    })
}

/// Returns for each identified joint the multiple of its Coulomb column that is nearest to its load column.
fn load_torques_nm(columns: &Columns, parts: &[Vec<JointRows>]) -> Vec<f64> {
    let of_joint = |(row, &joint): (usize, &usize)| {
        let indices = [Column::Load(joint), Column::Coulomb(joint)].map(|c| columns.position(c));
        let [Some(load), Some(dry)] = indices else {
            return 0.0;
        };
        let (mut product, mut square) = (0.0, 0.0);
        for part in parts {
            let dry = part[row].a.column(dry);
            product += dry.dot(&part[row].a.column(load));
            square += dry.norm_squared();
        }
        product / square.max(f64::MIN_POSITIVE)
    };
    columns
        .identified_joints()
        .iter()
        .enumerate()
        .map(of_joint)
        .collect()
}

impl<const N: usize> Fit<N> {
    /// Returns the identified arm.
    ///
    /// # Errors
    /// [`IdentError::NotPhysical`], for plain least squares only.
    pub fn arm(&self) -> Result<Arm<N>, IdentError> {
        model::arm(&self.nominal, &self.columns, &self.x)
    }

    /// Returns the friction of every joint of the arm in the controller's friction law; load-dependent friction refers to the
    /// load [`Fit::load_nm`].
    pub fn friction(&self) -> Vec<Friction> {
        self.friction_of(&self.x)
    }

    /// Returns springs, tilt and torque scales as learned terms of a controller with this configuration.
    pub fn learned(&self, config: &Config<N>) -> LearnedTerms<N> {
        effect_rows::learned(&self.columns, &|column| self.value(column), config)
    }

    /// Returns the compliance between encoder and link of each joint \[rad/(N m)\]; zero where it is not identified.
    pub fn compliance_rad_per_nm(&self) -> [f64; N] {
        core::array::from_fn(|j| effect_rows::COMPLIANCE_UNIT * self.value(Column::Compliance(j)))
    }

    /// Returns the torque scale of each joint relative to the common scale of all joints; zero where it is not identified.
    pub fn torque_scale(&self) -> [f64; N] {
        core::array::from_fn(|j| self.value(Column::TorqueScale(j)))
    }

    pub(crate) fn value(&self, column: Column) -> f64 {
        self.columns.position(column).map_or(0.0, |i| self.x[i])
    }

    fn friction_of(&self, x: &DVector<f64>) -> Vec<Friction> {
        let mut friction = model::friction(&self.columns, x, &self.load_nm);
        for (friction, presliding_rad) in friction.iter_mut().zip(&self.presliding_rad) {
            friction.presliding_rad = *presliding_rad;
        }
        friction
    }

    /// Returns the nominal arm: kinematics and prior.
    pub fn nominal(&self) -> &Arm<N> {
        &self.nominal
    }

    /// Returns the number of column combinations that the data determine.
    pub fn rank(&self) -> usize {
        self.base.rank()
    }

    /// Returns the condition number of the independent columns, scaled to unit length.
    pub fn condition(&self) -> f64 {
        self.base.condition
    }

    /// Predicts the torques of one state \[N m\]. Joints that are not identified count as held: at rest, independent of `qd` and
    /// `qdd`, and without friction.
    pub fn predict(&self, q: &Vector<N>, qd: &Vector<N>, qdd: &Vector<N>) -> Vector<N> {
        let identified_joints = self.columns.identified_joints();
        let with_held_at_rest = |v: &Vector<N>| {
            Vector::<N>::from_fn(|j, _| {
                if identified_joints.contains(&j) {
                    v[j]
                } else {
                    0.0
                }
            })
        };
        let link_regressor = regressor(
            &self.nominal,
            q,
            &with_held_at_rest(qd),
            &with_held_at_rest(qdd),
        );
        let links = model::link_parameters::<N>(&self.x);
        let mut torque = regressor_times(&link_regressor, &links);
        let passes = if self.columns.friction().load == Some(LoadTorque::Motor) {
            LOAD_PASSES
        } else {
            1
        };
        for pass in 0..passes {
            let load = (pass > 0).then_some(&torque);
            let rows = rows_under_load(&self.nominal, &self.columns, [q, qd, qdd], load);
            let explained = rows * &self.x;
            for (row, &joint) in identified_joints.iter().enumerate() {
                let rotor = match self.columns.position(Column::Rotor(joint)) {
                    Some(_) => 0.0,
                    None => self.nominal.armature()[joint] * qdd[joint],
                };
                torque[joint] = explained[row] + rotor;
            }
        }
        torque
    }

    /// Draws a random model from the posterior: the estimate plus a draw of its normal distribution. Held joints have
    /// no friction.
    ///
    /// # Errors
    /// [`IdentError::NotPhysical`] if the fit itself is physically inconsistent.
    pub fn draw(&self, seed: u64) -> Result<(Arm<N>, Vec<Friction>), IdentError> {
        let mut random = Random::new(seed);
        let mut change = self
            .base
            .draw(self.spread, &mut random)
            .unwrap_or_else(|| DVector::zeros(self.rank()));
        loop {
            let mut x = self.x.clone();
            for (i, position) in self.base.independent.iter().enumerate() {
                x[*position] += change[i];
            }
            let friction = self.friction_of(&x);
            match model::arm(&self.nominal, &self.columns, &x) {
                Ok(arm) if friction.iter().all(|f| f.validate().is_ok()) => {
                    return Ok((arm, friction));
                }
                // At the boundary of the feasible set, a draw may be infeasible; shorten it.
                _ if change.amax() > 1e-12 => change *= 0.5,
                _ => return Ok((self.arm()?, self.friction())),
            }
        }
    }

    /// Returns the values of the base parameters, in the order of [`BaseParameters::text`].
    pub fn base_parameters(&self) -> DVector<f64> {
        self.base.values(&self.x)
    }
}
