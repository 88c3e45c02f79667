"""Logs of real robots. They may not be redistributed: without them each test is skipped."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import supple

DRIVE_GAIN_NM_PER_A = np.array([14.87, 13.26, 11.13, 10.62, 11.03, 11.47])
UR10E = os.environ.get("SUPPLE_UR10E_DIR")
# Maximum relative torque error, with one fit for all three.
UR10E_HELD_OUT = {
    "ur-20_01_17-ptp_10_points.csv": (slice(700, 4200), 0.040),
    "ur-20_02_12-40sec_12harm.csv": (slice(500, 4460), 0.031),
    "ur-20_02_05-20sec_8harm.csv": (slice(320, 2310), 0.044),
}


@pytest.mark.skipif(
    UR10E is None,
    reason="prediction of three UR10e logs: name the folder of dynamic_calibration/dataset_ur10e, "
    "with ur10e.urdf in it, in SUPPLE_UR10E_DIR",
)
def test_one_ur10e_log_predicts_the_others():
    folder = Path(UR10E)

    def columns(name, rows):
        table = np.loadtxt(folder / name, delimiter=",", usecols=range(19))[rows]
        t, q, qd, current = np.split(table, [1, 7, 13], axis=1)
        return t[:, 0], q, current * DRIVE_GAIN_NM_PER_A, qd

    # Gazebo's elements, which supple does not read.
    with pytest.warns(UserWarning, match="unknown element"):
        arm = supple.Arm.from_urdf(folder / "ur10e.urdf", tip="tool0")
    given = columns("ur-20_02_10-30sec_12harm.csv", slice(635, 3510))
    fit = supple.identify(arm, *given, cutoff_hz=8.0, rate_hz=100.0)
    for name, (rows, bound) in UR10E_HELD_OUT.items():
        validation = fit.validate(*columns(name, rows))
        print(f"{name}: {100.0 * validation.total_relative:.2f} %")
        assert validation.total_relative <= bound
        assert validation.positive_definite == 1.0
    assert fit.arm.dof == 6
