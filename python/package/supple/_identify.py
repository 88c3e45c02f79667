"""Identification of physically consistent models from logs."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from supple import _check, _native
from supple._check import flag, integer, number
from supple._fit import Fit
from supple._log_input import log_inputs
from supple._progress import elapsed

__all__ = ["DataWarning", "FrictionColumns", "identify"]


class DataWarning(UserWarning):
    """A warning about a log or a fit: column, problem, remedy."""


@dataclass(frozen=True, kw_only=True)
class FrictionColumns:
    """Friction columns of every moving joint."""

    viscous: bool = True
    """``V qd``."""
    coulomb: bool = True
    """``S p(qd / band)``, ``p`` the parabola of :class:`Friction`."""
    offset: bool = False
    """Constant torque: Coulomb friction may then differ by direction."""
    asymmetry: bool = False
    """``A |qd|``: viscous friction that differs by direction. Needs ``viscous``."""
    load: Literal["joint", "motor"] | None = None
    """``L |g| p(qd / band)``: Coulomb friction that grows with a torque ``g``: ``"joint"``, what the joint's
    gear transmits to the links, computed with the nominal arm, or ``"motor"``, what the motor applies, friction
    included. ``None`` if it does not grow. Needs ``coulomb``."""
    stribeck_rad_per_s: float | None = None
    """Stribeck speed (rad/s); ``None`` for no Stribeck effect."""
    band_rad_per_s: float = 0.01
    """Half-width of the parabola (rad/s)."""

    def __post_init__(self) -> None:
        for name in ("viscous", "coulomb", "offset", "asymmetry"):
            flag(name, getattr(self, name))
        if self.load not in (None, "joint", "motor"):
            wrong = ValueError if isinstance(self.load, str) else TypeError
            raise wrong(f'load: expected "joint" (before: True), "motor" or None, got {self.load!r}')
        if self.stribeck_rad_per_s is not None:
            number("stribeck_rad_per_s", self.stribeck_rad_per_s, signed=True)
        number("band_rad_per_s", self.band_rad_per_s, signed=True)


_FRICTION = {
    "none": FrictionColumns(viscous=False, coulomb=False),
    "viscous": FrictionColumns(coulomb=False),
    "coulomb": FrictionColumns(),
    "offset": FrictionColumns(offset=True),
    "asymmetric": FrictionColumns(offset=True, asymmetry=True),
    "load": FrictionColumns(load="joint"),
    "motor-load": FrictionColumns(load="motor"),
    "stribeck": FrictionColumns(offset=True),
}
# Default of slow_rad_per_s with friction="stribeck" (rad/s).
_SLOW_RAD_PER_S = 0.15


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
    torque_delay_s: float | None = None,
    rotor: bool = True,
    slow_rad_per_s: float | None = None,
    prior_weight: float | None = None,
    joint_noise_nm: ArrayLike | None = None,
    effects: Literal["auto", "none"] = "none",
    accept_wrong_logs: bool = False,
    progress: bool | None = None,
) -> Fit:
    """Identify an arm from one or several logs.

    Kinematics and undetermined parameters are those of ``arm``. Options that are not set (``friction``,
    ``prior_weight``, weights) are chosen by cross-validation within the logs.

    Parameters
    ----------
    arm : Arm
        Kinematics and nominal model, from a data sheet or CAD.
    t : array_like, (samples,), or a list of them
        Time (s), strictly increasing, without gaps. Several logs are given as lists of equal length.
    q : array_like, (samples, N)
        Angles (rad).
    tau : array_like, (samples, N)
        Motor torques at the joints (N m).
    qd : array_like, (samples, N), optional
        Velocities (rad/s). Default: differentiated.
    qdd : array_like, (samples, N), optional
        Accelerations (rad/s^2), only with ``qd``. Default: differentiated. With them and without a
        filter, rows are used unchanged and need not be in temporal order.
    moving : sequence of int, optional
        Joints to identify, increasing from 0; the others are held at their logged positions. Default:
        all.
    coupling : (int, int) or a sequence of pairs, optional
        Joints whose sum turns a motor: rotor inertia and friction of ``qd_a + qd_b`` act on both.
    cutoff_hz : float, optional
        Cutoff of the fourth-order zero-phase filter for ``q``, ``qd``, ``qdd`` and ``tau`` (Hz);
        ``math.inf`` for none. Default: 8, or none if ``qdd`` is given.
    method : {"consistent", "wls", "irls", "ols"}
        Physically consistent weighted least squares; weighted least squares; robust (Huber); ordinary
        least squares.
    friction : str or FrictionColumns
        Friction columns of every moving joint: ``"auto"``, ``"none"``, ``"viscous"``, ``"coulomb"``,
        ``"offset"``, ``"asymmetric"``, ``"load"``, ``"motor-load"`` or ``"stribeck"``. ``"auto"`` chooses by
        cross-validation. ``"load"``, ``"motor-load"``: viscous and Coulomb friction that grows with the load
        of the joint, or with the torque of its motor. ``"stribeck"``: viscous and Coulomb friction with
        offset, and a Stribeck effect whose parameters are fitted to slow motion in a second stage.
    rate_hz : float, optional
        Rate of the regular grid to which the log is resampled (Hz). Default: the log's own mean rate.
    keep_every : int
        Decimation factor: every n-th sample of the grid is used.
    torque_delay_s : float, optional
        Time from a logged torque to its action (s), either sign: 1.5 periods for commands that act during
        the next cycle, negative for measured torques that lag. Default: estimated by cross-validation;
        zero if ``qdd`` is given.
    rotor : bool
        Whether to fit a rotor inertia for each moving joint; otherwise those of ``arm`` are taken as
        known.
    slow_rad_per_s : float
        Samples of a joint slower than this are excluded from its rows (rad/s); a Stribeck effect is then
        fitted to them in a second stage. Default: none, 0.15 with ``friction="stribeck"``.
    prior_weight : float, optional
        Weight of the nominal model, in equivalent observations. Default: by cross-validation.
    joint_noise_nm : array_like, (M,), optional
        Noise of each moving joint's torque (N m), instead of weights from residuals.
    effects : {"none", "auto"}
        ``"auto"`` identifies springs over the joints (hoses), tilt of the base, compliance, and friction of
        motors that drive several joints, if cross-validation finds that they predict better; the tilt only if
        all joints move. They become part of ``Fit.arm``, friction of motors as that of the joints.
    accept_wrong_logs : bool
        Whether to fit a log although its checks against ``arm`` found an error (units, signs, order, zeros,
        clock); what they found is then a warning.
    progress : bool, optional
        Whether to show the elapsed time (needs tqdm). Default: in a terminal or a notebook, if tqdm is installed and the call takes
        more than a second.

    Returns
    -------
    Fit
        The model, its statistics, and the choices made.

    Raises
    ------
    TypeError
        For an argument of the wrong type.
    ValueError
        For unusable columns (not finite, gaps in time, degrees, joints that hardly move), shapes that do
        not agree, options out of range, or insufficient data; the message names column or argument,
        problem and remedy.

    Warns
    -----
    DataWarning
        For doubtful data or results.

    Examples
    --------
    Sums of sinusoids, torques of a known arm, no noise: the base parameters are recovered.

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
    _check.arm("arm", arm)
    if qdd is not None and qd is None:
        raise ValueError("qd: expected velocities together with the accelerations qdd, got None")
    is_known = friction in ("auto", *_FRICTION) if isinstance(friction, str) else isinstance(friction, FrictionColumns)
    if not is_known:
        known = ", ".join(("auto", *_FRICTION))
        raise ValueError(f"friction: expected one of {known} or FrictionColumns, got {friction!r}")
    if effects not in ("auto", "none"):
        raise ValueError(f"effects: expected auto or none, got {effects!r}")
    columns = _FRICTION.get(friction) if isinstance(friction, str) else friction
    find_stribeck = friction == "stribeck"
    if slow_rad_per_s is None:
        slow_rad_per_s = _SLOW_RAD_PER_S if find_stribeck else 0.0
    if cutoff_hz is None:
        cutoff_hz = inf if qdd is not None else 8.0
    has_filter = np.ndim(cutoff_hz) > 0 or cutoff_hz != inf
    if progress is not None:
        progress = flag("progress", progress)
    logs = log_inputs(t, q, tau, qd, qdd)
    options = {
        "moving": None if moving is None else _check.integers("moving", moving),
        "couplings": _pairs(coupling),
        "rate_hz": _optional("rate_hz", rate_hz),
        "cutoff_hz": number("cutoff_hz", cutoff_hz, signed=True) if has_filter else None,
        "keep_every": integer("keep_every", keep_every),
        "torque_delay_s": _optional("torque_delay_s", torque_delay_s),
        "find_stribeck": find_stribeck,
        "method": _check.text("method", method),
        "friction": columns,
        "effects": effects == "auto",
        "rotor": flag("rotor", rotor),
        "slow_rad_per_s": number("slow_rad_per_s", slow_rad_per_s, signed=True),
        "prior_weight": _optional("prior_weight", prior_weight),
        "accept_wrong_logs": flag("accept_wrong_logs", accept_wrong_logs),
        "joint_noise_nm": _noise(joint_noise_nm),
    }
    with elapsed("identification", progress):
        native, result_warnings = _native.identify(arm, logs, options)
    for warning in result_warnings:
        warnings.warn(warning, DataWarning, stacklevel=2)
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
        warnings=tuple(result_warnings),
    )


def _optional(name: str, value: float | None) -> float | None:
    return None if value is None else number(name, value, signed=True)


def _noise(joint_noise_nm: ArrayLike | None) -> list[float] | None:
    return None if joint_noise_nm is None else list(_check.array("joint_noise_nm", joint_noise_nm).ravel())


def _pairs(coupling: Any) -> list[tuple[int, int]]:
    if coupling is None:
        return []
    try:
        array = np.asarray(coupling)
    except ValueError:
        array = np.zeros(0)
    if array.ndim not in (1, 2) or array.shape[-1] != 2:
        raise ValueError(f"coupling: expected a pair of joints or a list of pairs, got {coupling!r}")
    return [(integer("coupling", a), integer("coupling", b)) for a, b in np.atleast_2d(array)]
