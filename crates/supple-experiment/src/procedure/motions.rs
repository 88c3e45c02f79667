//! The motions of a calibration, their requests and durations.

use crate::error::ExperimentError;
use crate::excite::move_to;
use crate::request_sequence::Step;
use supple_core::config::{JointGains, Role};
use supple_core::controller::{Breakaway, Request};
use supple_core::dynamics::{crba, gravity, rnea};
use supple_core::trajectory::{Fourier, HARMONICS, JointReference};
use supple_core::{Config, Controller, Vector};
use supple_ident::IdentError;
use supple_ident::excitation_design::{DesignOptions, constant_speed_series, design, slow_series};

/// Period of the excitations \[s\], and the number of periods of each and of the validation motion.
const EXCITATION: (f64, f64, f64) = (12.0, 1.0, 1.25);
/// Number of excitations: excitations about different poses give more information than repetitions.
const EXCITATIONS: u64 = 3;
/// Fraction of the amplitude of the first pass, and its number of periods.
const FIRST: (f64, f64) = (0.25, 1.5);
/// The same fraction where the designs are [careful](DesignPlan::careful).
const FIRST_OF_CAREFUL: f64 = 0.5;
/// Share of the torque limits that careful designs and their ripple runs use.
const CAREFUL_SHARE: f64 = 1.0 / 1.5;
/// Maximum share of the torque limits that a motion about a pose may need.
const TORQUE_SHARE: f64 = 0.8;
/// Number of times that the amplitude of such a motion is reduced, and the factor.
const REDUCTIONS: (usize, f64) = (20, 0.85);
/// Number of poses of a straight line at which torques are evaluated.
const LINE_POSES: usize = 40;
/// Number of poses of a series at which torques are evaluated.
const POSES: usize = 400;
/// Maximum joint speed \[rad/s\] and period \[s\] of slow motion.
const SLOW: (f64, f64) = (0.1, 40.0);
/// The same period for an arm that falls without torque.
const SLOW_OF_FALLING_S: f64 = 25.0;
/// Share of the joint speeds that designs for such an arm use: the loop with the model of a first fit overshoots.
const SPEED_SHARE_OF_FALLING: f64 = 0.85;
/// Speeds of the runs at constant speed \[rad/s\], and the period of each \[s\].
const CONSTANT: ([f64; 2], f64) = ([0.06, 0.12], 25.0);
/// Seed of the validation motion, relative to that of the excitation.
const UNSEEN_SEED: u64 = 1000;

/// Slope of the torque ramps that determine which joint a motor moves \[N m/s\], and joint motion at which a ramp stops \[rad\].
pub const WIRING_RAMP: (f64, f64) = (15.0, 0.03);
/// Maximum of that slope over the inertia of the joint \[rad/s^3\]: the joint has about 1 rad/s when its ramp stops.
const WIRING_RAMP_PER_INERTIA: f64 = 200.0;
/// Slope of the ramps that measure the breakaway torque \[N m/s\], and joint motion at which a ramp stops \[rad\].
pub const BREAKAWAY_RAMP: (f64, f64) = (0.4, 0.025);
/// Maximum torque of a ramp \[N m\].
pub const RAMP_LIMIT_NM: f64 = 6.0;
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
    /// Motion at constant speeds, for torque ripple; none if it is not identified.
    pub constant: Vec<Fourier<N>>,
    /// Another excitation, for validation.
    pub validation: Fourier<N>,
    /// The pose of the excitations in which gravity needs the smallest share of the torque limits.
    pub light_rad: Vector<N>,
}

/// How the motions are designed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignPlan {
    /// Seed of the designs.
    pub seed: u64,
    /// Number of candidates of each design.
    pub candidates: usize,
    /// Whether the arm falls without torque: gravity may need much of its torque limits, so that slow motion is about the light pose
    /// instead of home.
    pub falls: bool,
    /// Whether torque ripple is identified.
    pub ripple: bool,
    /// Whether motors may give a share of the commanded torque only.
    pub careful: bool,
}

