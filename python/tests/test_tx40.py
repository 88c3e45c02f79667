"""A real Stäubli TX40, joints 5 and 6 coupled by a gear, from its raw log: fitted on the first half,
validated on the second. Provenance and gear ratios: crates/supple-ident/tests/data/tx40/README.md."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import supple

DATA = Path(__file__).parents[2] / "crates/supple-ident/tests/data/tx40"
GEAR = np.array([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
RATE_HZ = 5000.0


@pytest.fixture(scope="module")
def log():
    """Time, angles and torques at the joints."""
    motor_rad, motor_nm = (
        np.loadtxt(DATA / f"{name}_data.csv", delimiter=",", skiprows=1) for name in ("pos_read", "curr")
    )
    samples = min(len(motor_rad), len(motor_nm))
    q, tau = motor_rad[:samples] / GEAR, motor_nm[:samples] * GEAR
    q[:, 5] -= q[:, 4]
    q += np.array([0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0])
    tau[:, 4] += tau[:, 5]
    return np.arange(samples) / RATE_HZ, q, tau


@pytest.fixture(scope="module")
def arm():
    return supple.Arm.from_urdf(DATA / "tx40.urdf", tip="tool0", point_mass_radius_m=0.03)


@pytest.mark.filterwarnings("ignore:t. the log lasts 4.500 s:supple.DataWarning")
@pytest.mark.parametrize("options", [{"cutoff_hz": 40.0, "keep_every": 10}, {"keep_every": 20}])
def test_the_second_half_is_predicted_from_the_first(log, arm, options):
    half = len(log[0]) // 2
    first, second = [column[:half] for column in log], [column[half:] for column in log]
    fit = supple.identify(arm, *first, coupling=(4, 5), **options)
    validation = fit.validate(*second)
    assert validation.total_relative < 0.117
    assert validation.positive_definite == 1.0
    alone = supple.identify(arm, *first, **options).validate(*second)
    assert alone.total_relative > validation.total_relative


def test_a_link_without_inertia_needs_a_point_mass_radius_or_repair():
    with pytest.raises(ValueError, match=r"link `link_6` .*must be positive.*point_mass_radius_m.*repair=True"):
        supple.Arm.from_urdf(DATA / "tx40.urdf", tip="tool0")
    with pytest.warns(UserWarning, match="link `link_6`"):
        repaired = supple.Arm.from_urdf(DATA / "tx40.urdf", tip="tool0", repair=True)
    # The ball that replaces it has a radius of 20 mm.
    ball = supple.Arm.from_urdf(DATA / "tx40.urdf", tip="tool0", point_mass_radius_m=0.02)
    np.testing.assert_allclose(repaired.parameters, ball.parameters, rtol=1e-12, atol=1e-15)
