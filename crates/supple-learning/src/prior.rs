//! The unknowns and their prior before any motion.

use nalgebra::{DMatrix, DVector};
use supple_core::Config;
use supple_core::learned::{JointMap, LearnedBounds, LearnedParameters, LearnedTerms, MAP_KNOTS};

/// Order of the unknowns in a joint's equations: the joint's own unknowns, then the unknowns that all joints share.
pub mod unknowns {
    use super::MAP_KNOTS;

    /// Change of the viscous friction.
    pub const VISCOUS: usize = 0;
    /// Change of the Coulomb friction.
    pub const COULOMB: usize = 1;
    /// Offset.
    pub const OFFSET: usize = 2;
    /// Torque scale.
    pub const SCALE: usize = 3;
    /// First coefficient of the map's part over the angle alone.
    pub const MAP_TORQUE: usize = 4;
    /// First coefficient of the map's part against the motion.
    pub const MAP_DRY: usize = MAP_TORQUE + MAP_KNOTS;
    /// Change of the logarithm of the presliding distance. Like the two unknowns after it, it is estimated so that equations of low speeds
    /// do not change the others, and not requested.
    pub const PRESLIDING: usize = MAP_DRY + MAP_KNOTS;
    /// Change of the Stribeck effect `S_0 - S`.
    pub const STRIBECK: usize = PRESLIDING + 1;
    /// Change of its offset `O_s`.
    pub const STRIBECK_OFFSET: usize = STRIBECK + 1;
    /// Unknowns of a joint.
    pub const JOINT: usize = STRIBECK_OFFSET + 1;
    /// Payload mass, the first of the shared unknowns.
    pub const PAYLOAD: usize = JOINT;
    /// First moment of the payload, three.
    pub const MOMENT: usize = PAYLOAD + 1;
    /// Tilt, three.
    pub const TILT: usize = MOMENT + 3;
    /// Shared unknowns.
    pub const SHARED: usize = 7;
    /// All unknowns in the equations of one joint.
    pub const ALL: usize = JOINT + SHARED;
}
use unknowns::{
    ALL, COULOMB, JOINT, MAP_DRY, MAP_TORQUE, MOMENT, OFFSET, PAYLOAD, PRESLIDING, SCALE, SHARED,
    STRIBECK, STRIBECK_OFFSET, TILT, VISCOUS,
};

/// Standard deviation of the prior relative to the bound, for payload, tilt and friction.
const PRIOR_SHARE: f64 = 0.4;
/// The same ratio for a torque scale, which identification determines better than its bound.
const SCALE_SHARE: f64 = 0.2;
/// The same ratio for an offset, which payload and tilt can explain as well.
const OFFSET_SHARE: f64 = 0.05;
/// The same ratio for the map's part that depends on the angle alone.
const MAP_TORQUE_SHARE: f64 = 0.05;
/// Standard deviation of the map's part against the motion, relative to the Coulomb friction.
const MAP_DRY_SHARE: f64 = 0.2;
/// Standard deviation of the map's second differences relative to that of its coefficients, which determines its smoothness.
const SMOOTHNESS: f64 = 0.5;
/// Standard deviation of the change of the logarithm of the presliding distance, and its bound.
const PRESLIDING_STD: f64 = 0.3;
const PRESLIDING_BOUND: f64 = 1.0;
/// Standard deviation of the change of the Stribeck effect in proportion to the Coulomb friction, and its bound. That of its offset is
/// as the offset's. Both are small: of a joint that only creeps, they are not told apart from what is requested.
const STRIBECK_SHARE: f64 = 0.05;
const STRIBECK_BOUND: f64 = 0.5;
/// Minimum standard deviation, so that no precision is infinite.
const MIN_STD: f64 = 1e-9;
/// Share of the dry friction, and of the torque limit, in the noise of a joint's torque.
const NOISE_FRICTION_SHARE: f64 = 0.1;
const NOISE_TORQUE_SHARE: f64 = 4e-4;

/// Prior and bounds of one arm.
#[derive(Clone, Debug)]
pub struct Prior<const N: usize> {
    /// Prior precision of each joint's own unknowns.
    pub joint_precision: Vec<DMatrix<f64>>,
    /// Prior precision of the shared unknowns, diagonal.
    pub shared_precision: DVector<f64>,
    /// Prior mean of each joint's own unknowns.
    pub joint_mean: Vec<DVector<f64>>,
    /// Prior mean of the shared unknowns.
    pub shared_mean: DVector<f64>,
    /// Bound of the magnitude of each joint's own unknowns.
    pub joint_bound: Vec<DVector<f64>>,
    /// Bound of the magnitude of the shared unknowns.
    pub shared_bound: DVector<f64>,
    /// Standard deviation of the filtered torque of each joint \[N m\].
    pub noise_nm: [f64; N],
}

