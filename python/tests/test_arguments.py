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
        ({"realistic": 3}, TypeError),
        ({"duration_s": "5"}, TypeError),
        ({"duration_s": np.array([5.0])}, TypeError),
        ({"duration_s": 10**400}, ValueError),
        ({"speed": True}, TypeError),
        ({"seed": True}, TypeError),
        ({"model": "wam4"}, TypeError),
        ({"log_dir": 7}, TypeError),
        ({"log_dir": b"logs"}, TypeError),
        ({"plant_options": 7}, TypeError),
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


LOG = {"t": np.arange(3.0), "q": np.zeros((3, 4)), "tau": np.zeros((3, 4))}
MOTION = supple.design_excitation(ARM, candidates=1, period_s=5.0, periods=1)
WRONG_TYPES = [
    ("arm: expected an Arm, got 3", lambda: supple.simulate(3)),
    ("arm: expected an Arm, got 'wam4'", lambda: supple.simulated("wam4")),
    ("arm: expected an Arm", lambda: supple.excite(None, MOTION)),
    ("arm: expected an Arm", lambda: supple.identify(3, **LOG)),
    ("arm: expected an Arm", lambda: supple.learn(3, **LOG)),
    ("arm: expected an Arm", lambda: supple.design_excitation(3)),
    ("arm: expected an Arm", lambda: supple.base_parameters(3)),
    ("plant_options['tool_extra_kg']: expected a number", lambda: supple.simulate(ARM, plant_options={"tool_extra_kg": "1"})),
    ("name: expected text, got 5", lambda: supple.plant_options(5)),
    ("name_or_path: expected a path, got 5", lambda: supple.Arm.load(5)),
    ("strict: expected True or False, got 1", lambda: supple.Arm.load("wam4", strict=1)),
    ("path: expected a path, got 5", lambda: supple.read_log(5)),
    ("path: expected a path, got 5", lambda: supple.Arm.from_urdf(5)),
    ("tip: expected text, got 5", lambda: supple.Arm.from_urdf("arm.urdf", tip=5)),
    ("tip: expected text, got None", lambda: supple.Arm.from_urdf("arm.urdf", None)),
    ("repair: expected True or False, got 1", lambda: supple.Arm.from_urdf("arm.urdf", repair=1)),
    ("strict: expected True or False", lambda: supple.Arm.from_urdf("arm.urdf", strict="yes")),
    ("point_mass_radius_m: expected a number", lambda: supple.Arm.from_urdf("arm.urdf", point_mass_radius_m="1")),
    ("fixed_joints_rad: expected a mapping", lambda: supple.Arm.from_urdf("arm.urdf", fixed_joints_rad=["joint1"])),
    ("fixed_joints_rad['a']: expected a number", lambda: supple.Arm.from_urdf("arm.urdf", fixed_joints_rad={"a": "0"})),
    ("prefix: expected text, got 3", lambda: supple.connect(prefix=3)),
    ("watch: expected True or False", lambda: supple.connect("nobody", watch=3)),
    ("timeout_s: expected a number", lambda: supple.connect("nobody", timeout_s="1")),
    ("start_rad: expected numbers", lambda: supple.simulated(ARM, start_rad=["0"] * 4)),
    ("excitation: expected an Excitation, got 3", lambda: supple.excite(ARM, 3)),
    ("model: expected an Arm", lambda: supple.excite(ARM, MOTION, model=3)),
    ("log_dir: expected a path", lambda: supple.excite(ARM, MOTION, log_dir=7)),
    ("realistic: expected True or False", lambda: supple.excite(ARM, MOTION, realistic=3)),
    ("encoder_noise_rad: expected a number", lambda: supple.excite(ARM, MOTION, encoder_noise_rad="0")),
    ("moving: expected integers", lambda: supple.design_excitation(ARM, moving="0123")),
    ("moving: expected an iterable", lambda: supple.design_excitation(ARM, moving=3)),
    ("moving[1]: expected an integer, got 1.5", lambda: supple.design_excitation(ARM, moving=[0, 1.5])),
    ("candidates: expected an integer", lambda: supple.design_excitation(ARM, candidates="60")),
    ("workspace: expected numbers", lambda: supple.design_excitation(ARM, workspace="all")),
    ("progress: expected a callable, True or False, got 3", lambda: supple.design_excitation(ARM, progress=3)),
    ("progress: expected True or False, got 3", lambda: supple.excite(ARM, MOTION, progress=3)),
    ("moving[0]: expected an integer, got True", lambda: supple.identify(ARM, **LOG, moving=[True] * 4)),
    ("coupling: expected an integer", lambda: supple.identify(ARM, **LOG, coupling=(0.5, 1.5))),
    ("cutoff_hz: expected a number", lambda: supple.identify(ARM, **LOG, cutoff_hz="8")),
    ("rate_hz: expected a number", lambda: supple.identify(ARM, **LOG, rate_hz="8")),
    ("keep_every: expected an integer", lambda: supple.identify(ARM, **LOG, keep_every=1.5)),
    ("torque_delay_s: expected a number", lambda: supple.identify(ARM, **LOG, torque_delay_s="0")),
    ("method: expected text, got 3", lambda: supple.identify(ARM, **LOG, method=3)),
    ("rotor: expected True or False", lambda: supple.identify(ARM, **LOG, rotor=1)),
    ("slow_rad_per_s: expected a number", lambda: supple.identify(ARM, **LOG, slow_rad_per_s="0")),
    ("prior_weight: expected a number", lambda: supple.identify(ARM, **LOG, prior_weight="1")),
    ("joint_noise_nm: expected numbers", lambda: supple.identify(ARM, **LOG, joint_noise_nm=["1"] * 4)),
    ("progress: expected True or False, got 3", lambda: supple.identify(ARM, **LOG, progress=3)),
    ("progress: expected True or False, got 3", lambda: supple.simulate(ARM, progress=3)),
    ("accept_wrong_logs: expected True or False", lambda: supple.identify(ARM, **LOG, accept_wrong_logs="no")),
    ("viscous: expected True or False", lambda: supple.FrictionColumns(viscous="yes")),
    ("load: expected", lambda: supple.FrictionColumns(load=True)),
    ("band_rad_per_s: expected a number", lambda: supple.FrictionColumns(band_rad_per_s="0.01")),
    ("cutoff_hz: expected a number", lambda: supple.learn(ARM, **LOG, cutoff_hz="8")),
    ("samples: expected an integer", lambda: supple.base_parameters(ARM, samples="500")),
    ("rotor: expected True or False", lambda: supple.base_parameters(ARM, rotor=1)),
    ("function: expected a callable, got 3", lambda: supple.sweep(3, [1], seed=0)),
    ("parameters: expected an iterable, got 3", lambda: supple.sweep(max, 3, seed=0)),
    ("executor: expected an executor, got 3", lambda: supple.sweep(max, [1], seed=0, executor=3)),
    ("progress: expected a callable, True or False, got 3", lambda: supple.sweep(max, [1], seed=0, progress=3)),
    ("results: expected a path, got 3", lambda: supple.sweep(max, [1], seed=0, results=3)),
]


