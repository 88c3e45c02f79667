"""Identification: from logs to a model that a body could have."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple import _native

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

__all__ = [
    "BaseParameters",
    "DataWarning",
    "Fit",
    "FrictionColumns",
    "Payload",
    "Validation",
    "base_parameters",
    "identify",
]


class DataWarning(UserWarning):
    """Something doubtful about a log or a fit that was let pass: column, problem, remedy."""


@dataclass(frozen=True, kw_only=True)
class FrictionColumns:
    """Friction that is fitted to every moving joint."""

    viscous: bool = True
    """``V qd``."""
    coulomb: bool = True
    """``S p(qd / band)``, ``p`` the parabola of :class:`Friction`."""
    offset: bool = False
    """Constant: with it, Coulomb friction may differ by direction."""
    asymmetry: bool = False
    """``A |qd|``: viscous friction that differs by direction. Needs ``viscous``."""
    load: bool = False
    """``L |g| p(qd / band)``: Coulomb friction that grows with the torque ``g`` which the joint's gear
    passes on to the links, by the arm that the fit starts from. Needs ``coulomb``."""
    stribeck_rad_per_s: float | None = None
    """Speed over which a Stribeck dip fades (rad/s); ``None`` for no dip."""
    band_rad_per_s: float = 0.01
    """Half-width of the parabola (rad/s)."""


_FRICTION = {
    "none": FrictionColumns(viscous=False, coulomb=False),
    "viscous": FrictionColumns(coulomb=False),
    "coulomb": FrictionColumns(),
    "offset": FrictionColumns(offset=True),
    "asymmetric": FrictionColumns(offset=True, asymmetry=True),
    "load": FrictionColumns(load=True),
    "stribeck": FrictionColumns(offset=True),
}
# Of the fit with a dip, where nothing is said (rad/s).
_SLOW_RAD_PER_S = 0.15


Ripple = tuple[tuple[tuple[int, float, float], ...], ...]


@dataclass(frozen=True, eq=False)
class Payload:
    """A body in the last link's frame."""

    mass_kg: float
    """Mass (kg)."""
    com_m: ArrayLike
    """Centre of mass, (3,) (m)."""
    inertia_kg_m2: ArrayLike
    """Inertia about the centre of mass, (3, 3) (kg m^2)."""

    @staticmethod
    def ball(mass_kg: float, radius_m: float, com_m: ArrayLike) -> Payload:
        """A solid ball."""
        return Payload(mass_kg, com_m, 0.4 * mass_kg * radius_m**2 * np.eye(3))

    def _dict(self) -> dict[str, Any]:
        com, inertia = np.asarray(self.com_m, float), np.asarray(self.inertia_kg_m2, float)
        for name, array, shape in (("com_m", com, (3,)), ("inertia_kg_m2", inertia, (3, 3))):
            if array.shape != shape:
                raise ValueError(f"{name}: expected shape {shape}, got {array.shape}")
        return {
            "mass_kg": float(self.mass_kg),
            "com_m": com.tolist(),
            "inertia_kg_m2": inertia.tolist(),
        }


@dataclass(frozen=True, eq=False)
class Validation:
    """How well a fit predicts a log that it has not seen. N is the number of joints."""

    rms: Array
    """RMS error of each joint, (N,) (N m); NaN for joints that were held."""
    relative: Array
    """``|tau - tau_hat| / |tau|`` of each joint, (N,); NaN for joints that were held."""
    total_relative: float
    """The same over all moving joints."""
    positive_definite: float
    """Share of 2,000 random poses with a positive definite mass matrix."""
    verdict: str
    """In plain words whether a controller can use the model."""


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """What motion can tell of an arm: combinations of the columns, see :func:`base_parameters`.

    ``values = x[independent] + combination @ x[dependent]`` for parameters ``x`` of the columns.
    """

    names: tuple[str, ...]
    """Each base parameter in words, such as ``"Izz1 + Iyy2 - 0.55 mcx2"``, (rank,)."""
    values: Array
    """Their values for this arm, (rank,), SI units."""
    null_space: tuple[str, ...]
    """Directions in which the parameters may move without any change of torque, in words."""
    columns: tuple[str, ...]
    """Names of the columns: ten a link, then the rotors; links and joints are counted from 0."""
    independent: NDArray[np.intp]
    """Positions of the independent columns, (rank,)."""
    dependent: NDArray[np.intp]
    """Positions of the others."""
    combination: Array
    """(rank, dependent)."""
    condition: float
    """Greatest by least singular value of the independent columns, each scaled to unit length."""

    @property
    def rank(self) -> int:
        """Number of base parameters."""
        return len(self.names)


