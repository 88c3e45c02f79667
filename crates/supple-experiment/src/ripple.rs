//! Identifies torque ripple before any other parameter, from slow runs at constant speed.
//!
//! Gravity and friction are fitted as nuisance parameters and discarded; the remaining residual is periodic in
//! the motor angles.

use crate::error::ExperimentError;
use crate::excite::{constant_speed_runs, excitation};
use crate::recorded_logs::{CUTOFF_HZ, log_of, preparation};
use supple_core::{Config, RippleTable, Vector};
use supple_ident::{
    FrictionChoice, FrictionColumns, Log, Motion, Procedure, RippleSearch, fit_ripple,
    identify_motions,
};
use supple_plant::PlantConfig;

/// Identifies the ripple tables of all motors with a controller of configuration `start` on a plant that starts at
/// rest at `home_rad`.
///
/// # Errors
/// [`ExperimentError`].
pub fn identify_ripple<const N: usize>(
    start: &Config<N>,
    plant: &PlantConfig<N>,
    home_rad: &Vector<N>,
) -> Result<[RippleTable; N], ExperimentError> {
    let joints: Vec<usize> = (0..N).collect();
    let runs = constant_speed_runs(start, home_rad, &joints)?;
    let sequence = excitation("constant speed", start, plant, home_rad, &runs);
    let recordings = sequence.perform(&mut |_, _| Ok(()))?;
    let logs: Vec<Log> = recordings.iter().map(log_of).collect();
    let prepare = |cutoff_hz| {
        let preparation = preparation(start.period_s, cutoff_hz);
        let motions = logs
            .iter()
            .map(|log| Motion::prepare(log, N, &joints, &preparation).map(|(motion, _)| motion));
        motions.collect::<Result<Vec<_>, _>>()
    };
    let procedure = Procedure {
        friction: FrictionChoice::Columns(FrictionColumns::COULOMB_AND_OFFSET),
        rotor: false,
        prior_weight: Some(1.0),
        ..Procedure::default()
    };
    let fit = identify_motions(&start.arm, &prepare(CUTOFF_HZ.0)?, &joints, &procedure)?;
    let motor_from_joint = *supple_core::Controller::new(*start)?.motor_from_joint();
    let search = RippleSearch::default();
    Ok(fit_ripple(
        &fit,
        &prepare(CUTOFF_HZ.1)?,
        &motor_from_joint,
        &search,
    )?)
}
