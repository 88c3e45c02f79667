"""Excitation: its design for any arm, and a simulated arm that tracks it."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple import _check, _native
from supple._check import flag, integer, number
from supple._plant import PlantOptions, _chosen
from supple._progress import bar, elapsed, split

Array = NDArray[np.float64]

__all__ = ["Excitation", "Recording", "design_excitation", "excite"]


@dataclass(frozen=True, eq=False)
class Excitation:
    """An exciting trajectory: one Fourier series per joint, from rest to rest."""

    t: Array
    """Time, (samples,) (s)."""
    q: Array
    """Angles, (samples, N) (rad)."""
    qd: Array
    """Velocities, (samples, N) (rad/s)."""
    qdd: Array
    """Accelerations, (samples, N) (rad/s^2)."""
    rank: int
    """Rank of the base regressor along this trajectory."""
    condition: float
    """Condition number of the base regressor along this trajectory, columns scaled to unit length."""
    history: Array
    """Best value of the criterion after each candidate, (candidates,)."""
    _series: dict[str, Any] = field(repr=False)


@dataclass(frozen=True, eq=False)
class Recording:
    """Recorded data of an excitation, as a real arm would log it and :func:`identify` accepts it."""

    t: Array
    """Time, (samples,) (s)."""
    q: Array
    """Encoder angles, (samples, N) (rad)."""
    tau: Array
    """Commanded joint torques, (samples, N) (N m)."""
    torque_delay_s: float
    """Delay of the torques relative to the angles (s)."""
    log: Path | None
    """Path of the log, if ``log_dir`` was given."""


def design_excitation(
    arm: _native.Arm,
    *,
    moving: Sequence[int] | None = None,
    period_s: float = 15.0,
    periods: float = 4.0,
    criterion: Literal["condition", "d-optimality"] = "condition",
    workspace: ArrayLike | None = None,
    candidates: int = 3000,
    seed: int = 0,
    rate_hz: float = 100.0,
    progress: Callable[[int, float], object] | bool | None = None,
) -> Excitation:
    """Design an exciting trajectory within the arm's limits of angle, speed, torque and workspace.

    Parameters
    ----------
    arm : Arm
        The arm, with its limits.
    moving : sequence of int, optional
        Joints to excite, increasing from 0; the others rest at home. Default: all.
    period_s : float
        Length of a period (s).
    periods : float
        Number of periods.
    criterion : {"condition", "d-optimality"}
        Criterion to minimise: the condition number of the base regressor, columns scaled to unit length,
        or ``-log det(Y' Y) / rank``.
    workspace : array_like, (2, 3), optional
        Minimum and maximum coordinates of the tip, base axes (m).
    candidates : int
        Number of candidates.
    seed : int
        Seed of the search, zero or more.
    rate_hz : float
        Rate of the arrays of the result (Hz).
    progress : callable or bool, optional
        Called as ``progress(tried, best)``; an exception stops the search. True shows a bar (needs tqdm), False none. Default: a
        bar in a terminal or a notebook, if tqdm is installed and the search takes more than a second.

    Returns
    -------
    Excitation
        The trajectory, its rank and condition number.

    Raises
    ------
    TypeError
        For an argument of the wrong type.
    ValueError
        If an option is out of range, or no candidate meets the limits.

    Examples
    --------
    >>> import supple
    >>> arm = supple.Arm.load("wam3")
    >>> found = supple.design_excitation(arm, candidates=60, period_s=5.0, periods=1)
    >>> found.q.shape[1], bool(found.history[-1] <= found.history[-30])
    (3, True)
    """
    _check.arm("arm", arm)
    if criterion not in ("condition", "d-optimality"):
        raise ValueError(f"criterion: expected condition or d-optimality, got {criterion!r}")
    rate_hz = number("rate_hz", rate_hz, positive=True)
    period_s = number("period_s", period_s, positive=True)
    periods = number("periods", periods, positive=True)
    candidates = integer("candidates", candidates, least=1)
    seed = integer("seed", seed)
    box = None
    if workspace is not None:
        lower, upper = _check.array("workspace", workspace, (2, 3))
        box = (lower.tolist(), upper.tolist())
    if progress is not None and not isinstance(progress, bool):
        _check.function("progress", progress, "a callable, True or False")
    shows, given_report = split(progress)
    with bar("design", "candidate", candidates, shows) as show:
        report = given_report if show is None else lambda tried, best: show(tried)
        found = _native.design_excitation(
            arm,
            {
                "moving": list(range(arm.dof)) if moving is None else _check.integers("moving", moving),
                "period_s": period_s,
                "periods": periods,
                "d_optimality": criterion == "d-optimality",
                "workspace": box,
                "candidates": candidates,
                "seed": seed,
                "rate_hz": rate_hz,
            },
            report,
        )
    return Excitation(_series=found.pop("series"), **found)


def excite(
    arm: _native.Arm,
    excitation: Excitation,
    *,
    model: _native.Arm | None = None,
    encoder_noise_rad: float | None = None,
    load: bool = False,
    seed: int = 0,
    log_dir: str | os.PathLike[str] | None = None,
    plant_options: PlantOptions | None = None,
    realistic: bool = False,
    progress: bool | None = None,
) -> Recording:
    """Let the simulated arm track an excitation and return its recorded data.

    Parameters
    ----------
    arm : Arm
        The plant.
    excitation : Excitation
        The trajectory to track.
    model : Arm, optional
        The controller's model of the arm. Default: ``arm``.
    encoder_noise_rad : float, optional
        Standard deviation of the encoder noise at the motor, in addition to quantisation (rad). Default: that of the
        arm's realistic set, see :func:`plant_options`.
    load : bool
        Whether the plant's friction depends on direction and load.
    seed : int
        Seed of all noise, zero or more.
    log_dir : str or os.PathLike, optional
        Folder for ``excitation.mcap``; see :func:`read_log`.
    plant_options : mapping or path, optional
        Effects of a real arm in the plant: sizes by name, as :func:`plant_options` returns them, or a TOML file. Default:
        none.
    realistic : bool
        All effects of a real arm, each of modest size: the realistic set of the arm, see :func:`plant_options`.
    progress : bool, optional
        Whether to show the elapsed time (needs tqdm). Default: in a terminal or a notebook, if tqdm is installed and the call takes
        more than a second.

    Returns
    -------
    Recording
        Time, angles, torques.

    Raises
    ------
    TypeError
        For an argument of the wrong type.
    ValueError
        If the controller rejects the motion, or the motion ends in a fault.

    Examples
    --------
    >>> import supple
    >>> arm = supple.Arm.load("wam3")
    >>> motion = supple.design_excitation(arm, candidates=60, period_s=5.0, periods=1)
    >>> recording = supple.excite(arm, motion)
    >>> recording.q.shape == recording.tau.shape
    True
    """
    _check.arm("arm", arm)
    _check.instance("excitation", excitation, Excitation)
    if model is not None:
        _check.arm("model", model)
    if encoder_noise_rad is not None:
        encoder_noise_rad = number("encoder_noise_rad", encoder_noise_rad)
    seed = integer("seed", seed)
    load = flag("load", load)
    if progress is not None:
        progress = flag("progress", progress)
    if excitation.q.shape[1] != arm.dof:
        raise ValueError(
            f"excitation: expected {arm.dof} joints, as arm, got {excitation.q.shape[1]}"
        )
    with elapsed("excitation", progress):
        found = _native.excite(
            arm,
            arm if model is None else model,
            excitation._series,
            {
                "encoder_noise_rad": encoder_noise_rad,
                "load": load,
                "seed": seed,
                "log_dir": None if log_dir is None else _check.path("log_dir", log_dir),
                "plant_options": _chosen(arm, plant_options, realistic),
            },
        )
    return Recording(torque_delay_s=1.5 * found.pop("period_s"), **found)
