//! Finds which joints the law controls, the home pose, and the place of the paths.
//!
//! Over poses that are spread evenly, the three active joints are those with which the tip moves best (the mean of the
//! smallest singular value of their Jacobian, over the better half of the poses); all others are held, at zero or in the
//! middle of their range. Then the paper's paths are laid around the tip of many poses, as large as the arm follows
//! with a margin: joints clear of their stops, no pose near a singular one, gravity within half and speeds within the
//! limits. Collisions of the arm with itself and with what stands around it are not known and not checked.

use super::gains::Gains;
use super::write::{Writer, list};
use crate::description::Description;
use crate::error::{ModelError, Reporter};
use crate::paths::Paths;
use crate::reach::{self, active_joints, min_singular_value_m, spread_poses};
use core::f64::consts::PI;
use supple_core::config::Role;
use supple_core::dynamics::{Terms, gravity, terms, tip_pose};
use supple_core::math::Vector3;
use supple_core::task::Task;
use supple_core::{Config, Trajectory, Vector};
use toml_edit::{InlineTable, Value};

/// Poses over which triples of joints are compared.
const TRIPLE_POSES: u32 = 40;
/// Poses in whose surroundings the paths are tried.
const POSES: u32 = 300;
/// Those in which the weight of the arm at the tip is least, which are tried in detail: an error of the gravity model then
/// does least.
const TRIED: usize = 60;
/// Sizes that are tried, relative to the paper's.
const SCALES: [f64; 9] = [1.0, 0.8, 0.65, 0.5, 0.4, 0.3, 0.2, 0.15, 0.1];
/// Points on each path.
const POINTS: u32 = 24;
/// Distance from the soft zone that a joint keeps \[rad\].
const STOP_MARGIN_RAD: f64 = 0.05;
/// Share of the torque limit that gravity may use.
const GRAVITY_SHARE: f64 = 0.6;
/// Share of the joint speed limits that the fastest path may use.
const SPEED_SHARE: f64 = 0.6;
/// Smallest singular value on the paths with which the law is not damped ([`supple_core::task`]) \[m\], and the smallest size for
/// which it is asked.
const REGULAR: (f64, f64) = (0.19, 0.3);
/// Otherwise this share of the arm's best, for paths of at most this size: the law then leaves out a part of the inertia.
const NEAR_REGULAR: (f64, f64) = (0.75, 0.4);
/// Otherwise this share, for any size.
const SINGULAR_SHARE: f64 = 0.5;
/// Least distance of the tip from the base's vertical axis, as a share of the arm's reach.
const MIN_RADIUS: f64 = 0.15;
/// Fastest of the demo's sinusoids and quadrants, relative to the paper and in m/s.
const FASTEST: (f64, f64) = (2.0, 0.1 * PI);

/// What was found.
pub(super) struct Placed<const N: usize> {
    roles_are_chosen: bool,
    roles: [Role; N],
    home_rad: Vector<N>,
    paths: Paths,
}

impl<const N: usize> Placed<N> {
    /// Searches; `choose_roles` replaces the roles of the description.
    pub fn find(description: &Description, choose_roles: bool) -> Result<Self, ModelError> {
        let mut config = description.config::<N>()?;
        let roles_are_chosen = choose_roles && N > 3;
        if roles_are_chosen {
            config.roles = choose_three(&config);
        }
        let (home_rad, paths) = place(&config).ok_or_else(|| {
            let report = Reporter {
                file: description.toml_file(),
            };
            report.invalid(
                "[paths]",
                "no pose was found from which the arm follows even paths of a tenth of the paper's size, \
                 clear of stops and singular poses",
                format!("{} active joints", active_joints(&config).len()),
                "give home_rad and [paths], other joints as held, or another tip_frame",
            )
        })?;
        Ok(Self {
            roles_are_chosen,
            roles: config.roles,
            home_rad,
            paths,
        })
    }

    /// Adds home pose and paths.
    pub fn add(&self, writer: &mut Writer) {
        let home: Vec<f64> = self.home_rad.iter().copied().collect();
        let why = "bent, clear of the stops, the tip where the sinusoid starts";
        writer.set("", "home_rad", list(&home), why);
        let Paths {
            radius_m,
            azimuth_rad,
            height_m,
            scale,
        } = self.paths;
        writer.set(
            "paths",
            "radius_m",
            radius_m,
            "centre of the paths: the tip at home",
        );
        writer.set(
            "paths",
            "azimuth_rad",
            azimuth_rad,
            "outward from the base's vertical axis",
        );
        writer.set(
            "paths",
            "height_m",
            height_m,
            "of the centre above the base frame",
        );
        writer.set(
            "paths",
            "scale",
            scale,
            "the largest of the tried sizes that the arm follows with a margin",
        );
    }

