"""Sweeps without executor, on threads, processes and a Dask cluster give the same, distinct results."""

from __future__ import annotations

import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest
import supple
import tasks

TASKS = 40


@pytest.fixture(scope="module")
def reference():
    return supple.sweep(tasks.draw, [1.0] * TASKS, seed=5)


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, memory_limit=0
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


def test_invalid_arguments_are_rejected():
    with pytest.raises(ValueError, match="seed: expected zero or more, got -1"):
        supple.sweep(tasks.draw, [1.0], seed=-1)
    with pytest.raises(TypeError, match="function: expected a callable, got int"):
        supple.sweep(3, [1.0], seed=0)
    assert len(supple.sweep(tasks.draw, [], seed=0)) == 0
