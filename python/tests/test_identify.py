"""Identification from Python: recovery, constrained optimum, held joints, invalid logs, results."""

from __future__ import annotations

import re

import numpy as np
import pytest
import supple

BAND_RAD_PER_S = 0.01


def motion(dof, seed, samples=2000, period_s=0.02):
    """Sums of sinusoids with their exact derivatives: t, q, qd, qdd."""
    rng = np.random.default_rng(seed)
    t = np.arange(samples) * period_s
    w = 2.0 * np.pi * rng.uniform(0.05, 0.5, size=(5, 1, dof))
    a = rng.uniform(0.1, 0.5, size=(5, 1, dof))
    angle = w * t[:, None] + rng.uniform(0.0, 6.0, size=(5, 1, dof))
    q = (a * np.sin(angle)).sum(axis=0)
    qd = (a * w * np.cos(angle)).sum(axis=0)
    qdd = (-a * w**2 * np.sin(angle)).sum(axis=0)
    return t, q, qd, qdd


def torques(arm, q, qd, qdd):
    friction = [f.torque_nm(qd[:, j]) for j, f in enumerate(arm.friction)]
    return arm.rnea(q, qd, qdd) + np.stack(friction, axis=1)


@pytest.fixture(scope="module")
def arm():
    return supple.Arm.load("wam4")


@pytest.fixture(scope="module")
def noisy(arm):
    """A fit to torques with noise of 0.05 N m."""
    t, q, qd, qdd = motion(4, 1)
    noise = np.random.default_rng(2).normal(scale=0.05, size=q.shape)
    return supple.identify(arm, t, q, torques(arm, q, qd, qdd) + noise, qd, qdd, friction="coulomb")


@pytest.mark.parametrize("method", ["ols", "wls", "irls", "consistent"])
def test_noise_free_torques_are_recovered(arm, method):
    t, q, qd, qdd = motion(4, 3)
    tau = torques(arm, q, qd, qdd)
    weak = {"prior_weight": 1e-6} if method == "consistent" else {}
    fit = supple.identify(arm, t, q, tau, qd, qdd, method=method, friction="coulomb", **weak)
    _, q, qd, qdd = motion(4, 4)
    bound = 1e-3 if method == "consistent" else 1e-8
    np.testing.assert_allclose(fit.predict(q, qd, qdd), torques(arm, q, qd, qdd), atol=bound)
    for found, true in zip(fit.friction, arm.friction, strict=True):
        assert found.coulomb_nm == pytest.approx(true.coulomb_nm, abs=bound)
        assert found.viscous_nm_s_per_rad == pytest.approx(true.viscous_nm_s_per_rad, abs=bound)


def test_the_report_is_complete(arm, noisy):
    assert noisy.rank == len(noisy.base_parameters) == len(noisy.base_names) == len(noisy.std)
    assert noisy.rank + len(noisy.null_space) == len(noisy.columns) == 10 * 4 + 3 * 4
    assert (noisy.std > 0.0).all() and noisy.condition > 1.0
    np.testing.assert_allclose(noisy.noise_nm, 0.05, rtol=0.1)
    assert noisy.moving == (0, 1, 2, 3)
    assert noisy.choices and all("held-out" in table for _, table in noisy.choices)
    assert "rank" in str(noisy) and noisy.arm_given == arm


def test_the_identified_arm_equals_the_fit(noisy):
    found = noisy.arm
    x = np.array(list(noisy.columns.values()))
    np.testing.assert_allclose(found.parameters, x[:40], atol=1e-9)
    _, q, qd, qdd = motion(4, 5, samples=50)
    np.testing.assert_allclose(torques(found, q, qd, qdd), noisy.predict(q, qd, qdd), atol=1e-7)


def test_standard_deviations_match_repeated_fits(arm):
    """Spread of the base parameters over repeated noise. The independent columns may change with the
    noise: those that are always independent are compared."""
    t, q, qd, qdd = motion(4, 6, samples=600)
    tau = torques(arm, q, qd, qdd)
    found = []
    for seed in range(60):
        noise = np.random.default_rng(seed).normal(scale=0.05, size=q.shape)
        fit = supple.identify(arm, t, q, tau + noise, qd, qdd, method="ols", friction="coulomb")
        values = zip(fit.base_parameters, fit.std, strict=True)
        found.append(dict(zip(fit.base_names, values, strict=True)))
    names = set.intersection(*(set(one) for one in found))
    assert len(names) >= 12
    values, stds = np.array([[one[name] for name in sorted(names)] for one in found]).transpose(2, 0, 1)
    ratio = values.std(axis=0, ddof=1) / stds.mean(axis=0)
    assert np.median(ratio) == pytest.approx(1.0, abs=0.15)
    assert (ratio > 0.6).all() and (ratio < 1.5).all()


