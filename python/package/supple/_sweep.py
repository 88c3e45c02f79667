"""Repeated calls of one function with different seeds, on any executor."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar, overload

import numpy as np

from supple._check import integer
from supple._frames import table
from supple._progress import bar

if TYPE_CHECKING:
    import pandas as pd

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

    def __repr__(self) -> str:
        return f"<Sweep of {len(self)} results>"

    def to_pandas(self) -> pd.DataFrame:
        """One row per task: ``parameter``, ``seed``, ``result``. Needs pandas.

        Parameters and results that are mappings become columns of their own.
        """
        import pandas as pd

        rows = []
        for parameter, seed, result in zip(self.parameters, self.seeds, self.results, strict=True):
            row: dict[str, object] = dict(parameter) if isinstance(parameter, Mapping) else {"parameter": parameter}
            row["seed"] = seed
            row |= dict(result) if isinstance(result, Mapping) else {"result": result}
            rows.append(row)
        return pd.DataFrame(rows)

    def _repr_html_(self) -> str:
        shown = 20
        rows: list[tuple[object, ...]] = [
            *zip(self.parameters[:shown], self.seeds[:shown], self.results[:shown], strict=True)
        ]
        if len(self) > shown:
            rows.append(("..", "", f"{len(self) - shown} more"))
        return table(repr(self), ("parameter", "seed", "result"), rows)


def sweep(
    function: Callable[[P, int], R],
    parameters: Iterable[P],
    *,
    seed: int,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | bool | None = None,
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
    progress : callable or bool, optional
        Called as ``progress(done, total)`` after each task; True shows a bar (needs tqdm).

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
        The first exception of a task, or KeyboardInterrupt; tasks that have not started are cancelled. What is
        finished is not lost: the exception's attribute ``sweep`` is a :class:`Sweep` of it.

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
    seed = integer("seed", seed)
    report = bar("sweep") if progress is True else progress or None
    given = tuple(parameters)
    seeds = tuple(
        int(child.generate_state(1, np.uint64)[0] >> np.uint64(1))
        for child in np.random.SeedSequence(seed).spawn(len(given))
    )
    results: list[R] = []
    if executor is None:
        try:
            for parameter, task_seed in zip(given, seeds, strict=True):
                results.append(function(parameter, task_seed))
                if report is not None:
                    report(len(results), len(given))
        except BaseException as error:
            _keep(error, Sweep(given[: len(results)], seeds[: len(results)], tuple(results)), len(given))
            raise
        return Sweep(given, seeds, tuple(results))
    futures: list[Future[R]] = [
        executor.submit(function, parameter, task_seed)
        for parameter, task_seed in zip(given, seeds, strict=True)
    ]
    try:
        for future in futures:
            results.append(future.result())
            if report is not None:
                report(len(results), len(given))
    except BaseException as error:
        for future in futures:
            future.cancel()
        done = [
            (parameter, task_seed, future.result())
            for parameter, task_seed, future in zip(given, seeds, futures, strict=True)
            if future.done() and not future.cancelled() and future.exception() is None
        ]
        _keep(
            error,
            Sweep(
                tuple(parameter for parameter, _, _ in done),
                tuple(task_seed for _, task_seed, _ in done),
                tuple(result for _, _, result in done),
            ),
            len(given),
        )
        raise
    return Sweep(given, seeds, tuple(results))


def _keep(error: BaseException, finished: Sweep[P, R], total: int) -> None:
    """Attaches the finished tasks to the exception that ends a sweep."""
    error.sweep = finished  # type: ignore[attr-defined]
    error.add_note(f"{len(finished)} of {total} tasks of this sweep are finished: attribute `sweep` of this exception")
