"""Logs as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike, fspath

import numpy as np
from numpy.typing import NDArray

from supple import _native

Array = NDArray[np.float64]

__all__ = ["Log", "Truth", "read_log"]


@dataclass(frozen=True, eq=False)
class Truth:
    """What was really so in a simulated plant, a row at the start of each cycle."""

    t: Array
    """Time since the log began, (samples,) (s)."""
    q: Array
    """Joint angles, (samples, N) (rad)."""
    qd: Array
    """Joint velocities, (samples, N) (rad/s)."""
    tau: Array
    """Torques of the motors, at the joints, (samples, N) (N m)."""
    friction_nm: Array
    """Friction torques, positive against positive motion, (samples, N) (N m)."""
    tip_position_m: Array
    """Tip, base axes, (samples, 3) (m)."""
    tip_velocity_m_per_s: Array
    """Its velocity, base axes, (samples, 3) (m/s)."""
    contact_force_n: Array
    """Contact force on the tip, unfiltered, base axes, (samples, 3) (N)."""


@dataclass(frozen=True, eq=False)
class Log:
    """A log of a controlled arm: a row for each step of the controller."""

    arm: _native.Arm
    """The arm, from the description inside the log."""
    experiment: str
    """Name of the experiment."""
    software: str
    """Name and version of what wrote it."""
    seed: int | None
    """Seed of everything random in it."""
    notes: Mapping[str, str]
    """Whatever else belongs to it."""
    t: Array
    """Time since the log began, (samples,) (s)."""
    q: Array
    """Joint angles that the controller used, (samples, N) (rad)."""
    qd: Array
    """Joint velocities that it estimated, (samples, N) (rad/s)."""
    tau: Array
    """Joint torques that it commanded in answer, (samples, N) (N m)."""
    mode: NDArray[np.str_]
    """Mode in force, (samples,): ``"track"``, ``"gravity_hold"`` .."""
    tip_position_m: Array
    """Tip by the model, base axes, (samples, 3) (m)."""
    tip_velocity_m_per_s: Array
    """Its velocity, base axes, (samples, 3) (m/s)."""
    has_reference: NDArray[np.bool_]
    """Where a tip trajectory runs, (samples,)."""
    reference_position_m: Array
    """Where the tip should be, base axes, (samples, 3) (m); zero without a reference."""
    reference_velocity_m_per_s: Array
    """Its velocity, base axes, (samples, 3) (m/s); zero without a reference."""
    has_tip_force: NDArray[np.bool_]
    """Where a force sensor reported, (samples,)."""
    tip_force_n: Array
    """Measured force on the tip, base axes, (samples, 3) (N); zero without a sensor."""
    external_torque_nm: Array
    """Observed external torque, (samples, N) (N m)."""
    external_force_n: Array
    """Observed force on the tip, base axes, (samples, 3) (N)."""
    stiffness_n_per_m: Array
    """Stiffness in force along base axes, (samples, 3) (N/m)."""
    damping_n_s_per_m: Array
    """Damping in force along base axes, (samples, 3) (N s/m)."""
    in_contact: NDArray[np.bool_]
    """Where contact is latched, (samples,)."""
    friction_share: Array
    """Share of the friction feed-forward applied, (samples,), 0 to 1."""
    torques: Mapping[str, Array]
    """Terms of the law by name, (samples, N) each (N m); their sum, once limited, is ``tau``."""
    faults: tuple[tuple[float, str], ...]
    """Time (s) and words of every fault, as it latched."""
    timing: Mapping[str, Array]
    """``t``, ``period_s``, ``latency_s``, ``step_s`` of timed cycles, (cycles,) each (s)."""
    truth: Truth | None
    """What was really so, if the log is of a simulated plant."""

    @property
    def samples(self) -> int:
        """Number of rows."""
        return len(self.t)

    def __repr__(self) -> str:
        return f"<Log {self.experiment!r} of {self.arm.name!r}, {self.samples} samples>"


def read_log(path: str | PathLike[str]) -> Log:
    """Read a log of supple (MCAP) into arrays.

    Parameters
    ----------
    path : str or os.PathLike
        The log.

    Returns
    -------
    Log
        Arm, columns, faults, and the truth of a simulated plant.

    Raises
    ------
    FileNotFoundError
        For a path that leads nowhere.
    ValueError
        For a file that is no log of supple, or is cut: ``supple log recover`` keeps what is whole.

    Examples
    --------
    >>> import supple, tempfile, os
    >>> arm = supple.Arm.load("wam4")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     run = supple.simulate(arm, "sinusoid", duration_s=0.5, log_dir=folder)
    ...     log = supple.read_log(run.log)
    >>> log.q.shape[1], str(log.mode[0]), str(log.mode[-1])
    (4, 'gravity_hold', 'track')
    """
    content = _native.read_log(fspath(path))
    steps, truth = content["steps"], content["truth"]
    flags = {
        name: steps.pop(name).astype(bool) for name in ("has_reference", "has_tip_force", "in_contact")
    }
    terms = {
        name.removesuffix("_nm"): steps.pop(name)
        for name in list(steps)
        if name.endswith("_nm") and name != "external_torque_nm"
    }
    return Log(
        arm=content["arm"],
        experiment=content["experiment"],
        software=content["software"],
        seed=content["seed"],
        notes=content["notes"],
        mode=np.array(content["modes"], dtype=np.str_),
        faults=tuple(content["faults"]),
        torques=terms,
        timing=content["timing"],
        truth=Truth(**truth) if truth else None,
        **flags,
        **steps,
    )
