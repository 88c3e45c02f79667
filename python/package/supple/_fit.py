"""A model that was found, and what is asked of it: predictions, validation, payload, ripple, files."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple import _native
from supple._given import given_log, given_logs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

__all__ = ["Fit", "Payload", "Validation"]


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
        found = self._fit.validate(given_log(t, q, tau, qd, qdd))
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
        found = _native.payload(self._fit, given_logs(t, q, tau, qd, qdd), guess._dict())
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

        Published torque constants of one arm differ by a fifth; a weight tells. Every joint is told by
        itself, from the logs of this fit and those with the body: the scales may differ. ``None`` where
        the body adds too little to a joint's torque. Multiply ``tau`` by them and identify again: with
        different scales on joints that share links, this fit is off.

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
        return tuple(_native.torque_scale(self._fit, given_logs(t, q, tau, qd, qdd), known._dict()))

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
        """Torque ripple of every motor, from slow motion of all joints, best at constant speed.

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
        logs = given_logs(t, q, tau, None, None)
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
            Where it cannot be written, or a device, FIFO, socket or folder has the name of a file.
        """
        arm = self._fit.arm(ripple)
        folder = Path(path)
        arm._save(folder)
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
