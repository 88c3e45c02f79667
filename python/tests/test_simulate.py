"""Experiments on the simulated arm, and their logs, from Python."""

from __future__ import annotations

import numpy as np
import pytest
import supple


@pytest.fixture(scope="module")
def arm():
    return supple.Arm.load("wam4")


@pytest.fixture(scope="module")
def run(arm, tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs") / "not" / "there"
    return supple.simulate(arm, "sinusoid", duration_s=2.0, seed=3, log_dir=folder)


@pytest.fixture(scope="module")
def log(run):
    return supple.read_log(run.log)


def test_the_error_matches_the_rows(run):
    distance = np.linalg.norm(run.reference_position_m - run.tip_position_m, axis=1)
    assert run.rms_error_m == pytest.approx(np.sqrt(np.mean(distance**2)), rel=1e-9)
    assert run.max_error_m == pytest.approx(distance.max(), rel=1e-9)
    np.testing.assert_allclose(np.diff(run.t), 1e-3, atol=1e-12)
    assert run.ended is None and not run.in_contact.any()


def test_the_same_arguments_give_the_same_numbers(arm, run):
    again = supple.simulate(arm, "sinusoid", duration_s=2.0, seed=3)
    np.testing.assert_array_equal(again.q, run.q)
    np.testing.assert_array_equal(again.tau, run.tau)
    other = supple.simulate(arm, "sinusoid", duration_s=2.0, seed=3, friction_error=0.1)
    assert other.rms_error_m > run.rms_error_m


def test_the_log_contains_the_run(arm, run, log):
    assert log.arm == arm
    assert (log.experiment, log.seed) == ("sinusoid", 3)
    assert log.faults == ()
    tracking = log.mode == "track"
    assert tracking.sum() == len(run.t)
    np.testing.assert_array_equal(log.q[tracking], run.q)
    np.testing.assert_array_equal(log.qd[tracking], run.qd)
    np.testing.assert_array_equal(log.tau[tracking], run.tau)
    np.testing.assert_array_equal(log.reference_position_m[tracking], run.reference_position_m)
    np.testing.assert_array_equal(log.truth.tip_position_m[tracking], run.tip_position_m)
    np.testing.assert_allclose(np.diff(log.t), 1e-3, atol=1e-9)


def test_the_log_agrees_with_the_model(arm, log):
    tip = arm.tip_pose(log.q)[:, :3, 3]
    np.testing.assert_allclose(log.tip_position_m, tip, atol=1e-12)
    tracking = log.mode == "track"
    gravity = arm.gravity(log.q[tracking])
    np.testing.assert_allclose(log.torques["gravity"][tracking], gravity, atol=1e-9)
    total = sum(log.torques.values())
    np.testing.assert_allclose(total[tracking], log.tau[tracking], atol=1e-9)


def test_probing_touches_the_block(arm):
    run = supple.simulate(arm, "probing", duration_s=7.0, stiffness_n_per_m=25.0)
    assert run.in_contact.any()
    assert run.strokes["peak_filtered_n"].shape == run.strokes["contact_s"].shape
    assert run.strokes["peak_filtered_n"][0] == pytest.approx(run.tip_force_n[:, 2].max(), rel=0.2)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"experiment": "dance"}, "experiment: expected one of sinusoid, arc, quadrant, probing"),
        ({"stiffness_n_per_m": -1.0}, "stiffness_n_per_m: expected .* not negative, got -1.0"),
        ({"speed": 0.0}, "speed: expected .* positive, got 0.0"),
        ({"duration_s": float("nan")}, "duration_s: expected .*, got nan"),
        ({"friction_error": 1.5}, "friction_error: expected a fraction below 1, got 1.5"),
        ({"seed": -2}, "seed: expected zero or more, got -2"),
    ],
)
def test_invalid_arguments_are_reported(arm, arguments, message):
    with pytest.raises(ValueError, match=message):
        supple.simulate(arm, **arguments)


def test_invalid_logs_are_rejected(tmp_path, run):
    with pytest.raises(FileNotFoundError, match="nowhere.mcap"):
        supple.read_log("nowhere.mcap")
    path = tmp_path / "text.mcap"
    path.write_text("no log")
    with pytest.raises(ValueError, match="text.mcap"):
        supple.read_log(path)
    cut = tmp_path / "cut.mcap"
    content = run.log.read_bytes()
    cut.write_bytes(content[: len(content) * 2 // 3])
    with pytest.raises(ValueError, match="cut.mcap is incomplete .*supple log recover"):
        supple.read_log(cut)


def test_plant_options_change_the_plant_and_are_noted_in_the_log(arm, run, tmp_path):
    options = {"tool_extra_kg": 0.05}
    heavy = supple.simulate(
        arm, "sinusoid", duration_s=2.0, seed=3, plant_options=options, log_dir=tmp_path
    )
    assert heavy.rms_error_m > 2.0 * run.rms_error_m
    file = tmp_path / "plant.toml"
    file.write_text("tool_extra_kg = 0.05\n")
    same = supple.simulate(arm, "sinusoid", duration_s=2.0, seed=3, plant_options=file)
    np.testing.assert_array_equal(same.q, heavy.q)
    none = supple.simulate(arm, "sinusoid", duration_s=2.0, seed=3, plant_options={})
    np.testing.assert_array_equal(none.q, run.q)


def test_realistic_is_the_named_set(arm):
    named = supple.simulate(arm, "sinusoid", duration_s=1.0, realistic=True)
    same = supple.simulate(
        arm, "sinusoid", duration_s=1.0, plant_options=supple.plant_options("realistic")
    )
    np.testing.assert_array_equal(named.q, same.q)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"tool_kg": 1.0}, "tool_kg"),
        ({"base_tilt_rad": 3.0}, "base_tilt_rad is 3"),
        ("nowhere.toml", "nowhere.toml"),
    ],
)
def test_wrong_plant_options_are_named(arm, options, expected):
    with pytest.raises(ValueError, match=expected):
        supple.simulate(arm, plant_options=options)


def test_plant_options_and_realistic_exclude_each_other(arm):
    with pytest.raises(ValueError, match="realistic"):
        supple.simulate(arm, plant_options={}, realistic=True)
    with pytest.raises(ValueError, match="realistic"):
        supple.plant_options("surreal")


def test_learning_brings_wrong_friction_back(arm, tmp_path):
    def late_rms_m(learning):
        run = supple.simulate(
            arm, duration_s=24.0, friction_error=0.15, seed=1, learning=learning, log_dir=tmp_path
        )
        distance = np.linalg.norm(run.reference_position_m - run.tip_position_m, axis=1)
        return np.sqrt(np.mean(distance[run.t >= 16.0] ** 2)), run

    without, _ = late_rms_m(False)
    found, run = late_rms_m(True)
    assert found < 0.006 and found < 0.5 * without
    log = supple.read_log(run.log)
    assert np.abs(log.torques["learned"]).max() > 0.05
