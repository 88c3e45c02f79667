"""Learning, payload, torque scale and ripple, each compared with a known arm."""

from __future__ import annotations

import numpy as np
import pytest
import supple
from test_identify import motion, torques

BALL = supple.Payload.ball(1.5, 0.05, (0.02, -0.03, 0.1))


@pytest.fixture(scope="module")
def arm():
    return supple.Arm.load("wam4")


def loaded(arm, payload):
    """Torques of a payload in the last link's frame: the last link's regressor times its parameters."""
    c = np.asarray(payload.com_m)
    about = payload.inertia_kg_m2 + payload.mass_kg * (c @ c * np.eye(3) - np.outer(c, c))
    entries = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)]
    p = np.concatenate([[payload.mass_kg], payload.mass_kg * c, [about[i] for i in entries]])
    return lambda q, qd, qdd: arm.regressor(q, qd, qdd)[..., -10:] @ p


@pytest.fixture(scope="module")
def empty(arm):
    t, q, qd, qdd = motion(4, 30)
    noise = np.random.default_rng(0).normal(scale=0.01, size=q.shape)
    return supple.identify(
        arm, t, q, torques(arm, q, qd, qdd) + noise, qd, qdd, friction="coulomb", prior_weight=1e-2
    )


def test_a_payload_is_identified(arm, empty):
    t, q, qd, qdd = motion(4, 31)
    tau = torques(arm, q, qd, qdd) + loaded(arm, BALL)(q, qd, qdd)
    guess = supple.Payload.ball(1.0, 0.03, (0.0, 0.0, 0.05))
    found = empty.payload(t, q, tau, qd, qdd, guess=guess)
    assert found.mass_kg == pytest.approx(BALL.mass_kg, rel=0.02)
    np.testing.assert_allclose(found.com_m, BALL.com_m, atol=3e-3)
    assert (np.linalg.eigvalsh(found.inertia_kg_m2) > 0.0).all()
    with pytest.raises(ValueError, match=r"com_m: expected shape \(3,\), got \(2,\)"):
        empty.payload(t, q, tau, qd, qdd, guess=supple.Payload(1.0, (0.0, 0.0), np.eye(3)))


def test_a_known_payload_gives_the_torque_scale_of_each_joint(arm):
    scale = np.array([0.8, 1.1, 0.9, 1.25])
    t, q, qd, qdd = motion(4, 32)
    fit = supple.identify(
        arm, t, q, torques(arm, q, qd, qdd) / scale, qd, qdd, method="wls", friction="coulomb"
    )
    t, q, qd, qdd = motion(4, 33)
    tau = (torques(arm, q, qd, qdd) + loaded(arm, BALL)(q, qd, qdd)) / scale
    found = fit.torque_scale(t, q, tau, qd, qdd, known=BALL)
    assert found == pytest.approx(tuple(scale), rel=1e-6)
    nothing = supple.Payload.ball(-1.0, 0.05, (0.0, 0.0, 0.1))
    with pytest.raises(ValueError, match="payload"):
        fit.torque_scale(t, q, tau, qd, qdd, known=nothing)


def test_a_known_mass_alone_gives_torque_scales_and_its_place(arm):
    scale = np.array([0.8, 1.1, 0.9, 1.25])
    noise = np.random.default_rng(4)

    def logged(tau):
        return tau / scale + noise.normal(scale=0.01, size=tau.shape)

    t, q, qd, qdd = motion(4, 32)
    fit = supple.identify(arm, t, q, logged(torques(arm, q, qd, qdd)), qd, qdd, method="wls", friction="coulomb")
    t, q, qd, qdd = motion(4, 33)
    tau = logged(torques(arm, q, qd, qdd) + loaded(arm, BALL)(q, qd, qdd))
    found = fit.weigh(t, q, tau, qd, qdd, mass_kg=BALL.mass_kg)
    assert found.torque_scale == pytest.approx(tuple(scale), rel=0.02)
    np.testing.assert_allclose(found.com_m, BALL.com_m, atol=5e-3)
    assert max(found.torque_scale_deviation) < 0.05 and found.com_deviation_m.max() < 0.01
    assert found.warnings == () and "torque scales 0.8" in repr(found)
    with pytest.raises(ValueError, match="mass_kg"):
        fit.weigh(t, q, tau, qd, qdd, mass_kg=-1.0)
    with pytest.raises(TypeError, match="mass_kg"):
        fit.weigh(t, q, tau, qd, qdd, mass_kg="2 kg")


