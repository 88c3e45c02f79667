//! Moves between excitation series stay below the limits of joints and tip.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use supple_core::controller::Request;
use supple_core::dynamics::tip_pose;
use supple_core::math::smooth_step;
use supple_core::trajectory::Fourier;
use supple_core::{Config, Vector};
use supple_experiment::excitation;
use supple_model::{Description, with_dof};
use supple_plant::PlantConfig;

const ARMS: [&str; 5] = ["wam3", "wam4", "wam7", "openarm", "yam"];
/// Poses for each arm.
const POSES: usize = 40;
/// Number of points on a move at which speeds are computed from differences.
const POINTS: u32 = 400;
/// Mean speed of a move that no limit slows down \[rad/s\], and its minimum duration \[s\].
const USUAL: (f64, f64) = (0.4, 0.5);

/// A series that rests at `pose_rad`.
fn rest<const N: usize>(pose_rad: Vector<N>) -> Fourier<N> {
    Fourier {
        centre_rad: pose_rad,
        sine_rad: core::array::from_fn(|_| Vector::zeros()),
        cosine_rad: core::array::from_fn(|_| Vector::zeros()),
        angular_frequency_rad_per_s: 1.0,
        duration_s: 2.0,
        ramp_s: 1.0,
    }
}

fn random_pose<const N: usize>(config: &Config<N>, random: &mut ChaCha8Rng) -> Vector<N> {
    let limits = &config.limits;
    Vector::from_fn(|i, _| {
        let (lower, upper) = (limits.position_lower_rad[i], limits.position_upper_rad[i]);
        lower + (upper - lower) * random.random_range(0.0..1.0)
    })
}

/// Durations of the moves from pose to pose, with their ends.
fn moves<const N: usize>(
    config: &Config<N>,
    plant: &PlantConfig<N>,
    poses: &[Vector<N>],
) -> Vec<(Vector<N>, Vector<N>, f64)> {
    let series: Vec<Fourier<N>> = poses[1..].iter().map(|pose| rest(*pose)).collect();
    let sequence = excitation("moves", config, plant, &poses[0], &series);
    let mut from_rad = poses[0];
    let mut found = Vec::new();
    for step in &sequence.steps {
        if let Request::Move {
            target_rad,
            duration_s,
        } = step.request
        {
            found.push((from_rad, target_rad, duration_s));
            from_rad = target_rad;
        }
    }
    found
}

/// Greatest shares of the speed limits, of the joints and of the tip, on a minimum-jerk move, from differences of poses.
fn shares<const N: usize>(
    config: &Config<N>,
    (from_rad, to_rad, duration_s): &(Vector<N>, Vector<N>, f64),
) -> (f64, f64) {
    let limits = &config.limits;
    let pose = |k: u32| {
        let (share, ..) = smooth_step(f64::from(k) / f64::from(POINTS));
        from_rad + (to_rad - from_rad) * share
    };
    let step_s = duration_s / f64::from(POINTS);
    (0..POINTS).fold((0.0, 0.0), |(joints, tip): (f64, f64), k| {
        let (before, after) = (pose(k), pose(k + 1));
        let of_joints =
            (0..N).map(|i| (after[i] - before[i]).abs() / step_s / limits.joint_speed_rad_per_s[i]);
        let at = |q: &Vector<N>| tip_pose(&config.arm, q).translation;
        let tip_m_per_s = (at(&after) - at(&before)).norm() / step_s;
        (
            of_joints.fold(joints, f64::max),
            tip.max(tip_m_per_s / limits.tip_speed_m_per_s),
        )
    })
}

fn with_random_limits<const N: usize>(config: &Config<N>, random: &mut ChaCha8Rng) -> Config<N> {
    let mut slow = *config;
    let mut factor = || 10.0_f64.powf(random.random_range(-2.0..0.0));
    slow.limits.tip_speed_m_per_s *= factor();
    for i in 0..N {
        slow.limits.joint_speed_rad_per_s[i] *= factor();
        slow.limits.joint_acceleration_rad_per_s2[i] *= factor();
        slow.limits.joint_jerk_rad_per_s3[i] *= factor();
    }
    slow
}

fn stays_below<const N: usize>(arm: &Description, random: &mut ChaCha8Rng) {
    let config = arm.config::<N>().expect("an arm");
    let plant = PlantConfig::<N>::from_description(arm).expect("an arm");
    let poses: Vec<Vector<N>> = (0..POSES).map(|_| random_pose(&config, random)).collect();
    let mut slowed = 0;
    for _ in 0..3 {
        let config = with_random_limits(&config, random);
        for each in moves(&config, &plant, &poses) {
            let (joints, tip) = shares(&config, &each);
            assert!(joints < 1.0 && tip < 1.0, "{}: {joints}, {tip}", arm.name());
            let (from_rad, to_rad, duration_s) = each;
            let way = to_rad - from_rad;
            for i in 0..N {
                let limits = &config.limits;
                let distance_rad = way[i].abs();
                // Peaks of a minimum-jerk move.
                let acceleration = 10.0 / 3.0_f64.sqrt() * distance_rad / duration_s.powi(2);
                let jerk = 60.0 * distance_rad / duration_s.powi(3);
                assert!(acceleration < limits.joint_acceleration_rad_per_s2[i]);
                assert!(jerk < limits.joint_jerk_rad_per_s3[i]);
            }
            slowed += usize::from(duration_s > (way.amax() / USUAL.0).max(USUAL.1));
        }
    }
    assert!(slowed > POSES, "{}: {slowed} moves are slower", arm.name());
}

#[test]
fn a_move_stays_below_low_limits_of_joints_and_tip() {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    for name in ARMS {
        let arm = Description::asset(name).expect("built in");
        with_dof!(arm.dof(), N => stays_below::<N>(&arm, &mut random)).expect("an arm");
    }
}

/// If the limits allow it, a move of the WAM has the usual mean speed.
#[test]
fn a_move_of_the_wam_within_the_limits_is_as_fast_as_usual() {
    let arm = Description::asset("wam4").expect("built in");
    let mut config = arm.config::<4>().expect("four joints");
    // All joints at once move the tip at up to twice its limit.
    config.limits.tip_speed_m_per_s *= 2.0;
    let plant = PlantConfig::<4>::from_description(&arm).expect("four joints");
    let mut random = ChaCha8Rng::seed_from_u64(12);
    let poses: Vec<Vector<4>> = (0..POSES)
        .map(|_| random_pose(&config, &mut random))
        .collect();
    for (from_rad, to_rad, duration_s) in moves(&config, &plant, &poses) {
        let usual_s = ((to_rad - from_rad).amax() / USUAL.0).max(USUAL.1);
        assert_eq!(duration_s, usual_s);
    }
}
