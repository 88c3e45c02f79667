//! The impedance law of [`supple_core::impedance`] over batches of states: the sum of its terms, or every term separately.
//!
//! The terms are those of the function that the controller runs in its modes track and track pose; the sum is
//! their total.

use crate::arrays::{self, Array, Batch, Shaped, States};
use numpy::{PyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use supple_core::config::{FrictionVelocity, Gains, Role};
use supple_core::dynamics::{self, Terms};
use supple_core::impedance::{ChosenInertia, LawInput, PositionTarget, Target, Task, impedance};
use supple_core::math::{Matrix3, Vector3};
use supple_core::target::{PoseGains, PoseReference, PoseTarget};
use supple_core::torques::TERMS;
use supple_core::{Arm, Friction, Matrix, Pose, Reference, Vector};
use supple_model::Description;

/// Names of the law's terms, in the order of [`TERMS`]; the controller adds the other terms.
pub const LAW_TERMS: [&str; 9] = [
    "gravity",
    "coriolis",
    "friction",
    "jacobian_rate",
    "inertial",
    "stiffness",
    "damping",
    "force",
    "nullspace",
];

/// Greatest deviation of a reference's matrix from a pose.
const POSE_TOLERANCE: f64 = 1e-6;

/// The arguments as Python passes them.
pub struct Given<'a, 'py> {
    pub q: &'a Bound<'py, PyAny>,
    pub qd: &'a Bound<'py, PyAny>,
    pub reference: &'a Bound<'py, PyAny>,
    pub velocity: Option<&'a Bound<'py, PyAny>>,
    pub acceleration: Option<&'a Bound<'py, PyAny>>,
    pub stiffness: &'a Bound<'py, PyAny>,
    pub damping: &'a Bound<'py, PyAny>,
    pub friction: Option<&'a str>,
    pub stribeck_velocity: Option<&'a Bound<'py, PyAny>>,
    pub active_joints: Option<Vec<bool>>,
    pub nullspace_damping: Option<&'a Bound<'py, PyAny>>,
    pub nullspace_torque: Option<&'a Bound<'py, PyAny>>,
    pub apparent_inertia: Option<&'a Bound<'py, PyAny>>,
    pub force: Option<&'a Bound<'py, PyAny>>,
}

/// A batch of states with the arguments of the law.
pub struct LawBatch<'a> {
    directions: usize,
    active_joints: &'a [bool],
    friction: Option<(&'a [Friction], FrictionVelocity)>,
    stribeck_velocity: Option<States<'a>>,
    q: States<'a>,
    qd: States<'a>,
    reference: States<'a>,
    velocity: States<'a>,
    acceleration: States<'a>,
    stiffness: States<'a>,
    damping: States<'a>,
    nullspace_damping: States<'a>,
    nullspace_torque: Option<States<'a>>,
    /// Chosen inertia and measured force.
    apparent: Option<(States<'a>, States<'a>)>,
    /// Indices in [`TERMS`] of the terms to return separately; empty for their sum.
    apart: &'a [usize],
}

/// A state for which the law cannot be evaluated.
pub struct Rejected {
    state: usize,
    reason: Reason,
}

enum Reason {
    MassMatrix,
    NotAPose,
    ApparentInertia,
}

/// Returns the sum of the law's terms, `(..., N)`.
pub fn torque<'py>(
    py: Python<'py>,
    (description, law): (&Description, &dyn BatchedLaw),
    given: &Given<'_, 'py>,
    out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Array<'py>> {
    evaluate(py, description, law, given, &[], out)
}

