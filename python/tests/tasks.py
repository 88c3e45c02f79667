"""Task functions that other processes import."""

from __future__ import annotations

import os

import numpy as np
import supple


def draw(scale, seed):
    """A random number that depends on the seed of the task."""
    return scale * np.random.default_rng(seed).normal()


def process(_parameter, _seed):
    """The process in which a task runs."""
    return os.getpid()


def gravity_of_random_pose(arm, seed):
    """Uses an arm that is pickled to the task."""
    q = np.random.default_rng(seed).uniform(-1.0, 1.0, size=arm.dof)
    return arm.gravity(q)


def tracking_error(friction_error, seed):
    """One second of the sinusoid with a perturbed model."""
    arm = supple.Arm.load("wam4")
    run = supple.simulate(arm, duration_s=1.0, friction_error=friction_error, seed=seed)
    return run.rms_error_m


def fail_at_three(parameter, _seed):
    if parameter == 3:
        raise RuntimeError("three")
    return parameter


def fails_until_mended(parameter, seed):
    """Fails for this parameter, as long as a file is absent."""
    if parameter["fails"] and not os.path.exists(parameter["flag"]):
        raise RuntimeError("not mended")
    return {"number": parameter["i"], "drawn": draw(1.0, seed)}
