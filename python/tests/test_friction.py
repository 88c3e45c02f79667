"""The friction law from Python."""

from __future__ import annotations

import numpy as np
import pytest
import supple


def test_the_law_matches_its_formula():
    friction = supple.Friction(
        viscous_nm_s_per_rad=1.5,
        viscous_asymmetry_nm_s_per_rad=0.2,
        coulomb_nm=0.8,
        breakaway_nm=1.0,
        stribeck_rad_per_s=0.1,
        offset_nm=0.05,
        stribeck_offset_nm=-0.03,
        band_rad_per_s=0.02,
    )
    v = np.linspace(-0.5, 0.5, 2001).reshape(3, 667)
    x = v / 0.02
    parabola = np.where(np.abs(x) <= 1.0, 2.0 * x - np.sign(x) * x**2, np.sign(x))
    at_rest = np.exp(-((v / 0.1) ** 2))
    expected = (1.5 + 0.2 * parabola) * v + 0.05 - 0.03 * at_rest + (0.8 + 0.2 * at_rest) * parabola
    np.testing.assert_allclose(friction.torque_nm(v), expected, atol=1e-14)


@pytest.mark.parametrize(
    "wrong",
    [
        {"viscous_nm_s_per_rad": -1.0},
        {"viscous_nm_s_per_rad": 1.0, "viscous_asymmetry_nm_s_per_rad": 1.1},
        {"coulomb_nm": float("nan")},
        {"coulomb_nm": 1.0, "breakaway_nm": 0.5},
        {"coulomb_nm": 1.0, "breakaway_nm": 1.1, "stribeck_offset_nm": 0.2},
        {"band_rad_per_s": 0.0},
        {"load_coefficient": 0.6},
        {"load_torque": "gear"},
        {"coulomb_at_nm": -1.0},
    ],
)
def test_friction_that_supplies_energy_is_rejected(wrong):
    with pytest.raises(ValueError, match=list(wrong)[-1]):
        supple.Friction(**wrong)
