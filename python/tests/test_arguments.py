"""Wrong arguments are named; Ctrl-C is heard; a sweep that fails keeps what is finished."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import supple

ARM = supple.Arm.load("wam4")


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        ({"seed": 1.5}, TypeError),
        ({"seed": "1"}, TypeError),
        ({"seed": -1}, ValueError),
        ({"seed": 2**64}, ValueError),
        ({"speed": 0.0}, ValueError),
        ({"speed": float("nan")}, ValueError),
        ({"speed": "fast"}, TypeError),
        ({"duration_s": [1.0]}, TypeError),
        ({"stiffness_n_per_m": -5.0}, ValueError),
        ({"gravity_error": 1.0}, ValueError),
        ({"load": "yes"}, TypeError),
    ],
)
def test_an_error_names_the_argument(arguments, error):
    (name,) = arguments
    with pytest.raises(error, match=f"^{name}: expected"):
        supple.simulate(ARM, "sinusoid", **arguments)


def test_errors_of_other_functions_name_the_argument():
    with pytest.raises(TypeError, match="^seed: expected an integer, got 1.5"):
        supple.sweep(max, [1], seed=1.5)
    with pytest.raises(TypeError, match="^seed: expected"):
        supple.simulated(ARM, seed=1.5)
    with pytest.raises(TypeError, match="^seed: expected"):
        supple.base_parameters(ARM, seed=1.5)
    with pytest.raises(ValueError, match="^rate_hz: expected"):
        supple.design_excitation(ARM, rate_hz=float("nan"))
    assert supple.simulate(ARM, duration_s=0.01, seed=np.int64(3)).rms_error_m >= 0.0


def fails_at_three(parameter, seed):
    if parameter == 3:
        raise RuntimeError("task three")
    return 10 * parameter


def test_a_failing_task_keeps_the_finished_ones():
    with pytest.raises(RuntimeError, match="task three") as raised:
        supple.sweep(fails_at_three, range(6), seed=0)
    assert list(raised.value.sweep) == [0, 10, 20]
    assert raised.value.sweep.parameters == (0, 1, 2)
    assert "3 of 6 tasks" in raised.value.__notes__[0]
    with ThreadPoolExecutor(1) as executor, pytest.raises(RuntimeError) as raised:
        supple.sweep(fails_at_three, range(6), seed=0, executor=executor)
    assert list(raised.value.sweep)[:3] == [0, 10, 20]


SIMULATE = """
import supple
arm = supple.Arm.load("wam4")
print("ready", flush=True)
{call}
"""

CALLS = {
    "simulate": "supple.simulate(arm, 'sinusoid', duration_s=1e5)",
    "sweep": "supple.sweep(lambda p, s: supple.simulate(arm, 'sinusoid', duration_s=1e5), [0], seed=0)",
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS.keys())
def test_an_interrupt_ends_a_long_calculation(call):
    """The calculation takes minutes: without a look for signals the program would not end before the limit."""
    program = subprocess.Popen(
        [sys.executable, "-c", SIMULATE.format(call=call)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert program.stdout is not None
    assert program.stdout.readline() == "ready\n"
    time.sleep(0.5)
    program.send_signal(signal.SIGINT)
    try:
        _, errors = program.communicate(timeout=20)
    finally:
        program.kill()
    assert "KeyboardInterrupt" in errors, errors


def test_an_interrupt_ends_an_identification():
    motion = supple.design_excitation(ARM, candidates=20, period_s=6.0, periods=2)
    recording = supple.excite(ARM, motion)
    timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            for _ in range(1000):
                supple.identify(ARM, recording.t, recording.q, recording.tau)
    finally:
        timer.cancel()


def test_representations_are_short():
    assert len(repr(supple.Payload.ball(1.0, 0.05, [0.0, 0.0, 0.1]))) < 80
    assert len(repr(supple.sweep(lambda p, s: p, range(1000), seed=0))) < 80