    /// Adds `held` to all joints that are not active.
    pub fn hold(&self, writer: &mut Writer, gains: &Gains<N>) {
        if !self.roles_are_chosen {
            return;
        }
        for (i, role) in self.roles.iter().enumerate() {
            let Role::Held { position_rad, .. } = role else {
                continue;
            };
            let mut held = InlineTable::new();
            held.insert("position_rad", (*position_rad).into());
            held.insert("stiffness_nm_per_rad", gains.stiffness[i].into());
            held.insert("damping_nm_s_per_rad", gains.damping[i].into());
            let why = "the law controls the three joints that move the tip best; remove it to control this one too";
            writer.joint(i, "held", Value::InlineTable(held), why);
        }
    }
}

/// Returns zero if the joint is then clear of its stops, otherwise the middle of its range.
fn rest_rad<const N: usize>(config: &Config<N>, joint: usize) -> f64 {
    let (lower, upper) = (
        config.limits.position_lower_rad[joint],
        config.limits.position_upper_rad[joint],
    );
    let margin = config.limits.soft_zone_rad + 0.1 * (upper - lower);
    match (lower + margin..=upper - margin).contains(&0.0) {
        true => 0.0,
        false => rounded3(0.5 * (lower + upper)),
    }
}

/// Rounds to a millimetre or a milliradian.
fn rounded3(value: f64) -> f64 {
    format!("{value:.3}").parse().unwrap_or(value)
}

fn held_but<const N: usize>(config: &Config<N>, active: &[usize; 3]) -> [Role; N] {
    core::array::from_fn(|i| match active.contains(&i) {
        true => Role::Active,
        false => Role::Held {
            position_rad: rest_rad(config, i),
            stiffness_nm_per_rad: 1.0,
            damping_nm_s_per_rad: 0.0,
        },
    })
}

/// Returns the three joints with which the tip moves best.
fn choose_three<const N: usize>(config: &Config<N>) -> [Role; N] {
    let mut best: Option<(f64, [Role; N])> = None;
    for a in 0..N {
        for b in a + 1..N {
            for c in b + 1..N {
                let roles = held_but(config, &[a, b, c]);
                let config = Config { roles, ..*config };
                let mut values: Vec<f64> = poses(&config, TRIPLE_POSES)
                    .map(|q| min_singular_value_m(&config, &q))
                    .collect();
                values.sort_by(|x, y| y.total_cmp(x));
                let half = &values[..values.len() / 2];
                let mean = half.iter().sum::<f64>() / half.len() as f64;
                if best.is_none_or(|(most, _)| mean > 1.02 * most) {
                    best = Some((mean, roles));
                }
            }
        }
    }
    best.map_or(config.roles, |(_, roles)| roles)
}

/// Returns the evenly spread poses, held joints at their angle, no joint beyond half a turn.
fn poses<const N: usize>(config: &Config<N>, count: u32) -> impl Iterator<Item = Vector<N>> {
    let mut within = *config;
    within.limits.position_lower_rad = config.limits.position_lower_rad.map(|x| x.max(-PI));
    within.limits.position_upper_rad = config.limits.position_upper_rad.map(|x| x.min(PI));
    let poses: Vec<Vector<N>> = spread_poses(&within, count).collect();
    let roles = config.roles;
    poses.into_iter().map(move |q| {
        Vector::from_fn(|i, _| match roles[i] {
            Role::Held { position_rad, .. } => position_rad,
            Role::Active => q[i],
        })
    })
}

/// Returns the force at the tip that carries the gravity torques of the active joints \[N\].
pub(crate) fn tip_weight_n<const N: usize>(config: &Config<N>, q: &Vector<N>) -> f64 {
    let mut state = Terms::default();
    terms(&config.arm, q, &Vector::zeros(), &mut state);
    let task = Task::new(&state, &config.roles);
    task.map_or(0.0, |task| task.inverse.tr_mul(&state.gravity).norm())
}

/// Returns the greatest share of a torque limit that gravity takes.
fn gravity_share<const N: usize>(config: &Config<N>, q: &Vector<N>) -> f64 {
    let torque_nm = gravity(&config.arm, q);
    let share = torque_nm.component_div(&config.limits.joint_torque_nm);
    share.amax()
}