impl<const N: usize> Motions<N> {
    /// Designs the motions of all joints within the limits of `config`.
    ///
    /// # Errors
    /// Limits that no motion satisfies.
    pub fn design(
        config: &Config<N>,
        home_rad: &Vector<N>,
        plan: &DesignPlan,
    ) -> Result<Motions<N>, ExperimentError> {
        let mut config = *config;
        if plan.careful {
            config.limits.joint_torque_nm *= CAREFUL_SHARE;
        }
        if plan.falls {
            config.limits.joint_speed_rad_per_s *= SPEED_SHARE_OF_FALLING;
        }
        let config = &config;
        let (seed, candidates) = (plan.seed, plan.candidates);
        let joints: Vec<usize> = (0..N).collect();
        let (period_s, periods, validation_periods) = EXCITATION;
        let search = |seed, periods, candidates| {
            let options = DesignOptions {
                seed,
                candidates,
                period_s,
                periods,
                ..DesignOptions::new(&joints)
            };
            design(config, home_rad, &options, &mut |_, _| {}).map(|found| found.series)
        };
        let full = (0..EXCITATIONS).map(|k| search(seed.wrapping_add(k), periods, candidates));
        let full = full.collect::<Result<Vec<_>, _>>()?;
        let validation = search(
            seed.wrapping_add(UNSEEN_SEED),
            validation_periods,
            (candidates / 10).max(20),
        )?;
        let light_rad = light_pose(config, &full);
        let centre_rad = if plan.falls { &light_rad } else { home_rad };
        let fitting = |series: Fourier<N>| match plan.falls {
            true => within_torque(config, series),
            false => series,
        };
        let (speeds, constant_s) = CONSTANT;
        let run = |speed| constant_speed_series(config, centre_rad, &joints, speed, constant_s);
        let speeds = speeds.into_iter().filter(|_| plan.ripple);
        let constant: Result<Vec<_>, IdentError> = speeds.map(run).collect();
        let (speed_rad_per_s, slow_period_s) = SLOW;
        let slow_period_s = match plan.falls {
            true => SLOW_OF_FALLING_S,
            false => slow_period_s,
        };
        let slow = slow_series(config, centre_rad, &joints, speed_rad_per_s, slow_period_s)?;
        let first = if plan.careful {
            FIRST_OF_CAREFUL
        } else {
            FIRST.0
        };
        Ok(Motions {
            first: scaled(&full[0], first, FIRST.1),
            slow: fitting(slow),
            constant: constant?.into_iter().map(fitting).collect(),
            full,
            validation,
            light_rad,
        })
    }

    /// Returns all series, in the order in which they are performed.
    pub fn all(&self) -> Vec<Fourier<N>> {
        let mut all = vec![self.first];
        all.extend(&self.full);
        all.push(self.slow);
        all.extend(&self.constant);
        all.push(self.validation);
        all
    }
}

/// Returns the greatest gains of the move mode at which the position loops of `model` are stable in all poses of these series.
///
/// # Errors
/// A configuration that no controller accepts.
pub fn gains_along<const N: usize>(
    model: &Config<N>,
    all: &[Fourier<N>],
) -> Result<JointGains<N>, ExperimentError> {
    let controller = Controller::new(*model)?;
    let mut gains = model.move_gains;
    for state in all.iter().flat_map(states) {
        let here = controller.move_gains(&crba(&model.arm, &state.position_rad));
        gains.stiffness_nm_per_rad = gains.stiffness_nm_per_rad.inf(&here.stiffness_nm_per_rad);
        gains.damping_nm_s_per_rad = gains.damping_nm_s_per_rad.inf(&here.damping_nm_s_per_rad);
    }
    Ok(gains)
}

fn states<const N: usize>(series: &Fourier<N>) -> impl Iterator<Item = JointReference<N>> {
    let series = *series;
    (0..=POSES).map(move |i| series.at(series.duration_s * i as f64 / POSES as f64))
}

/// Returns the greatest ratio of a torque to its limit.
fn share<const N: usize>(config: &Config<N>, torque_nm: &Vector<N>) -> f64 {
    let shares = torque_nm.component_div(&config.limits.joint_torque_nm);
    shares.amax()
}

/// Returns the pose of these series in which gravity needs the smallest share of the torque limits.
fn light_pose<const N: usize>(config: &Config<N>, all: &[Fourier<N>]) -> Vector<N> {
    let poses = all.iter().flat_map(states).map(|state| state.position_rad);
    let weighed = poses.map(|q| (share(config, &gravity(&config.arm, &q)), q));
    let light = weighed.min_by(|a, b| a.0.total_cmp(&b.0));
    light.map_or_else(Vector::zeros, |(_, q)| q)
}

/// Returns the series with amplitudes for which the model needs no more than [`TORQUE_SHARE`] of the torque limits.
fn within_torque<const N: usize>(config: &Config<N>, mut series: Fourier<N>) -> Fourier<N> {
    let (times, by) = REDUCTIONS;
    for _ in 0..times {
        let needs = states(&series).map(|state| {
            let speed = &state.velocity_rad_per_s;
            let friction = Vector::from_fn(|j, _| config.friction[j].torque_nm(speed[j]));
            let q = &state.position_rad;
            let moved = rnea(&config.arm, q, speed, &state.acceleration_rad_per_s2);
            share(config, &(moved + friction))
        });
        if needs.fold(0.0, f64::max) <= TORQUE_SHARE {
            break;
        }
        series = scaled(&series, by, 1.0);
    }
    series
}

