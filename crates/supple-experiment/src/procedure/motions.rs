//! The motions of a calibration, their requests and how long they take.

use crate::error::ExperimentError;
use crate::excite::move_to;
use crate::request_sequence::Step;
use supple_core::controller::{Breakaway, Request};
use supple_core::dynamics::crba;
use supple_core::trajectory::{Fourier, HARMONICS};
use supple_core::{Config, Vector};
use supple_ident::IdentError;
use supple_ident::design::{DesignOptions, constant_speed_series, design, slow_series};

/// Period of the excitations \[s\], and the number of periods of each and of the unseen motion.
const EXCITATION: (f64, f64, f64) = (12.0, 1.0, 1.25);
/// Number of excitations: other poses tell more than repetitions.
const EXCITATIONS: u64 = 3;
/// Fraction of the amplitude of the first pass, and its number of periods.
const FIRST: (f64, f64) = (0.25, 1.5);
/// Maximum joint speed \[rad/s\] and period \[s\] of slow motion.
const SLOW: (f64, f64) = (0.1, 40.0);
/// Speeds of the runs at constant speed \[rad/s\], and the period of each \[s\].
const CONSTANT: ([f64; 2], f64) = ([0.06, 0.12], 25.0);
/// Seed of the unseen motion, relative to that of the excitation.
const UNSEEN_SEED: u64 = 1000;

/// Slope of the torque ramps that show which joint a motor moves \[N m/s\], and motion at which they stop \[rad\].
pub const WIRING_RAMP: (f64, f64) = (15.0, 0.03);
/// Maximum of that slope over the inertia of the joint \[rad/s^3\]: the joint has about 1 rad/s when its ramp stops.
const WIRING_RAMP_PER_INERTIA: f64 = 200.0;
/// Slope of the ramps that measure the breakaway torque \[N m/s\], and motion at which they stop \[rad\].
pub const BREAKAWAY_RAMP: (f64, f64) = (0.4, 0.025);
/// Maximum torque of a ramp \[N m\].
const RAMP_LIMIT_NM: f64 = 6.0;
/// Distance from its pose within which a joint needs no move \[rad\].
const THERE_RAD: f64 = 5e-3;
/// Time in which the mode of a ramp ends after its torque limit \[s\].
const RAMP_END_S: f64 = 0.3;

/// All motions along Fourier series.
#[derive(Clone, Debug, PartialEq)]
pub struct Motions<const N: usize> {
    /// The excitation at a quarter of its amplitude.
    pub first: Fourier<N>,
    /// The designed excitations.
    pub full: Vec<Fourier<N>>,
    /// Slow motion, for dry friction.
    pub slow: Fourier<N>,
    /// Motion at constant speeds, for torque ripple.
    pub constant: Vec<Fourier<N>>,
    /// Another excitation, for validation.
    pub unseen: Fourier<N>,
}

impl<const N: usize> Motions<N> {
    /// Designs the motions of all joints within the limits of `config`.
    ///
    /// # Errors
    /// Limits that no motion meets.
    pub fn design(
        config: &Config<N>,
        home_rad: &Vector<N>,
        seed: u64,
        candidates: usize,
    ) -> Result<Motions<N>, ExperimentError> {
        let joints: Vec<usize> = (0..N).collect();
        let (period_s, periods, unseen_periods) = EXCITATION;
        let search = |seed, periods, candidates| {
            let options = DesignOptions {
                seed,
                candidates,
                period_s,
                periods,
                ..DesignOptions::of(&joints)
            };
            design(config, home_rad, &options, &mut |_, _| {}).map(|found| found.series)
        };
        let full = (0..EXCITATIONS).map(|k| search(seed.wrapping_add(k), periods, candidates));
        let full = full.collect::<Result<Vec<_>, _>>()?;
        let unseen = search(
            seed.wrapping_add(UNSEEN_SEED),
            unseen_periods,
            (candidates / 10).max(20),
        )?;
        let (speeds, constant_s) = CONSTANT;
        let run = |speed| constant_speed_series(config, home_rad, &joints, speed, constant_s);
        let constant: Result<_, IdentError> = speeds.into_iter().map(run).collect();
        let (speed_rad_per_s, slow_period_s) = SLOW;
        Ok(Motions {
            first: scaled(&full[0], FIRST.0, FIRST.1),
            slow: slow_series(config, home_rad, &joints, speed_rad_per_s, slow_period_s)?,
            constant: constant?,
            full,
            unseen,
        })
    }

