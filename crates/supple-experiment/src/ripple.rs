//! Torque ripple of a plant before anything else is known of it: from slow runs of all joints at constant
//! speed.
//!
//! Gravity and friction are fitted beside it, from a model that is off as a data sheet is, and thrown
//! away; what is left turns with the motors' angles.

use crate::calibrate::{CUTOFF_HZ, log_of, preparation};
use crate::error::ExperimentError;
use crate::excite::{constant_speed_runs, excitation};
use supple_core::{Config, RippleTable, Vector};
use supple_ident::{
    FrictionChoice, FrictionColumns, Log, Motion, Procedure, RippleSearch, fit_ripple,
    identify_motions,
};
use supple_plant::PlantConfig;

/// Tables of all motors, found by a controller that starts from `start` on a plant that stands at
/// `home_rad`.
///
/// # Errors
/// [`ExperimentError`].
pub fn ripple_on<const N: usize>(
    start: &Config<N>,
    plant: &PlantConfig<N>,
    home_rad: &Vector<N>,
) -> Result<[RippleTable; N], ExperimentError> {
    let joints: Vec<usize> = (0..N).collect();
    let runs = constant_speed_runs(start, home_rad, &joints)?;
    let session = excitation("constant speed", start, plant, home_rad, &runs);
    let recordings = session.perform(&mut |_, _| Ok(()))?;
    let logs: Vec<Log> = recordings.iter().map(log_of).collect();
    let prepare = |cutoff_hz| {
        let preparation = preparation(start.period_s, cutoff_hz);
        let motions = logs
            .iter()
            .map(|log| Motion::prepare(log, N, &joints, &preparation).map(|(motion, _)| motion));
        motions.collect::<Result<Vec<_>, _>>()
    };
    let procedure = Procedure {
        friction: FrictionChoice::Columns(FrictionColumns::OFFSET),
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
