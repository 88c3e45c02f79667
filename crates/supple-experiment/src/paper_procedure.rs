//! The paper's own identification on its own arm: breakaway for `S`, then Eq. (3.7) and (3.8) with `N` samples.
//!
//! `m3` is known, as the paper weighs the last link. The twelve columns have rank ten, so that the result is compared by
//! its ten determined combinations and by the gravity torque that it predicts. For comparison, this project's own fit identifies
//! the same simulated arm.

use crate::breakaway::{JointBreakaway, breakaway};
use crate::calibrate::{Calibration, identify, model_accuracy, plant_of, upright};
use crate::error::ExperimentError;
use crate::excite::{excitation, slow_motion, without_held_joints};
use crate::metrics::Rms;
use crate::recorded_logs::{CUTOFF_HZ, log_of, preparation};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use supple_core::dynamics::{gravity, rnea};
use supple_core::{Config, Vector};
use supple_ident::excitation_design::{DesignOptions, design};
use supple_ident::paper_estimator::{Estimate, estimate, with_psi};
use supple_ident::{DMatrix, Log, Motion};
use supple_model::Description;
use supple_model::paper::Parameters;
use supple_plant::PlantConfig;

/// Name of the asset.
pub const ARM: &str = "paper3";
/// Number of poses at which gravity is compared.
const POSES: usize = 500;

/// Results of the paper's procedure.
#[derive(Clone, Debug)]
pub struct PaperProcedureResult {
    /// Measured breakaway torque of each joint, which the procedure uses as `S`, and the plant's `S` \[N m\].
    pub breakaway: [(JointBreakaway, f64); 3],
    /// Duration of the recorded motion \[s\].
    pub motion_s: f64,
    /// Samples used, `N`.
    pub samples: usize,
    /// The estimate of (3.8).
    pub estimate: Estimate,
    /// The plant's ten determined combinations, in the order of [`Parameters::BASE_NAMES`].
    pub truth: [f64; 10],
    /// Root mean square error of the predicted gravity torque relative to the root mean square gravity torque, at random poses.
    pub gravity_relative: f64,
    /// The same error of this project's own fit.
    pub own_gravity_relative: f64,
}

/// Runs the paper's procedure on the simulated arm of the paper, with `samples` samples spread over the excitation.
/// `progress` is called with the name of each stage.
///
/// # Errors
/// [`ExperimentError`]; fewer than 1600 samples.
pub fn paper_procedure(
    calibration: &Calibration,
    samples: usize,
    progress: &mut dyn FnMut(&str),
) -> Result<PaperProcedureResult, ExperimentError> {
    let description = Description::asset(ARM)?;
    let nominal = description.config::<3>()?;
    let home = description.home::<3>()?;
    let start = calibration.start.apply(&nominal)?;
    let plant = plant_of::<3>(&description, calibration)?;
    let joints = [0, 1, 2];

    progress("breakaway");
    let pose = upright(&start);
    let measured = breakaway(&start, &plant, &pose, &joints, &mut |_| {})?;
    let known = Parameters {
        coulomb_nm: core::array::from_fn(|i| measured[i].breakaway_nm()),
        ..Parameters::PUBLISHED
    };

    progress("design of the excitation");
    let free = without_held_joints(&start);
    let options = DesignOptions {
        seed: calibration.seed,
        candidates: calibration.candidates,
        ..DesignOptions::new(&joints)
    };
    let designed = design(&free, &home, &options, &mut |_, _| {})?.series;
    let slow = slow_motion(&free, &home, &joints)?;

    progress("excitation");
    let sequence = excitation("excitation", &free, &plant, &home, &[designed, slow]);
    let recordings = sequence.record_with_notes(
        calibration.log_dir.as_deref(),
        &description,
        calibration.seed,
        calibration.plant.notes(),
    )?;
    let logs: Vec<Log> = recordings.iter().map(log_of).collect();

    progress("identification: the paper's estimator, then this project's own");
    let preparation = preparation(start.period_s, CUTOFF_HZ.0);
    let (motion, _) = Motion::prepare(&logs[0], 3, &joints, &preparation)?;
    let motion = spread(&motion, samples);
    let found = estimate(&known, &motion)?;
    let model = with_psi(&known, &found.psi);
    let (own, _) = identify(&start, &logs, &[])?;
    let own = own.description(&description, None)?.config::<3>()?;
    Ok(PaperProcedureResult {
        breakaway: core::array::from_fn(|i| (measured[i], plant.friction[i].coulomb_nm)),
        motion_s: designed.duration_s,
        samples: motion.samples(),
        estimate: found,
        truth: determined_combinations(&known, &plant, &motion)?,
        gravity_relative: gravity_error(&nominal, &plant, &model, calibration.seed),
        own_gravity_relative: model_accuracy(&own, &plant, calibration.seed).gravity_relative,
    })
}

/// Returns `samples` samples of a motion, evenly spread over it; all samples if it has fewer.
fn spread(motion: &Motion, samples: usize) -> Motion {
    let all = motion.samples();
    let kept = samples.min(all);
    let rows = |m: &DMatrix<f64>| DMatrix::from_fn(kept, m.ncols(), |i, j| m[(i * all / kept, j)]);
    Motion {
        rate_hz: motion.rate_hz * kept as f64 / all as f64,
        q: rows(&motion.q),
        qd: rows(&motion.qd),
        qdd: rows(&motion.qdd),
        tau: rows(&motion.tau),
        ..motion.clone()
    }
}

/// Returns the plant's ten determined combinations: the estimate from the plant's own torques, by recursive Newton-Euler, at the
/// states of `motion`.
fn determined_combinations(
    known: &Parameters,
    plant: &PlantConfig<3>,
    motion: &Motion,
) -> Result<[f64; 10], ExperimentError> {
    let friction = Parameters {
        viscous_nm_s_per_rad: core::array::from_fn(|i| plant.friction[i].viscous_nm_s_per_rad),
        ..*known
    }
    .friction();
    let mut exact = motion.clone();
    for i in 0..motion.samples() {
        let at = |m: &DMatrix<f64>| Vector::<3>::from_fn(|j, _| m[(i, j)]);
        let qd = at(&motion.qd);
        let torque = rnea(&plant.arm, &at(&motion.q), &qd, &at(&motion.qdd));
        (0..3).for_each(|j| exact.tau[(i, j)] = torque[j] + friction[j].torque_nm(qd[j]));
    }
    Ok(estimate(known, &exact)?.base)
}

/// Returns the root mean square error of the closed form's gravity torque relative to the root mean square of the plant's gravity
/// torque, at random poses.
fn gravity_error(limits: &Config<3>, plant: &PlantConfig<3>, model: &Parameters, seed: u64) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x7061_7065);
    let limits = &limits.limits;
    let (mut error, mut reference) = (Rms::default(), Rms::default());
    for _ in 0..POSES {
        let q = Vector::<3>::from_fn(|i, _| {
            let (lower, upper) = (limits.position_lower_rad[i], limits.position_upper_rad[i]);
            lower + (upper - lower) * random.random::<f64>()
        });
        let (found, truth) = (model.gravity(&q), gravity(&plant.arm, &q));
        for j in 0..3 {
            error.add(found[j] - truth[j]);
            reference.add(truth[j]);
        }
    }
    error.rms() / reference.rms().max(f64::MIN_POSITIVE)
}