    /// All series, in the order in which they are performed.
    pub fn all(&self) -> Vec<Fourier<N>> {
        let mut all = vec![self.first];
        all.extend(&self.full);
        all.push(self.slow);
        all.extend(&self.constant);
        all.push(self.unseen);
        all
    }
}

/// The series with smaller amplitudes and another number of periods.
fn scaled<const N: usize>(series: &Fourier<N>, by: f64, periods: f64) -> Fourier<N> {
    let mut scaled = *series;
    for k in 0..HARMONICS {
        scaled.sine_rad[k] *= by;
        scaled.cosine_rad[k] *= by;
    }
    scaled.duration_s = periods * series.period_s() + series.ramp_s;
    scaled
}

/// Moves to the start of each series and follows it.
pub fn follow<const N: usize>(from_rad: &Vector<N>, all: &[Fourier<N>]) -> Vec<Step<N>> {
    let mut steps = Vec::new();
    let mut at_rad = *from_rad;
    for series in all {
        steps.push(move_to(&series.at(0.0).position_rad, &at_rad));
        steps.push(Step {
            recorded: true,
            ..Step::wait(Request::Excite(*series), series.duration_s)
        });
        at_rad = series.at(series.duration_s).position_rad;
    }
    steps
}

/// Moves to `pose_rad`, ramps the torque of a joint there, in the direction of the sign of `rate_nm_per_s`, and moves
/// back.
pub fn ramp<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    pose_rad: &Vector<N>,
    joint: usize,
    (rate_nm_per_s, stop_rad): (f64, f64),
) -> Vec<Step<N>> {
    let limit_nm = RAMP_LIMIT_NM.min(config.limits.joint_torque_nm[joint]);
    let ramp = Breakaway {
        joint,
        rate_nm_per_s,
        stop_rad,
        limit_nm,
    };
    let duration_s = limit_nm / rate_nm_per_s.abs() + RAMP_END_S;
    let ramp = [
        Step {
            until_done: true,
            recorded: true,
            ..Step::wait(Request::Breakaway(ramp), duration_s)
        },
        // Gravity that the model lacks would pull the arm away from there.
        move_to(pose_rad, pose_rad),
    ];
    let is_there = (pose_rad - from_rad).amax() < THERE_RAD;
    let approach = (!is_there).then(|| move_to(pose_rad, from_rad));
    approach.into_iter().chain(ramp).collect()
}

/// Slope of the ramp that shows whether a motor moves this joint \[N m/s\]: less for a light joint.
pub fn wiring_slope_nm_per_s<const N: usize>(
    config: &Config<N>,
    pose_rad: &Vector<N>,
    joint: usize,
) -> f64 {
    let inertia_kg_m2 = crba(&config.arm, pose_rad)[(joint, joint)];
    WIRING_RAMP.0.min(WIRING_RAMP_PER_INERTIA * inertia_kg_m2)
}

/// Time that ramps in both directions take, for a model with these breakaway torques \[s\].
pub fn ramps_s<const N: usize>(config: &Config<N>) -> f64 {
    let breakaway_nm: f64 = config.friction.iter().map(|f| f.breakaway_nm).sum();
    let moves_s = 5.0 * N as f64 * move_to(&Vector::<N>::zeros(), &Vector::zeros()).duration_s;
    2.0 * breakaway_nm / BREAKAWAY_RAMP.0 + moves_s
}