/// Returns every term of the law by its name, each `(..., N)`, in the order of the sum.
pub fn terms<'py>(
    py: Python<'py>,
    (description, law): (&Description, &dyn BatchedLaw),
    given: &Given<'_, 'py>,
) -> PyResult<Bound<'py, PyDict>> {
    let index = |name: &&str| TERMS.iter().position(|term| term.name == *name);
    let apart: Vec<usize> = LAW_TERMS.iter().filter_map(index).collect();
    let all = evaluate(py, description, law, given, &apart, None)?;
    let named = PyDict::new(py);
    for (i, name) in LAW_TERMS.iter().enumerate() {
        named.set_item(name, all.get_item(i)?)?;
    }
    Ok(named)
}

fn evaluate<'py>(
    py: Python<'py>,
    description: &Description,
    law: &dyn BatchedLaw,
    given: &Given<'_, 'py>,
    apart: &[usize],
    out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Array<'py>> {
    let dof = description.dof();
    let directions = directions(given.reference)?;
    let active_joints = active_joints(description, given.active_joints.as_deref(), directions)?;
    let friction_velocity = match given.friction {
        None => None,
        Some("reference") => Some(FrictionVelocity::Reference),
        Some("measured") => Some(FrictionVelocity::Measured),
        Some(other) => {
            return Err(PyValueError::new_err(format!(
                "friction: expected \"reference\", \"measured\" or None, got {other:?}"
            )));
        }
    };
    if given.stribeck_velocity.is_some() && friction_velocity != Some(FrictionVelocity::Reference) {
        return Err(PyValueError::new_err(
            "stribeck_velocity: only friction at the velocity of the reference has another velocity for the Stribeck \
             effect; pass friction=\"reference\", or leave it out",
        ));
    }
    if given.apparent_inertia.is_some() != given.force.is_some() {
        return Err(PyValueError::new_err(
            "apparent_inertia: a chosen inertia needs the measured force of the tip; pass both \
             apparent_inertia and force, or neither",
        ));
    }
    // A number stands for all axes of a position and for all joints; a pose has two units.
    let per_axis = if directions == 3 { 3 } else { 0 };
    let stiffness = gain(py, "stiffness", given.stiffness, per_axis)?;
    let damping = gain(py, "damping", given.damping, per_axis)?;
    let nullspace_damping = given
        .nullspace_damping
        .map(|value| gain(py, "nullspace_damping", value, dof))
        .transpose()?;

    let [joints, axes, square] = [&[dof][..], &[directions], &[directions, directions]];
    let reference: &[usize] = if directions == 3 { axes } else { &[4, 4] };
    let mut arguments: Vec<Shaped<'_, 'py>> = vec![
        (("q", given.q), joints),
        (("qd", given.qd), joints),
        (("reference", given.reference), reference),
        (("stiffness", &stiffness), axes),
        (("damping", &damping), axes),
    ];
    let optional = [
        ("velocity", given.velocity, axes),
        ("acceleration", given.acceleration, axes),
        ("stribeck_velocity", given.stribeck_velocity, joints),
        ("nullspace_damping", nullspace_damping.as_ref(), joints),
        ("nullspace_torque", given.nullspace_torque, joints),
        ("apparent_inertia", given.apparent_inertia, square),
        ("force", given.force, axes),
    ];
    arguments.extend(
        optional
            .into_iter()
            .filter_map(|(name, value, shape)| Some(((name, value?), shape))),
    );
    let batch = Batch::read_shaped(&arguments)?;
    let shape = match apart {
        [] => [&batch.shape[..], joints].concat(),
        _ => [&[apart.len()], &batch.shape[..], joints].concat(),
    };
    let (array, mut writable) = arrays::output(py, out, &shape)?;

    let states = batch.states()?;
    let states_of = |name: &str| {
        let argument = arguments.iter().position(|((given, _), _)| *given == name);
        argument.map(|i| states[i])
    };
    let zeros = [0.0; 7];
    let or_zero = |name, width: usize| states_of(name).unwrap_or(States::constant(&zeros[..width]));
    let law_batch = LawBatch {
        directions,
        active_joints: &active_joints,
        friction: friction_velocity.map(|at| (description.friction(), at)),
        stribeck_velocity: states_of("stribeck_velocity"),
        q: states[0],
        qd: states[1],
        reference: states[2],
        stiffness: states[3],
        damping: states[4],
        velocity: or_zero("velocity", directions),
        acceleration: or_zero("acceleration", directions),
        nullspace_damping: or_zero("nullspace_damping", dof),
        nullspace_torque: states_of("nullspace_torque"),
        apparent: states_of("apparent_inertia").zip(states_of("force")),
        apart,
    };
    let values = writable.as_slice_mut()?;
    py.detach(|| law.impedance(&law_batch, values))
        .map_err(|rejected| rejected.error(&batch.shape))?;
    drop(writable);
    Ok(array)
}

