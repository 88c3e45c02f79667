//! The class `Arm`.

use crate::arrays::{self, Argument, Array, Batch};
use crate::check::{self, Unchecked};
use crate::complete;
use crate::dynamics::{Dynamics, Quantity};
use crate::errors;
use crate::friction::Friction;
use crate::law::{self, BatchedLaw, Given};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::OnceLock;
use supple_model::{Completed, Description, ModelError, with_dof};

/// A serial arm of 3 to 7 revolute joints with a tip frame. Immutable.
///
/// Built by :meth:`Arm.load` or :meth:`Arm.from_urdf`. Joint angles are in rad, torques in N m, lengths
/// in m, masses in kg. Positions, forces and Jacobians are in *base axes*: those of the URDF's root link.
///
/// Every method takes one state, ``(N,)``, or a batch with any leading axes, ``(..., N)``; arguments of one
/// call have the same leading axes, or none. Float64 arrays in C order are read without a copy, and the
/// interpreter lock is released while a call computes. ``out``, if given, is a writable float64 array in C
/// order of the result's shape; the call returns it.
///
/// Examples
/// --------
/// >>> import numpy as np, supple
/// >>> arm = supple.Arm.load("wam4")
/// >>> arm.dof, arm.joint_names
/// (4, ['joint1', 'joint2', 'joint3', 'joint4'])
/// >>> q = np.zeros((1000, arm.dof))
/// >>> arm.rnea(q, 0 * q, 0 * q).shape
/// (1000, 4)
#[pyclass(frozen, module = "supple")]
pub struct Arm {
    description: Description,
    dynamics: Box<dyn Dynamics>,
    completed: OnceLock<Completed>,
}

impl Arm {
    /// Creates an arm from a description.
    pub fn new(description: Description) -> Result<Self, ModelError> {
        let dynamics: Result<Box<dyn Dynamics>, ModelError> = with_dof!(description.dof(), N => {
            let arm = description.arm::<N>()?;
            Box::new(arm) as Box<dyn Dynamics>
        });
        Ok(Self {
            dynamics: dynamics?,
            description,
            completed: OnceLock::new(),
        })
    }

    /// Returns the description of the arm.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Returns the description with every setting that a controller needs. A `UserWarning` reports derived settings, unless
    /// only the places of the paths are derived.
    pub fn for_controller(&self, py: Python<'_>) -> PyResult<&Description> {
        complete::completed(py, &self.description, &self.completed)
    }

    /// Returns description and law of the arm.
    fn law(&self) -> (&Description, &dyn BatchedLaw) {
        (&self.description, &*self.dynamics)
    }

    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        quantity: Quantity,
        arguments: &[Argument<'_, 'py>],
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array<'py>> {
        let dof = self.description.dof();
        let batch = Batch::read(arguments, dof)?;
        let shape = [&batch.shape[..], &quantity.shape(dof)].concat();
        let (array, mut writable) = arrays::output(py, out, &shape)?;
        let states = batch.states()?;
        let values = writable.as_slice_mut()?;
        py.detach(|| self.dynamics.evaluate(quantity, &states, values));
        Ok(array)
    }
}

