"""Wrong arguments are named; Ctrl-C acts; a sweep that fails keeps what is finished."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

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


PROGRAM = """
import time
import supple
arm = supple.Arm.load("wam4")
{before}
print("ready", flush=True)
try:
    {call}
except KeyboardInterrupt:
    print(time.monotonic(), flush=True)
"""

CALLS = {
    "simulate": ("", "supple.simulate(arm, 'sinusoid', duration_s=1e5)"),
    "sweep": ("", "supple.sweep(lambda p, s: supple.simulate(arm, 'sinusoid', duration_s=1e5), [0], seed=0)"),
    "identify": (
        "motion = supple.design_excitation(arm, candidates=5, period_s=6.0, periods=2);"
        "log = supple.excite(arm, motion)",
        "[supple.identify(arm, log.t, log.q, log.tau) for _ in range(1000)]",
    ),
}
# Loosely: what is promised is 0.2 s on a machine with nothing else to do.
INTERRUPTED_WITHIN_S = 5.0


def interrupted(before, call):
    """Seconds from the signal to the exception; the calculation itself takes minutes."""
    program = subprocess.Popen(
        [sys.executable, "-c", PROGRAM.format(before=before, call=call)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert program.stdout is not None
    try:
        assert program.stdout.readline() == "ready\n"
        time.sleep(0.5)
        sent = time.monotonic()
        program.send_signal(signal.SIGINT)
        # The clock is the machine's, the same in both processes.
        return float(program.stdout.readline()) - sent
    finally:
        program.kill()
        program.communicate()


@pytest.mark.parametrize(("before", "call"), CALLS.values(), ids=CALLS.keys())
def test_an_interrupt_ends_a_long_calculation(before, call, capsys):
    interrupted_s = sorted(interrupted(before, call) for _ in range(3))
    with capsys.disabled():
        print(f" interrupted after {', '.join(f'{1e3 * seconds:.0f}' for seconds in interrupted_s)} ms", end="")
    assert interrupted_s[1] < INTERRUPTED_WITHIN_S


def worker_threads():
    """Threads in which a calculation runs."""
    tasks = Path("/proc/self/task")
    return [task for task in tasks.iterdir() if (task / "comm").read_text().strip() == "supple"]


def test_an_interrupted_identification_stops_computing():
    """What it still computes after the interrupt is a small part of the whole."""
    motion = supple.design_excitation(ARM, candidates=5, period_s=10.0, periods=2)
    recording = supple.excite(ARM, motion)

    def cpu_s(call):
        before = time.process_time()
        call()
        while worker_threads():
            time.sleep(0.01)
        return time.process_time() - before

    whole_s = cpu_s(lambda: supple.identify(ARM, recording.t, recording.q, recording.tau))

    def broken_off():
        # Counts the process's own time, so that a busy machine does not change what is interrupted.
        signal.signal(signal.SIGPROF, signal.default_int_handler)
        signal.setitimer(signal.ITIMER_PROF, 0.1 * whole_s)
        with pytest.raises(KeyboardInterrupt):
            supple.identify(ARM, recording.t, recording.q, recording.tau)

    try:
        part_s = cpu_s(broken_off)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
    assert part_s < 0.5 * whole_s, f"{part_s} of {whole_s} s"


def test_representations_are_short():
    rng = np.random.default_rng(0)
    q, qd, qdd = rng.normal(size=(3, 2000, ARM.dof))
    fit = supple.identify(ARM, 0.02 * np.arange(2000), q, ARM.rnea(q, qd, qdd), qd, qdd, method="ols", friction="none")
    assert repr(fit).startswith("<Fit of wam4") and len(repr(fit)) < 160
    assert len(repr(supple.Payload.ball(1.0, 0.05, [0.0, 0.0, 0.1]))) < 80
    assert len(repr(supple.sweep(lambda p, s: p, range(1000), seed=0))) < 80
