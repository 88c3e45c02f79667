"""Systems from Python: a simulated one in the process, and the processes of `supple up`.

The programs are those in SUPPLE_PROGRAMS, or of the checkout's debug build; ./ci.sh package builds them.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
import supple

PROGRAMS = Path(os.environ.get("SUPPLE_PROGRAMS", Path(__file__).resolve().parents[2] / "target/debug"))
RATE_HZ = 250
AMPLITUDE_M, OMEGA = 0.03, np.pi


@pytest.fixture
def system():
    system = supple.simulated(supple.Arm.load("wam4"))
    system.hold()
    return system


def curve(t):
    """A tip motion that starts and ends at rest: offset, velocity, acceleration along y."""
    return (
        AMPLITUDE_M * np.sin(0.5 * OMEGA * t) ** 2,
        0.5 * AMPLITUDE_M * OMEGA * np.sin(OMEGA * t),
        0.5 * AMPLITUDE_M * OMEGA**2 * np.cos(OMEGA * t),
    )


def along_y(value):
    return np.array([0.0, value, 0.0])


def test_state_has_shapes_and_names(system):
    state = system.state
    assert (state.mode, state.fault) == ("track", None)
    assert state.q.shape == state.qd.shape == state.tau.shape == (4,)
    np.testing.assert_array_equal(state.reference_position_m, state.columns["reference_position_m"])
    rows = system.record(0.05)
    assert len(rows) == 50
    np.testing.assert_array_equal(np.diff(rows.cycle), 1)
    np.testing.assert_allclose(rows.t, 1e-3 * np.arange(50), atol=1e-12)
    assert system.recent(0.02).cycle[-1] == rows.cycle[-1]
    assert system.period_s == pytest.approx(1e-3)


@pytest.mark.parametrize(
    ("call", "parts"),
    [
        (lambda s: s.move([0.0] * 3, 1.0), ["target_rad", "(4,)", "(3,)"]),
        (lambda s: s.line([0.0, 0.0], 1.0), ["to_m", "(3,)", "(2,)"]),
        (lambda s: s.gains(stiffness_n_per_m=[1.0, 2.0]), ["stiffness_n_per_m", "(3,)", "(2,)"]),
        (lambda s: s.set_points(rate_hz=5000.0), ["rate_hz", "1000 Hz"]),
        (lambda s: s.set_points(lead_s=3.0), ["lead_s", "1 s"]),
        (lambda s: s.request("gain"), ["kind", "gains", "'gain'"]),
        (lambda s: s.request("gains", [1.0]), ["1 values", "takes 7"]),
    ],
)
def test_errors_name_argument_shape_and_remedy(system, call, parts):
    with pytest.raises(ValueError) as error:
        call(system)
    for part in parts:
        assert part in str(error.value)


def test_a_refusal_says_why_and_changes_nothing(system):
    before = system.state
    with pytest.raises(supple.Refused, match="stiffness_n_per_m is 1000000"):
        system.gains(stiffness_n_per_m=1e6)
    after = system.state
    assert after.mode == before.mode
    np.testing.assert_array_equal(after.stiffness_n_per_m, before.stiffness_n_per_m)


def test_a_watching_connection_commands_nothing():
    watching = supple.System(supple.simulated(supple.Arm.load("wam4"))._native, watch=True)
    for command in (watching.hold, watching.gravity_hold, watching.set_points):
        with pytest.raises(PermissionError, match="watch"):
            command()
    assert watching.idle().mode == "idle"


def test_a_stream_goes_on_where_it_is_after_cycles_were_dropped(system):
    blocks = system.stream(every_s=0.1)
    first = next(blocks)
    system.wait(10.0)
    second, third = next(blocks), next(blocks)
    assert second.cycle[0] > first.cycle[-1] + 1
    assert third.cycle[0] == second.cycle[-1] + 1


def test_blocks_may_be_longer_than_a_second(system):
    block = next(system.stream(every_s=1.5))
    assert len(block) == 1500


def test_a_model_comes_without_errors():
    arm = supple.Arm.load("wam4")
    with pytest.raises(ValueError, match="gravity_error.*model"):
        supple.simulated(arm, model=arm, gravity_error=0.01)


def test_a_late_set_point_starts_the_estimate_of_the_velocity_anew(system):
    start = system.state.tip_position_m
    with system.set_points(100.0, lead_s=0.2) as points:
        for _ in range(3):
            points.send(start)
        system.wait(1.0)
        # Ten milliseconds after the last point this would be 0.75 m/s; it is passed 0.2 s from now, at rest.
        points.send(start + along_y(0.005), pace=False)
        state = points.finish()
    np.testing.assert_allclose(state.reference_position_m, start + along_y(0.005), atol=1e-9)


def test_gains_change_along_a_ramp(system):
    system.gains(stiffness_n_per_m=[10.0, 20.0, 30.0], ramp_s=0.1)
    np.testing.assert_array_equal(system.wait(0.2).stiffness_n_per_m, [10.0, 20.0, 30.0])


def rotation(vector):
    """Rotation matrix of axis times angle."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