/// Returns three for a reference that is a position, six for a pose.
fn directions(reference: &Bound<'_, PyAny>) -> PyResult<usize> {
    match arrays::numbers("reference", reference)?.shape() {
        [.., 4, 4] => Ok(6),
        [.., 3] => Ok(3),
        other => Err(arrays::wrong_shape(
            "reference",
            "(3,) or (..., 3) for a position, (4, 4) or (..., 4, 4) for a pose",
            other,
        )),
    }
}

/// Returns the given active joints, or by default the arm's.
fn active_joints(
    description: &Description,
    given: Option<&[bool]>,
    directions: usize,
) -> PyResult<Vec<bool>> {
    let active_joints = given.map_or_else(|| description.active_joints(), <[bool]>::to_vec);
    if active_joints.len() != description.dof() {
        return Err(PyValueError::new_err(format!(
            "active_joints: expected {} booleans, one for each joint, got {}",
            description.dof(),
            active_joints.len()
        )));
    }
    let count = active_joints.iter().filter(|active| **active).count();
    if count < directions {
        let task = if directions == 3 { "position" } else { "pose" };
        return Err(PyValueError::new_err(format!(
            "active_joints: the {task} of the tip needs at least {directions} active joints, {} has {count} of {}; \
             pass active_joints with more of them true",
            description.name(),
            description.dof(),
        )));
    }
    Ok(active_joints)
}

/// Reads a gain and checks that every number is finite and zero or more; a single number is repeated `repeat` times, unless that is zero.
fn gain<'py>(
    py: Python<'py>,
    name: &'static str,
    value: &Bound<'py, PyAny>,
    repeat: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let array = arrays::numbers(name, value)?;
    let numbers = array.as_slice()?;
    if let Some(place) = numbers.iter().position(|x| !(x.is_finite() && *x >= 0.0)) {
        return Err(PyValueError::new_err(format!(
            "{name}: expected finite numbers of zero or more, got {}{}",
            numbers[place],
            at_index(place, array.shape()),
        )));
    }
    match numbers {
        [number] if array.ndim() == 0 && repeat > 0 => {
            Ok(arrays::array(py, vec![*number; repeat], &[repeat])?.into_any())
        }
        _ => {
            let same: &Bound<'py, PyArrayDyn<f64>> = &array;
            Ok(same.clone().into_any())
        }
    }
}

/// Returns a text such as " at index (1, 2)" for an array of this shape; empty for a single number.
fn at_index(place: usize, shape: &[usize]) -> String {
    if shape.is_empty() {
        return String::new();
    }
    let mut rest = place;
    let mut index: Vec<usize> = Vec::with_capacity(shape.len());
    for axis in shape.iter().rev() {
        index.push(rest % axis);
        rest /= axis;
    }
    index.reverse();
    format!(" at index {}", arrays::shape_text(&index))
}

