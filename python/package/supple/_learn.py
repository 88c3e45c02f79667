"""Learning from the prediction error of a repeated motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple import _check, _native
from supple._check import integer, number
from supple._log_input import log_inputs

Array = NDArray[np.float64]

__all__ = ["Learned", "learn"]


@dataclass(frozen=True, eq=False)
class Learned:
    """Result of :func:`learn`."""

    arm: _native.Arm
    """The arm with its updated friction and, if it was fitted, its payload."""
    before_nm: Array
    """RMS prediction error of each joint before learning, (N,) (N m); zero for joints that did not
    move."""
    after_nm: Array
    """RMS prediction error of each joint after learning, (N,) (N m)."""
    payload_kg: float | None
    """Mass of the payload relative to ``arm`` (kg); ``None`` if it was not fitted."""
    payload_first_moment_kg_m: Array | None
    """First moment of the payload in the last link's frame, (3,) (kg m)."""


def learn(
    arm: _native.Arm,
    t: ArrayLike | Sequence[ArrayLike],
    q: ArrayLike | Sequence[ArrayLike],
    tau: ArrayLike | Sequence[ArrayLike],
    qd: ArrayLike | Sequence[ArrayLike] | None = None,
    *,
    moving: Sequence[int] | None = None,
    cutoff_hz: float = 8.0,
    keep_every: int = 1,
    torque_delay_s: float = 0.0,
    slow_rad_per_s: float = 0.08,
    friction_change: float = 0.2,
    payload_kg: float | None = None,
    noise_nm: float = 0.05,
) -> Learned:
    """Update friction and, optionally, a payload from the prediction error of the torques.

    For a few periods of a motion in free space: too few to identify an arm, but enough to correct
    day-to-day changes. Friction is scaled for each joint, regularised by a prior; link masses are
    unchanged.

    Parameters
    ----------
    arm : Arm
        The present model.
    t, q, tau, qd
        The log or logs, as in :func:`identify`.
    moving : sequence of int, optional
        Joints that moved, increasing from 0. Default: all.
    cutoff_hz, keep_every, torque_delay_s
        Preparation, as in :func:`identify`.
    slow_rad_per_s : float
        Slower samples of a joint are excluded (rad/s).
    friction_change : float
        Expected relative change of friction.
    payload_kg : float, optional
        Expected mass of a payload (kg). Default: no payload.
    noise_nm : float
        Noise of the torques (N m).

    Raises
    ------
    TypeError, ValueError
        As :func:`identify`; if no joint moved faster than ``slow_rad_per_s``.

    Examples
    --------
    Viscous and dry friction 10 % above the model's, no noise:

    >>> import numpy as np, supple
    >>> arm = supple.Arm.load("wam4")
    >>> t = np.arange(0.0, 10.0, 0.01)
    >>> w = 2.0 * np.pi * np.array([0.3, 0.4, 0.5, 0.6])
    >>> q, qd, qdd = (0.3 * np.sin(w * t[:, None]), 0.3 * w * np.cos(w * t[:, None]),
    ...               -0.3 * w**2 * np.sin(w * t[:, None]))
    >>> friction = np.stack([f.torque_nm(qd[:, j]) for j, f in enumerate(arm.friction)], axis=1)
    >>> found = supple.learn(arm, t, q, arm.rnea(q, qd, qdd) + 1.1 * friction)
    >>> ratios = [a.coulomb_nm / b.coulomb_nm for a, b in zip(found.arm.friction, arm.friction)]
    >>> bool(np.allclose(ratios, 1.1, atol=0.02))
    True
    """
    _check.arm("arm", arm)
    found = _native.learn(
        arm,
        log_inputs(t, q, tau, qd, None),
        {
            "moving": list(range(arm.dof)) if moving is None else _check.integers("moving", moving),
            "cutoff_hz": number("cutoff_hz", cutoff_hz, signed=True),
            "keep_every": integer("keep_every", keep_every),
            "torque_delay_s": number("torque_delay_s", torque_delay_s, signed=True),
            "slow_rad_per_s": number("slow_rad_per_s", slow_rad_per_s, signed=True),
            "friction_change": number("friction_change", friction_change, signed=True),
            "payload_kg": None if payload_kg is None else number("payload_kg", payload_kg, signed=True),
            "noise_nm": number("noise_nm", noise_nm, signed=True),
        },
    )
    payload = found["payload"]
    return Learned(
        arm=found["arm"],
        before_nm=found["before_nm"],
        after_nm=found["after_nm"],
        payload_kg=None if payload is None else payload[0],
        payload_first_moment_kg_m=None if payload is None else np.array(payload[1:]),
    )
