"""Figures of results, with matplotlib (``pip install './python[viz]'``).

Every function takes what :func:`simulate`, :func:`read_log` or :meth:`System.record` returned, draws on the axes that it is
given, or on a figure of its own, and returns the figure.

Examples
--------
>>> import supple, supple.plot
>>> run = supple.simulate(supple.Arm.load("wam4"), "sinusoid", duration_s=0.5)
>>> len(supple.plot.tracking(run).axes)
2
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from supple._log import Log
    from supple._sweep import Sweep

__all__ = ["joints", "sweep", "torques", "tracking"]

Array = NDArray[np.float64]
BLUE, VERMILION, GREEN, PURPLE, ORANGE = "#0072B2", "#D55E00", "#009E73", "#B45A96", "#E69F00"
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE)
REFERENCE: dict[str, Any] = {"color": "#B4BBC6", "linewidth": 3.0}
# Each curve of the torque with the terms that it adds up; all other terms are one further curve.
TERM_CURVES = {
    "gravity": ("gravity",),
    "friction": ("friction",),
    "inertia": ("inertial", "jacobian_rate", "coriolis"),
    "feedback": ("stiffness", "damping", "joint_pd"),
}


class Tracked(Protocol):
    """A result with a tip and its reference."""

    t: Array
    tip_position_m: Array
    reference_position_m: Array


def _figure(rows: int, axes: Any, height_in: float = 2.4) -> tuple[Figure, list[Axes]]:
    import matplotlib.pyplot as plt

    if axes is None:
        figure, made = plt.subplots(
            rows, 1, sharex=True, figsize=(8.0, height_in * rows), layout="constrained", squeeze=False
        )
        return figure, list(made[:, 0])
    given = list(np.atleast_1d(axes))
    if len(given) != rows:
        raise ValueError(f"axes: expected {rows}, got {len(given)}")
    return given[0].figure, given


def tracking(result: Tracked, axes: Any = None) -> Figure:
    """The tip with its reference along each axis, and their distance.

    Parameters
    ----------
    result : Run, Log or States
        What was tracked.
    axes : sequence of 2 matplotlib axes, optional
        Where to draw.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.
    """
    figure, (above, below) = _figure(2, axes)
    there = np.asarray(getattr(result, "has_reference", np.ones(len(result.t), bool)))
    reference = np.where(there[:, None], result.reference_position_m, np.nan)
    for axis, name in enumerate("xyz"):
        above.plot(result.t, reference[:, axis], **REFERENCE)
        above.plot(result.t, result.tip_position_m[:, axis], color=COLOURS[axis], linewidth=1.2, label=name)
    above.set_ylabel("tip [m]")
    above.legend(loc="upper right", ncols=3, frameon=False)
    error_mm = 1e3 * np.linalg.norm(result.tip_position_m - reference, axis=1)
    below.plot(result.t, error_mm, color=BLUE, linewidth=1.2)
    below.set(xlabel="time [s]", ylabel="distance [mm]")
    _shade_contact(result, (above, below))
    return figure


def joints(result: Any, axes: Any = None) -> Figure:
    """Angles, velocities and torques of the joints.

    Parameters
    ----------
    result : Run, Log or States
        What has ``q``, ``qd`` and ``tau``.
    axes : sequence of 3 matplotlib axes, optional
        Where to draw.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.
    """
    figure, drawn = _figure(3, axes)
    labels = (("q", "angle [rad]"), ("qd", "velocity [rad/s]"), ("tau", "torque [N m]"))
    for panel, (name, label) in zip(drawn, labels, strict=True):
        for joint, column in enumerate(getattr(result, name).T):
            panel.plot(result.t, column, linewidth=1.2, label=f"joint {joint}")
        panel.set_ylabel(label)
    drawn[0].legend(loc="upper right", ncols=4, frameon=False)
    drawn[-1].set_xlabel("time [s]")
    return figure


def torques(log: Log, axes: Any = None) -> Figure:
    """The terms whose sum is each joint's torque before the limits, and the commanded torque.

    The curves are gravity, friction, inertia with Coriolis, feedback, and the sum of all other terms, such as ripple and
    what was learned.

    Parameters
    ----------
    log : Log
        A log.
    axes : sequence of N matplotlib axes, optional
        Where to draw, one for each joint.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.
    """
    figure, drawn = _figure(log.q.shape[1], axes, 2.0)
    curve_of = {term: curve for curve, terms in TERM_CURVES.items() for term in terms}
    curves = {name: np.zeros_like(log.tau) for name in (*TERM_CURVES, "other")}
    for name, torque_nm in log.torques.items():
        curves[curve_of.get(name, "other")] += torque_nm
    for joint, panel in enumerate(drawn):
        panel.plot(log.t, log.tau[:, joint], label="commanded", **REFERENCE)
        for colour, (name, curve) in zip(COLOURS, curves.items(), strict=True):
            panel.plot(log.t, curve[:, joint], color=colour, linewidth=1.2, label=name)
        panel.set_ylabel(f"joint {joint} [N m]")
    drawn[0].legend(loc="upper right", ncols=6, frameon=False)
    drawn[-1].set_xlabel("time [s]")
    return figure


def sweep(results: Sweep[float, float], xlabel: str = "parameter", ylabel: str = "result", axes: Any = None) -> Figure:
    """Every result of a sweep over numbers, and the median for each parameter.

    Parameters
    ----------
    results : Sweep
        Of numbers over numbers.
    xlabel, ylabel : str
        Labels of the axes.
    axes : matplotlib axes, optional
        Where to draw.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.
    """
    figure, (panel,) = _figure(1, axes, 4.0)
    parameters, values = np.asarray(results.parameters, float), np.asarray(results.results, float)
    if parameters.ndim != 1 or parameters.shape != values.shape:
        raise ValueError(
            f"results: expected one number for each parameter, which is one too, got shapes {values.shape} and "
            f"{parameters.shape}"
        )
    panel.plot(parameters, values, "o", color=BLUE, markersize=4, alpha=0.5)
    distinct = np.unique(parameters)
    medians = [float(np.median(values[parameters == parameter])) for parameter in distinct]
    panel.plot(distinct, medians, color=VERMILION, linewidth=1.5, label="median")
    panel.set(xlabel=xlabel, ylabel=ylabel)
    panel.legend(frameon=False)
    return figure


def _shade_contact(result: Any, panels: tuple[Axes, ...]) -> None:
    in_contact = getattr(result, "in_contact", None)
    if in_contact is None or not np.any(in_contact):
        return
    edges = np.flatnonzero(np.diff(np.concatenate(([0], np.asarray(in_contact, int), [0]))))
    for begin, end in edges.reshape(-1, 2):
        for panel in panels:
            panel.axvspan(result.t[begin], result.t[min(end, len(result.t) - 1)], color="#B4BBC6", alpha=0.25)