def test_the_constrained_fit_matches_the_optimum_of_clarabel():
    cvxpy = pytest.importorskip("cvxpy")
    arm = supple.Arm.load("wam3")
    t, q, qd, qdd = motion(3, 7, samples=400)
    rng = np.random.default_rng(8)
    noise_nm = np.array([0.3, 0.2, 0.1])
    tau = torques(arm, q, qd, qdd) + noise_nm * rng.normal(size=q.shape)
    prior_weight = 0.5
    fit = supple.identify(
        arm,
        t,
        q,
        tau,
        qd,
        qdd,
        friction="coulomb",
        prior_weight=prior_weight,
        joint_noise_nm=noise_nm,
    )
    dry = supple.Friction(coulomb_nm=1.0, band_rad_per_s=BAND_RAD_PER_S)
    rows = []
    for j in range(3):
        own = np.zeros((len(t), 9))
        own[:, 3 * j : 3 * j + 3] = np.stack([qdd[:, j], qd[:, j], dry.torque_nm(qd[:, j])], axis=1)
        rows.append(np.hstack([arm.regressor(q, qd, qdd)[:, j], own]) / noise_nm[j])
    a = np.concatenate(rows)
    b = np.concatenate([tau[:, j] / noise_nm[j] for j in range(3)])
    triangle = np.linalg.qr(np.column_stack([a, b]), mode="r")
    a, b = triangle[:, :-1], triangle[:, -1]

    def pseudo_inertia(p, stack):
        m, hx, hy, hz, xx, xy, yy, xz, yz, zz = (p[i] for i in range(10))
        half = (xx + yy + zz) / 2
        return stack(
            [
                [half - xx, -xy, -xz, hx],
                [-xy, half - yy, -yz, hy],
                [-xz, -yz, half - zz, hz],
                [hx, hy, hz, m],
            ]
        )

    def cost(x, bodies, trace, log_det, squares):
        value = 0.5 * squares(a @ x - b)
        for body, prior in zip(bodies, arm.parameters.reshape(3, 10), strict=True):
            inverse = np.linalg.inv(pseudo_inertia(prior, np.array))
            value += prior_weight * (trace(inverse @ body) - log_det(body))
        return value

    x = cvxpy.Variable(39)
    bodies = [cvxpy.Variable((4, 4), PSD=True) for _ in range(3)]
    constraints = [x[30:] >= 0]
    constraints += [
        body == pseudo_inertia(x[10 * k : 10 * k + 10], cvxpy.bmat)
        for k, body in enumerate(bodies)
    ]
    objective = cost(x, bodies, cvxpy.trace, cvxpy.log_det, cvxpy.sum_squares)
    problem = cvxpy.Problem(cvxpy.Minimize(objective), constraints)
    problem.solve(solver=cvxpy.CLARABEL)
    assert problem.status == "optimal"

    ours = np.array(list(fit.columns.values()))
    found = [pseudo_inertia(p, np.array) for p in ours[:30].reshape(3, 10)]
    value = cost(ours, found, np.trace, lambda m: np.linalg.slogdet(m)[1], lambda r: r @ r)
    assert value == pytest.approx(problem.value, rel=1e-6)
    assert (ours[30:] >= 0.0).all()
    assert all(np.linalg.eigvalsh(body).min() > 0.0 for body in found)
    np.testing.assert_allclose(a @ ours, a @ x.value, atol=1e-3 * np.abs(b).max())


def test_held_joints_keep_their_nominal_friction(arm):
    t, q, qd, qdd = motion(4, 9)
    for joint, held_at in ((0, 0.2), (2, -0.3)):
        q[:, joint], qd[:, joint], qdd[:, joint] = held_at, 0.0, 0.0
    tau = arm.rnea(q, qd, qdd)
    for joint in (1, 3):
        tau[:, joint] += arm.friction[joint].torque_nm(qd[:, joint])
    fit = supple.identify(
        arm, t, q, tau, qd, qdd, moving=[1, 3], method="ols", friction="coulomb"
    )
    assert fit.moving == (1, 3)
    assert fit.friction[0] == arm.friction[0] and fit.friction[2] == arm.friction[2]
    np.testing.assert_allclose(fit.predict(q, qd, qdd)[:, [1, 3]], tau[:, [1, 3]], atol=1e-8)
    validation = fit.validate(t, q, tau, qd, qdd)
    np.testing.assert_array_equal(np.isnan(validation.rms), [True, False, True, False])
    assert validation.total_relative < 1e-9


