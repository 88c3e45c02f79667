"""Results as data frames, tables, figures and progress bars."""

from __future__ import annotations

from html import escape

import numpy as np
import pytest
import supple


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    arm = supple.Arm.load("wam3")
    return supple.simulate(arm, "sinusoid", duration_s=0.3, log_dir=tmp_path_factory.mktemp("log"))


def test_a_run_as_a_data_frame(run):
    frame = run.to_pandas()
    assert len(frame) == len(run.t) and frame.index.name == "t"
    np.testing.assert_array_equal(frame["q.1"], run.q[:, 1])
    np.testing.assert_array_equal(frame["tip_position_m.z"], run.tip_position_m[:, 2])


def test_a_log_as_a_data_set(run):
    log = supple.read_log(run.log)
    data = log.to_xarray()
    assert data["q"].dims == ("t", "joint") and data["tip_position_m"].dims == ("t", "axis")
    np.testing.assert_array_equal(data["torques.gravity"].sel(joint=2), log.torques["gravity"][:, 2])
    np.testing.assert_array_equal(data["tip_position_m"].sel(axis="x"), log.tip_position_m[:, 0])


def test_the_terms_of_a_torque_add_up(tmp_path):
    """On an arm with ripple and presliding; the curves of the figure add up, too."""
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import supple.plot

    toml = supple.Arm.load("wam3").toml
    ripple = "[[motors.ripple]]\nmotor = 0\nharmonic = 3\nsine_nm = 0.002\ncosine_nm = 0.001\n"
    assert "coulomb_nm = " in toml
    (tmp_path / "arm.urdf").write_text(supple.Arm.load("wam3").urdf)
    (tmp_path / "arm.toml").write_text(toml.replace("coulomb_nm = ", "presliding_rad = 0.002, coulomb_nm = ") + ripple)
    arm = supple.Arm.load(tmp_path)
    log = supple.read_log(supple.simulate(arm, "sinusoid", duration_s=0.3, log_dir=tmp_path / "log").log)
    free = (log.columns["torque_limited"] == 0) & (log.columns["rate_limited"] == 0)
    assert free.sum() > 200
    assert np.abs(log.torques["ripple"]).max() > 1e-3
    np.testing.assert_allclose(sum(log.torques.values())[free], log.tau[free], atol=1e-12)

    figure = supple.plot.torques(log)
    for joint, panel in enumerate(figure.axes):
        commanded, *curves = (line.get_ydata() for line in panel.lines)
        assert len(curves) == 5
        np.testing.assert_allclose(np.sum(curves, axis=0)[free], commanded[free], atol=1e-12)
        np.testing.assert_array_equal(commanded, log.tau[:, joint])
    plt.close("all")


def test_tables_for_notebooks(run):
    html = run._repr_html_()
    assert "<table>" in html and "mm RMS" in html and f"{len(run.t)} x 3" in html
    payload = supple.Payload.ball(0.5, 0.03, [0.0, 0.0, 0.1])
    assert "0.500 kg" in repr(payload)
    html = payload._repr_html_()
    assert "0.500 kg" in html and "<td>z</td><td>0.1000</td>" in html and "0.00018" in html


def test_an_arm_is_a_table_of_its_joints():
    arm = supple.Arm.load("wam4")
    html = arm._repr_html_()
    assert html.count("<tr>") == 1 + arm.dof and "wam4, 4 joints" in html
    for name, friction in zip(arm.joint_names, arm.friction, strict=True):
        assert f"<td>{name}</td>" in html and f"<td>{friction.coulomb_nm:.4g}</td>" in html


def test_a_fit_is_a_table_of_its_joints_and_base_parameters():
    arm = supple.Arm.load("wam3")
    motion = supple.design_excitation(arm, candidates=20, seed=0)
    data = supple.excite(arm, motion, seed=0)
    fit = supple.identify(arm, data.t, data.q, data.tau, torque_delay_s=data.torque_delay_s)
    html = fit._repr_html_()
    assert f"rank {fit.rank}" in html
    assert html.count("<tr>") == 2 + len(fit.moving) + fit.rank
    for warning in fit.warnings:
        assert escape(warning) in html
    # Names of combinations have signs that mean something in HTML.
    assert all(escape(name) in html for name in fit.base_names)


def square(parameter, seed):
    return {"square": parameter**2, "even": seed % 2 == 0}


def test_a_sweep_as_a_data_frame_with_progress(capsys):
    sweep = supple.sweep(square, [1.0, 2.0, 3.0], seed=1, progress=True)
    frame = sweep.to_pandas()
    assert list(frame.columns) == ["parameter", "seed", "square", "even"]
    assert frame["square"].tolist() == [1.0, 4.0, 9.0]
    assert repr(sweep) == "<Sweep of 3 results>" and "<td>2.0</td>" in sweep._repr_html_()
    assert capsys.readouterr().err == "", "a bar is for terminals"


def test_figures(run):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import supple.plot

    log = supple.read_log(run.log)
    drawn = [
        supple.plot.tracking(run),
        supple.plot.tracking(log),
        supple.plot.joints(run),
        supple.plot.torques(log),
        supple.plot.sweep(supple.sweep(lambda x, seed: x + seed % 3, [1.0, 1.0, 2.0], seed=0)),
    ]
    assert [len(figure.axes) for figure in drawn] == [2, 2, 3, 3, 1]
    with pytest.raises(ValueError, match="axes: expected 2"):
        supple.plot.tracking(run, drawn[0].axes[0])
    error_mm = drawn[0].axes[1].lines[0].get_ydata()
    assert 1e-3 * np.sqrt(np.mean(error_mm**2)) == pytest.approx(run.rms_error_m, rel=1e-6)
    plt.close("all")