impl<const N: usize> Prior<N> {
    /// Creates the prior around the initial learned terms of the configuration.
    pub fn new(config: &Config<N>) -> Prior<N> {
        let limits = &config.limits;
        let bounds = LearnedBounds::new(&config.friction, &limits.joint_torque_nm);
        let box_of = LearnedTerms {
            parameters: bounds.parameters,
            map: core::array::from_fn(|i| JointMap {
                torque_nm: [bounds.map_nm[i]; MAP_KNOTS],
                dry_nm: [bounds.map_nm[i]; MAP_KNOTS],
            }),
        };
        let shared_bound = shared_of(&box_of.parameters);
        Prior {
            joint_precision: (0..N)
                .map(|i| {
                    joint_precision(
                        &joint_bound(&box_of, config, i),
                        config.friction[i].coulomb_nm,
                    )
                })
                .collect(),
            shared_precision: shared_bound.map(|bound| precision(PRIOR_SHARE * bound)),
            joint_mean: (0..N).map(|i| joint_of(&config.learned, i)).collect(),
            shared_mean: shared_of(&config.learned.parameters),
            joint_bound: (0..N).map(|i| joint_bound(&box_of, config, i)).collect(),
            shared_bound,
            noise_nm: core::array::from_fn(|i| {
                NOISE_FRICTION_SHARE * config.friction[i].breakaway_nm
                    + NOISE_TORQUE_SHARE * limits.joint_torque_nm[i]
            }),
        }
    }
}

fn precision(deviation: f64) -> f64 {
    deviation.max(MIN_STD).powi(-2)
}

fn joint_precision(bound: &DVector<f64>, coulomb_nm: f64) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(JOINT, JOINT);
    for (index, share) in [
        (VISCOUS, PRIOR_SHARE),
        (COULOMB, PRIOR_SHARE),
        (OFFSET, OFFSET_SHARE),
        (SCALE, SCALE_SHARE),
    ] {
        matrix[(index, index)] = precision(share * bound[index]);
    }
    for (index, deviation) in [
        (PRESLIDING, PRESLIDING_STD),
        (STRIBECK, STRIBECK_SHARE * coulomb_nm),
        (STRIBECK_OFFSET, OFFSET_SHARE * bound[OFFSET]),
    ] {
        matrix[(index, index)] = precision(deviation);
    }
    for (first, deviation) in [
        (MAP_TORQUE, MAP_TORQUE_SHARE * bound[MAP_TORQUE]),
        (MAP_DRY, MAP_DRY_SHARE * coulomb_nm),
    ] {
        for k in first..first + MAP_KNOTS {
            matrix[(k, k)] += precision(deviation);
        }
        let smooth = precision(SMOOTHNESS * deviation);
        for k in first..first + MAP_KNOTS - 2 {
            for (a, x) in [(0, 1.0), (1, -2.0), (2, 1.0)] {
                for (b, y) in [(0, 1.0), (1, -2.0), (2, 1.0)] {
                    matrix[(k + a, k + b)] += smooth * x * y;
                }
            }
        }
    }
    matrix
}

/// Returns the bounds of a joint's own unknowns.
fn joint_bound<const N: usize>(
    box_of: &LearnedTerms<N>,
    config: &Config<N>,
    joint: usize,
) -> DVector<f64> {
    let mut bound = joint_of(box_of, joint);
    let stribeck_nm = STRIBECK_BOUND * config.friction[joint].coulomb_nm;
    bound[PRESLIDING] = PRESLIDING_BOUND;
    bound[STRIBECK] = stribeck_nm;
    bound[STRIBECK_OFFSET] = stribeck_nm;
    bound
}

/// Returns a joint's own unknowns; those that are not requested are zero.
pub(crate) fn joint_of<const N: usize>(terms: &LearnedTerms<N>, joint: usize) -> DVector<f64> {
    let parameters = &terms.parameters;
    let first = [
        parameters.viscous_nm_s_per_rad[joint],
        parameters.coulomb_nm[joint],
        parameters.offset_nm[joint],
        parameters.torque_scale[joint],
    ];
    let all = first.iter().chain(terms.map[joint].coefficients()).copied();
    let not_requested = core::iter::repeat_n(0.0, JOINT - PRESLIDING);
    DVector::from_iterator(JOINT, all.chain(not_requested))
}

/// Returns the shared unknowns.
pub(crate) fn shared_of<const N: usize>(parameters: &LearnedParameters<N>) -> DVector<f64> {
    let moment = &parameters.payload_moment_kg_m;
    let tilt = &parameters.tilt_rad;
    let all = core::iter::once(&parameters.payload_kg)
        .chain(moment)
        .chain(tilt);
    DVector::from_iterator(SHARED, all.copied())
}

/// Returns the learned terms of these unknowns.
pub(crate) fn terms_of<const N: usize>(
    joints: &[DVector<f64>],
    shared: &DVector<f64>,
) -> LearnedTerms<N> {
    let mut terms = LearnedTerms::zero();
    let parameters = &mut terms.parameters;
    for (i, x) in joints.iter().enumerate().take(N) {
        parameters.viscous_nm_s_per_rad[i] = x[VISCOUS];
        parameters.coulomb_nm[i] = x[COULOMB];
        parameters.offset_nm[i] = x[OFFSET];
        parameters.torque_scale[i] = x[SCALE];
        for (coefficient, value) in terms.map[i]
            .coefficients_mut()
            .zip(x.iter().skip(MAP_TORQUE))
        {
            *coefficient = *value;
        }
    }
    parameters.payload_kg = shared[0];
    for axis in 0..3 {
        parameters.payload_moment_kg_m[axis] = shared[MOMENT - PAYLOAD + axis];
        parameters.tilt_rad[axis] = shared[TILT - PAYLOAD + axis];
    }
    terms
}

const _: () = assert!(ALL == JOINT + SHARED);
