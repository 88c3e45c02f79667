"""Progress of long calls, in a terminal."""

import sys
import threading

import pytest
import supple
from supple import _progress

ARM = supple.Arm.load("wam3")


class Terminal:
    """What was written to the terminal."""

    def __init__(self, capsys):
        self._capsys = capsys
        self._text = ""

    def getvalue(self):
        self._text += self._capsys.readouterr().err
        return self._text


@pytest.fixture
def terminal(monkeypatch, capsys):
    """A terminal, in which every call counts as a long one."""
    pytest.importorskip("tqdm")
    monkeypatch.setattr(_progress, "_in_terminal", lambda: True)
    monkeypatch.setattr(_progress, "_DELAY_S", 0.0)
    monkeypatch.delenv("TQDM_DISABLE", raising=False)
    return Terminal(capsys)


def add(parameter, seed):
    return parameter + 1


def simulated(parameter, seed):
    return supple.simulate(ARM, duration_s=0.05, seed=seed).rms_error_m


def excitation(progress=None):
    return supple.design_excitation(ARM, candidates=60, period_s=5.0, periods=1, progress=progress)


def identified(motion, progress=None):
    return supple.identify(
        ARM, motion.t, motion.q, ARM.rnea(motion.q, motion.qd, motion.qdd), motion.qd, motion.qdd,
        method="ols", friction="none", progress=progress,
    )  # fmt: skip


def test_a_sweep_counts_its_tasks(terminal):
    assert tuple(supple.sweep(add, range(7), seed=0)) == (1, 2, 3, 4, 5, 6, 7)
    assert "sweep: 100%" in terminal.getvalue() and "7/7" in terminal.getvalue()


def test_a_resumed_sweep_counts_what_it_has(terminal, tmp_path):
    pytest.importorskip("pyarrow")
    supple.sweep(add, range(3), seed=0, results=tmp_path, progress=False)
    assert terminal.getvalue() == ""
    supple.sweep(add, range(4), seed=0, results=tmp_path)
    assert "4/4" in terminal.getvalue()


def test_a_design_counts_its_candidates(terminal):
    excitation()
    assert "design: 100%" in terminal.getvalue() and "60/60" in terminal.getvalue()


def test_calls_of_unknown_length_show_the_elapsed_time(terminal):
    motion = excitation(progress=False)
    for name, call in (
        ("sinusoid", lambda: supple.simulate(ARM, duration_s=0.05)),
        ("excitation", lambda: supple.excite(ARM, motion)),
        ("identification", lambda: identified(motion)),
    ):
        call()
        assert f"{name}: 00:00" in terminal.getvalue()


def test_the_elapsed_time_goes_on(terminal, monkeypatch):
    monkeypatch.setattr(_progress, "_INTERVAL_S", 0.001)
    updates = []
    enough = threading.Event()

    class Bar:
        def __init__(self, **options):
            pass

        def update(self):
            updates.append(1)
            if len(updates) == 3:
                enough.set()

        def close(self):
            pass

    monkeypatch.setattr(_progress, "_tqdm", lambda: Bar)
    with _progress.elapsed("anything", None):
        assert enough.wait(60.0)
    after = len(updates)
    assert not any(thread.name == "supple-progress" for thread in threading.enumerate()) and len(updates) == after


def test_only_the_outermost_call_shows_progress(terminal):
    supple.sweep(simulated, range(2), seed=0)
    assert "sweep" in terminal.getvalue() and "sinusoid" not in terminal.getvalue()


def test_a_sweep_without_progress_silences_its_tasks(terminal):
    seen = []
    supple.sweep(simulated, [1], seed=0, progress=False)
    supple.sweep(simulated, [1], seed=0, progress=lambda *done: seen.append(done))
    assert (terminal.getvalue(), seen) == ("", [(1, 1)])
    supple.simulate(ARM, duration_s=0.05)
    assert "sinusoid" in terminal.getvalue(), "later calls show it again"


def test_false_shows_none(terminal):
    motion = excitation(progress=False)
    supple.simulate(ARM, duration_s=0.05, progress=False)
    supple.excite(ARM, motion, progress=False)
    identified(motion, progress=False)
    assert terminal.getvalue() == ""


def test_other_threads_show_none(terminal):
    thread = threading.Thread(target=lambda: supple.simulate(ARM, duration_s=0.05))
    thread.start()
    thread.join()
    assert terminal.getvalue() == ""


def test_tqdm_can_be_switched_off(terminal, monkeypatch):
    monkeypatch.setenv("TQDM_DISABLE", "1")
    supple.sweep(add, range(3), seed=0, progress=True)
    supple.sweep(add, range(3), seed=0)
    assert terminal.getvalue() == ""


def test_short_calls_show_none(terminal, monkeypatch):
    monkeypatch.setattr(_progress, "_DELAY_S", 1e6)
    supple.sweep(add, range(3), seed=0)
    supple.simulate(ARM, duration_s=0.05)
    assert terminal.getvalue() == ""


def test_without_a_terminal_there_is_none(monkeypatch, capsys):
    monkeypatch.setattr(_progress, "_DELAY_S", 0.0)
    supple.simulate(ARM, duration_s=0.05)
    supple.sweep(add, range(3), seed=0)
    assert capsys.readouterr().err == ""


def test_an_error_closes_the_bar(terminal):
    with pytest.raises(ZeroDivisionError):
        supple.sweep(lambda x, seed: 1 // x, [1, 0], seed=0)
    assert "1/2" in terminal.getvalue()
    supple.sweep(add, [1], seed=0)
    assert "1/1" in terminal.getvalue()


def test_without_tqdm_only_true_is_an_error(terminal, monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    supple.sweep(add, [1], seed=0)
    supple.simulate(ARM, duration_s=0.05)
    assert terminal.getvalue() == ""
    for call in (
        lambda: supple.sweep(add, [1], seed=0, progress=True),
        lambda: supple.simulate(ARM, duration_s=0.05, progress=True),
    ):
        with pytest.raises(ImportError, match="tqdm"):
            call()