#[pymethods]
impl Arm {
    /// Load a built-in arm by its name, or another by the path of its TOML or of the folder that contains it.
    ///
    /// Parameters
    /// ----------
    /// name_or_path : str or os.PathLike
    ///     One of :func:`supple.assets`, or the path of an ``arm.toml`` beside its URDF.
    /// strict : bool
    ///     Reject a URDF with elements that are not read, such as Gazebo's. Default: a warning for each kind of
    ///     element. Unsupported elements that affect the dynamics are always rejected.
    ///
    /// Raises
    /// ------
    /// TypeError
    ///     For an argument of the wrong type.
    /// ValueError
    ///     If no arm of that name is built in, or the files are invalid.
    /// FileNotFoundError
    ///     If the path does not exist.
    /// OSError
    ///     If the path is not a regular file, or the file exceeds 16 MiB.
    ///
    /// Warns
    /// -----
    /// UserWarning
    ///     For each kind of element and attribute that is ignored, with its first position.
    ///
    /// Examples
    /// --------
    /// >>> import supple
    /// >>> supple.Arm.load("wam7").dof
    /// 7
    #[staticmethod]
    #[pyo3(signature = (name_or_path, *, strict = Unchecked::LEFT_OUT),
        text_signature = "(name_or_path, *, strict=False)")]
    fn load<'py>(
        py: Python<'py>,
        name_or_path: &Bound<'py, PyAny>,
        strict: Unchecked<'py>,
    ) -> PyResult<Self> {
        let name_or_path = check::path("name_or_path", name_or_path)?;
        let strict = strict.or(false, |given| check::flag("strict", given))?;
        let description = Description::find(&name_or_path.to_string_lossy());
        let description = description.and_then(|found| found.strict_if(strict));
        let description = description.map_err(errors::model)?;
        errors::warn(py, &description)?;
        Self::new(description).map_err(errors::model)
    }

    /// Load the arm of a URDF: the chain of movable joints from the root link to the link ``tip``.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     The URDF.
    /// tip : str
    ///     Link whose origin is the tip. Default ``"tip"``.
    /// gravity : array_like, (3,)
    ///     Gravitational acceleration in base axes (m/s^2). Default (0, 0, -9.81).
    /// armature : array_like, (N,), optional
    ///     Rotor inertia of each joint, reflected to the joint (kg m^2). Default: none.
    /// fixed_joints_rad : mapping of str to float, optional
    ///     Movable joints that are fixed, each at a position (rad, m for a prismatic joint). Joints that do not carry
    ///     the tip, such as a gripper's, are fixed without being listed: see the notes.
    /// point_mass_radius_m : float, optional
    ///     Links with mass but zero inertia are modelled as solid balls of this radius (m). Default: they are
    ///     rejected.
    /// repair : bool
    ///     Replace an inertia that no rigid body has by the nearest one that a rigid body has, with a warning that names
    ///     both. Default: such a link between root and tip is rejected.
    /// strict : bool
    ///     As in :meth:`Arm.load`. Joints that are fixed without being listed and inertias that are replaced are rejected
    ///     too.
    ///
    /// Raises
    /// ------
    /// TypeError
    ///     For an argument of the wrong type.
    /// ValueError
    ///     If the model is physically inconsistent, not connected or unsupported; the message names file,
    ///     element, value and remedy.
    /// FileNotFoundError
    ///     If the path does not exist.
    /// OSError
    ///     If the path is not a regular file, or the file exceeds 16 MiB.
    ///
    /// Warns
    /// -----
    /// UserWarning
    ///     As :meth:`Arm.load`; for each kind of joint that is fixed without being listed, and for each inertia that is
    ///     replaced.
    ///
    /// Notes
    /// -----
    /// Friction is read from the URDF's ``<dynamics>``. Joints that do not carry the tip, prismatic ones, mimics, and the
    /// first ones of more than seven are fixed; those that ``fixed_joints_rad`` does not list at zero, or at the end of
    /// their range that is closest to it, each kind with a warning. A joint whose range, effort or velocity the URDF omits
    /// or sets to zero is practically unlimited: one turn in either direction, 1e5 N m, 100 rad/s. That does for dynamics
    /// and identification; :func:`design_excitation` needs the true limits too.
    ///
    /// Dynamics are those of the URDF, with ``armature``. :func:`simulate`, :func:`simulated` and :func:`excite` take the
    /// rest, such as gains, home pose and estimated rotor inertias, from :meth:`completed`. They need the limits of
    /// torque and speed of every joint.
    ///
    /// Examples
    /// --------
    /// >>> import supple
    /// >>> arm = supple.Arm.from_urdf("robot.urdf", tip="tool0").completed()  # doctest: +SKIP
    /// >>> supple.simulate(arm, "sinusoid", stiffness_n_per_m=50.0).rms_error_m  # doctest: +SKIP
    #[staticmethod]
    #[pyo3(signature = (path, tip = Unchecked::LEFT_OUT, *, gravity = None, armature = None, fixed_joints_rad = None,
        point_mass_radius_m = None, repair = Unchecked::LEFT_OUT, strict = Unchecked::LEFT_OUT),
        text_signature = "(path, tip='tip', *, gravity=(0.0, 0.0, -9.81), armature=None, \
        fixed_joints_rad=None, point_mass_radius_m=None, repair=False, strict=False)")]
    #[expect(
        clippy::too_many_arguments,
        reason = "all but the path are keywords in Python"
    )]
    fn from_urdf<'py>(
        py: Python<'py>,
        path: &Bound<'py, PyAny>,
        tip: Unchecked<'py>,
        gravity: Option<&Bound<'py, PyAny>>,
        armature: Option<&Bound<'py, PyAny>>,
        fixed_joints_rad: Option<&Bound<'py, PyAny>>,
        point_mass_radius_m: Option<&Bound<'py, PyAny>>,
        repair: Unchecked<'py>,
        strict: Unchecked<'py>,
    ) -> PyResult<Self> {
        let path = check::path("path", path)?;
        let tip = tip.or("tip".to_owned(), |given| check::text("tip", given))?;
        let repair = repair.or(false, |given| check::flag("repair", given))?;
        let strict = strict.or(false, |given| check::flag("strict", given))?;
        let fixed = fixed_joints_rad.map(|given| check::named_numbers("fixed_joints_rad", given));
        let fixed = fixed.transpose()?.unwrap_or_default();
        let radius_m = point_mass_radius_m.map(|given| check::number("point_mass_radius_m", given));
        let radius_m = radius_m.transpose()?;
        let urdf = supple_files::read_text(&path, Description::MAX_BYTES).map_err(|cause| {
            let message = format!("{}: cannot be read: {cause}", path.display());
            errors::system(&cause, message)
        })?;
        let urdf = supple_model::unlimited::with_default_limits(&urdf);
        let gravity = match gravity {
            Some(gravity) => arrays::fixed("gravity", gravity, &[3])?
                .as_slice()?
                .to_vec(),
            None => vec![0.0, 0.0, -9.81],
        };
        let name = path.file_stem().map(|stem| stem.to_string_lossy());
        let mut settings = toml::Table::from_iter([
            entry("name", name.as_deref().unwrap_or("arm")),
            entry("urdf", path.to_string_lossy().into_owned()),
            entry("tip_frame", tip),
            entry("gravity_m_per_s2", gravity),
        ]);
        if repair {
            settings.insert("repair_inertia".to_owned(), true.into());
        }
        if let Some(radius_m) = radius_m {
            settings.insert("point_mass_radius_m".to_owned(), radius_m.into());
        }
        let fixed = fixed.into_iter().map(|(joint, at)| (joint, at.into()));
        let fixed: toml::Table = fixed.collect();
        settings.insert("fixed_joints_rad".to_owned(), fixed.into());
        let read = |settings: &toml::Table| {
            let description = Description::from_text(&settings.to_string(), &urdf);
            let description = description.and_then(|found| found.strict_if(strict));
            description.map_err(|error| errors::model(with_arguments(error)))
        };
        let mut description = read(&settings)?;
        if let Some(armature) = armature {
            let armature = arrays::fixed("armature", armature, &[description.dof()])?;
            let joints = description.joint_names().iter().zip(armature.as_slice()?);
            let joints = joints.map(|(joint, inertia)| {
                toml::Table::from_iter([
                    entry("name", joint.as_str()),
                    entry("armature_kg_m2", *inertia),
                ])
            });
            let joints: Vec<toml::Table> = joints.collect();
            settings.insert("joints".to_owned(), joints.into());
            description = read(&settings)?;
        }
        errors::warn(py, &description)?;
        Self::new(description).map_err(errors::model)
    }

    /// Creates an arm from the texts of its two files, as logs and pickles contain them.
    #[staticmethod]
    fn _from_text(toml: &str, urdf: &str) -> PyResult<Self> {
        let description = Description::from_text(toml, urdf);
        description.and_then(Self::new).map_err(errors::model)
    }

    /// Writes its two files into a folder, which is created if necessary.
    fn _save(&self, folder: PathBuf) -> PyResult<()> {
        self.description.save(&folder).map_err(errors::model)
    }

    /// Name of the arm.
    #[getter]
    fn name(&self) -> &str {
        self.description.name()
    }

    /// Number of joints, N.
    #[getter]
    pub fn dof(&self) -> usize {
        self.description.dof()
    }

    /// Names of the joints, from the base to the tip.
    #[getter]
    fn joint_names(&self) -> Vec<String> {
        self.description.joint_names().to_vec()
    }

    /// Whether the impedance law acts on each joint: on those that the TOML does not hold.
    #[getter]
    fn active_joints(&self) -> Vec<bool> {
        self.description.active_joints()
    }

    /// The arm with every setting that a controller needs.
    ///
    /// What its TOML leaves out is derived from the arm: estimates of rotor inertias, gains, damping, rates, thresholds,
    /// home pose and the place of the paper's trajectories. If the TOML has no entry for single joints, the three that
    /// move the tip best are active and the others are held. :attr:`toml` gives each derived setting with its reason. What
    /// the TOML gives stays, so that a built-in arm is returned as it is, except for what it leaves out.
    ///
    /// Returns
    /// -------
    /// Arm
    ///     The arm; its :attr:`armature` and hence its mass matrix have the estimates.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a joint has no limits of torque and speed, or if there is no pose from which the tip follows even small
    ///     trajectories.
    ///
    /// Examples
    /// --------
    /// >>> import supple
    /// >>> arm = supple.Arm.load("wam4")
    /// >>> arm.completed() == arm
    /// True
    #[pyo3(name = "completed")]
    fn completed_arm(&self, py: Python<'_>) -> PyResult<Self> {
        let completed = complete::of(py, &self.description, &self.completed)?;
        Self::new(completed.description.clone()).map_err(errors::model)
    }

    /// Inertial parameters, (10 N,), in the order of :meth:`regressor`.
    ///
    /// Ten for each link, in the axes of the URDF's link frame: mass ``m`` (kg); first moments ``m cx, m cy, m
    /// cz`` (kg m); inertia about the frame's origin ``Ixx, Ixy, Iyy, Ixz, Iyz, Izz`` (kg m^2). The tool and
    /// fixed links are part of the link that carries them.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        arrays::array(py, self.dynamics.parameters(), &[10 * self.dof()])
    }

    /// Rotor inertia of each joint, reflected to the joint, (N,) (kg m^2).
    #[getter]
    fn armature<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        arrays::array(py, self.dynamics.armature(), &[self.dof()])
    }

    /// Gravitational acceleration in base axes, (3,) (m/s^2).
    #[getter]
    fn gravity_m_per_s2<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        arrays::array(py, self.dynamics.gravity_m_per_s2().to_vec(), &[3])
    }

    /// Friction of each joint.
    #[getter]
    fn friction(&self) -> Vec<Friction> {
        let joints = self.description.friction().iter();
        joints.map(|inner| Friction { inner: *inner }).collect()
    }

    /// Start pose of the arm, (N,) (rad).
    #[getter]
    fn home_rad<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        arrays::array(py, self.description.home_rad().to_vec(), &[self.dof()])
    }

    /// Text of the URDF.
    #[getter]
    fn urdf(&self) -> &str {
        self.description.urdf()
    }

    /// Text of the TOML.
    #[getter]
    fn toml(&self) -> &str {
        self.description.toml()
    }

    /// Inverse dynamics ``H(q) qdd + C(q, qd) qd + G(q)``, without friction.
    ///
    /// Parameters
    /// ----------
    /// q, qd, qdd : array_like, (..., N)
    ///     Angles (rad), velocities (rad/s), accelerations (rad/s^2).
    /// out : numpy.ndarray, (..., N), optional
    ///     Array for the result.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, (..., N)
    ///     Joint torques (N m).
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the shapes do not agree; the message names argument, expected and actual shape.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, supple
    /// >>> arm = supple.Arm.load("wam4")
    /// >>> q, zero = arm.home_rad, np.zeros(arm.dof)
    /// >>> bool(np.allclose(arm.rnea(q, zero, zero), arm.gravity(q)))
    /// True
    #[pyo3(signature = (q, qd, qdd, *, out = None))]
    fn rnea<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        qdd: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array<'py>> {
        let arguments = [("q", q), ("qd", qd), ("qdd", qdd)];
        self.evaluate(py, Quantity::Rnea, &arguments, out)
    }

    /// Mass matrix ``H(q)``, rotor inertias included.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, (..., N)
    ///     Angles (rad).
    /// out : numpy.ndarray, (..., N, N), optional
    ///     Array for the result.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, (..., N, N)
    ///     Symmetric, positive definite (kg m^2).
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the shapes do not agree.
    #[pyo3(signature = (q, *, out = None))]
    fn mass_matrix<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array<'py>> {
        self.evaluate(py, Quantity::MassMatrix, &[("q", q)], out)
    }

    /// Torques ``G(q)`` that hold the arm still against gravity.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, (..., N)
    ///     Angles (rad).
    /// out : numpy.ndarray, (..., N), optional
    ///     Array for the result.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, (..., N)
    ///     Joint torques (N m).
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the shapes do not agree.
    #[pyo3(signature = (q, *, out = None))]
    fn gravity<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array<'py>> {
        self.evaluate(py, Quantity::Gravity, &[("q", q)], out)
    }

    /// Forward dynamics: the accelerations that torques cause, without friction.
    ///
    /// Parameters
    /// ----------
    /// q, qd, tau : array_like, (..., N)
    ///     Angles (rad), velocities (rad/s), joint torques (N m).
    /// out : numpy.ndarray, (..., N), optional
    ///     Array for the result.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, (..., N)
    ///     Accelerations (rad/s^2): the inverse of :meth:`rnea`.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the shapes do not agree.
    #[pyo3(signature = (q, qd, tau, *, out = None))]
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        tau: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array<'py>> {
        let arguments = [("q", q), ("qd", qd), ("tau", tau)];
        self.evaluate(py, Quantity::ForwardDynamics, &arguments, out)
    }

    /// Velocity products ``C(q, qd) qd``, without gravity.
    ///
    /// Parameters
    /// ----------
    /// q, qd : array_like, (..., N)
    ///     Angles (rad), velocities (rad/s).
    /// out : numpy.ndarray, (..., N), optional
    ///     Array for the result.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, (..., N)
    ///     Joint torques (N m).
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the shapes do not agree.
    #[pyo3(signature = (q, qd, *, out = None))]
    fn coriolis<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array<'py>> {
        self.evaluate(py, Quantity::Coriolis, &[("q", q), ("qd", qd)], out)
    }

    /// Christoffel matrix ``C(q, qd)``: ``H' - 2 C`` is skew.
    ///
    /// Parameters
    /// ----------
    /// q, qd : array_like, (..., N)
    ///     Angles (rad), velocities (rad/s).
    /// out : numpy.ndarray, (..., N, N), optional
    ///     Array for the result.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, (..., N, N)
    ///     Torque for velocity (N m s/rad).
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the shapes do not agree.
    #[pyo3(signature = (q, qd, *, out = None))]
    fn coriolis_matrix<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array<'py>> {
        self.evaluate(py, Quantity::CoriolisMatrix, &[("q", q), ("qd", qd)], out)
    }

    /// Pose of the tip in the base, ``base_from_tip``: it maps tip coordinates to base coordinates.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, (..., N)
    ///     Angles (rad).
    /// out : numpy.ndarray, (..., 4, 4), optional
    ///     Array for the result.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, (..., 4, 4)
    ///     Homogeneous matrix; the last column is the tip's position (m).
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the shapes do not agree.
    #[pyo3(signature = (q, *, out = None))]
    fn tip_pose<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array<'py>> {
        self.evaluate(py, Quantity::TipPose, &[("q", q)], out)
    }

    /// Jacobian of the tip, base axes: linear rows first, then angular.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, (..., N)
    ///     Angles (rad).
    /// out : numpy.ndarray, (..., 6, N), optional
    ///     Array for the result.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, (..., 6, N)
    ///     Velocity of the tip (m/s) and angular velocity (rad/s) for joint velocities.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the shapes do not agree.
    #[pyo3(signature = (q, *, out = None))]
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array<'py>> {
        self.evaluate(py, Quantity::Jacobian, &[("q", q)], out)
    }

    /// ``J' qd``: acceleration of the tip at ``qdd = 0``, base axes.
    ///
    /// Parameters
    /// ----------
    /// q, qd : array_like, (..., N)
    ///     Angles (rad), velocities (rad/s).
    /// out : numpy.ndarray, (..., 6), optional
    ///     Array for the result.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, (..., 6)
    ///     Classical linear (m/s^2), then angular acceleration (rad/s^2).
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the shapes do not agree.
    #[pyo3(signature = (q, qd, *, out = None))]
    fn jacobian_dot_qd<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array<'py>> {
        self.evaluate(py, Quantity::JacobianDotQd, &[("q", q), ("qd", qd)], out)
    }

    /// Torques as a linear function of the inertial parameters.
    ///
    /// ``rnea(q, qd, qdd) = regressor(q, qd, qdd) @ parameters + armature * qdd``.
    ///
    /// Parameters
    /// ----------
    /// q, qd, qdd : array_like, (..., N)
    ///     Angles (rad), velocities (rad/s), accelerations (rad/s^2).
    /// out : numpy.ndarray, (..., N, 10 N), optional
    ///     Array for the result.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, (..., N, 10 N)
    ///     Ten columns for each link, in the order of :attr:`parameters`.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the shapes do not agree.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, supple
    /// >>> arm = supple.Arm.load("wam4")
    /// >>> q, qd, qdd = np.random.default_rng(0).normal(size=(3, 100, arm.dof))
    /// >>> tau = arm.regressor(q, qd, qdd) @ arm.parameters + arm.armature * qdd
    /// >>> bool(np.allclose(tau, arm.rnea(q, qd, qdd)))
    /// True
    #[pyo3(signature = (q, qd, qdd, *, out = None))]
    fn regressor<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        qdd: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array<'py>> {
        let arguments = [("q", q), ("qd", qd), ("qdd", qdd)];
        self.evaluate(py, Quantity::Regressor, &arguments, out)
    }

    /// Joint torques of the impedance law: the function that the controller runs in its modes track and track pose.
    ///
    /// ``tau = G + C qd + D + H Jb (Xo'' - J' qd) + J^T (K (Xo - X) + B (Xo' - X'))``, with ``Jb`` the dynamically
    /// consistent inverse of the active joints' Jacobian, damped near singular poses, and in the null space of the
    /// tip's motion the damping and the torque that are given.
    ///
    /// Every argument is one state or a batch, and everything of the tip is in base axes. The task is the tip's
    /// position or its pose, by the shape of ``reference``. With ``d = 3`` for a position, vectors of the tip have
    /// x, y and z; with ``d = 6`` for a pose they have x, y and z along the axes, then about them.
    ///
    /// Parameters
    /// ----------
    /// q, qd : array_like, (..., N)
    ///     Angles (rad) and velocities (rad/s) of the joints.
    /// reference : array_like, (..., 3) or (..., 4, 4)
    ///     Position of the tip that is wanted (m); or its pose, as :meth:`tip_pose` returns it.
    /// velocity, acceleration : array_like, (..., d), optional
    ///     Of the reference (m/s and rad/s; m/s^2 and rad/s^2). Default: zero.
    /// stiffness, damping : array_like, (..., d)
    ///     Diagonals of ``K`` (N/m, then N m/rad) and ``B`` (N s/m, then N m s/rad), zero or more. For a position a
    ///     single number stands for all axes.
    /// friction : {"reference", "measured"}, optional
    ///     Adds the feed-forward of :attr:`friction` at the joint velocities of the reference, as the controller does,
    ///     or at ``qd``. Default: none.
    /// stribeck_velocity : array_like, (..., N), optional
    ///     Joint velocities for the Stribeck effect of active joints (rad/s), with ``friction="reference"``: the controller
    ///     of an arm whose description has ``measured_stribeck`` (all but paper3) uses the measured ones, averaged over 50 ms.
    ///     Default: as the rest of the friction.
    /// active_joints : sequence of bool, (N,), optional
    ///     Joints on which the law acts; at least ``d``. The others get ``G + C qd``, friction and the coupling torque.
    ///     Default: :attr:`active_joints`.
    /// nullspace_damping : array_like, (..., N), optional
    ///     Damping of the joints' motion that leaves the tip alone (N m s/rad), zero or more; a single number stands for
    ///     all joints. Default: 0.
    /// nullspace_torque : array_like, (..., N), optional
    ///     Torque to apply where the tip does not feel it, as towards a posture (N m). Default: 0.
    /// apparent_inertia : array_like, (..., d, d), optional
    ///     Inertia that the tip is to have, symmetric and positive definite (kg, kg m^2). It needs ``force``. Default:
    ///     the arm's own.
    /// force : array_like, (..., d), optional
    ///     Measured force on the tip (N), for a pose with the moment (N m).
    /// out : numpy.ndarray, (..., N), optional
    ///     Array for the result. If the call raises an error, it holds the states before the one that is wrong.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, (..., N)
    ///     Joint torques (N m): the sum of :meth:`impedance_terms`, bit for bit. Without what the controller adds: loops
    ///     of held joints, soft stops, ripple, learned terms, handover and limits.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the shapes do not agree, a gain is negative, too few joints are active, a reference is no pose or an
    ///     inertia not positive definite; the message names argument, index and remedy.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, supple
    /// >>> arm = supple.Arm.load("wam4")
    /// >>> q, still = arm.home_rad, np.zeros(arm.dof)
    /// >>> here = arm.tip_pose(q)[:3, 3]
    /// >>> tau = arm.impedance_torque(q, still, here, stiffness=5.0, damping=1.5)
    /// >>> bool(np.allclose(tau, arm.gravity(q)))
    /// True
    #[pyo3(signature = (q, qd, reference, velocity = None, acceleration = None, *, stiffness, damping,
        friction = None, stribeck_velocity = None, active_joints = None, nullspace_damping = None, nullspace_torque = None,
        apparent_inertia = None, force = None, out = None))]
    #[expect(
        clippy::too_many_arguments,
        reason = "all but the state and the reference are keywords in Python"
    )]
    fn impedance_torque<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        reference: &Bound<'py, PyAny>,
        velocity: Option<&Bound<'py, PyAny>>,
        acceleration: Option<&Bound<'py, PyAny>>,
        stiffness: &Bound<'py, PyAny>,
        damping: &Bound<'py, PyAny>,
        friction: Option<&str>,
        stribeck_velocity: Option<&Bound<'py, PyAny>>,
        active_joints: Option<Vec<bool>>,
        nullspace_damping: Option<&Bound<'py, PyAny>>,
        nullspace_torque: Option<&Bound<'py, PyAny>>,
        apparent_inertia: Option<&Bound<'py, PyAny>>,
        force: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array<'py>> {
        let given = Given {
            q,
            qd,
            reference,
            velocity,
            acceleration,
            stiffness,
            damping,
            friction,
            stribeck_velocity,
            active_joints,
            nullspace_damping,
            nullspace_torque,
            apparent_inertia,
            force,
        };
        law::torque(py, self.law(), &given, out)
    }

    /// Every term of the impedance law apart; arguments and errors are those of :meth:`impedance_torque`.
    ///
    /// Returns
    /// -------
    /// dict of str to numpy.ndarray, (..., N)
    ///     The terms (N m): ``gravity``, ``coriolis``, ``friction``, ``jacobian_rate``, ``inertial``, ``stiffness``,
    ///     ``damping``, ``force``, ``nullspace``, with the names of the controller's record and of logs. Added in this
    ///     order they are the torque.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, supple
    /// >>> arm = supple.Arm.load("wam4")
    /// >>> q, still = np.tile(arm.home_rad, (1000, 1)), np.zeros(arm.dof)
    /// >>> above = arm.tip_pose(arm.home_rad)[:3, 3] + [0.0, 0.0, 0.1]
    /// >>> terms = arm.impedance_terms(q, still, above, stiffness=5.0, damping=1.5)
    /// >>> pull = arm.jacobian(arm.home_rad)[2] * 0.5
    /// >>> bool(np.allclose(terms["stiffness"], np.where(arm.active_joints, pull, 0.0)))
    /// True
    #[pyo3(signature = (q, qd, reference, velocity = None, acceleration = None, *, stiffness, damping,
        friction = None, stribeck_velocity = None, active_joints = None, nullspace_damping = None, nullspace_torque = None,
        apparent_inertia = None, force = None))]
    #[expect(
        clippy::too_many_arguments,
        reason = "all but the state and the reference are keywords in Python"
    )]
    fn impedance_terms<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        reference: &Bound<'py, PyAny>,
        velocity: Option<&Bound<'py, PyAny>>,
        acceleration: Option<&Bound<'py, PyAny>>,
        stiffness: &Bound<'py, PyAny>,
        damping: &Bound<'py, PyAny>,
        friction: Option<&str>,
        stribeck_velocity: Option<&Bound<'py, PyAny>>,
        active_joints: Option<Vec<bool>>,
        nullspace_damping: Option<&Bound<'py, PyAny>>,
        nullspace_torque: Option<&Bound<'py, PyAny>>,
        apparent_inertia: Option<&Bound<'py, PyAny>>,
        force: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let given = Given {
            q,
            qd,
            reference,
            velocity,
            acceleration,
            stiffness,
            damping,
            friction,
            stribeck_velocity,
            active_joints,
            nullspace_damping,
            nullspace_torque,
            apparent_inertia,
            force,
        };
        law::terms(py, self.law(), &given)
    }

    fn __eq__(&self, other: &Self) -> bool {
        let (a, b) = (&self.description, &other.description);
        a.toml() == b.toml() && a.urdf() == b.urdf()
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        (self.description.toml(), self.description.urdf()).hash(&mut hasher);
        hasher.finish()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String, String))> {
        let rebuild = py.get_type::<Self>().getattr("_from_text")?;
        let texts = (
            self.description.toml().to_owned(),
            self.description.urdf().to_owned(),
        );
        Ok((rebuild, texts))
    }

    fn __repr__(&self) -> String {
        format!("<Arm {:?}, {} joints>", self.name(), self.dof())
    }

    /// A table of the joints, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let module = slf.py().import("supple._arm_html")?;
        module.call_method1("arm_table", (slf,))
    }
}

/// Replaces the remedies in an error by the arguments of `from_urdf`.
fn with_arguments(error: ModelError) -> ModelError {
    match error {
        ModelError::Invalid(mut finding) => {
            let option = "--repair (repair_inertia = true in the TOML)";
            finding.remedy = finding.remedy.replace(option, "repair=True");
            ModelError::Invalid(finding)
        }
        error => error,
    }
}

fn entry(key: &str, value: impl Into<toml::Value>) -> (String, toml::Value) {
    (key.to_owned(), value.into())
}

/// Names of the built-in arms, for :meth:`Arm.load`.
///
/// Examples
/// --------
/// >>> import supple
/// >>> supple.assets()
/// ['openarm', 'paper3', 'wam3', 'wam4', 'wam7', 'yam']
#[pyfunction]
pub fn assets() -> Vec<&'static str> {
    supple_model::assets().to_vec()
}