@pytest.fixture
def pose_system(tmp_path):
    arm = supple.Arm.load("wam7")
    active = "".join(line for line in arm.toml.splitlines(keepends=True) if not line.startswith("held"))
    (tmp_path / "arm.toml").write_text(active)
    (tmp_path / "arm.urdf").write_text(arm.urdf)
    system = supple.simulated(supple.Arm.load(tmp_path))
    system.turn([0.0, 0.0, 1.0], 0.0, 0.1)
    assert system.state.mode == "track_pose"
    return system


def test_the_tip_turns_while_its_position_stays(pose_system):
    pose_system.gains(stiffness_n_per_m=100.0, damping_n_s_per_m=8.0)
    pose_system.rotational_gains(2.0, 0.04)
    pose_system.wait(1.0)
    before = pose_system.state
    after = pose_system.turn([0.0, 0.0, 2.0], 0.2, 2.0) and pose_system.wait(1.0)
    np.testing.assert_allclose(after.tip_position_m, before.tip_position_m, atol=5e-3)
    assert np.linalg.norm(after.columns["rotation_error_rad"]) < 0.05
    turned = [rotation(state.columns["reference_rotation_rad"]) for state in (before, after)]
    angle = 0.2
    expected = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(turned[1] @ turned[0].T, expected, atol=1e-9)


def test_full_matrices_of_stiffness_and_damping(pose_system):
    stiffness = np.array([[50.0, 10.0, 0.0], [10.0, 40.0, 0.0], [0.0, 0.0, 30.0]])
    pose_system.gains(stiffness, np.diag([3.0, 3.0, 3.0]), axes="tip", ramp_s=0.1)
    pose_system.rotational_gains(np.diag([1.0, 2.0, 3.0]), 0.05, ramp_s=0.1)
    state = pose_system.wait(0.3)
    assert (state.mode, state.fault) == ("track_pose", None)
    indefinite = stiffness - 60.0 * np.eye(3)
    with pytest.raises(supple.Refused, match="eigenvalue of the stiffness matrix"):
        pose_system.gains(indefinite, np.eye(3))


@pytest.mark.parametrize(
    ("call", "parts"),
    [
        (lambda s: s.gains(np.eye(3)), ["damping_n_s_per_m", "(3, 3)", "nothing"]),
        (lambda s: s.gains(np.eye(2), np.eye(2)), ["stiffness_n_per_m", "(3, 3)", "(2, 2)"]),
        (lambda s: s.gains(np.tri(3), np.eye(3)), ["stiffness_n_per_m", "symmetric"]),
        (lambda s: s.gains(np.eye(3), np.eye(3), axes="world"), ["axes", "'tip'", "'world'"]),
        (lambda s: s.rotational_gains([1.0, 2.0], 0.1), ["stiffness_nm_per_rad", "(2,)"]),
        (lambda s: s.turn([0.0, 0.0, 0.0], 0.1, 1.0), ["axis", "direction"]),
    ],
)
def test_errors_of_the_pose_name_the_argument(pose_system, call, parts):
    with pytest.raises(ValueError) as error:
        call(pose_system)
    for part in parts:
        assert part in str(error.value)


def test_matrices_need_six_active_joints(system):
    with pytest.raises(supple.Refused, match="active"):
        system.gains(np.eye(3), np.eye(3))