def test_a_coupled_motor_is_identified(arm):
    t, q, qd, qdd = motion(4, 10)
    tau = torques(arm, q, qd, qdd)
    both = 0.07 * (qdd[:, 2] + qdd[:, 3]) + 0.4 * (qd[:, 2] + qd[:, 3])
    tau[:, 2] += both
    tau[:, 3] += both
    fit = supple.identify(
        arm, t, q, tau, qd, qdd, coupling=(2, 3), method="ols", friction="coulomb"
    )
    assert fit.columns["Ir2+3"] == pytest.approx(0.07, abs=1e-8)
    assert fit.columns["V2+3"] == pytest.approx(0.4, abs=1e-8)


def test_several_logs_are_one_fit(arm):
    logs = [motion(4, seed, samples=500) for seed in (11, 12)]
    tau = [torques(arm, q, qd, qdd) for _, q, qd, qdd in logs]
    t, q, qd, qdd = (list(columns) for columns in zip(*logs, strict=True))
    fit = supple.identify(arm, t, q, tau, qd, qdd, method="ols", friction="coulomb")
    for k in range(2):
        np.testing.assert_allclose(fit.predict(q[k], qd[k], qdd[k]), tau[k], atol=1e-8)
    with pytest.raises(ValueError, match="tau: expected 2 logs, as many as t, got 1"):
        supple.identify(arm, t, q, tau[:1], qd, qdd)


def test_differentiation_and_filter(arm):
    """Angles alone, with encoder noise: velocities and accelerations come out of the filter."""
    t, q, qd, qdd = motion(4, 13, samples=10_000, period_s=0.004)
    rng = np.random.default_rng(14)
    tau = torques(arm, q, qd, qdd) + rng.normal(scale=0.1, size=q.shape)
    measured = q + rng.normal(scale=1e-5, size=q.shape)
    fit = supple.identify(arm, t, measured, tau, cutoff_hz=8.0, keep_every=5, friction="coulomb")
    t, q, qd, qdd = motion(4, 15, samples=10_000, period_s=0.004)
    validation = fit.validate(t, q, torques(arm, q, qd, qdd))
    assert validation.total_relative < 0.03
    assert validation.positive_definite == 1.0
    assert validation.verdict.startswith("good")
    assert validation.rms.shape == validation.relative.shape == (4,)


def test_a_saved_fit_is_loaded_unchanged(noisy, tmp_path):
    path = noisy.save(tmp_path / "identified")
    loaded = supple.Arm.load(path)
    assert loaded == noisy.arm
    assert sorted(p.name for p in path.parent.iterdir()) == ["arm.toml", "arm.urdf"]
    for found, true in zip(loaded.friction, noisy.friction, strict=True):
        assert found.coulomb_nm == pytest.approx(true.coulomb_nm, rel=1e-9)


def test_the_figure_has_one_axis_per_joint(noisy, tmp_path):
    pytest.importorskip("matplotlib")
    figure = noisy.plot()
    assert len(figure.axes) == 4
    measured, predicted, residual = (line.get_ydata() for line in figure.axes[0].lines)
    np.testing.assert_allclose(measured - predicted, residual, atol=1e-12)
    assert np.sqrt(np.mean(residual**2)) == pytest.approx(noisy.noise_nm[0], rel=0.05)
    figure.savefig(tmp_path / "fit.png")
    with pytest.raises(IndexError):
        noisy.plot(1)


@pytest.mark.parametrize("rotor", [False, True])
@pytest.mark.parametrize("name", supple.assets())
def test_base_parameters_match_the_regressor(name, rotor):
    arm = supple.Arm.load(name)
    base = supple.base_parameters(arm, rotor=rotor)
    q, qd, qdd = np.random.default_rng(1).normal(scale=1.5, size=(3, 400, arm.dof))
    stacked = arm.regressor(q, qd, qdd)
    x = arm.parameters
    if rotor:
        stacked = np.concatenate([stacked, qdd[..., None] * np.eye(arm.dof)], axis=2)
        x = np.concatenate([x, arm.armature])
    stacked = stacked.reshape(-1, stacked.shape[-1])
    lengths = np.linalg.norm(stacked, axis=0)
    scaled = stacked / np.where(lengths > 1e-9 * lengths.max(), lengths, 1.0)
    assert base.rank == np.linalg.matrix_rank(scaled, tol=1e-7 * np.linalg.norm(scaled, 2))
    expected = x[base.independent] + base.combination @ x[base.dependent]
    np.testing.assert_allclose(base.values, expected, atol=1e-9)
    np.testing.assert_allclose(stacked[:, base.independent] @ base.values, stacked @ x, atol=1e-7)
    assert len(base.null_space) == len(base.dependent)
    assert base.rank + len(base.dependent) == len(base.columns)


