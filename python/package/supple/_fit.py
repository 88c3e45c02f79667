"""Identified models: prediction, validation, payload, ripple, saving."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple import _check, _native
from supple._frames import AXES, table
from supple._log_input import log_input, log_inputs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

__all__ = ["Fit", "Payload", "Validation", "Weighing"]


Ripple = tuple[tuple[tuple[int, float, float], ...], ...]


@dataclass(frozen=True, eq=False)
class Payload:
    """A payload in the last link's frame."""

    mass_kg: float
    """Mass (kg)."""
    com_m: ArrayLike
    """Centre of mass, (3,) (m)."""
    inertia_kg_m2: ArrayLike
    """Inertia about the centre of mass, (3, 3) (kg m^2)."""

    @staticmethod
    def ball(mass_kg: float, radius_m: float, com_m: ArrayLike) -> Payload:
        """Returns a payload that is a solid ball."""
        return Payload(mass_kg, com_m, 0.4 * mass_kg * radius_m**2 * np.eye(3))

    def __repr__(self) -> str:
        com = ", ".join(f"{x:.4f}" for x in np.asarray(self.com_m, float))
        return f"<Payload of {self.mass_kg:.3f} kg at ({com}) m>"

    def _repr_html_(self) -> str:
        com_m, inertia_kg_m2 = np.asarray(self.com_m, float), np.asarray(self.inertia_kg_m2, float)
        rows = [
            (axis, f"{com:.4f}", *(f"{moment:.3g}" for moment in moments))
            for axis, com, moments in zip(AXES, com_m, inertia_kg_m2, strict=True)
        ]
        head = ("", "centre [m]", *(f"inertia {axis} [kg m²]" for axis in AXES))
        return table(f"Payload of {self.mass_kg:.3f} kg", head, rows)

    def _dict(self) -> dict[str, Any]:
        return {
            "mass_kg": _check.number("mass_kg", self.mass_kg, signed=True),
            "com_m": _check.array("com_m", self.com_m, (3,)).tolist(),
            "inertia_kg_m2": _check.array("inertia_kg_m2", self.inertia_kg_m2, (3, 3)).tolist(),
        }


@dataclass(frozen=True, eq=False)
class Weighing:
    """Torque scales and the place of a weight of known mass. Deviations are those of the noise, without errors of the model."""

    torque_scale: tuple[float | None, ...]
    """Ratio of true to logged torque of each moving joint, (M,); ``None`` if it is not known within 5 %."""
    torque_scale_deviation: tuple[float, ...]
    """Relative standard deviation of each scale, (M,); infinite if the weight does not load the joint, or was not carried."""
    com_m: Array
    """Centre of mass of the weight in the last link's frame, (3,) (m)."""
    com_deviation_m: Array
    """Standard deviation of each coordinate, (3,) (m)."""
    warnings: tuple[str, ...]
    """What the logs do not tell apart, with a remedy."""

    def __repr__(self) -> str:
        scales = ", ".join("unknown" if scale is None else f"{scale:.3f}" for scale in self.torque_scale)
        com = ", ".join(f"{x:.4f}" for x in self.com_m)
        return f"<Weighing: torque scales {scales}; weight at ({com}) m>"