impl Rejected {
    /// Returns the exception, for a batch of this shape.
    fn error(&self, batch: &[usize]) -> PyErr {
        let index = at_index(self.state, batch);
        PyValueError::new_err(match self.reason {
            Reason::MassMatrix => format!(
                "q: the mass matrix of the active joints is not positive definite{index}; pass finite angles, and an \
                 arm whose links have mass"
            ),
            Reason::NotAPose => format!(
                "reference: the matrix{index} is not a pose: expected orthonormal axes, right-handed, to {POSE_TOLERANCE:e}, \
                 and the last row (0, 0, 0, 1); orthonormalise its rotation"
            ),
            Reason::ApparentInertia => format!(
                "apparent_inertia: the matrix{index} is not symmetric and positive definite; pass one that is"
            ),
        })
    }
}

/// Evaluates the law of an arm with any number of joints.
pub trait BatchedLaw: Send + Sync {
    /// Writes the torque of every state to `out`, or one term of all states after the other.
    ///
    /// # Errors
    /// The first state for which the law cannot be evaluated.
    fn impedance(&self, batch: &LawBatch<'_>, out: &mut [f64]) -> Result<(), Rejected>;
}

impl<const N: usize> BatchedLaw for Arm<N> {
    fn impedance(&self, batch: &LawBatch<'_>, out: &mut [f64]) -> Result<(), Rejected> {
        match batch.directions {
            3 => each_state::<PositionTask, N, 3>(self, batch, out),
            _ => each_state::<PoseTask, N, 6>(self, batch, out),
        }
    }
}

/// Reference and gains of a state in `D` directions.
trait TipTask<const D: usize>: Sized {
    /// Returns the task of state `k`; `None` if its reference is not a pose.
    fn at(batch: &LawBatch<'_>, k: usize) -> Option<Self>;

    fn target(&self) -> impl Target<D>;

    fn task<const N: usize>(terms: &Terms<N>, roles: &[Role; N]) -> Option<Task<N, D>>;
}

struct PositionTask {
    reference: Reference,
    gains: Gains,
}

impl TipTask<3> for PositionTask {
    fn at(batch: &LawBatch<'_>, k: usize) -> Option<Self> {
        Some(PositionTask {
            reference: Reference {
                position: batch.reference.vector(k),
                velocity: batch.velocity.vector(k),
                acceleration: batch.acceleration.vector(k),
            },
            gains: Gains {
                stiffness_n_per_m: batch.stiffness.vector(k),
                damping_n_s_per_m: batch.damping.vector(k),
            },
        })
    }

    fn target(&self) -> impl Target<3> {
        PositionTarget {
            reference: &self.reference,
            gains: &self.gains,
            spring_limit_n: f64::MAX,
        }
    }

    fn task<const N: usize>(terms: &Terms<N>, roles: &[Role; N]) -> Option<Task<N, 3>> {
        Task::new(terms, roles)
    }
}

struct PoseTask {
    reference: PoseReference,
    gains: PoseGains,
}

impl TipTask<6> for PoseTask {
    fn at(batch: &LawBatch<'_>, k: usize) -> Option<Self> {
        let [velocity, angular_velocity] = halves(&batch.velocity.vector(k));
        let [acceleration, angular_acceleration] = halves(&batch.acceleration.vector(k));
        let [stiffness, angular_stiffness] = halves(&batch.stiffness.vector(k));
        let [damping, angular_damping] = halves(&batch.damping.vector(k));
        let gains = Gains {
            stiffness_n_per_m: stiffness,
            damping_n_s_per_m: damping,
        };
        Some(PoseTask {
            reference: PoseReference {
                base_from_tip: pose(batch.reference.at(k))?,
                velocity_m_per_s: velocity,
                angular_velocity_rad_per_s: angular_velocity,
                acceleration_m_per_s2: acceleration,
                angular_acceleration_rad_per_s2: angular_acceleration,
            },
            gains: PoseGains::diagonal(&gains, &angular_stiffness, &angular_damping),
        })
    }

    fn target(&self) -> impl Target<6> {
        PoseTarget {
            reference: &self.reference,
            gains: &self.gains,
        }
    }

