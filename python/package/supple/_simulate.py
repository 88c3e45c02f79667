"""The paper's experiments on the simulated arm."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from supple import _check, _native
from supple._check import flag, integer, number
from supple._frames import Tabular
from supple._plant import PlantOptions, _chosen
from supple._progress import elapsed

Array = NDArray[np.float64]
EXPERIMENTS = ("sinusoid", "arc", "quadrant", "probing")

__all__ = ["Run", "simulate"]


@dataclass(frozen=True, eq=False)
class Run(Tabular):
    """Result of :func:`simulate`: one row for each cycle, from the start of the trajectory."""

    experiment: str
    """Name of the experiment."""
    rms_error_m: float
    """Root mean square distance of the true tip from its reference (m)."""
    max_error_m: float
    """Maximum distance of the true tip from its reference (m)."""
    ended: tuple[float, str] | None
    """Time (s) and text of the fault that ended the run early, if one did."""
    t: Array
    """Time since the start of the trajectory, (cycles,) (s)."""
    q: Array
    """Joint angles that the controller used, (cycles, N) (rad)."""
    qd: Array
    """Joint velocities that the controller estimated, (cycles, N) (rad/s)."""
    tau: Array
    """Joint torques that the controller commanded, (cycles, N) (N m)."""
    reference_position_m: Array
    """Reference position of the tip, base axes, (cycles, 3) (m)."""
    tip_position_m: Array
    """True position of the tip, base axes, (cycles, 3) (m)."""
    tip_force_n: Array
    """Force sensor, filtered, base axes, (cycles, 3) (N)."""
    in_contact: NDArray[np.bool_]
    """Whether contact is latched, (cycles,)."""
    strokes: Mapping[str, Array]
    """Probing only, by name, (strokes,) each: ``approach_m_per_s`` (speed of the tip just before the first touch),
    ``peak_filtered_n`` (maximum of the filtered vertical force in the first transient), ``contact_s`` (time in contact
    until the next stroke, without the dwell), ``impulse_newton_s``, ``rest_force_n`` (mean vertical force over the last
    0.3 s of the way down), ``pressing_force_n`` (mean vertical force over the last 0.5 s of the dwell),
    ``spring_force_n`` (vertical force that the spring commands over that time)."""
    log: Path | None
    """Path of the log, if ``log_dir`` was given."""

    def __repr__(self) -> str:
        return f"<Run {self.experiment!r}, {1e3 * self.rms_error_m:.2f} mm RMS>"


def simulate(
    arm: _native.Arm,
    experiment: Literal["sinusoid", "arc", "quadrant", "probing"] = "sinusoid",
    *,
    stiffness_n_per_m: float = 5.0,
    speed: float = 1.0,
    duration_s: float | None = None,
    model: _native.Arm | None = None,
    gravity_error: float = 0.0,
    friction_error: float = 0.0,
    stribeck: bool = True,
    load: bool = True,
    fade: bool = True,
    learning: bool = False,
    seed: int = 0,
    log_dir: str | os.PathLike[str] | None = None,
    plant_options: PlantOptions | None = None,
    realistic: bool = False,
    progress: bool | None = None,
) -> Run:
    """Run one of the paper's experiments on the simulated arm, in virtual time.

    ``arm`` defines the plant; ``model`` or the error options set the controller's model of it. The plant uses a different
    dynamics engine than the controller's model, with bristle friction, quantised encoders and torques,
    and a delay of one cycle; ``plant_options`` adds effects of a real arm. The interpreter lock is released during the run; the same arguments give
    the same numbers.

    Parameters
    ----------
    arm : Arm
        The arm, with its friction, limits and gains: :meth:`Arm.load` reads them.
    experiment : {"sinusoid", "arc", "quadrant", "probing"}
        ``"sinusoid"``: figure 3a of the paper; ``"arc"``: an arc about the base; ``"quadrant"``: figure 3b; ``"probing"``:
        figures 5 and 6.
    stiffness_n_per_m : float
        Stiffness of the tip on each axis (N/m), zero or more. The damping is proportional to its square
        root.
    speed : float
        Speed of the sinusoid and the quadrant, relative to the paper's.
    duration_s : float, optional
        Duration of the trajectory (s). Default: the paper's.
    model : Arm, optional
        The controller's model of the arm, such as :attr:`Fit.arm`: its inertias, friction, limits and
        gains. Default: the arm itself with the errors below.
    gravity_error, friction_error : float
        Relative errors of the controller's model: of each mass and each component of a centre of mass, and of each
        friction parameter. Each is wrong by exactly this fraction, with a sign drawn from ``seed``. 1e-3 and 0.03 are typical of a good identification. Default 0: exact.
    stribeck : bool
        Whether the friction feed-forward includes the plant's Stribeck effect.
    load : bool
        Whether the plant's friction depends on direction and load.
    fade : bool
        Whether the contact latch fades the friction feed-forward.
    learning : bool
        Whether the controller refines its model while the arm moves, from the prediction error of the
        torques. What it learned is in the log.
    seed : int
        Seed of all noise and of the signs above, zero or more.
    log_dir : str or os.PathLike, optional
        Folder for ``<experiment>.mcap``, created if necessary; see :func:`read_log`.
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
    Run
        Every cycle, and the tracking error. A fault of the controller is a result: ``run.ended``.

    Raises
    ------
    TypeError
        For an argument of the wrong type.
    ValueError
        For an unknown experiment, an invalid value, or an arm that cannot reach the trajectory.
    RuntimeError
        For a fault during the move to the start pose.

    Examples
    --------
    >>> import supple
    >>> run = supple.simulate(supple.Arm.load("wam4"), "sinusoid", duration_s=2.0)
    >>> run.rms_error_m < 0.005, run.ended
    (True, None)
    """
    _check.arm("arm", arm)
    if experiment not in EXPERIMENTS:
        known = ", ".join(EXPERIMENTS)
        raise ValueError(f"experiment: expected one of {known}, got {experiment!r}")
    stiffness_n_per_m = number("stiffness_n_per_m", stiffness_n_per_m)
    speed = number("speed", speed, positive=True)
    if duration_s is not None:
        duration_s = number("duration_s", duration_s, positive=True)
    gravity_error = number("gravity_error", gravity_error)
    friction_error = number("friction_error", friction_error)
    for name, value in (("gravity_error", gravity_error), ("friction_error", friction_error)):
        if value >= 1.0:
            raise ValueError(f"{name}: expected a fraction below 1, got {value}")
    seed = integer("seed", seed)
    stribeck, load = flag("stribeck", stribeck), flag("load", load)
    fade, learning = flag("fade", fade), flag("learning", learning)
    if model is not None:
        _check.arm("model", model)
        if gravity_error or friction_error:
            raise ValueError("gravity_error, friction_error: expected 0 if model is given")
    if progress is not None:
        progress = flag("progress", progress)
    effects = _chosen(arm, plant_options, realistic)
    folder = None if log_dir is None else _check.path("log_dir", log_dir)
    if folder is not None:
        Path(folder).mkdir(parents=True, exist_ok=True)
    with elapsed(experiment, progress):
        result = _native.simulate(
            arm,
            model,
            {
                "experiment": experiment,
                "stiffness_n_per_m": stiffness_n_per_m,
                "speed": speed,
                "duration_s": duration_s,
                "gravity_error": gravity_error,
                "friction_error": friction_error,
                "stribeck": stribeck,
                "load": load,
                "fade": fade,
                "learning": learning,
                "seed": seed,
                "log_dir": folder,
                "plant_options": effects,
            },
        )
    cycles = result["cycles"]
    in_contact = cycles.pop("in_contact").astype(bool)
    return Run(
        experiment=experiment,
        rms_error_m=result["rms_error_m"],
        max_error_m=result["max_error_m"],
        ended=result["ended"],
        strokes=result["strokes"],
        log=result["log"],
        in_contact=in_contact,
        **cycles,
    )