@pytest.mark.parametrize(("message", "call"), WRONG_TYPES, ids=[message for message, _ in WRONG_TYPES])
def test_a_wrong_type_is_named(message, call):
    with pytest.raises(TypeError) as raised:
        call()
    assert str(raised.value).startswith(message)
    # Short and on one line, whatever was given.
    assert ", got " in str(raised.value) and len(str(raised.value)) < 150 and "\n" not in str(raised.value)


def test_a_wrong_argument_leaves_no_folder(tmp_path):
    with pytest.raises(TypeError, match="^realistic: expected"):
        supple.simulate(ARM, log_dir=tmp_path / "logs", realistic=3)
    assert not (tmp_path / "logs").exists()


def test_numbers_of_other_types_are_taken():
    given = {"duration_s": np.float32(0.01), "speed": np.array(1.0), "seed": np.uint8(3), "load": np.True_}
    same = {"duration_s": float(np.float32(0.01)), "speed": 1, "seed": 3, "load": True}
    np.testing.assert_array_equal(supple.simulate(ARM, **given).q, supple.simulate(ARM, **same).q)


def test_commands_name_their_arguments():
    system = supple.simulated(ARM)
    for message, call in (
        ("duration_s: expected a number", lambda: system.wait("1")),
        ("duration_s: expected a number", lambda: system.move(ARM.home_rad, "1")),
        ("target_rad: expected numbers", lambda: system.move(["0"] * 4, 1.0)),
        ("to_m: expected numbers", lambda: system.line("there", 1.0)),
        ("ramp_s: expected a number", lambda: system.gains(5.0, ramp_s="1")),
        ("frequency_hz: expected a number", lambda: system.sinusoid([0.0, 0.1, 0.0], "1")),
        ("rate_hz: expected a number", lambda: system.set_points("100")),
        ("kind: expected text", lambda: system.request(3)),
    ):
        with pytest.raises(TypeError, match=f"^{message}, got "):
            call()


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