@pytest.mark.parametrize("rate_hz", [20.0, 100.0, 1000.0])
def test_set_points_follow_the_curve_at_any_rate(rate_hz):
    # Stiff enough that friction moves the tip by millimetres at most: at 5 N/m it is 8 mm for any motion like this.
    system = supple.simulated(supple.Arm.load("wam4"), stiffness_n_per_m=200.0)
    system.hold()
    start = system.state.tip_position_m
    begin = None
    with system.set_points(rate_hz, lead_s=0.05) as points:
        begin = points._begin
        while points.time_s < 2.0:
            offset, velocity, acceleration = curve(points.time_s)
            points.send(start + along_y(offset), along_y(velocity), along_y(acceleration))
        points.finish()
    rows = system.recent(2.5)
    t = 1e-3 * (rows.cycle - begin)
    inside = (t > 0.06) & (t < 1.9)
    wanted = start + np.array([along_y(curve(time)[0]) for time in t[inside]])
    # Before the first set-point the reference rests.
    assert np.abs(rows.reference_position_m[inside] - wanted).max() < 2e-5
    error_m = np.linalg.norm(rows.tip_position_m[inside] - wanted, axis=1)
    assert error_m.max() < 5e-3


def test_streamed_and_inside_agree_within_a_millimetre():
    """100 Hz of positions alone against the same sinusoid inside the controller."""
    tips = []
    for streamed in (False, True):
        system = supple.simulated(supple.Arm.load("wam4"))
        system.hold()
        centre = system.state.reference_position_m
        ramp_s, frequency_hz = 1.0, 0.25
        if not streamed:
            begin = system.sinusoid([0.0, 0.05, 0.0], frequency_hz, centre_m=centre, ramp_s=ramp_s).cycle
            system.wait(5.0)
        else:
            with system.set_points(100.0) as points:
                begin = points._begin
                while points.time_s < 5.0:
                    s = path_time(points.time_s, ramp_s)
                    points.send(centre + along_y(0.05 * np.sin(2.0 * np.pi * frequency_hz * s)))
        rows = system.recent(5.0)
        chosen = (rows.cycle >= begin + 100) & (rows.cycle < begin + 4800)
        tips.append(rows.tip_position_m[chosen])
    assert tips[0].shape == tips[1].shape
    assert np.linalg.norm(tips[0] - tips[1], axis=1).max() < 1e-3


def path_time(t, ramp_s):
    """Path time of a start from rest, as the controller has it."""
    if t >= ramp_s:
        return t - 0.5 * ramp_s
    x = t / ramp_s
    return ramp_s * x**4 * (2.5 + x * (x - 3.0))


def test_the_torque_reflects_gains_at_once_and_a_set_point_in_the_next_cycle():
    def torques(act=None):
        system = supple.simulated(supple.Arm.load("wam4"), stiffness_n_per_m=20.0)
        system.hold()
        # At a distance from its reference the tip has a spring force, which the gains change.
        system.line(system.state.tip_position_m + [0.0, 0.0, 0.05], 1.0)
        with system.set_points(100.0, lead_s=0.02) as points:
            system.wait(0.1)
            before = system.state
            if act is not None:
                act(system, points, before.reference_position_m)
            system.wait(0.1)
        rows = system.recent(1.0)
        requests = rows.cycle[(rows.columns["request"] != 0.0) & (rows.cycle > before.cycle)]
        return dict(zip(rows.cycle.tolist(), rows.tau.tolist(), strict=True)), requests

    without, _ = torques()
    for act, later in (
        (lambda system, points, reference: system.gains(stiffness_n_per_m=25.0, ramp_s=0.0), 0),
        (lambda system, points, reference: points.send(reference + along_y(5e-5), pace=False), 1),
    ):
        changed, (request,) = torques(act)
        differs = [cycle for cycle in sorted(changed.keys() & without.keys()) if changed[cycle] != without[cycle]]
        assert differs[0] == request + later


def test_silence_ends_at_rest(system):
    start = system.state.tip_position_m
    with system.set_points(100.0) as points:
        for k in range(30):
            points.send(start + along_y(1e-3 * k))
    rows = system.record(1.0)
    last = rows.reference_position_m[-1]
    np.testing.assert_array_equal(rows.reference_position_m[-300:], np.tile(last, (300, 1)))
    assert 0.029 <= last[1] - start[1] < 0.05
    assert system.state.mode == "track"