def broken(name, change):
    """Log columns with one of them changed."""
    t, q, qd, qdd = motion(4, 16, samples=600)
    columns = {"t": t, "q": q, "tau": 10.0 * np.sin(q), "qd": qd}
    columns[name] = change(columns[name].copy())
    return columns


def put(index, value):
    def change(column):
        column[index] = value
        return column

    return change


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("q", put((40, 2), np.nan), r"q\[2\]: NaN at sample 40; remove these rows"),
        ("tau", put((7, 1), np.inf), r"tau\[1\]: inf at sample 7"),
        ("t", put(30, -1.0), r"t: goes from .* at sample 29; sort the rows"),
        ("t", lambda t: np.where(np.arange(600) > 300, t + 2.0, t), r"t: a gap of 2.\d* s after"),
        ("t", lambda t: t[:-1], r"q: expected shape \(599, 4\), a row for each of t, got \(600, 4\)"),
        ("q", lambda q: q[:, :3], r"q: expected shape \(600, 4\), .*got \(600, 3\)"),
        ("q", lambda q: np.degrees(q), r"q: .*in degrees; give radians: multiply q by pi / 180"),
        ("q", put((slice(None), 3), 0.4), r"q\[3\]: moves by .*not excited; leave it out"),
        ("qd", lambda qd: np.degrees(qd), r"qd: is 57\.\d* times the slope .*give rad/s: multiply qd"),
        ("tau", put((slice(None), 0), 2.0), r"tau\[0\]: is 2 throughout; check"),
    ],
)
def test_unusable_columns_are_reported(arm, name, change, message):
    with pytest.raises(ValueError, match=message):
        supple.identify(arm, **broken(name, change))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "lasso"}, "method: expected one of ols, wls, irls, consistent, got \"lasso\""),
        ({"friction": "sticky"}, "friction: expected one of auto, none, .*, got 'sticky'"),
        ({"moving": [1, 9]}, r"moving: expected joint numbers below 4, .*got \[1, 9\]"),
        ({"coupling": (0, 0)}, r"coupling: expected two of the moving joints .*got \(0, 0\)"),
        ({"coupling": (0, 1, 2)}, r"coupling: expected a pair of joints"),
        ({"cutoff_hz": 40.0}, "cutoff_hz is 40, it must be below half the sampling rate"),
        ({"keep_every": 0}, "keep_every is 0, it must be 1 or more"),
        ({"prior_weight": -1.0}, "prior_weight is -1, it must be finite and positive"),
        ({"joint_noise_nm": [0.1, 0.1]}, "weights: expected 4 values"),
    ],
)
def test_options_out_of_range_are_reported(arm, options, message):
    t, q, qd, qdd = motion(4, 17, samples=600)
    with pytest.raises(ValueError, match=message):
        supple.identify(arm, t, q, torques(arm, q, qd, qdd), qd, **options)


def test_accelerations_need_velocities(arm):
    t, q, _, qdd = motion(4, 18, samples=100)
    with pytest.raises(ValueError, match="qd: expected velocities together with the accelerations"):
        supple.identify(arm, t, q, q, qdd=qdd)


def test_doubtful_data_give_warnings(arm):
    t, q, qd, qdd = motion(4, 19, samples=200)
    with pytest.warns(supple.DataWarning, match=re.escape("t: the log lasts 3.980 s; record")):
        fit = supple.identify(
            arm, t, q, torques(arm, q, qd, qdd), qd, qdd, method="ols", friction="coulomb"
        )
    assert any("lasts" in warning for warning in fit.warnings)


def test_springs_are_found_with_effects():
    arm = supple.Arm.load("wam4")
    t, q, qd, qdd = motion(4, 3)
    log = (t, q, arm.rnea(q, qd, qdd) + 0.1 * q, qd, qdd)
    options = {"friction": "none", "torque_delay_s": 0.0, "prior_weight": 1e-2}
    plain = supple.identify(arm, *log, **options)
    found = supple.identify(arm, *log, effects="auto", **options)
    assert found.choices[0][0] == "effects"
    assert found.training_relative < 0.5 * plain.training_relative
    with pytest.raises(ValueError, match="effects: expected auto or none, got 'all'"):
        supple.identify(arm, *log, effects="all", **options)