def base_parameters(
    arm: _native.Arm,
    *,
    rotor: bool = False,
    moving: Sequence[int] | None = None,
    samples: int = 500,
    seed: int = 0,
) -> BaseParameters:
    """Which combinations of an arm's inertial parameters any motion can tell apart.

    The regressor of random states, all angles within half a turn, is taken apart by QR with column
    pivoting.

    Parameters
    ----------
    arm : Arm
        The arm.
    rotor : bool
        With a rotor inertia for each moving joint.
    moving : sequence of int, optional
        Joints that move, increasing from 0; the others are held. Default: all.
    samples : int
        Random states.
    seed : int
        Their seed.

    Returns
    -------
    BaseParameters
        Rank, names, values, null space.

    Raises
    ------
    ValueError
        For joints that do not exist, or too few samples.

    Examples
    --------
    >>> import supple
    >>> base = supple.base_parameters(supple.Arm.load("wam4"))
    >>> base.rank, base.columns[:4]
    (22, ('m0', 'mcx0', 'mcy0', 'mcz0'))
    """
    if samples < 20 * arm.dof:
        raise ValueError(f"samples: expected {20 * arm.dof} or more for this arm, got {samples}")
    rng = np.random.default_rng(seed)
    q = rng.uniform(-np.pi, np.pi, size=(samples, arm.dof))
    qd, qdd = rng.normal(scale=3.0, size=(2, samples, arm.dof))
    joints = list(range(arm.dof)) if moving is None else [int(joint) for joint in moving]
    found = _native.base_parameters(arm, [q, qd, qdd], rotor, joints)
    return BaseParameters(
        names=tuple(found["names"]),
        values=found["values"],
        null_space=tuple(found["null_space"]),
        columns=tuple(found["columns"]),
        independent=np.array(found["independent"], dtype=np.intp),
        dependent=np.array(found["dependent"], dtype=np.intp),
        combination=found["combination"],
        condition=found["condition"],
    )