/// Returns the series with its amplitudes multiplied by `by`, and with `periods` periods.
fn scaled<const N: usize>(series: &Fourier<N>, by: f64, periods: f64) -> Fourier<N> {
    let mut scaled = *series;
    for k in 0..HARMONICS {
        scaled.sine_rad[k] *= by;
        scaled.cosine_rad[k] *= by;
    }
    scaled.duration_s = periods * series.period_s() + series.ramp_s;
    scaled
}

/// Via pose of moves whose straight line would need more than [`TORQUE_SHARE`] of the torque limits.
#[derive(Clone, Copy, Debug)]
pub struct ViaPose<const N: usize> {
    /// The model.
    pub config: Config<N>,
    /// The candidates: a pose in which gravity needs little torque, and home.
    pub via_rad: [Vector<N>; 2],
}

impl<const N: usize> ViaPose<N> {
    /// Creates the via poses of an arm, whose held joints stay in the home pose.
    pub fn new(config: Config<N>, light_rad: &Vector<N>, home_rad: Vector<N>) -> ViaPose<N> {
        ViaPose {
            config,
            via_rad: [with_held_at(&config, light_rad, &home_rad), home_rad],
        }
    }

    /// Returns the greatest share of a torque limit that gravity and dry friction under its load need along a line.
    fn share_along(&self, from_rad: &Vector<N>, to_rad: &Vector<N>) -> f64 {
        let config = &self.config;
        let at = |i: usize| {
            let q = from_rad + (to_rad - from_rad) * (i as f64 / LINE_POSES as f64);
            let load_nm = gravity(&config.arm, &q);
            let dry_nm =
                Vector::from_fn(|j, _| config.friction[j].at_load(load_nm[j]).dry_size_nm(0.0));
            share(config, &(load_nm.abs() + dry_nm))
        };
        (0..=LINE_POSES).map(at).fold(0.0, f64::max)
    }

    fn moves(&self, from_rad: &Vector<N>, to_rad: &Vector<N>) -> Vec<Step<N>> {
        let direct = vec![move_to(&self.config, to_rad, from_rad)];
        let straight = self.share_along(from_rad, to_rad);
        if straight <= TORQUE_SHARE {
            return direct;
        }
        let around = self.via_rad.iter().map(|via_rad| {
            let first = self.share_along(from_rad, via_rad);
            (first.max(self.share_along(via_rad, to_rad)), via_rad)
        });
        match around.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((share, via_rad)) if share < straight => vec![
                move_to(&self.config, via_rad, from_rad),
                move_to(&self.config, to_rad, via_rad),
            ],
            _ => direct,
        }
    }
}

/// Returns a pose with the held joints of another one.
pub fn with_held_at<const N: usize>(
    config: &Config<N>,
    pose_rad: &Vector<N>,
    held_rad: &Vector<N>,
) -> Vector<N> {
    Vector::from_fn(|joint, _| match config.roles[joint] {
        Role::Held { .. } => held_rad[joint],
        Role::Active => pose_rad[joint],
    })
}

/// Returns the moves that lead from one pose to another, by way of the via pose if there is one and the straight line needs it.
pub fn moves<const N: usize>(
    config: &Config<N>,
    via_pose: Option<&ViaPose<N>>,
    from_rad: &Vector<N>,
    to_rad: &Vector<N>,
) -> Vec<Step<N>> {
    match via_pose {
        Some(via_pose) => via_pose.moves(from_rad, to_rad),
        None => vec![move_to(config, to_rad, from_rad)],
    }
}

/// Returns a route over every way in which the arm may go from each pose to the next and home at the end: straight, or by a via pose.
pub fn every_way<const N: usize>(
    from_rad: &Vector<N>,
    poses: &[Vector<N>],
    home_rad: &Vector<N>,
    via_pose: Option<&ViaPose<N>>,
) -> Vec<Vector<N>> {
    let vias = via_pose.map_or(&[][..], |via_pose| &via_pose.via_rad);
    let mut route = Vec::new();
    let mut at_rad = *from_rad;
    for to_rad in poses.iter().chain([home_rad]) {
        for via_rad in vias {
            route.extend([*via_rad, *to_rad, at_rad]);
        }
        route.push(*to_rad);
        at_rad = *to_rad;
    }
    route
}