/// Returns the home pose and paths.
fn place<const N: usize>(config: &Config<N>) -> Option<(Vector<N>, Paths)> {
    let tip = |q: &Vector<N>| tip_pose(&config.arm, q).translation;
    let all: Vec<(Vector<N>, Vector3<f64>, f64)> = poses(config, POSES)
        .map(|q| (q, tip(&q), min_singular_value_m(config, &q)))
        .collect();
    let reach_m = all
        .iter()
        .map(|(_, tip, _)| tip.xy().norm())
        .fold(0.0, f64::max);
    let best_sigma = all.iter().map(|(.., sigma)| *sigma).fold(0.0, f64::max);
    let any_sigma = REGULAR.0.min(SINGULAR_SHARE * best_sigma);
    let mut candidates: Vec<(f64, Vector3<f64>, Vector<N>)> = all
        .into_iter()
        .filter(|(q, tip, sigma)| {
            *sigma >= any_sigma
                && tip.xy().norm() >= MIN_RADIUS * reach_m
                && gravity_share(config, q) <= GRAVITY_SHARE
        })
        .map(|(q, tip, _)| (tip_weight_n(config, &q), tip, q))
        .collect();
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
    candidates.truncate(TRIED);
    let regular = SCALES.iter().filter(|scale| **scale >= REGULAR.1);
    let regular = regular.map(|scale| (*scale, REGULAR.0));
    let near = SCALES.iter().filter(|scale| **scale <= NEAR_REGULAR.1);
    let near = near.map(|scale| (*scale, NEAR_REGULAR.0 * best_sigma));
    let any = SCALES.iter().map(|scale| (*scale, any_sigma));
    for (scale, min_sigma) in regular.chain(near).chain(any) {
        let check = Check { config, min_sigma };
        let mut found: Vec<(f64, Paths)> = candidates
            .iter()
            .filter_map(|(_, tip, q)| {
                let paths = Paths {
                    radius_m: rounded3(tip.xy().norm()),
                    azimuth_rad: rounded3(supple_core::math::atan2(tip.y, tip.x)),
                    height_m: rounded3(tip.z),
                    scale,
                };
                Some((check.weight_n(&paths, q)?, paths))
            })
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, paths) in found {
            if let Some(home_rad) = check.start(&paths) {
                return Some((home_rad.map(rounded3), paths));
            }
        }
    }
    None
}

/// The checks of a place.
struct Check<'a, const N: usize> {
    config: &'a Config<N>,
    min_sigma: f64,
}

impl<const N: usize> Check<'_, N> {
    /// Returns the four paths, at their fastest, each with the time that holds its whole geometry \[s\].
    fn paths(&self, paths: &Paths) -> [(Trajectory, f64); 4] {
        let (sinusoid, sinusoid_s) = paths.sinusoid(FASTEST.0);
        let (quadrant, quadrant_s) = paths.quadrant(FASTEST.1);
        let (arc, arc_s) = paths.arc(1.0);
        let (probe, probe_s) = paths.probe(0.02);
        [
            (sinusoid, 0.6 * sinusoid_s),
            (Trajectory::Quadrant(quadrant), 0.55 * quadrant_s),
            (arc, 0.6 * arc_s),
            (Trajectory::Probe(probe), probe_s),
        ]
    }

    /// Returns the greatest weight of the arm at the tip on all paths \[N\], from the pose `q` at their centre; `None` if the arm
    /// does not follow them.
    fn weight_n(&self, paths: &Paths, q: &Vector<N>) -> Option<f64> {
        let mut weight_n: f64 = 0.0;
        for (trajectory, duration_s) in self.paths(paths) {
            let mut q = *q;
            for k in 0..=POINTS {
                let time_s = duration_s * f64::from(k) / f64::from(POINTS);
                let reference = trajectory.at(time_s);
                let found = reach::solve(self.config, &q, &reference.position);
                q = found.position_rad;
                if !(found.reached() && self.is_good(&q, &reference.velocity)) {
                    return None;
                }
                weight_n = weight_n.max(tip_weight_n(self.config, &q));
            }
        }
        Some(weight_n)
    }

    /// Returns whether a pose on a path, at this velocity of the tip, keeps the margins.
    fn is_good(&self, q: &Vector<N>, velocity: &Vector3<f64>) -> bool {
        let limits = &self.config.limits;
        let margin = limits.soft_zone_rad + STOP_MARGIN_RAD;
        let is_clear = |i: usize| {
            self.config.roles[i] != Role::Active
                || (limits.position_lower_rad[i] + margin..=limits.position_upper_rad[i] - margin)
                    .contains(&q[i])
        };
        if !(0..N).all(is_clear) || gravity_share(self.config, q) > GRAVITY_SHARE {
            return false;
        }
        let mut state = Terms::default();
        terms(&self.config.arm, q, &Vector::zeros(), &mut state);
        let Some(task) = Task::new(&state, &self.config.roles) else {
            return false;
        };
        let speed = task.inverse * velocity;
        task.min_singular_value_m >= self.min_sigma
            && (0..N).all(|i| speed[i].abs() <= SPEED_SHARE * limits.joint_speed_rad_per_s[i])
    }

    /// Returns the start pose of the sinusoid, if every path can be followed from the start pose that a run would choose.
    fn start(&self, paths: &Paths) -> Option<Vector<N>> {
        let mut home = None;
        for (trajectory, duration_s) in self.paths(paths) {
            let start = reach::start_pose(self.config, &trajectory, duration_s).ok()?;
            home = home.or(Some(start));
        }
        home
    }
}
