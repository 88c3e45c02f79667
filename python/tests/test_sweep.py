"""Sweeps without executor, on threads, processes and a Dask cluster give the same, distinct results."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest
import supple
import tasks
from supple._spec import Spec, SpecError

TASKS = 40


@pytest.fixture(scope="module")
def reference():
    return supple.sweep(tasks.draw, [1.0] * TASKS, seed=5)


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0", memory_limit=0
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client.get_executor()


@pytest.fixture(scope="module")
def processes():
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=context) as executor:
        yield executor


def test_every_task_has_its_own_seed(reference):
    assert len(reference) == len(set(reference.seeds)) == len(set(reference)) == TASKS
    assert reference.parameters == (1.0,) * TASKS
    assert all(0 <= seed < 2**63 for seed in reference.seeds)
    for i in (0, 7, TASKS - 1):
        assert reference[i] == tasks.draw(reference.parameters[i], reference.seeds[i])


def test_results_depend_on_the_seed_of_the_sweep(reference):
    assert supple.sweep(tasks.draw, [1.0] * TASKS, seed=5) == reference
    other = supple.sweep(tasks.draw, [1.0] * TASKS, seed=6)
    assert not set(other) & set(reference)


def test_threads(reference):
    with ThreadPoolExecutor(3) as executor:
        assert supple.sweep(tasks.draw, [1.0] * TASKS, seed=5, executor=executor) == reference


def test_processes(processes, reference):
    assert supple.sweep(tasks.draw, [1.0] * TASKS, seed=5, executor=processes) == reference
    where = supple.sweep(tasks.process, range(8), seed=0, executor=processes)
    assert os.getpid() not in where


def test_dask_does_not_merge_identical_calls(cluster, reference):
    swept = supple.sweep(tasks.draw, [1.0] * TASKS, seed=5, executor=cluster)
    assert swept == reference
    assert len(set(swept)) == TASKS
    assert os.getpid() not in supple.sweep(tasks.process, range(8), seed=0, executor=cluster)


def test_arms_can_be_sent_to_the_cluster(cluster):
    arm = supple.Arm.load("wam7")
    swept = supple.sweep(tasks.gravity_of_random_pose, [arm] * 10, seed=2, executor=cluster)
    here = supple.sweep(tasks.gravity_of_random_pose, [arm] * 10, seed=2)
    np.testing.assert_array_equal(np.stack(list(swept)), np.stack(list(here)))
    assert len(np.unique(np.stack(list(swept)), axis=0)) == 10


def test_experiments_on_processes(processes):
    errors = supple.sweep(tasks.tracking_error, [0.0, 0.3], seed=1, executor=processes)
    assert errors[0] < errors[1]


def test_progress_counts_every_task():
    seen = []
    supple.sweep(tasks.draw, [1.0] * 3, seed=0, progress=lambda *done: seen.append(done))
    assert seen == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize("workers", [0, 2])
def test_exceptions_of_a_task_are_raised(workers):
    if workers == 0:
        with pytest.raises(RuntimeError, match="three"):
            supple.sweep(tasks.fail_at_three, range(5), seed=0)
        return
    with ThreadPoolExecutor(workers) as executor, pytest.raises(RuntimeError, match="three"):
        supple.sweep(tasks.fail_at_three, range(5), seed=0, executor=executor)


def test_stored_results_are_read_again_and_failed_tasks_run_again(tmp_path):
    pytest.importorskip("pyarrow")
    folder, flag = tmp_path / "results", tmp_path / "mended"
    parameters = [{"fails": i == 3, "flag": str(flag), "i": i} for i in range(6)]
    first = supple.sweep(tasks.fails_until_mended, parameters, seed=0, results=folder)
    assert [result["number"] for result in first] == [0, 1, 2, 4, 5]
    (failed,) = first.failures
    assert failed.parameter == parameters[3] and failed.error == "RuntimeError: not mended"
    assert repr(first) == "<Sweep of 5 results, 1 failed>"
    flag.touch()
    seen = []
    again = supple.sweep(
        tasks.fails_until_mended, parameters, seed=0, results=folder, progress=lambda *done: seen.append(done)
    )
    # One task was left to do.
    assert seen == [(6, 6)] and again.failures == ()
    assert [result["number"] for result in again] == list(range(6)) and again[:3] == first[:3]
    whole = supple.sweep(tasks.fails_until_mended, parameters, seed=0)
    assert list(again) == list(whole) and again.seeds == whole.seeds
    with pytest.raises(ValueError, match="results: .*give another folder"):
        supple.sweep(tasks.draw, parameters, seed=0, results=folder)
    with pytest.raises(ValueError, match="results: .*seed .*expected.*give another folder"):
        supple.sweep(tasks.fails_until_mended, [{**row, "i": -1} for row in parameters], seed=0, results=folder)


def test_an_interrupted_sweep_keeps_what_is_finished(tmp_path):
    pytest.importorskip("pyarrow")

    def interrupt(done, _total):
        if done == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as raised:
        supple.sweep(tasks.draw, [1.0] * 9, seed=5, results=tmp_path, progress=interrupt)
    assert len(raised.value.sweep) == 4
    seen = []
    swept = supple.sweep(tasks.draw, [1.0] * 9, seed=5, results=tmp_path, progress=lambda *done: seen.append(done))
    assert seen == [(done, 9) for done in range(5, 10)]
    assert swept == supple.sweep(tasks.draw, [1.0] * 9, seed=5)


def test_experiments_on_a_cluster_survive_a_killed_worker(tmp_path):
    """300 short experiments on two workers, one of which is killed: none is lost, each has the result of its seed."""
    distributed = pytest.importorskip("distributed")
    pytest.importorskip("pyarrow")
    spec = tmp_path / "spec.toml"
    spec.write_text(
        "seed = 7\nrepetitions = 100\n[fixed]\nduration_s = 0.05\nfriction_error = 0.03\n"
        "[varied]\nstiffness_n_per_m = [5.0, 25.0, 125.0]\n"
    )
    spec = Spec.read(spec)
    killed = []
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0", memory_limit=0
        ) as cluster,
        distributed.Client(cluster) as client,
    ):

        def kill_one(done, _total):
            if done >= 50 and not killed:
                killed.append(next(iter(client.run(os.getpid).values())))
                os.kill(killed[0], signal.SIGKILL)

        swept = supple.sweep(
            spec.run,
            spec.tasks(),
            seed=spec.seed,
            executor=client.get_executor(),
            progress=kill_one,
            results=tmp_path / "results",
        )
    assert len(killed) == 1
    assert swept.failures == () and len(swept) == len(set(swept.seeds)) == 300
    for i in (0, 137, 299):
        assert swept[i] == spec.run(swept.parameters[i], swept.seeds[i])
    # All of them are in the folder: nothing is left to do.
    seen = []
    again = supple.sweep(
        spec.run, spec.tasks(), seed=spec.seed, results=tmp_path / "results", progress=lambda *done: seen.append(done)
    )
    assert again == swept and seen == []


def test_the_command_runs_a_spec(tmp_path):
    pytest.importorskip("distributed")
    pytest.importorskip("pyarrow")
    (tmp_path / "spec.toml").write_text("repetitions = 3\n[fixed]\nduration_s = 0.05\n")
    command = [sys.executable, "-m", "supple", "sweep", "spec.toml", "--workers", "1", "--json"]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    assert json.loads(ran.stdout) == {"finished": 3, "failed": 0, "results": "out/sweep", "failures": []}
    assert "3 of 3 tasks" in ran.stderr
    (tmp_path / "spec.toml").write_text("repetition = 3\n")
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ran.returncode == 2 and "spec.toml: repetition: unknown key" in ran.stderr


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("seed = 'a'", "seed: expected int"),
        ("experiment = 'dance'", "experiment: expected one of"),
        ("[fixed]\nseed = 3", "seed: expected once"),
        ("[varied]\nspeed = 1.0", r"\[varied\] speed: expected a list"),
        ("[fixed]\nspeed = 1.0\n[varied]\nspeed = [1.0]", "speed: expected once"),
        ("repetitions = 0", "repetitions: expected"),
        ("a b", "spec.toml"),
    ],
)
def test_a_wrong_spec_is_named(tmp_path, text, named):
    file = tmp_path / "spec.toml"
    file.write_text(text)
    with pytest.raises(SpecError, match=named):
        Spec.read(file)


def test_invalid_arguments_are_rejected():
    with pytest.raises(ValueError, match="seed: expected zero or more, got -1"):
        supple.sweep(tasks.draw, [1.0], seed=-1)
    with pytest.raises(TypeError, match="function: expected a callable, got 3"):
        supple.sweep(3, [1.0], seed=0)
    assert len(supple.sweep(tasks.draw, [], seed=0)) == 0