/// Returns the steps that move to the start of each series and follow it.
pub fn follow<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    all: &[Fourier<N>],
    via_pose: Option<&ViaPose<N>>,
) -> Vec<Step<N>> {
    let mut steps = Vec::new();
    let mut at_rad = *from_rad;
    for series in all {
        let start_rad = series.at(0.0).position_rad;
        steps.extend(moves(config, via_pose, &at_rad, &start_rad));
        steps.push(Step {
            recorded: true,
            ..Step::wait(Request::Excite(*series), series.duration_s)
        });
        at_rad = series.at(series.duration_s).position_rad;
    }
    steps
}

/// Returns the steps that move to `pose_rad`, ramp the torque of a joint in that pose, in the direction of the sign of
/// `rate_nm_per_s`, and move back.
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
        // Gravity that the model lacks would pull the arm away from that pose.
        move_to(config, pose_rad, pose_rad),
    ];
    let is_there = (pose_rad - from_rad).amax() < THERE_RAD;
    let approach = (!is_there).then(|| move_to(config, pose_rad, from_rad));
    approach.into_iter().chain(ramp).collect()
}

/// Returns the slope of the ramp that determines whether a motor moves this joint \[N m/s\]: smaller for a joint of small
/// inertia.
pub fn wiring_slope_nm_per_s<const N: usize>(
    config: &Config<N>,
    pose_rad: &Vector<N>,
    joint: usize,
) -> f64 {
    let inertia_kg_m2 = crba(&config.arm, pose_rad)[(joint, joint)];
    WIRING_RAMP.0.min(WIRING_RAMP_PER_INERTIA * inertia_kg_m2)
}

/// Returns the duration of ramps in both directions, for a model with these breakaway torques \[s\].
pub fn ramps_s<const N: usize>(config: &Config<N>) -> f64 {
    let breakaway_nm: f64 = config.friction.iter().map(|f| f.breakaway_nm).sum();
    let there = Vector::zeros();
    let moves_s = 5.0 * N as f64 * move_to(config, &there, &there).duration_s;
    2.0 * breakaway_nm / BREAKAWAY_RAMP.0 + moves_s
}

#[cfg(test)]
pub(super) mod tests {
    use super::{TORQUE_SHARE, ViaPose, moves};
    use supple_core::{Config, Vector};
    use supple_model::Description;

    /// Returns a YAM whose motors give 60 % of the torque that is commanded.
    pub(in crate::procedure) fn yam() -> Config<6> {
        let mut config: Config<6> = Description::asset("yam").unwrap().config().unwrap();
        config.limits.joint_torque_nm *= 0.6;
        config
    }

    /// Returns 100 poses that fill the limits of an arm: multiples of irrational numbers, without their integer part.
    pub(in crate::procedure) fn spread_poses(config: &Config<6>) -> Vec<Vector<6>> {
        let lower_rad = config.limits.position_lower_rad;
        let range_rad = config.limits.position_upper_rad - lower_rad;
        let share = |k: usize, j: usize| {
            (k as f64 * [2.0, 3.0, 5.0, 7.0, 11.0, 13.0_f64][j].sqrt()).fract()
        };
        let pose = |k| Vector::from_fn(|j, _| lower_rad[j] + share(k, j) * range_rad[j]);
        (1..=100).map(pose).collect()
    }

    /// Both a straight line that suffices and a way around it occur; the way around needs less torque.
    #[test]
    fn a_move_goes_by_a_via_pose_where_the_straight_line_needs_more_torque() {
        let config = yam();
        let mut counts = [0; 2];
        for poses in spread_poses(&config).chunks_exact(4) {
            let (from_rad, to_rad) = (&poses[0], &poses[1]);
            let via_pose = ViaPose {
                config,
                via_rad: [poses[2], poses[3]],
            };
            let straight = via_pose.share_along(from_rad, to_rad);
            let around = via_pose.via_rad.map(|via_rad| {
                let first = via_pose.share_along(from_rad, &via_rad);
                first.max(via_pose.share_along(&via_rad, to_rad))
            });
            let least = around[0].min(around[1]);
            let steps = moves(&config, Some(&via_pose), from_rad, to_rad).len();
            let goes_around = straight > TORQUE_SHARE && least < straight;
            assert_eq!(
                steps,
                if goes_around { 2 } else { 1 },
                "{straight} {around:?}"
            );
            assert_eq!(moves(&config, None, from_rad, to_rad).len(), 1);
            counts[steps - 1] += 1;
        }
        assert!(counts[0] > 3 && counts[1] > 3, "{counts:?}");
    }
}