# The signal comes after a given processor time of the process and has Ctrl-C's handler. What a busy machine does
# besides has no influence. A calculation that goes on is killed after 30 s of processor time.
PROGRAM = """
import resource, signal, time
from pathlib import Path
import supple
arm = supple.Arm.load("wam4")
{before}
resource.setrlimit(resource.RLIMIT_CPU, (int(time.process_time()) + 30,) * 2)
signal.signal(signal.SIGPROF, signal.default_int_handler)
due_s = time.process_time() + {after_s}
signal.setitimer(signal.ITIMER_PROF, {after_s})
try:
    {call}
except KeyboardInterrupt:
    print(time.process_time() - due_s)
    def name(thread):
        try:
            return (thread / "comm").read_text().strip()
        except (FileNotFoundError, ProcessLookupError):
            return "ended"
    while "supple" in map(name, Path("/proc/self/task").iterdir()):
        time.sleep(0.01)
"""

CALLS = {
    "simulate": ("", "supple.simulate(arm, 'sinusoid', duration_s=1e5)"),
    "sweep": ("", "supple.sweep(lambda p, s: supple.simulate(arm, 'sinusoid', duration_s=1e5), [0], seed=0)"),
    "identify": (
        "motion = supple.design_excitation(arm, candidates=5, period_s=6.0, periods=2);"
        "log = supple.excite(arm, motion)",
        "[supple.identify(arm, log.t, log.q, log.tau) for _ in range(1000)]",
    ),
    "design_excitation": ("", "supple.design_excitation(arm, candidates=10**6)"),
}
# Processor time from the signal to the exception (s).
HEARD_WITHIN_S = 0.2


def interrupted(before, call, after_s):
    """Processor time from a signal to the exception (s) during a calculation that would take minutes."""
    program = PROGRAM.format(before=before, call=call, after_s=after_s)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"it went on after the interrupt: exit code {done.returncode}, {done.stderr}"
    return float(done.stdout)


@pytest.mark.parametrize(("before", "call"), CALLS.values(), ids=CALLS.keys())
# The first one shortly after the beginning: a look for signals at long intervals is then heard late for certain.
@pytest.mark.parametrize("after_s", [0.05, 0.3])
def test_an_interrupt_ends_a_long_calculation(before, call, after_s):
    heard_s = interrupted(before, call, after_s)
    if heard_s > HEARD_WITHIN_S:
        # In a virtual machine the time that others take may count as the process's own: late is what is late again.
        heard_s = interrupted(before, call, after_s)
    assert heard_s <= HEARD_WITHIN_S


def thread_name(task):
    """Name of a thread; it may end while it is asked."""
    try:
        return (task / "comm").read_text().strip()
    except (FileNotFoundError, ProcessLookupError):
        return "ended"


def worker_threads():
    """Threads in which a calculation runs."""
    return [task for task in Path("/proc/self/task").iterdir() if thread_name(task) == "supple"]


def test_an_interrupted_identification_stops_computing():
    """What it still computes after the interrupt is a small part of the whole. Other work of the process counts, too: the least of
    three attempts decides."""
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
        part_s = min(cpu_s(broken_off) for _ in range(3))
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