def test_an_impossible_set_point_is_refused_and_the_arm_holds(system):
    start = system.state.tip_position_m
    with system.set_points(100.0) as points:
        with pytest.raises(supple.Refused, match=r"joint joint1 would turn at .* rad/s, limit 1\.900 rad/s"):
            for k in range(20):
                points.send(start + along_y(0.5 * (k > 5)))
    state = system.wait(0.5)
    assert (state.mode, state.fault) == ("track", None)
    np.testing.assert_allclose(state.tip_position_m, start, atol=5e-3)


def test_who_ends_the_motion_keeps_the_arm(system):
    start = system.state.tip_position_m
    with system.set_points(100.0) as points:
        points.send(start)
        system.gravity_hold()
        with pytest.raises(supple.Refused, match="gravity_hold"):
            for _ in range(20):
                points.send(start)
    assert system.state.mode == "gravity_hold"


# The processes of `supple up`


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    """A simulated system in real time; its prefix."""
    if os.environ.get("SUPPLE_LIVE") != "1":
        pytest.skip("needs a machine that is not busy: SUPPLE_LIVE=1 ./ci.sh package")
    if not (PROGRAMS / "supple").exists():
        assert "SUPPLE_PROGRAMS" not in os.environ, f"no programs in {PROGRAMS}"
        pytest.skip(f"no programs in {PROGRAMS}: cargo build -p supple -p supple-rt -p supple-sim")
    prefix = f"pytest-{os.getpid()}"
    folder = tmp_path_factory.mktemp("up")
    command = [PROGRAMS / "supple", "up", "--plant", "sim", "--prefix", prefix, "--no-realtime", "--no-log"]
    # Four times slower than usual: a machine that is busy with other tests then delays no cycle for too long.
    command += ["--rate-hz", str(RATE_HZ)]
    for _ in range(5):
        up = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        try:
            state = begun(prefix, up)
            if state.mode == "track":
                yield prefix
                return
            # The machine held a cycle up. Any other fault is not its doing.
            assert state.fault is not None and state.fault.startswith("no new arm state"), state
        finally:
            up.send_signal(signal.SIGTERM)
            up.wait(30)
            up.stdout.close()
    pytest.fail(f"the machine is too busy for a system at {RATE_HZ} Hz: {state}")


def begun(prefix, up):
    """The state once it tracks or has a fault."""
    with supple.connect(prefix, watch=True, timeout_s=60.0) as watching:
        end = time.monotonic() + 60.0
        while (state := watching.state).mode != "track" and state.fault is None:
            assert up.poll() is None, up.stdout.read()
            assert time.monotonic() < end, state
            time.sleep(0.1)
    return state


def test_a_running_system_is_seen_and_commanded(running):
    with supple.connect(running) as system, supple.connect(running, watch=True) as watching:
        assert (system.dof, round(1.0 / system.period_s)) == (4, RATE_HZ)
        answer = system.gravity_hold()
        assert answer.mode == "gravity_hold"
        assert watching.wait(0.1).mode == "gravity_hold"
        blocks = watching.stream(every_s=0.02)
        first, second = next(blocks), next(blocks)
        assert second.cycle[0] == first.cycle[-1] + 1
        with supple.connect(running) as other, pytest.raises(ConnectionError, match=str(os.getpid())):
            other.gravity_hold()
    with supple.connect(running) as again:
        assert again.gravity_hold().mode == "gravity_hold"


def test_a_closed_connection_says_so(running):
    system = supple.connect(running)
    system.close()
    with pytest.raises(ConnectionError, match="closed"):
        _ = system.state


def test_set_points_move_a_running_system(running):
    with supple.connect(running) as system:
        system.gravity_hold()
        system.wait(0.5)
        system.hold()
        start = system.state.reference_position_m
        # A long lead: the machine of the tests is busy.
        with system.set_points(100.0, lead_s=0.5) as points:
            while points.time_s < 1.0:
                points.send(start + along_y(0.02 * np.sin(0.5 * np.pi * points.time_s) ** 2))
            state = points.finish()
        assert (state.mode, state.fault) == ("track", None)
        moved = state.reference_position_m - start
        assert 0.015 < moved[1] < 0.025 and np.abs(moved[[0, 2]]).max() < 1e-9


def test_without_a_system_the_error_names_prefix_and_remedy():
    with pytest.raises(ConnectionError, match="`nobody-here`.*supple up"):
        supple.connect("nobody-here", timeout_s=0.1)
    with pytest.raises(ValueError, match="prefix"):
        supple.connect("Not A Prefix")
