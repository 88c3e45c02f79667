"""Repeated calls of one function with different seeds, on any executor."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Generic, TypeVar, overload

import numpy as np

P = TypeVar("P")
R = TypeVar("R")

__all__ = ["Sweep", "sweep"]


@dataclass(frozen=True)
class Sweep(Sequence[R], Generic[P, R]):
    """Results of :func:`sweep`, in the order of the parameters.

    A sequence of the results; ``parameters`` and ``seeds`` hold the inputs of each.
    """

    parameters: tuple[P, ...]
    """Parameter of each task."""
    seeds: tuple[int, ...]
    """Seed of each task, all distinct: ``function(parameters[i], seeds[i])`` gives ``results[i]``."""
    results: tuple[R, ...]
    """Result of each task."""

    @overload
    def __getitem__(self, index: int) -> R: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[R, ...]: ...
    def __getitem__(self, index: int | slice) -> R | tuple[R, ...]:
        return self.results[index]

    def __len__(self) -> int:
        return len(self.results)

    def __iter__(self) -> Iterator[R]:
        return iter(self.results)


def sweep(
    function: Callable[[P, int], R],
    parameters: Iterable[P],
    *,
    seed: int,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Sweep[P, R]:
    """Call ``function(parameter, seed)`` for every parameter, with a seed spawned for each.

    Seeds are 63-bit numbers from ``numpy.random.SeedSequence(seed).spawn``: they differ between tasks,
    so that an executor which merges identical calls (such as Dask) runs every one. The same sweep gives
    the same results on any executor.

    Parameters
    ----------
    function : callable
        Called as ``function(parameter, seed)``. For a process pool or a cluster it must be importable.
    parameters : iterable
        One task each. ``range(100)`` is a Monte-Carlo run of 100.
    seed : int
        Seed of the sweep, zero or more.
    executor : concurrent.futures.Executor, optional
        Executor of the tasks, such as ``distributed.Client.get_executor()``. Default: run in this
        thread, in order.
    progress : callable, optional
        Called as ``progress(done, total)`` after each task.

    Returns
    -------
    Sweep
        Results in the order of ``parameters``.

    Raises
    ------
    TypeError
        If ``function`` is not callable.
    ValueError
        If the seed is negative.
    Exception
        The first exception of a task; tasks that have not started are cancelled.

    Examples
    --------
    >>> import numpy as np, supple
    >>> def sample(scale, seed):
    ...     return scale * np.random.default_rng(seed).normal()
    >>> draws = supple.sweep(sample, [1.0] * 20, seed=7)
    >>> len(set(draws))
    20
    """
    if not callable(function):
        raise TypeError(f"function: expected a callable, got {type(function).__name__}")
    if seed < 0:
        raise ValueError(f"seed: expected zero or more, got {seed}")
    given = tuple(parameters)
    seeds = tuple(
        int(child.generate_state(1, np.uint64)[0] >> np.uint64(1))
        for child in np.random.SeedSequence(seed).spawn(len(given))
    )
    results: list[R] = []
    if executor is None:
        for parameter, task_seed in zip(given, seeds, strict=True):
            results.append(function(parameter, task_seed))
            if progress is not None:
                progress(len(results), len(given))
        return Sweep(given, seeds, tuple(results))
    futures: list[Future[R]] = [
        executor.submit(function, parameter, task_seed)
        for parameter, task_seed in zip(given, seeds, strict=True)
    ]
    try:
        for future in futures:
            results.append(future.result())
            if progress is not None:
                progress(len(results), len(given))
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    return Sweep(given, seeds, tuple(results))
