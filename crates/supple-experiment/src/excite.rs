//! Excitation of the simulated arm: a position-controlled move to the start of each Fourier series, a rest, then
//! the series.

use crate::approach_time::within_limits_s;
use crate::request_sequence::{RequestSequence, Step};
use supple_core::controller::Request;
use supple_core::trajectory::Fourier;
use supple_core::{Config, Vector};
use supple_ident::IdentError;
use supple_ident::excitation_design::{constant_speed_series, slow_series};
use supple_plant::PlantConfig;

/// Gravity hold before the first move \[s\].
const SETTLE_S: f64 = 0.1;
/// Rest before a series \[s\].
const REST_S: f64 = 0.4;
/// Maximum joint speed \[rad/s\] and period \[s\] of slow motion.
const SLOW: (f64, f64) = (0.1, 60.0);
/// Speeds of the runs at constant speed \[rad/s\], and the period of each \[s\].
const RUNS: ([f64; 2], f64) = ([0.05, 0.1], 40.0);
/// Mean joint speed of the moves between series, where the limits allow it \[rad/s\].
const MOVE_RAD_PER_S: f64 = 0.4;

/// Returns a request sequence that moves to the start of each series and records the series, one after the other; the plant
/// starts at rest at `home_rad`.
pub fn excitation<const N: usize>(
    name: &str,
    config: &Config<N>,
    plant: &PlantConfig<N>,
    home_rad: &Vector<N>,
    series: &[Fourier<N>],
) -> RequestSequence<N> {
    let mut steps = vec![Step::wait(Request::GravityHold, SETTLE_S)];
    let mut at = *home_rad;
    for series in series {
        let start = series.at(0.0).position_rad;
        steps.push(move_to(config, &start, &at));
        steps.push(Step {
            recorded: true,
            ..Step::wait(Request::Excite(*series), series.duration_s)
        });
        at = series.at(series.duration_s).position_rad;
    }
    RequestSequence {
        name: name.to_owned(),
        config: without_held_joints(config),
        plant: plant.clone(),
        start_rad: *home_rad,
        steps,
    }
}

/// Returns one minute of motion of each of `joints` up to 0.1 rad/s, in which dry friction dominates.
///
/// # Errors
/// Options out of range.
pub fn slow_motion<const N: usize>(
    config: &Config<N>,
    home_rad: &Vector<N>,
    joints: &[usize],
) -> Result<Fourier<N>, IdentError> {
    let (speed_rad_per_s, period_s) = SLOW;
    slow_series(config, home_rad, joints, speed_rad_per_s, period_s)
}

/// Returns back-and-forth motion of each of `joints` at constant speeds, for the identification of torque ripple.
///
/// # Errors
/// Options out of range.
pub fn constant_speed_runs<const N: usize>(
    config: &Config<N>,
    home_rad: &Vector<N>,
    joints: &[usize],
) -> Result<Vec<Fourier<N>>, IdentError> {
    let (speeds, period_s) = RUNS;
    let run = |speed| constant_speed_series(config, home_rad, joints, speed, period_s);
    speeds.into_iter().map(run).collect()
}

/// Returns a move followed by a rest. The move is as slow as the limits of joints and tip require.
pub(crate) fn move_to<const N: usize>(
    config: &Config<N>,
    target_rad: &Vector<N>,
    from_rad: &Vector<N>,
) -> Step<N> {
    let usual_s = ((target_rad - from_rad).amax() / MOVE_RAD_PER_S).max(0.5);
    let duration_s = usual_s.max(within_limits_s(config, from_rad, target_rad));
    let request = Request::Move {
        target_rad: *target_rad,
        duration_s,
    };
    Step::wait(request, duration_s + REST_S)
}

/// Returns the configuration without held joints, so that all joints can be excited.
pub(crate) fn without_held_joints<const N: usize>(config: &Config<N>) -> Config<N> {
    Config {
        roles: [supple_core::config::Role::Active; N],
        ..*config
    }
}
