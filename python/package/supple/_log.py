"""Logs as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple import _check, _native
from supple._frames import Tabular

Array = NDArray[np.float64]

__all__ = ["Log", "Truth", "read_log"]


@dataclass(frozen=True, eq=False)
class Truth(Tabular):
    """Ground truth of a simulated plant, one row at the start of each cycle."""

    t: Array
    """Time since the log began, (samples,) (s)."""
    q: Array
    """Joint angles, (samples, N) (rad)."""
    qd: Array
    """Joint velocities, (samples, N) (rad/s)."""
    tau: Array
    """Motor torques at the joints, (samples, N) (N m)."""
    friction_nm: Array
    """Friction torques, positive if they oppose positive motion, (samples, N) (N m)."""
    tip_position_m: Array
    """Tip, base axes, (samples, 3) (m)."""
    tip_velocity_m_per_s: Array
    """Velocity of the tip, base axes, (samples, 3) (m/s)."""
    contact_force_n: Array
    """Contact force on the tip, unfiltered, base axes, (samples, 3) (N)."""


@dataclass(frozen=True, eq=False)
class Log(Tabular):
    """A log of a controlled arm, one row for each step of the controller."""

    arm: _native.Arm
    """The arm, from the description inside the log."""
    experiment: str
    """Name of the experiment."""
    software: str
    """Name and version of the program that wrote the log."""
    seed: int | None
    """Seed of all random numbers of the run."""
    notes: Mapping[str, str]
    """Further metadata."""
    t: Array
    """Time since the log began, (samples,) (s)."""
    q: Array
    """Joint angles that the controller used, (samples, N) (rad)."""
    qd: Array
    """Joint velocities that the controller estimated, (samples, N) (rad/s)."""
    tau: Array
    """Joint torques that the controller commanded, (samples, N) (N m)."""
    mode: NDArray[np.str_]
    """Mode of the controller, (samples,): ``"track"``, ``"gravity_hold"`` .."""
    tip_position_m: Array
    """Tip position, computed with the model, base axes, (samples, 3) (m)."""
    tip_velocity_m_per_s: Array
    """Velocity of the tip, base axes, (samples, 3) (m/s)."""
    has_reference: NDArray[np.bool_]
    """Whether the controller follows a tip trajectory, (samples,)."""
    reference_position_m: Array
    """Reference position of the tip, base axes, (samples, 3) (m); zero without a reference."""
    reference_velocity_m_per_s: Array
    """Velocity of the tip's reference, base axes, (samples, 3) (m/s); zero without a reference."""
    has_tip_force: NDArray[np.bool_]
    """Whether a force sensor reported, (samples,)."""
    tip_force_n: Array
    """Measured force on the tip, base axes, (samples, 3) (N); zero without a sensor."""
    external_torque_nm: Array
    """Observed external torque, (samples, N) (N m)."""
    external_force_n: Array
    """Observed force on the tip, base axes, (samples, 3) (N)."""
    stiffness_n_per_m: Array
    """Present stiffness along base axes, (samples, 3) (N/m)."""
    damping_n_s_per_m: Array
    """Present damping along base axes, (samples, 3) (N s/m)."""
    in_contact: NDArray[np.bool_]
    """Whether contact is latched, (samples,)."""
    friction_share: Array
    """Applied fraction of the friction feed-forward, (samples,), 0 to 1."""
    torques: Mapping[str, Array]
    """Torque terms by name, (samples, N) each (N m); their sum, once limited, is ``tau``."""
    columns: Mapping[str, Array]
    """Every log field by name, (samples,) or (samples, N or 3); codes and flags are numbers."""
    faults: tuple[tuple[float, str], ...]
    """Time (s) and text of every latched fault."""
    timing: Mapping[str, Array]
    """``t``, ``period_s``, ``latency_s``, ``step_s`` of timed cycles, (cycles,) each (s)."""
    truth: Truth | None
    """Ground truth, if the log is of a simulated plant."""

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
        Arm, columns, faults, and the ground truth of a simulated plant.

    Raises
    ------
    FileNotFoundError
        If the path does not exist.
    ValueError
        If the file is not a log of supple, or is truncated: ``supple log recover`` keeps its complete
        records.

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
    content = _native.read_log(_check.path("path", path))
    steps, truth = content["steps"], content["truth"]
    flags = {
        name: steps[name].astype(bool) for name in ("has_reference", "has_tip_force", "in_contact")
    }
    prefix = "torques."
    terms = {
        name.removeprefix(prefix): column for name, column in steps.items() if name.startswith(prefix)
    }
    names = {"q": "position_rad", "qd": "velocity_rad_per_s", "tau": "torque_nm"}
    own = {field.name for field in fields(Log)} & steps.keys()
    columns: dict[str, Any] = {name: steps[name] for name in own}
    columns |= {name: steps[of] for name, of in names.items()} | flags
    # The log has a number, the result its name.
    columns["mode"] = np.array(content["modes"], dtype=np.str_)
    return Log(
        arm=content["arm"],
        experiment=content["experiment"],
        software=content["software"],
        seed=content["seed"],
        notes=content["notes"],
        faults=tuple(content["faults"]),
        torques=terms,
        columns=steps,
        timing=content["timing"],
        truth=Truth(**truth) if truth else None,
        **columns,
    )
