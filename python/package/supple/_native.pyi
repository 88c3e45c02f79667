"""Private native module of the package. Its docstrings are those of the module: python/stub_docstrings.py writes them."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Array = NDArray[np.float64]

__all__ = [
    "Arm",
    "Connection",
    "Fit",
    "Friction",
    "Simulation",
    "__version__",
    "assets",
    "base_parameters",
    "design_excitation",
    "dh_to_urdf",
    "excite",
    "identify",
    "learn",
    "payload",
    "plant_options",
    "realistic_set",
    "read_log",
    "ripple",
    "simulate",
    "torque_scale",
    "weigh",
]
__version__: str

def assets() -> list[str]:
    """Names of the built-in arms, for :meth:`Arm.load`.

    Examples
    --------
    >>> import supple
    >>> supple.assets()
    ['openarm', 'paper3', 'wam3', 'wam4', 'wam7', 'yam']
    """

@final
class Arm:
    """A serial arm of 3 to 7 revolute joints with a tip frame. Immutable.

    Built by :meth:`Arm.load` or :meth:`Arm.from_urdf`. Joint angles are in rad, torques in N m, lengths
    in m, masses in kg. Positions, forces and Jacobians are in *base axes*: those of the URDF's root link.

    Every method takes one state, ``(N,)``, or a batch with any leading axes, ``(..., N)``; arguments of one
    call have the same leading axes, or none. Float64 arrays in C order are read without a copy, and the
    interpreter lock is released while a call computes. ``out``, if given, is a writable float64 array in C
    order of the result's shape; the call returns it.

    Examples
    --------
    >>> import numpy as np, supple
    >>> arm = supple.Arm.load("wam4")
    >>> arm.dof, arm.joint_names
    (4, ['joint1', 'joint2', 'joint3', 'joint4'])
    >>> q = np.zeros((1000, arm.dof))
    >>> arm.rnea(q, 0 * q, 0 * q).shape
    (1000, 4)
    """
    @staticmethod
    def load(name_or_path: str | PathLike[str], *, strict: bool = False) -> Arm:
        """Load a built-in arm by its name, or another by the path of its TOML or of the folder that contains it.

        Parameters
        ----------
        name_or_path : str or os.PathLike
            One of :func:`supple.assets`, or the path of an ``arm.toml`` beside its URDF.
        strict : bool
            Reject a URDF with elements that are not read, such as Gazebo's. Default: a warning for each kind of
            element. Unsupported elements that affect the dynamics are always rejected.

        Raises
        ------
        TypeError
            For an argument of the wrong type.
        ValueError
            If no arm of that name is built in, or the files are invalid.
        FileNotFoundError
            If the path does not exist.
        OSError
            If the path is not a regular file, or the file exceeds 16 MiB.

        Warns
        -----
        UserWarning
            For each kind of element and attribute that is ignored, with its first position.

        Examples
        --------
        >>> import supple
        >>> supple.Arm.load("wam7").dof
        7
        """

    @staticmethod
    def from_urdf(
        path: str | PathLike[str],
        tip: str = "tip",
        *,
        gravity: ArrayLike = ...,
        armature: ArrayLike | None = None,
        fixed_joints_rad: Mapping[str, float] | None = None,
        point_mass_radius_m: float | None = None,
        repair: bool = False,
        strict: bool = False,
    ) -> Arm:
        """Load the arm of a URDF: the chain of movable joints from the root link to the link ``tip``.

        Parameters
        ----------
        path : str or os.PathLike
            The URDF.
        tip : str
            Link whose origin is the tip. Default ``"tip"``.
        gravity : array_like, (3,)
            Gravitational acceleration in base axes (m/s^2). Default (0, 0, -9.81).
        armature : array_like, (N,), optional
            Rotor inertia of each joint, reflected to the joint (kg m^2). Default: none.
        fixed_joints_rad : mapping of str to float, optional
            Movable joints that are fixed, each at a position (rad, m for a prismatic joint). Joints that do not carry
            the tip, such as a gripper's, are fixed without being listed: see the notes.
        point_mass_radius_m : float, optional
            Links with mass but zero inertia are modelled as solid balls of this radius (m). Default: they are
            rejected.
        repair : bool
            Replace an inertia that no rigid body has by the nearest one that a rigid body has, with a warning that names
            both. Default: such a link between root and tip is rejected.
        strict : bool
            As in :meth:`Arm.load`. Joints that are fixed without being listed and inertias that are replaced are rejected
            too.

        Raises
        ------
        TypeError
            For an argument of the wrong type.
        ValueError
            If the model is physically inconsistent, not connected or unsupported; the message names file,
            element, value and remedy.
        FileNotFoundError
            If the path does not exist.
        OSError
            If the path is not a regular file, or the file exceeds 16 MiB.

        Warns
        -----
        UserWarning
            As :meth:`Arm.load`; for each kind of joint that is fixed without being listed, and for each inertia that is
            replaced.

        Notes
        -----
        Friction is read from the URDF's ``<dynamics>``. Joints that do not carry the tip, prismatic ones, mimics, and the
        first ones of more than seven are fixed; those that ``fixed_joints_rad`` does not list at zero, or at the end of
        their range that is closest to it, each kind with a warning. A joint whose range, effort or velocity the URDF omits
        or sets to zero is practically unlimited: one turn in either direction, 1e5 N m, 100 rad/s. That does for dynamics
        and identification; :func:`design_excitation` needs the true limits too.

        Dynamics are those of the URDF, with ``armature``. :func:`simulate`, :func:`simulated` and :func:`excite` take the
        rest, such as gains, home pose and estimated rotor inertias, from :meth:`completed`. They need the limits of
        torque and speed of every joint.

        Examples
        --------
        >>> import supple
        >>> arm = supple.Arm.from_urdf("robot.urdf", tip="tool0").completed()  # doctest: +SKIP
        >>> supple.simulate(arm, "sinusoid", stiffness_n_per_m=50.0).rms_error_m  # doctest: +SKIP
        """

    @staticmethod
    def _from_text(toml: str, urdf: str) -> Arm: ...
    def _save(self, folder: PathLike[str]) -> None: ...
    @property
    def active_joints(self) -> list[bool]:
        """Whether the impedance law acts on each joint: on those that the TOML does not hold."""

    def completed(self) -> Arm:
        """The arm with every setting that a controller needs.

        What its TOML leaves out is derived from the arm: estimates of rotor inertias, gains, damping, rates, thresholds,
        home pose and the place of the paper's trajectories. If the TOML has no entry for single joints, the three that
        move the tip best are active and the others are held. :attr:`toml` gives each derived setting with its reason. What
        the TOML gives stays, so that a built-in arm is returned as it is, except for what it leaves out.

        Returns
        -------
        Arm
            The arm; its :attr:`armature` and hence its mass matrix have the estimates.

        Raises
        ------
        ValueError
            If a joint has no limits of torque and speed, or if there is no pose from which the tip follows even small
            trajectories.

        Examples
        --------
        >>> import supple
        >>> arm = supple.Arm.load("wam4")
        >>> arm.completed() == arm
        True
        """

    @property
    def name(self) -> str:
        """Name of the arm."""

    @property
    def dof(self) -> int:
        """Number of joints, N."""

    @property
    def joint_names(self) -> list[str]:
        """Names of the joints, from the base to the tip."""

    @property
    def parameters(self) -> _Array:
        """Inertial parameters, (10 N,), in the order of :meth:`regressor`.

        Ten for each link, in the axes of the URDF's link frame: mass ``m`` (kg); first moments ``m cx, m cy, m
        cz`` (kg m); inertia about the frame's origin ``Ixx, Ixy, Iyy, Ixz, Iyz, Izz`` (kg m^2). The tool and
        fixed links are part of the link that carries them.
        """

    @property
    def armature(self) -> _Array:
        """Rotor inertia of each joint, reflected to the joint, (N,) (kg m^2)."""

    @property
    def gravity_m_per_s2(self) -> _Array:
        """Gravitational acceleration in base axes, (3,) (m/s^2)."""

    @property
    def friction(self) -> list[Friction]:
        """Friction of each joint."""

    @property
    def home_rad(self) -> _Array:
        """Start pose of the arm, (N,) (rad)."""

    @property
    def urdf(self) -> str:
        """Text of the URDF."""

    @property
    def toml(self) -> str:
        """Text of the TOML."""

    def rnea(
        self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, *, out: _Array | None = None
    ) -> _Array:
        """Inverse dynamics ``H(q) qdd + C(q, qd) qd + G(q)``, without friction.

        Parameters
        ----------
        q, qd, qdd : array_like, (..., N)
            Angles (rad), velocities (rad/s), accelerations (rad/s^2).
        out : numpy.ndarray, (..., N), optional
            Array for the result.

        Returns
        -------
        numpy.ndarray, (..., N)
            Joint torques (N m).

        Raises
        ------
        ValueError
            If the shapes do not agree; the message names argument, expected and actual shape.

        Examples
        --------
        >>> import numpy as np, supple
        >>> arm = supple.Arm.load("wam4")
        >>> q, zero = arm.home_rad, np.zeros(arm.dof)
        >>> bool(np.allclose(arm.rnea(q, zero, zero), arm.gravity(q)))
        True
        """

    def mass_matrix(self, q: ArrayLike, *, out: _Array | None = None) -> _Array:
        """Mass matrix ``H(q)``, rotor inertias included.

        Parameters
        ----------
        q : array_like, (..., N)
            Angles (rad).
        out : numpy.ndarray, (..., N, N), optional
            Array for the result.

        Returns
        -------
        numpy.ndarray, (..., N, N)
            Symmetric, positive definite (kg m^2).

        Raises
        ------
        ValueError
            If the shapes do not agree.
        """

    def gravity(self, q: ArrayLike, *, out: _Array | None = None) -> _Array:
        """Torques ``G(q)`` that hold the arm still against gravity.

        Parameters
        ----------
        q : array_like, (..., N)
            Angles (rad).
        out : numpy.ndarray, (..., N), optional
            Array for the result.

        Returns
        -------
        numpy.ndarray, (..., N)
            Joint torques (N m).

        Raises
        ------
        ValueError
            If the shapes do not agree.
        """

    def forward_dynamics(
        self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, *, out: _Array | None = None
    ) -> _Array:
        """Forward dynamics: the accelerations that torques cause, without friction.

        Parameters
        ----------
        q, qd, tau : array_like, (..., N)
            Angles (rad), velocities (rad/s), joint torques (N m).
        out : numpy.ndarray, (..., N), optional
            Array for the result.

        Returns
        -------
        numpy.ndarray, (..., N)
            Accelerations (rad/s^2): the inverse of :meth:`rnea`.

        Raises
        ------
        ValueError
            If the shapes do not agree.
        """

    def coriolis(self, q: ArrayLike, qd: ArrayLike, *, out: _Array | None = None) -> _Array:
        """Velocity products ``C(q, qd) qd``, without gravity.

        Parameters
        ----------
        q, qd : array_like, (..., N)
            Angles (rad), velocities (rad/s).
        out : numpy.ndarray, (..., N), optional
            Array for the result.

        Returns
        -------
        numpy.ndarray, (..., N)
            Joint torques (N m).

        Raises
        ------
        ValueError
            If the shapes do not agree.
        """

    def coriolis_matrix(self, q: ArrayLike, qd: ArrayLike, *, out: _Array | None = None) -> _Array:
        """Christoffel matrix ``C(q, qd)``: ``H' - 2 C`` is skew.

        Parameters
        ----------
        q, qd : array_like, (..., N)
            Angles (rad), velocities (rad/s).
        out : numpy.ndarray, (..., N, N), optional
            Array for the result.

        Returns
        -------
        numpy.ndarray, (..., N, N)
            Torque for velocity (N m s/rad).

        Raises
        ------
        ValueError
            If the shapes do not agree.
        """

    def tip_pose(self, q: ArrayLike, *, out: _Array | None = None) -> _Array:
        """Pose of the tip in the base, ``base_from_tip``: it maps tip coordinates to base coordinates.

        Parameters
        ----------
        q : array_like, (..., N)
            Angles (rad).
        out : numpy.ndarray, (..., 4, 4), optional
            Array for the result.

        Returns
        -------
        numpy.ndarray, (..., 4, 4)
            Homogeneous matrix; the last column is the tip's position (m).

        Raises
        ------
        ValueError
            If the shapes do not agree.
        """

    def jacobian(self, q: ArrayLike, *, out: _Array | None = None) -> _Array:
        """Jacobian of the tip, base axes: linear rows first, then angular.

        Parameters
        ----------
        q : array_like, (..., N)
            Angles (rad).
        out : numpy.ndarray, (..., 6, N), optional
            Array for the result.

        Returns
        -------
        numpy.ndarray, (..., 6, N)
            Velocity of the tip (m/s) and angular velocity (rad/s) for joint velocities.

        Raises
        ------
        ValueError
            If the shapes do not agree.
        """

    def jacobian_dot_qd(self, q: ArrayLike, qd: ArrayLike, *, out: _Array | None = None) -> _Array:
        """``J' qd``: acceleration of the tip at ``qdd = 0``, base axes.

        Parameters
        ----------
        q, qd : array_like, (..., N)
            Angles (rad), velocities (rad/s).
        out : numpy.ndarray, (..., 6), optional
            Array for the result.

        Returns
        -------
        numpy.ndarray, (..., 6)
            Classical linear (m/s^2), then angular acceleration (rad/s^2).

        Raises
        ------
        ValueError
            If the shapes do not agree.
        """

    def regressor(
        self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, *, out: _Array | None = None
    ) -> _Array:
        """Torques as a linear function of the inertial parameters.

        ``rnea(q, qd, qdd) = regressor(q, qd, qdd) @ parameters + armature * qdd``.

        Parameters
        ----------
        q, qd, qdd : array_like, (..., N)
            Angles (rad), velocities (rad/s), accelerations (rad/s^2).
        out : numpy.ndarray, (..., N, 10 N), optional
            Array for the result.

        Returns
        -------
        numpy.ndarray, (..., N, 10 N)
            Ten columns for each link, in the order of :attr:`parameters`.

        Raises
        ------
        ValueError
            If the shapes do not agree.

        Examples
        --------
        >>> import numpy as np, supple
        >>> arm = supple.Arm.load("wam4")
        >>> q, qd, qdd = np.random.default_rng(0).normal(size=(3, 100, arm.dof))
        >>> tau = arm.regressor(q, qd, qdd) @ arm.parameters + arm.armature * qdd
        >>> bool(np.allclose(tau, arm.rnea(q, qd, qdd)))
        True
        """

    def impedance_torque(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        reference: ArrayLike,
        velocity: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        *,
        stiffness: ArrayLike,
        damping: ArrayLike,
        friction: Literal["reference", "measured"] | None = None,
        stribeck_velocity: ArrayLike | None = None,
        active_joints: Sequence[bool] | None = None,
        nullspace_damping: ArrayLike | None = None,
        nullspace_torque: ArrayLike | None = None,
        apparent_inertia: ArrayLike | None = None,
        force: ArrayLike | None = None,
        out: _Array | None = None,
    ) -> _Array:
        """Joint torques of the impedance law: the function that the controller runs in its modes track and track pose.

        ``tau = G + C qd + D + H Jb (Xo'' - J' qd) + J^T (K (Xo - X) + B (Xo' - X'))``, with ``Jb`` the dynamically
        consistent inverse of the active joints' Jacobian, damped near singular poses, and in the null space of the
        tip's motion the damping and the torque that are given.

        Every argument is one state or a batch, and everything of the tip is in base axes. The task is the tip's
        position or its pose, by the shape of ``reference``. With ``d = 3`` for a position, vectors of the tip have
        x, y and z; with ``d = 6`` for a pose they have x, y and z along the axes, then about them.

        Parameters
        ----------
        q, qd : array_like, (..., N)
            Angles (rad) and velocities (rad/s) of the joints.
        reference : array_like, (..., 3) or (..., 4, 4)
            Position of the tip that is wanted (m); or its pose, as :meth:`tip_pose` returns it.
        velocity, acceleration : array_like, (..., d), optional
            Of the reference (m/s and rad/s; m/s^2 and rad/s^2). Default: zero.
        stiffness, damping : array_like, (..., d)
            Diagonals of ``K`` (N/m, then N m/rad) and ``B`` (N s/m, then N m s/rad), zero or more. For a position a
            single number stands for all axes.
        friction : {"reference", "measured"}, optional
            Adds the feed-forward of :attr:`friction` at the joint velocities of the reference, as the controller does,
            or at ``qd``. Default: none.
        stribeck_velocity : array_like, (..., N), optional
            Joint velocities for the Stribeck effect of active joints (rad/s), with ``friction="reference"``: the controller
            of an arm whose description has ``measured_stribeck`` (all but paper3) uses the measured ones, averaged over 50 ms.
            Default: as the rest of the friction.
        active_joints : sequence of bool, (N,), optional
            Joints on which the law acts; at least ``d``. The others get ``G + C qd``, friction and the coupling torque.
            Default: :attr:`active_joints`.
        nullspace_damping : array_like, (..., N), optional
            Damping of the joints' motion that leaves the tip alone (N m s/rad), zero or more; a single number stands for
            all joints. Default: 0.
        nullspace_torque : array_like, (..., N), optional
            Torque to apply where the tip does not feel it, as towards a posture (N m). Default: 0.
        apparent_inertia : array_like, (..., d, d), optional
            Inertia that the tip is to have, symmetric and positive definite (kg, kg m^2). It needs ``force``. Default:
            the arm's own.
        force : array_like, (..., d), optional
            Measured force on the tip (N), for a pose with the moment (N m).
        out : numpy.ndarray, (..., N), optional
            Array for the result. If the call raises an error, it holds the states before the one that is wrong.

        Returns
        -------
        numpy.ndarray, (..., N)
            Joint torques (N m): the sum of :meth:`impedance_terms`, bit for bit. Without what the controller adds: loops
            of held joints, soft stops, ripple, learned terms, handover and limits.

        Raises
        ------
        ValueError
            If the shapes do not agree, a gain is negative, too few joints are active, a reference is no pose or an
            inertia not positive definite; the message names argument, index and remedy.

        Examples
        --------
        >>> import numpy as np, supple
        >>> arm = supple.Arm.load("wam4")
        >>> q, still = arm.home_rad, np.zeros(arm.dof)
        >>> here = arm.tip_pose(q)[:3, 3]
        >>> tau = arm.impedance_torque(q, still, here, stiffness=5.0, damping=1.5)
        >>> bool(np.allclose(tau, arm.gravity(q)))
        True
        """

    def impedance_terms(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        reference: ArrayLike,
        velocity: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        *,
        stiffness: ArrayLike,
        damping: ArrayLike,
        friction: Literal["reference", "measured"] | None = None,
        stribeck_velocity: ArrayLike | None = None,
        active_joints: Sequence[bool] | None = None,
        nullspace_damping: ArrayLike | None = None,
        nullspace_torque: ArrayLike | None = None,
        apparent_inertia: ArrayLike | None = None,
        force: ArrayLike | None = None,
    ) -> dict[str, _Array]:
        """Every term of the impedance law apart; arguments and errors are those of :meth:`impedance_torque`.

        Returns
        -------
        dict of str to numpy.ndarray, (..., N)
            The terms (N m): ``gravity``, ``coriolis``, ``friction``, ``jacobian_rate``, ``inertial``, ``stiffness``,
            ``damping``, ``force``, ``nullspace``, with the names of the controller's record and of logs. Added in this
            order they are the torque.

        Examples
        --------
        >>> import numpy as np, supple
        >>> arm = supple.Arm.load("wam4")
        >>> q, still = np.tile(arm.home_rad, (1000, 1)), np.zeros(arm.dof)
        >>> above = arm.tip_pose(arm.home_rad)[:3, 3] + [0.0, 0.0, 0.1]
        >>> terms = arm.impedance_terms(q, still, above, stiffness=5.0, damping=1.5)
        >>> pull = arm.jacobian(arm.home_rad)[2] * 0.5
        >>> bool(np.allclose(terms["stiffness"], np.where(arm.active_joints, pull, 0.0)))
        True
        """

    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, tuple[str, str]]: ...
    def _repr_html_(self) -> str: ...

@final
class Friction:
    """Friction of one joint: viscous and Coulomb, continuous over a band, with Stribeck effect and offset.

    ``D(v) = [V + A p(v / delta)] v + O + O_s e(v) + [S + (S0 - S) e(v)] p(v / delta)`` with ``e(v) = exp(-(v / v_s)^2)`` and
    ``p(x) = 2 x - sign(x) x^2`` inside the band and ``sign(x)`` outside. Immutable.

    Parameters
    ----------
    viscous_nm_s_per_rad : float
        ``V`` (N m s/rad), zero or more. Default 0.
    viscous_asymmetry_nm_s_per_rad : float
        ``A`` (N m s/rad), half of the difference between the viscous friction of the positive and the negative direction, at
        most ``viscous_nm_s_per_rad`` in magnitude. Default 0.
    coulomb_nm : float
        ``S`` (N m), zero or more. Default 0.
    breakaway_nm : float, optional
        ``S0`` (N m), at least ``coulomb_nm``. Default: ``coulomb_nm``, no Stribeck effect.
    stribeck_rad_per_s : float
        ``v_s`` (rad/s), positive. Default 0.05.
    offset_nm : float
        ``O`` (N m), torque that does not depend on the velocity. Default 0.
    stribeck_offset_nm : float
        ``O_s`` (N m), torque at rest in addition to ``offset_nm``, which falls with the Stribeck effect; at most
        ``breakaway_nm - coulomb_nm`` in magnitude. Default 0.
    band_rad_per_s : float
        ``delta`` (rad/s), positive. Default 0.01.
    presliding_rad : float
        Travel over which dry friction turns round after a reversal (rad), zero or more. Default 0: its direction is
        that of the velocity.
    load_coefficient : float
        Dry friction that a torque on the gear adds, per torque, 0 to 0.5. Default 0: friction does not depend on the load.
    load_torque : {"joint", "motor"}
        Which torque that is: that which the joint carries, or that of the motor, which has to overcome friction as well.
    coulomb_at_nm : float
        Size of that torque at which dry friction is ``coulomb_nm`` (N m), zero or more. Default 0.

    Raises
    ------
    ValueError
        If the friction would supply energy to the joint.

    Examples
    --------
    >>> import supple
    >>> friction = supple.Friction(viscous_nm_s_per_rad=2.0, coulomb_nm=0.5)
    >>> friction.torque_nm([-1.0, 0.0, 1.0])
    array([-2.5,  0. ,  2.5])
    """
    def __new__(
        cls,
        *,
        viscous_nm_s_per_rad: float = 0.0,
        viscous_asymmetry_nm_s_per_rad: float = 0.0,
        coulomb_nm: float = 0.0,
        breakaway_nm: float | None = None,
        stribeck_rad_per_s: float = 0.05,
        offset_nm: float = 0.0,
        stribeck_offset_nm: float = 0.0,
        band_rad_per_s: float = 0.01,
        presliding_rad: float = 0.0,
        load_coefficient: float = 0.0,
        load_torque: Literal["joint", "motor"] = "joint",
        coulomb_at_nm: float = 0.0,
    ) -> Friction: ...
    @property
    def viscous_nm_s_per_rad(self) -> float:
        """Viscous friction (N m s/rad)."""

    @property
    def viscous_asymmetry_nm_s_per_rad(self) -> float:
        """Half of the difference between the viscous friction of the positive and the negative direction (N m s/rad)."""

    @property
    def coulomb_nm(self) -> float:
        """Coulomb torque in steady sliding (N m)."""

    @property
    def breakaway_nm(self) -> float:
        """Limit of the Stribeck curve at standstill (N m)."""

    @property
    def stribeck_rad_per_s(self) -> float:
        """Stribeck speed (rad/s)."""

    @property
    def offset_nm(self) -> float:
        """Torque that does not depend on the velocity (N m)."""

    @property
    def stribeck_offset_nm(self) -> float:
        """Torque at rest in addition to ``offset_nm``, which falls with the Stribeck effect (N m)."""

    @property
    def band_rad_per_s(self) -> float:
        """Half-width of the band in which dry friction is a parabola (rad/s)."""

    @property
    def presliding_rad(self) -> float:
        """Travel over which dry friction turns round after a reversal (rad)."""

    @property
    def load_coefficient(self) -> float:
        """Dry friction that a torque on the gear adds, per torque."""

    @property
    def load_torque(self) -> Literal["joint", "motor"]:
        """Which torque that is, "joint" or "motor"."""

    @property
    def coulomb_at_nm(self) -> float:
        """Size of that torque at which dry friction is ``coulomb_nm`` (N m)."""

    def torque_nm(self, velocity_rad_per_s: ArrayLike) -> _Array:
        """Torque that compensates friction (N m), of the shape of ``velocity_rad_per_s``.

        Parameters
        ----------
        velocity_rad_per_s : array_like
            Joint velocities (rad/s), any shape.
        """

    @staticmethod
    def _of(values: tuple[float, ...], load_torque: str) -> Friction: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, tuple[list[float]]]: ...

@final
class Connection:
    """A connection to the system with a prefix. A thread receives its telemetry from the beginning."""
    def __new__(cls, prefix: str | None, timeout_s: float) -> Connection: ...
    @property
    def prefix(self) -> str: ...
    @property
    def dof(self) -> int: ...
    @property
    def period_s(self) -> float: ...
    def cycle(self) -> int:
        """Number of the last cycle."""

    def received(self) -> int:
        """Cycles received so far: a position for `read` and `wait`."""

    def lost(self) -> int:
        """Cycles that did not reach this connection."""

    def ended(self) -> str | None:
        """Why the connection has ended, if it has."""

    def wait(self, received: int, timeout_s: float) -> bool:
        """Waits until more than `received` cycles have come; returns whether there are more. Signals such as Ctrl-C end it."""

    def read(self, received: int) -> dict[str, Any]:
        """The cycles after the first `received`, as far as they are kept, as columns; `modes` and `faults` are lists, `first`
        is how many cycles came before them.
        """

    def latest(self) -> dict[str, Any]:
        """The last cycle, as columns with one row."""

    def request(
        self,
        kind: str,
        values: Sequence[float],
        trajectory: str | None = None,
        at_cycle: int | None = None,
    ) -> tuple[int, str]:
        """Sends a request by its name and values, as logs have them; returns the cycle and the mode after it."""

    def idle(self) -> tuple[int, str]:
        """Requests idle, over a separate socket, so that the request bypasses every queue."""

    def set_point(
        self,
        position_m: Sequence[float],
        velocity_m_per_s: Sequence[float],
        acceleration_m_per_s2: Sequence[float],
        at_cycle: int,
    ) -> None:
        """Sends a set-point of the tip and does not wait."""

    def take_refusal(self) -> str | None:
        """Why the controller refused a set-point since the last call, if it did."""

    def close(self) -> None:
        """Ends the connection."""


@final
class Simulation:
    """A simulated system in this process, with the methods of `Connection`."""
    def __new__(cls, arm: Arm, model: Arm | None, options: dict[str, Any]) -> Simulation: ...
    @property
    def prefix(self) -> str: ...
    @property
    def dof(self) -> int: ...
    @property
    def period_s(self) -> float: ...
    def cycle(self) -> int:
        """Number of the last cycle."""

    def received(self) -> int:
        """Cycles so far."""

    def lost(self) -> int:
        """None is ever lost."""

    def ended(self) -> str | None:
        """It never ends by itself."""

    def wait(self, received: int, timeout_s: float) -> bool:
        """Runs until more than `received` cycles are done. Signals such as Ctrl-C end it."""

    def read(self, received: int) -> dict[str, Any]:
        """The cycles after the first `received`, as far as they are kept, as columns; `first` is how many came before them."""

    def latest(self) -> dict[str, Any]:
        """The last cycle, as columns with one row."""

    def request(
        self,
        kind: str,
        values: Sequence[float],
        trajectory: str | None = None,
        at_cycle: int | None = None,
    ) -> tuple[int, str]:
        """Runs one cycle with a request; returns the cycle and the mode after it."""

    def idle(self) -> tuple[int, str]:
        """Requests idle."""

    def set_point(
        self,
        position_m: Sequence[float],
        velocity_m_per_s: Sequence[float],
        acceleration_m_per_s2: Sequence[float],
        at_cycle: int,
    ) -> None:
        """A set-point for the next cycle."""

    def take_refusal(self) -> str | None:
        """Why a set-point was refused since the last call, if one was."""

    def close(self) -> None:
        """Nothing: the interface of a connection."""


@final
class Fit:
    """Private class on which `supple.Fit` is built."""
    def report(self) -> dict[str, Any]:
        """All results by name."""

    def motions(self) -> list[dict[str, _Array]]:
        """The prepared samples of each fitted log; `predicted` has one column for each moving joint, with dry
        friction filtered like the torques.
        """

    def arm_given(self) -> Arm:
        """The nominal arm."""

    def arm(self, ripple: Sequence[Sequence[tuple[int, float, float]]] | None = None) -> Arm:
        """The identified arm, as a description that the controller loads."""

    def predict(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> _Array: ...
    def validate(self, log: dict[str, Any]) -> dict[str, Any]: ...

def read_log(path: str) -> dict[str, Any]:
    """Reads a log: the arm, its metadata and its columns."""

def realistic_set(arm: Arm) -> str:
    """Returns the name of the realistic set of `arm`."""

def plant_options(name: str) -> dict[str, float]:
    """Returns the set of options `name` as a dictionary."""

def simulate(arm: Arm, model: Arm | None, options: dict[str, Any]) -> dict[str, Any]:
    """Runs an experiment in virtual time. `model` is the controller's model of the arm; without it, the controller
    uses the arm itself with the given errors.
    """

def identify(
    arm: Arm, logs: list[dict[str, Any]], options: dict[str, Any]
) -> tuple[Fit, list[str]]:
    """Identifies `arm` from logs; returns the fit and its warnings."""

def base_parameters(
    arm: Arm, states: list[_Array], rotor: bool, moving: list[int]
) -> dict[str, Any]:
    """Computes the base parameters of the regressor stacked over given states."""

def design_excitation(
    arm: Arm, request: dict[str, Any], progress: Callable[[int, float], object] | None
) -> dict[str, Any]:
    """Searches for an excitation. `progress` receives the number of candidates and the best value so far, at most
    a hundred times. An exception in `progress` and a signal's stop the search.
    """

def excite(
    arm: Arm, model: Arm, series: dict[str, Any], options: dict[str, Any]
) -> dict[str, Any]:
    """Simulates an arm that tracks a series and returns its log. `model` is the controller's model of the arm."""

def learn(arm: Arm, logs: list[dict[str, Any]], options: dict[str, Any]) -> dict[str, Any]:
    """Updates friction and payload of an arm from logs of a repeated motion."""

def payload(fit: Fit, logs: list[dict[str, Any]], guess: dict[str, Any]) -> dict[str, Any]:
    """Identifies a payload from the residual of the fit over logs with it; undetermined parameters are regularised
    towards `guess`.
    """

def torque_scale(
    fit: Fit, logs: list[dict[str, Any]], known: dict[str, Any]
) -> list[float | None]:
    """Returns the ratio of true to logged torque of each moving joint; `None` if the known payload adds too little torque."""

def dh_to_urdf(name: str, standard: bool, rows: list[list[float]], masses_kg: list[float] | None) -> str:
    """Returns the text of a URDF; rows of `a`, `alpha`, `d`, `theta`."""

def weigh(fit: Fit, logs: list[dict[str, Any]], mass_kg: float) -> dict[str, Any]:
    """Estimates torque scales and the place of a weight of known mass."""

def ripple(
    fit: Fit,
    logs: list[dict[str, Any]],
    harmonics: list[int],
    fast_rad_per_s: float,
    cutoff_hz: float,
) -> list[list[tuple[int, float, float]]]:
    """Returns harmonic, sine and cosine amplitude of every line of each motor."""