def test_changed_friction_is_learnt_and_the_rest_is_unchanged(arm):
    t, q, qd, qdd = motion(4, 34)
    still = [0, 2]
    q[:, still], qd[:, still], qdd[:, still] = 0.2, 0.0, 0.0
    friction = np.stack([f.torque_nm(qd[:, j]) for j, f in enumerate(arm.friction)], axis=1)
    tau = arm.rnea(q, qd, qdd) + 1.15 * friction
    found = supple.learn(arm, t, q, tau, qd, moving=[1, 3])
    for joint, (new, old) in enumerate(zip(found.arm.friction, arm.friction, strict=True)):
        expected = 1.0 if joint in still else 1.15
        assert new.coulomb_nm == pytest.approx(expected * old.coulomb_nm, rel=0.02)
        assert new.viscous_nm_s_per_rad == pytest.approx(expected * old.viscous_nm_s_per_rad, rel=0.05)
    assert (found.after_nm[[1, 3]] < 0.5 * found.before_nm[[1, 3]]).all()
    assert found.payload_kg is None and found.payload_first_moment_kg_m is None
    np.testing.assert_allclose(found.arm.parameters, arm.parameters, atol=1e-9)


def test_a_payload_is_learnt_together_with_friction(arm):
    t, q, qd, qdd = motion(4, 35)
    tau = torques(arm, q, qd, qdd) + loaded(arm, BALL)(q, qd, qdd)
    found = supple.learn(arm, t, q, tau, qd, payload_kg=1.0)
    assert found.payload_kg == pytest.approx(BALL.mass_kg, rel=0.05)
    moment = BALL.mass_kg * np.asarray(BALL.com_m)
    np.testing.assert_allclose(found.payload_first_moment_kg_m, moment, atol=0.02)
    assert found.arm.parameters[-10] == pytest.approx(arm.parameters[-10] + found.payload_kg)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"slow_rad_per_s": 100.0}, "no joint moved faster than 100 rad/s"),
        ({"friction_change": 0.0}, "friction_change is 0, it must be finite and positive"),
        ({"moving": [3, 1]}, "moving: expected joint numbers below 4, increasing"),
    ],
)
def test_invalid_options_of_learn_are_reported(arm, options, message):
    t, q, qd, qdd = motion(4, 36, samples=600)
    with pytest.raises(ValueError, match=message):
        supple.learn(arm, t, q, torques(arm, q, qd, qdd), qd, **options)


def test_ripple_is_identified_and_saved(arm, tmp_path):
    """On wam3, one motor a joint: 5 Nmm of the third harmonic at the second motor."""
    small = supple.Arm.load("wam3")
    t, q, qd, qdd = motion(3, 37)
    fit = supple.identify(
        small, t, q, torques(small, q, qd, qdd), qd, qdd, friction="coulomb", prior_weight=1e-2
    )
    t = np.arange(0.0, 60.0, 0.005)
    w = 2.0 * np.pi / 60.0 * np.array([1.0, 2.0, 3.0])
    amplitude = 0.1 / w
    q, qd, qdd = (
        amplitude * np.sin(w * t[:, None]),
        amplitude * w * np.cos(w * t[:, None]),
        -amplitude * w**2 * np.sin(w * t[:, None]),
    )
    tau = torques(small, q, qd, qdd)
    with pytest.raises(ValueError, match="ripple: expected 3 motors"):
        fit.save(tmp_path / "wrong", ripple=((),))
    assert all(len(lines) == 0 for lines in fit.ripple(t, q, tau))
    table = (((2, 4e-3, -3e-3),), (), ())
    path = fit.save(tmp_path / "rippled", ripple=table)
    assert "sine_nm" in path.read_text()
    assert supple.Arm.load(path).friction == fit.arm.friction