    fn task<const N: usize>(terms: &Terms<N>, roles: &[Role; N]) -> Option<Task<N, 6>> {
        Task::of_pose(terms, roles)
    }
}

fn halves(six: &Vector<6>) -> [Vector3<f64>; 2] {
    [0, 3].map(|first| six.fixed_rows::<3>(first).into_owned())
}

/// Returns the pose of a homogeneous matrix given by rows; `None` if the matrix is not a pose.
fn pose(by_rows: &[f64]) -> Option<Pose> {
    let homogeneous = Matrix::<4, 4>::from_row_slice(by_rows);
    let rotation: Matrix3<f64> = homogeneous.fixed_view::<3, 3>(0, 0).into_owned();
    let deviation = (rotation.transpose() * rotation - Matrix3::identity()).norm();
    let last_row = homogeneous.row(3) - Matrix::<1, 4>::new(0.0, 0.0, 0.0, 1.0);
    let is_pose = deviation <= POSE_TOLERANCE
        && rotation.determinant() > 0.0
        && last_row.norm() <= POSE_TOLERANCE;
    is_pose.then(|| Pose {
        rotation,
        translation: homogeneous.fixed_view::<3, 1>(0, 3).into_owned(),
    })
}

fn each_state<T: TipTask<D>, const N: usize, const D: usize>(
    arm: &Arm<N>,
    batch: &LawBatch<'_>,
    out: &mut [f64],
) -> Result<(), Rejected> {
    let roles: [Role; N] = std::array::from_fn(|i| match batch.active_joints[i] {
        true => Role::Active,
        // The position loop of held joints is not part of the law.
        false => Role::Held {
            position_rad: 0.0,
            stiffness_nm_per_rad: 0.0,
            damping_nm_s_per_rad: 0.0,
        },
    });
    let friction = batch
        .friction
        .map(|(friction, at)| (std::array::from_fn(|i| friction[i]), at));
    let friction: Option<(&[Friction; N], FrictionVelocity)> =
        friction.as_ref().map(|(friction, at)| (friction, *at));
    let states = out.len() / N / batch.apart.len().max(1);
    let mut terms = Terms::default();
    for k in 0..states {
        let rejected = |reason| Rejected { state: k, reason };
        let (q, qd) = (batch.q.vector::<N>(k), batch.qd.vector::<N>(k));
        let tip = T::at(batch, k).ok_or(rejected(Reason::NotAPose))?;
        let apparent = match &batch.apparent {
            Some((inertia, force)) => {
                let inertia = Matrix::<D, D>::from_row_slice(inertia.at(k));
                let found = ChosenInertia::new(&inertia, force.vector(k));
                let found = found.filter(|_| inertia == inertia.transpose());
                Some(found.ok_or(rejected(Reason::ApparentInertia))?)
            }
            None => None,
        };
        let stribeck_velocity = batch.stribeck_velocity.map(|of| of.vector(k));
        let nullspace_torque_nm = batch.nullspace_torque.map(|torque| torque.vector(k));
        let law_input = LawInput {
            apparent,
            friction,
            stribeck_velocity_rad_per_s: stribeck_velocity.as_ref(),
            nullspace_damping_nm_s_per_rad: batch.nullspace_damping.vector(k),
            nullspace_torque_nm: nullspace_torque_nm.as_ref(),
            ..LawInput::new(tip.target(), &qd)
        };
        dynamics::terms(arm, &q, &qd, &mut terms);
        let task = T::task(&terms, &roles).ok_or(rejected(Reason::MassMatrix))?;
        let torques = impedance(&roles, &terms, &task, &law_input);
        if batch.apart.is_empty() {
            out[N * k..][..N].copy_from_slice(torques.total().as_slice());
        } else {
            let named = torques.named();
            for (place, term) in batch.apart.iter().enumerate() {
                let (_, torque) = named[*term];
                out[N * (place * states + k)..][..N].copy_from_slice(torque.as_slice());
            }
        }
    }
    Ok(())
}
