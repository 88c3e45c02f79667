"""Results as data frames, tables, figures and progress bars."""

from __future__ import annotations

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


def test_tables_for_notebooks(run):
    html = run._repr_html_()
    assert "<table>" in html and "mm RMS" in html and f"{len(run.t)} x 3" in html
    payload = supple.Payload.ball(0.5, 0.03, [0.0, 0.0, 0.1])
    assert "0.500 kg" in repr(payload)


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
