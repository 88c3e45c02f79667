"""The experiments of ``supple sweep``, from a TOML file."""

from __future__ import annotations

import inspect
import itertools
import os
import tomllib
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from supple import _native
from supple._simulate import EXPERIMENTS, simulate

# Arguments of simulate that are not plain values, or that a spec gives under other keys.
_ELSEWHERE = ("arm", "experiment", "seed", "model")
_ARGUMENTS = tuple(name for name in inspect.signature(simulate).parameters if name not in _ELSEWHERE)
_KEYS = ("arm", "experiment", "seed", "repetitions", "fixed", "varied")


class SpecError(Exception):
    """Error of an invalid spec; the message names file, key and remedy."""


@dataclass(frozen=True)
class Spec:
    """A sweep over every combination of the varied arguments, ``repetitions`` times, each with its own seed."""

    arm: str = "wam4"
    """Built-in arm, or path of an arm's TOML, folder or URDF, which every worker must be able to read."""
    experiment: str = "sinusoid"
    """Experiment of :func:`supple.simulate`."""
    seed: int = 0
    """Seed of the sweep."""
    repetitions: int = 1
    """Tasks of each combination."""
    fixed: dict[str, Any] = field(default_factory=dict)
    """Arguments of :func:`supple.simulate` that are the same for all tasks."""
    varied: dict[str, list[Any]] = field(default_factory=dict)
    """Lists of values of further arguments."""

    @staticmethod
    def read(file: str | os.PathLike[str]) -> Spec:
        """Reads a TOML file.

        Raises
        ------
        SpecError
            For a key or a value that a spec does not have.
        OSError
            If the file cannot be read.
        """
        try:
            given = tomllib.loads(Path(file).read_text())
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise SpecError(f"{file}: {error}") from None
        for key in given:
            if key not in _KEYS:
                raise SpecError(f"{file}: {key}: unknown key; known are {', '.join(_KEYS)}")
        spec = Spec(**given)
        for key, kind in (("arm", str), ("experiment", str), ("seed", int), ("repetitions", int), ("fixed", dict), ("varied", dict)):
            if not isinstance(getattr(spec, key), kind):
                raise SpecError(f"{file}: {key}: expected {kind.__name__}, got {getattr(spec, key)!r}")
        if spec.experiment not in EXPERIMENTS:
            raise SpecError(f"{file}: experiment: expected one of {', '.join(EXPERIMENTS)}, got {spec.experiment!r}")
        if spec.seed < 0 or spec.repetitions < 1:
            raise SpecError(f"{file}: seed, repetitions: expected 0 or more, and 1 or more")
        for key in (*spec.fixed, *spec.varied):
            if key not in _ARGUMENTS or key in spec.fixed and key in spec.varied:
                raise SpecError(f"{file}: {key}: expected once, in [fixed] or [varied], one of {', '.join(_ARGUMENTS)}")
        for key, values in spec.varied.items():
            if not isinstance(values, list) or not values:
                raise SpecError(f"{file}: [varied] {key}: expected a list of values, got {values!r}")
        return spec

    def tasks(self) -> list[dict[str, Any]]:
        """Returns the varied arguments of each task. More repetitions add tasks at the end, which extends a sweep."""
        combinations = [dict(zip(self.varied, values, strict=True)) for values in itertools.product(*self.varied.values())]
        return combinations * self.repetitions

    @property
    def run(self) -> partial[dict[str, Any]]:
        """Returns the function ``run(varied, seed)`` that runs one task."""
        return partial(_run, self.arm, self.experiment, self.fixed)


def _run(name: str, experiment: Any, fixed: dict[str, Any], varied: dict[str, Any], seed: int) -> dict[str, Any]:
    run = simulate(_arm(name), experiment, **fixed, **varied, seed=seed)
    ended_s, fault = run.ended or (None, None)
    return {"rms_error_m": run.rms_error_m, "max_error_m": run.max_error_m, "fault_s": ended_s, "fault": fault}


_arms: dict[str, _native.Arm] = {}


def _arm(name: str) -> _native.Arm:
    """Returns an arm, loaded once in each worker."""
    if name not in _arms:
        is_urdf = name.lower().endswith((".urdf", ".xml"))
        _arms[name] = _native.Arm.from_urdf(name).completed() if is_urdf else _native.Arm.load(name)
    return _arms[name]