@dataclass(frozen=True, eq=False)
class Fit:
    """A model found by :func:`identify`. N is the number of joints, M of those that moved."""

    _fit: _native.Fit = field(repr=False)
    columns: Mapping[str, float]
    """Every column by name with its value: ``"Izz2"``, rotor ``"Ir0"``, viscous ``"V0"``, Coulomb
    ``"S0"``, ``"offset0"``, asymmetry ``"A0"``, Stribeck ``"B0"``, load ``"L0"``; joints are counted from 0. SI units."""
    base_names: tuple[str, ...]
    """Each base parameter in words, (rank,)."""
    base_parameters: Array
    """Values of the combinations that the data determine, (rank,), SI units."""
    std: Array
    """Standard deviation of each, (rank,)."""
    null_space: tuple[str, ...]
    """Directions that the data leave open, in words: there the arm given decides."""
    condition: float
    """Greatest by least singular value of the independent columns, each scaled to unit length."""
    moving: tuple[int, ...]
    """Joints that were identified, from 0."""
    friction: tuple[_native.Friction, ...]
    """Friction of every joint, (N,); of joints that were held, that of the arm given."""
    noise_nm: Array
    """RMS residual of each moving joint, (M,) (N m)."""
    training_relative: float
    """``|tau - tau_hat| / |tau|`` over the samples that were fitted."""
    gap: float | None
    """Certified distance of the objective from its optimum, for ``method="consistent"``."""
    choices: tuple[tuple[str, str], ...]
    """What was chosen by cross-validation, each with the table of held-out errors that decided it."""
    warnings: tuple[str, ...]
    """What was let pass."""

    @property
    def rank(self) -> int:
        """Number of combinations that the data determine."""
        return len(self.base_parameters)

    @property
    def arm(self) -> _native.Arm:
        """The arm found, with its friction.

        Raises
        ------
        ValueError
            If the parameters are no arm: possible for the methods without constraints.
        """
        return self._fit.arm()

    def predict(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Array:
        """Joint torques (N m), friction included, of one state (N,) or a batch (..., N).

        Parameters
        ----------
        q, qd, qdd : array_like, (..., N)
            Angles (rad), velocities (rad/s), accelerations (rad/s^2). Joints that were held are
            predicted at rest and without friction.
        """
        return self._fit.predict(q, qd, qdd)

    def validate(
        self,
        t: ArrayLike,
        q: ArrayLike,
        tau: ArrayLike,
        qd: ArrayLike | None = None,
        qdd: ArrayLike | None = None,
    ) -> Validation:
        """Predict the torques of another log, prepared by the same filter as the fit's, and compare.

        Parameters
        ----------
        t : array_like, (samples,)
            Time (s), increasing.
        q, tau : array_like, (samples, N)
            Angles (rad) and measured torques (N m).
        qd, qdd : array_like, (samples, N), optional
            Velocities (rad/s) and accelerations (rad/s^2), as in :func:`identify`.

        Raises
        ------
        ValueError
            As :func:`identify`.
        """
        found = self._fit.validate(_log(t, q, tau, qd, qdd))
        joints = len(self.friction)
        for name in ("rms", "relative"):
            whole = np.full(joints, np.nan)
            whole[list(self.moving)] = found[name]
            found[name] = whole
        return Validation(**found)

    def payload(
        self,
        t: ArrayLike | Sequence[ArrayLike],
        q: ArrayLike | Sequence[ArrayLike],
        tau: ArrayLike | Sequence[ArrayLike],
        qd: ArrayLike | Sequence[ArrayLike] | None = None,
        qdd: ArrayLike | Sequence[ArrayLike] | None = None,
        *,
        guess: Payload,
    ) -> Payload:
        """The body in the hand that explains what this fit, of the arm without it, leaves of logs with it.

        Parameters
        ----------
        t, q, tau, qd, qdd
            The log or logs, as in :func:`identify`; prepared as the fitted ones were.
        guess : Payload
            What it is drawn to where the logs do not tell.

        Raises
        ------
        ValueError
            As :func:`identify`; for a guess that is no body.
        """
        found = _native.payload(self._fit, _logs(t, q, tau, qd, qdd), guess._dict())
        return Payload(**found)

    def torque_scale(
        self,
        t: ArrayLike | Sequence[ArrayLike],
        q: ArrayLike | Sequence[ArrayLike],
        tau: ArrayLike | Sequence[ArrayLike],
        qd: ArrayLike | Sequence[ArrayLike] | None = None,
        qdd: ArrayLike | Sequence[ArrayLike] | None = None,
        *,
        known: Payload,
    ) -> tuple[float | None, ...]:
        """True by logged torque of each moving joint, (M,), from logs with a known body in the hand.

        Published torque constants of one arm differ by a fifth; a weight tells. ``None`` where the body
        adds too little to a joint's torque. Multiply ``tau`` by it and identify again, twice where the
        scales of the joints differ: joints share links, and the first fit is off where they do.

        Parameters
        ----------
        t, q, tau, qd, qdd
            The log or logs, as in :func:`identify`; prepared as the fitted ones were, torques of the same
            scale as theirs.
        known : Payload
            The body.

        Raises
        ------
        ValueError
            As :func:`identify`; for a body that is none.
        """
        return tuple(_native.torque_scale(self._fit, _logs(t, q, tau, qd, qdd), known._dict()))

    def ripple(
        self,
        t: ArrayLike | Sequence[ArrayLike],
        q: ArrayLike | Sequence[ArrayLike],
        tau: ArrayLike | Sequence[ArrayLike],
        *,
        harmonics: Sequence[int] = range(1, 9),
        fast_rad_per_s: float = 0.2,
        cutoff_hz: float = 40.0,
    ) -> Ripple:
        """Torque ripple of every motor, from slow motion of all joints.

        Parameters
        ----------
        t, q, tau
            The log or logs, as in :func:`identify`.
        harmonics : sequence of int
            Periods in a revolution of the motor to look for.
        fast_rad_per_s : float
            Faster samples are left out (rad/s).
        cutoff_hz : float
            Cutoff of the filter (Hz): ripple is faster than what the model is fitted to.

        Returns
        -------
        tuple of tuples of (int, float, float)
            Motor by motor, the harmonics that stand out of the noise, the largest first: harmonic, sine
            and cosine amplitude at the motor (N m). :meth:`save` takes it.

        Raises
        ------
        ValueError
            As :func:`identify`; where not all joints were identified, or there is too little slow motion.
        """
        orders = [int(harmonic) for harmonic in harmonics]
        logs = _logs(t, q, tau, None, None)
        found = _native.ripple(self._fit, logs, orders, fast_rad_per_s, cutoff_hz)
        return tuple(tuple(lines) for lines in found)

    def save(self, path: str | os.PathLike[str], *, ripple: Ripple | None = None) -> Path:
        """Write the model as ``arm.toml`` and ``arm.urdf`` into the folder ``path``.

        The controller loads it (``supple demo --arm path``), and so does :meth:`Arm.load`. The folder is
        made if need be; files in it are replaced.

        Parameters
        ----------
        path : str or os.PathLike
            The folder.
        ripple : optional
            Torque ripple of the motors, as :meth:`ripple` gives it. Default: that of the arm given.

        Returns
        -------
        pathlib.Path
            The TOML.

        Raises
        ------
        ValueError
            As :attr:`arm`.
        OSError
            Where it cannot be written.
        """
        arm = self._fit.arm(ripple)
        folder = Path(path)
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in (("arm.urdf", arm.urdf), ("arm.toml", arm.toml)):
            temporary = folder / f".{name}.part"
            temporary.write_text(text, encoding="utf-8")
            temporary.replace(folder / name)
        return folder / "arm.toml"

    def plot(self, log: int = 0) -> Figure:
        """Measured and predicted torque of each moving joint, with the residual, over a fitted log.

        Needs matplotlib: ``pip install supple[viz]``.

        Parameters
        ----------
        log : int
            Which of the logs that were fitted.

        Raises
        ------
        ImportError
            Without matplotlib.
        IndexError
            For a log that is none.
        """
        try:
            from matplotlib.figure import Figure
        except ImportError as error:
            raise ImportError("plot needs matplotlib: pip install 'supple[viz]'") from error
        motion = self._fit.motions()[log]
        figure = Figure(figsize=(9.0, 2.2 * len(self.moving)), layout="constrained")
        axes = figure.subplots(len(self.moving), 1, sharex=True, squeeze=False)[:, 0]
        names = self.arm_given.joint_names
        for axis, joint, hat in zip(axes, self.moving, motion["predicted"].T, strict=True):
            measured = motion["tau"][:, joint]
            axis.plot(motion["t"], measured, color="0.35", linewidth=1.4, label="measured")
            axis.plot(motion["t"], hat, color="C0", linewidth=1.0, label="predicted")
            axis.plot(motion["t"], measured - hat, color="C3", linewidth=0.8, label="residual")
            relative = np.linalg.norm(measured - hat) / np.linalg.norm(measured)
            axis.set_title(f"{names[joint]}: {100.0 * relative:.2f} %", fontsize="medium", loc="left")
            axis.set_ylabel("torque (N m)")
        axes[0].legend(loc="upper right", ncols=3, fontsize="small")
        axes[-1].set_xlabel("time (s)")
        return figure

    @property
    def arm_given(self) -> _native.Arm:
        """The arm that fixed the kinematics, and what the data leave open."""
        return self._fit.arm_given()

    def __str__(self) -> str:
        joints = self.arm_given.joint_names
        lines = [
            f"{self.arm_given.name}: rank {self.rank} of {len(self.columns)} columns,"
            f" condition {self.condition:.0f},"
            f" {100.0 * self.training_relative:.2f} % of the torque unexplained",
            *(
                f"  {name:40} {value:12.6g} +- {std:.2g}"
                for name, value, std in zip(
                    self.base_names, self.base_parameters, self.std, strict=True
                )
            ),
            *(
                f"  {joints[joint]}: residual {noise:.3g} N m"
                for joint, noise in zip(self.moving, self.noise_nm, strict=True)
            ),
            *(f"  doubtful: {warning}" for warning in self.warnings),
        ]
        return "\n".join(lines)


def identify(
    arm: _native.Arm,
    t: ArrayLike | Sequence[ArrayLike],
    q: ArrayLike | Sequence[ArrayLike],
    tau: ArrayLike | Sequence[ArrayLike],
    qd: ArrayLike | Sequence[ArrayLike] | None = None,
    qdd: ArrayLike | Sequence[ArrayLike] | None = None,
    moving: Sequence[int] | None = None,
    coupling: Sequence[tuple[int, int]] | tuple[int, int] | None = None,
    cutoff_hz: float | None = None,
    method: Literal["ols", "wls", "irls", "consistent"] = "consistent",
    friction: str | FrictionColumns = "auto",
    *,
    rate_hz: float | None = None,
    keep_every: int = 1,
    torque_delay_s: float = 0.0,
    rotor: bool = True,
    slow_rad_per_s: float | None = None,
    prior_weight: float | None = None,
    joint_noise_nm: ArrayLike | None = None,
) -> Fit:
    """Identify an arm from a log, or from several.

    Kinematics are those of ``arm``, and so is what the data leave open. What is left open here
    (``friction``, ``prior_weight``, weights) is chosen by predicting parts of the logs from the others;
    nothing but these logs decides.

    Parameters
    ----------
    arm : Arm
        Kinematics and a first model, from a datasheet or CAD.
    t : array_like, (samples,), or a list of them
        Time (s), strictly increasing, without gaps. Several logs are given as lists of equal length.
    q : array_like, (samples, N)
        Angles (rad).
    tau : array_like, (samples, N)
        Torques of the motors, at the joints (N m).
    qd : array_like, (samples, N), optional
        Velocities (rad/s). Default: differentiated.
    qdd : array_like, (samples, N), optional
        Accelerations (rad/s^2), only with ``qd``. Default: differentiated. With them and without a
        filter, rows are taken as they are and need not follow each other in time.
    moving : sequence of int, optional
        Joints to identify, increasing from 0; the others are held where the log has them. Default: all.
    coupling : (int, int) or a sequence of pairs, optional
        Joints whose sum turns a motor: rotor inertia and friction of ``qd_a + qd_b`` act on both.
    cutoff_hz : float, optional
        Cutoff of the fourth-order zero-phase filter that ``q``, ``qd``, ``qdd`` and ``tau`` go through
        alike (Hz); ``math.inf`` for none. Default: 8, none where ``qdd`` is given.
    method : {"consistent", "wls", "irls", "ols"}
        Weighted with every link a body that can be and friction that takes energy; weighted least
        squares; robust (Huber); ordinary least squares.
    friction : "auto", {"none", "viscous", "coulomb", "offset", "asymmetric", "load", "stribeck"} or FrictionColumns
        Friction columns of every moving joint. ``"auto"`` chooses by cross-validation. ``"load"`` is
        viscous and Coulomb, which grows with the load; the controller's friction, which knows none, has
        it at the mean load. ``"stribeck"`` is
        viscous and Coulomb with offset, and a dip, its speed included, from slow motion in a second
        stage.
    rate_hz : float, optional
        Rate of the regular grid that the log is brought to (Hz). Default: the log's own mean rate.
    keep_every : int
        Every so many samples of the grid are fitted.
    torque_delay_s : float
        Time by which a logged torque acts later than the angle beside it was measured (s). A command
        that acts in the cycle after, for a cycle, does so by one and a half periods.
    rotor : bool
        A rotor inertia for each moving joint; without, those of ``arm`` are taken as known.
    slow_rad_per_s : float
        Samples of a joint slower than this are left out of its rows (rad/s); a Stribeck dip is then
        fitted from them in a second stage. Default: none, 0.15 with ``friction="stribeck"``.
    prior_weight : float, optional
        How many observations of one standard deviation the first model is worth. Default: by
        cross-validation.
    joint_noise_nm : array_like, (M,), optional
        Noise of each moving joint's torque (N m), in place of weights found from residuals.

    Returns
    -------
    Fit
        The model, what it is worth, and how it was chosen.

    Raises
    ------
    ValueError
        For columns that cannot be used (not finite, gaps in time, degrees, joints that hardly move),
        shapes that do not fit, options out of range, data that determine nothing: column or argument,
        problem and remedy are named.

    Warns
    -----
    DataWarning
        For what is doubtful and let pass.

    Examples
    --------
    Sums of sinusoids, torques of a known arm, no noise: the base parameters come back.

    >>> import numpy as np, supple
    >>> arm = supple.Arm.load("wam4")
    >>> rng = np.random.default_rng(0)
    >>> t = np.arange(0.0, 20.0, 0.02)
    >>> w = 2.0 * np.pi * rng.uniform(0.1, 0.6, size=(5, 1, 4))
    >>> a, phase = rng.uniform(0.1, 0.5, size=(5, 1, 4)), rng.uniform(0.0, 6.0, size=(5, 1, 4))
    >>> q = (a * np.sin(w * t[:, None] + phase)).sum(axis=0)
    >>> qd = (a * w * np.cos(w * t[:, None] + phase)).sum(axis=0)
    >>> qdd = (-a * w**2 * np.sin(w * t[:, None] + phase)).sum(axis=0)
    >>> tau = arm.rnea(q, qd, qdd)
    >>> fit = supple.identify(arm, t, q, tau, qd, qdd, method="ols", friction="none")
    >>> bool(np.allclose(fit.predict(q, qd, qdd), tau, atol=1e-9))
    True
    """
    if qdd is not None and qd is None:
        raise ValueError("qd: expected velocities beside the accelerations qdd, got None")
    if isinstance(friction, str) and friction not in ("auto", *_FRICTION):
        known = ", ".join(("auto", *_FRICTION))
        raise ValueError(f"friction: expected one of {known} or FrictionColumns, got {friction!r}")
    columns = _FRICTION.get(friction) if isinstance(friction, str) else friction
    dip = friction == "stribeck"
    if slow_rad_per_s is None:
        slow_rad_per_s = _SLOW_RAD_PER_S if dip else 0.0
    if cutoff_hz is None:
        cutoff_hz = inf if qdd is not None else 8.0
    native, doubts = _native.identify(
        arm,
        _logs(t, q, tau, qd, qdd),
        {
            "moving": None if moving is None else [int(joint) for joint in moving],
            "couplings": _pairs(coupling),
            "rate_hz": rate_hz,
            "cutoff_hz": None if cutoff_hz == inf else cutoff_hz,
            "keep_every": keep_every,
            "torque_delay_s": torque_delay_s,
            "dip": dip,
            "method": method,
            "friction": columns,
            "rotor": rotor,
            "slow_rad_per_s": slow_rad_per_s,
            "prior_weight": prior_weight,
            "joint_noise_nm": _optional_list(joint_noise_nm),
        },
    )
    for doubt in doubts:
        warnings.warn(doubt, DataWarning, stacklevel=2)
    report = native.report()
    return Fit(
        _fit=native,
        columns=dict(report["columns"]),
        base_names=tuple(report["base_names"]),
        base_parameters=report["base_parameters"],
        std=report["std"],
        null_space=tuple(report["null_space"]),
        condition=report["condition"],
        moving=tuple(report["moving"]),
        friction=tuple(report["friction"]),
        noise_nm=report["noise_nm"],
        training_relative=report["training_relative"],
        gap=report["gap"],
        choices=tuple(report["choices"]),
        warnings=tuple(doubts),
    )


def _optional_list(values: ArrayLike | None) -> list[float] | None:
    return None if values is None else [float(value) for value in np.asarray(values, float)]


def _pairs(coupling: Any) -> list[tuple[int, int]]:
    if coupling is None:
        return []
    array = np.asarray(coupling)
    if array.ndim not in (1, 2) or array.shape[-1] != 2:
        raise ValueError(f"coupling: expected a pair of joints or a list of pairs, got {coupling!r}")
    return [(int(a), int(b)) for a, b in np.atleast_2d(array)]


def _log(t: Any, q: Any, tau: Any, qd: Any, qdd: Any) -> dict[str, Any]:
    return {"t": t, "q": q, "tau": tau, "qd": qd, "qdd": qdd}


def _logs(t: Any, q: Any, tau: Any, qd: Any, qdd: Any) -> list[dict[str, Any]]:
    """One log, or several given as lists: then the entries of ``t`` are arrays themselves."""
    several = isinstance(t, (list, tuple)) and len(t) > 0 and all(np.ndim(part) > 0 for part in t)
    if not several:
        return [_log(t, q, tau, qd, qdd)]
    given = {"q": q, "tau": tau, "qd": qd, "qdd": qdd}
    for name, columns in given.items():
        if columns is not None and len(columns) != len(t):
            raise ValueError(f"{name}: expected {len(t)} logs, as many as t, got {len(columns)}")
    parts = {name: [None] * len(t) if value is None else value for name, value in given.items()}
    return [_log(t[k], *(parts[name][k] for name in ("q", "tau", "qd", "qdd"))) for k in range(len(t))]