@dataclass(frozen=True, eq=False)
class Validation:
    """Prediction errors of a fit on a held-out log. N is the number of joints."""

    rms: Array
    """RMS error of each joint, (N,) (N m); NaN for held joints."""
    relative: Array
    """``|tau - tau_hat| / |tau|`` of each joint, (N,); NaN for held joints."""
    total_relative: float
    """Relative error over all moving joints."""
    positive_definite: float
    """Fraction of 2,000 random poses with a positive definite mass matrix."""
    verdict: str
    """Verdict as text: whether a controller can use the model."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A model identified by :func:`identify`. N is the number of joints, M the number of moving
    joints."""

    _fit: _native.Fit = field(repr=False)
    columns: Mapping[str, float]
    """Every column by name with its value: ``"Izz2"``, rotor ``"Ir0"``, viscous ``"V0"``, Coulomb
    ``"S0"``, ``"offset0"``, asymmetry ``"A0"``, Stribeck ``"B0"`` and ``"O0"``, load ``"L0"``; joints are counted from 0. SI units."""
    base_names: tuple[str, ...]
    """Each base parameter as text, (rank,)."""
    base_parameters: Array
    """Values of the combinations that the data determine, (rank,), SI units."""
    std: Array
    """Standard deviations of ``base_parameters``, (rank,)."""
    null_space: tuple[str, ...]
    """Undetermined directions, as text; the nominal arm determines the values in these directions."""
    condition: float
    """Condition number of the independent columns, each scaled to unit length."""
    moving: tuple[int, ...]
    """Joints that were identified, from 0."""
    friction: tuple[_native.Friction, ...]
    """Friction of every joint, (N,); held joints keep the friction of the nominal arm."""
    noise_nm: Array
    """RMS residual of each moving joint, (M,) (N m)."""
    training_relative: float
    """``|tau - tau_hat| / |tau|`` over the fitted samples."""
    gap: float | None
    """Upper bound on the distance of the objective from its optimum, for ``method="consistent"``."""
    choices: tuple[tuple[str, str], ...]
    """Choices made by cross-validation, each with its table of held-out errors."""
    warnings: tuple[str, ...]
    """Warnings about the data and the fit."""

    @property
    def rank(self) -> int:
        """Number of combinations that the data determine."""
        return len(self.base_parameters)

    @property
    def arm(self) -> _native.Arm:
        """The identified arm, with its friction and, if identified, springs, tilt and compliance.

        Raises
        ------
        ValueError
            If the parameters are physically inconsistent, which only unconstrained methods can give.
        """
        return self._fit.arm()

    def predict(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Array:
        """Joint torques (N m), friction included, of one state (N,) or a batch (..., N).

        Parameters
        ----------
        q, qd, qdd : array_like, (..., N)
            Angles (rad), velocities (rad/s), accelerations (rad/s^2). Held joints are predicted at rest
            and without friction.
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
        """Predict the torques of another log, prepared like the fitted ones, and compare.

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
        found = self._fit.validate(log_input(t, q, tau, qd, qdd))
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
        """Identify a payload from logs with it, given this fit of the arm without it.

        Parameters
        ----------
        t, q, tau, qd, qdd
            The log or logs, as in :func:`identify`; prepared like the fitted ones.
        guess : Payload
            Prior for parameters that the logs do not determine.

        Raises
        ------
        ValueError
            As :func:`identify`; if the guess is physically inconsistent.
        """
        found = _native.payload(self._fit, log_inputs(t, q, tau, qd, qdd), _check.instance("guess", guess, Payload)._dict())
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
        """Ratio of true to logged torque of each moving joint, (M,), from logs with a known payload.

        Published torque constants of one arm differ by 20 %; a known weight resolves this. Every joint
        is estimated separately, from the logs of this fit and those with the payload: the scales may
        differ. ``None`` if the payload adds too little torque to a joint. Multiply ``tau`` by the scales
        and identify again: with different scales on joints that share links, this fit is inaccurate.

        Parameters
        ----------
        t, q, tau, qd, qdd
            The log or logs, as in :func:`identify`; prepared like the fitted ones, with the same torque
            scales.
        known : Payload
            The payload.

        Raises
        ------
        ValueError
            As :func:`identify`; if the payload is physically inconsistent.
        """
        payload = _check.instance("known", known, Payload)._dict()
        return tuple(_native.torque_scale(self._fit, log_inputs(t, q, tau, qd, qdd), payload))

    def weigh(
        self,
        t: ArrayLike | Sequence[ArrayLike],
        q: ArrayLike | Sequence[ArrayLike],
        tau: ArrayLike | Sequence[ArrayLike],
        qd: ArrayLike | Sequence[ArrayLike] | None = None,
        qdd: ArrayLike | Sequence[ArrayLike] | None = None,
        *,
        mass_kg: float,
    ) -> Weighing:
        """Torque scales and the centre of mass of a weight, from logs with a weight of which only the mass is known.

        Every joint has its own scale; all carry the same body. Multiply ``tau`` by the scales and identify again.

        Parameters
        ----------
        t, q, tau, qd, qdd
            The log or logs with the weight at the last link, as in :func:`identify`; prepared like the fitted ones, with
            the same torque scales.
        mass_kg : float
            Mass of the weight (kg).

        Raises
        ------
        ValueError
            As :func:`identify`; if the mass is not positive.
        """
        weight_kg = _check.number("mass_kg", mass_kg, positive=True)
        found = _native.weigh(self._fit, log_inputs(t, q, tau, qd, qdd), weight_kg)
        return Weighing(
            torque_scale=tuple(found["torque_scale"]),
            torque_scale_deviation=tuple(found["torque_scale_deviation"]),
            com_m=found["com_m"],
            com_deviation_m=found["com_deviation_m"],
            warnings=tuple(found["warnings"]),
        )

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
        """Identify the torque ripple of every motor from slow motion of all joints, best at constant
        speed.

        Parameters
        ----------
        t, q, tau
            The log or logs, as in :func:`identify`.
        harmonics : sequence of int
            Harmonics of a motor revolution to fit.
        fast_rad_per_s : float
            Faster samples are excluded (rad/s).
        cutoff_hz : float
            Cutoff of the filter (Hz), higher than that of the model fit since ripple is faster.

        Returns
        -------
        tuple of tuples of (int, float, float)
            For each motor, the significant harmonics, the largest first: harmonic, sine and cosine
            amplitude at the motor (N m). :meth:`save` accepts it.

        Raises
        ------
        ValueError
            As :func:`identify`; if not all joints were identified, or there is too little slow motion.
        """
        orders = _check.integers("harmonics", harmonics)
        logs = log_inputs(t, q, tau, None, None)
        fast_rad_per_s = _check.number("fast_rad_per_s", fast_rad_per_s, signed=True)
        cutoff_hz = _check.number("cutoff_hz", cutoff_hz, signed=True)
        found = _native.ripple(self._fit, logs, orders, fast_rad_per_s, cutoff_hz)
        return tuple(tuple(lines) for lines in found)

    def save(self, path: str | os.PathLike[str], *, ripple: Ripple | None = None) -> Path:
        """Write the model as ``arm.toml`` and ``arm.urdf`` into the folder ``path``.

        The controller loads it (``supple demo --arm path``), and so does :meth:`Arm.load`. The folder is
        created if necessary; existing files are replaced.

        Parameters
        ----------
        path : str or os.PathLike
            The folder.
        ripple : optional
            Torque ripple of the motors, as returned by :meth:`ripple`. Default: that of the nominal arm.

        Returns
        -------
        pathlib.Path
            The TOML.

        Raises
        ------
        ValueError
            As :attr:`arm`.
        OSError
            If it cannot be written, or the path of a file is a device, FIFO, socket or folder.
        """
        arm = self._fit.arm(ripple)
        folder = Path(_check.path("path", path))
        arm._save(folder)
        return folder / "arm.toml"

    def plot(self, log: int = 0) -> Figure:
        """Plot measured and predicted torque of each moving joint, with the residual, over a fitted log.

        Needs matplotlib: ``pip install './python[viz]'``.

        Parameters
        ----------
        log : int
            Index of the fitted log.

        Raises
        ------
        ImportError
            Without matplotlib.
        IndexError
            If there is no such log.
        """
        try:
            from matplotlib.figure import Figure
        except ImportError as error:
            raise ImportError("plot needs matplotlib: pip install './python[viz]'") from error
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
        """The nominal arm, which gives kinematics and undetermined parameters."""
        return self._fit.arm_given()

    def __repr__(self) -> str:
        return f"<Fit of {self._summary()}>"

    def _repr_html_(self) -> str:
        joints = self.arm_given.joint_names
        residuals = [
            (joints[joint], f"{noise:.3g}", f"{friction.coulomb_nm:.4g}", f"{friction.viscous_nm_s_per_rad:.4g}")
            for joint, noise, friction in zip(
                self.moving, self.noise_nm, (self.friction[joint] for joint in self.moving), strict=True
            )
        ]
        combinations = [
            (name, f"{value:.4g}", f"{std:.2g}")
            for name, value, std in zip(self.base_names, self.base_parameters, self.std, strict=True)
        ]
        head = ("joint", "residual [N m]", "Coulomb [N m]", "viscous [N m s/rad]")
        below = table("Base parameters, SI units", ("combination", "value", "standard deviation"), combinations)
        warnings = "".join(f"<li>{escape(warning)}</li>" for warning in self.warnings)
        return (
            table(self._summary(), head, residuals)
            + f"<details><summary>{self.rank} base parameters</summary>{below}</details>"
            + (f"<p>Warnings:</p><ul>{warnings}</ul>" if warnings else "")
        )

    def _summary(self) -> str:
        return (
            f"{self.arm_given.name}: rank {self.rank} of {len(self.columns)} columns,"
            f" condition {self.condition:.0f},"
            f" {100.0 * self.training_relative:.2f} % of the torque unexplained"
        )

    def __str__(self) -> str:
        joints = self.arm_given.joint_names
        lines = [
            self._summary(),
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
            *(f"  warning: {warning}" for warning in self.warnings),
        ]
        return "\n".join(lines)
