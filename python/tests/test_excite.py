"""Excitation and closed-loop identification on the simulated arm: from the design to a controller with
the model."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path

import numpy as np
import pytest
import supple


@pytest.fixture(scope="module")
def arm():
    return supple.Arm.load("wam3")


@pytest.fixture(scope="module")
def excitation(arm):
    return supple.design_excitation(arm, candidates=300, period_s=8.0, periods=2)


def test_the_motion_is_consistent(arm, excitation):
    """The derivatives are consistent, the motion starts and ends at rest, and the criterion never
    increases."""
    dt = np.diff(excitation.t).mean()
    np.testing.assert_allclose(np.gradient(excitation.q, dt, axis=0), excitation.qd, atol=0.02)
    np.testing.assert_allclose(excitation.qd[0], 0.0, atol=1e-9)
    np.testing.assert_allclose(excitation.qd[-1], 0.0, atol=1e-2)
    assert (np.diff(excitation.history[np.isfinite(excitation.history)]) <= 0.0).all()
    assert excitation.rank == supple.base_parameters(arm, rotor=True).rank + 2 * arm.dof
    assert excitation.condition == pytest.approx(excitation.history[-1], rel=0.2)


def test_a_urdf_alone_is_excited_and_identified():
    """Its motors are not described: its encoders measure at the joints, where the noise of a WAM's motors is a fault."""
    urdf = Path(__file__).parents[2] / "assets/wam3/arm.urdf"
    arm = supple.Arm.from_urdf(urdf, tip="tip").completed()
    motion = supple.design_excitation(arm, candidates=60, period_s=8.0, periods=2)
    recording = supple.excite(arm, motion)
    fit = supple.identify(
        arm, recording.t, recording.q, recording.tau, torque_delay_s=recording.torque_delay_s
    )
    assert fit.training_relative < 0.05
    assert supple.plant_options("urdf-realistic")["encoder_noise_rad"] < 1e-4
    with pytest.raises(ValueError, match="excitation: fault"):
        supple.excite(arm, motion, encoder_noise_rad=5e-3)


def test_the_tip_stays_in_the_workspace(arm):
    box = np.array([[-1.0, -0.5, -0.6], [1.0, 0.5, 1.2]])
    found = supple.design_excitation(
        arm, candidates=200, period_s=8.0, periods=1, workspace=box, criterion="d-optimality"
    )
    tip = arm.tip_pose(found.q)[:, :3, 3]
    assert (tip >= box[0] - 1e-2).all() and (tip <= box[1] + 1e-2).all()


def test_progress_is_reported_and_may_stop_the_search(arm):
    reports = []
    supple.design_excitation(
        arm, candidates=50, period_s=5.0, periods=1, progress=lambda *seen: reports.append(seen)
    )
    assert [tried for tried, _ in reports] == list(range(1, 51))

    def enough(tried, _best):
        if tried == 10:
            raise InterruptedError("enough")

    with pytest.raises(InterruptedError, match="enough"):
        supple.design_excitation(arm, candidates=50, period_s=5.0, periods=1, progress=enough)

    def cpu_s(progress):
        before = time.process_time()
        with contextlib.suppress(InterruptedError):
            supple.design_excitation(arm, candidates=1000, progress=progress)
        return time.process_time() - before

    # It stops after one in a hundred of the candidates.
    assert cpu_s(enough) < 0.5 * cpu_s(None)


def test_the_identified_model_controls_the_arm_it_came_from(arm, excitation):
    """The controller's model is identified from a noisy, quantised log of the plant only."""
    first = supple.excite(arm, excitation, seed=1)
    fit = supple.identify(
        arm,
        first.t,
        first.q,
        first.tau,
        cutoff_hz=8.0,
        keep_every=10,
        torque_delay_s=first.torque_delay_s,
        slow_rad_per_s=0.15,
        friction="offset",
    )
    other = supple.design_excitation(arm, candidates=60, period_s=8.0, periods=1, seed=5)
    second = supple.excite(arm, other, seed=2)
    assert fit.validate(second.t, second.q, second.tau).total_relative < 0.1
    exact = supple.simulate(arm, "sinusoid", duration_s=4.0, load=False)
    found = supple.simulate(arm, "sinusoid", duration_s=4.0, load=False, model=fit.arm)
    assert found.ended is None
    assert found.rms_error_m < exact.rms_error_m + 0.02


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"criterion": "luck"}, "criterion: expected condition or d-optimality, got 'luck'"),
        ({"workspace": [0.0, 1.0]}, r"workspace: expected shape \(2, 3\), got \(2,\)"),
        ({"candidates": 0}, "candidates: expected 1 or more, got 0"),
        ({"rate_hz": 0.0}, "rate_hz: expected a number that is finite and positive, got 0.0"),
        ({"moving": [0, 7]}, r"moving: expected joint numbers below 3"),
        ({"period_s": -1.0}, "period_s: expected a number that is finite and positive, got -1.0"),
    ],
)
def test_invalid_options_are_reported(arm, options, message):
    with pytest.raises(ValueError, match=message):
        supple.design_excitation(arm, **{"candidates": 10, **options})


def test_an_excitation_of_another_arm_is_rejected(excitation):
    with pytest.raises(ValueError, match="excitation: expected 4 joints, as arm, got 3"):
        supple.excite(supple.Arm.load("wam4"), excitation)
