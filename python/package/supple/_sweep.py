"""Repeated calls of one function with different seeds, on any executor."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, as_completed
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar, overload

import numpy as np

from supple import _check
from supple._check import integer
from supple._frames import table
from supple._progress import bar, split
from supple._results import Results

if TYPE_CHECKING:
    import pandas as pd

P = TypeVar("P")
R = TypeVar("R")

__all__ = ["Failed", "Sweep", "sweep"]


@dataclass(frozen=True)
class Failed(Generic[P]):
    """A task of :func:`sweep` that raised an exception."""

    parameter: P
    """Parameter of the task."""
    seed: int
    """Seed of the task."""
    error: str
    """Type and message of the exception."""


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
    failures: tuple[Failed[P], ...] = ()
    """Failed tasks, only with ``results``; the lists above do not contain them. Otherwise the first failure is raised."""

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
        failed = f", {len(self.failures)} failed" if self.failures else ""
        return f"<Sweep of {len(self)} results{failed}>"

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
    results: str | os.PathLike[str] | None = None,
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
        Called as ``progress(done, total)`` after each task. True shows a bar (needs tqdm), False none. Default: a bar in a terminal
        or a notebook, if tqdm is installed and the sweep takes more than a second.
    results : path, optional
        Folder for the results, Parquet, a row for each task with its seed (needs pyarrow). Tasks that it has are not run
        again: a sweep that was ended goes on, and one with more parameters runs the new ones. A task that fails is listed
        (:attr:`Sweep.failures`, column ``error``), the others go on, and the next call runs it again. Results are numbers,
        text, lists of them, or mappings of those; a worker of a Dask cluster that is killed loses nothing.

    Returns
    -------
    Sweep
        Results in the order of ``parameters``.

    Raises
    ------
    TypeError
        For an argument of the wrong type.
    ValueError
        If the seed is negative.
    Exception
        Without ``results`` the first exception of a task, or KeyboardInterrupt; tasks that have not started are cancelled. What is
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
    _check.function("function", function)
    seed = integer("seed", seed)
    _check.iterable("parameters", parameters)
    if executor is not None and not hasattr(executor, "submit"):
        raise _check.wrong("executor", "an executor", executor)
    if progress is not None and not isinstance(progress, bool):
        _check.function("progress", progress, "a callable, True or False")
    if results is not None:
        results = _check.path("results", results)
    given = tuple(parameters)
    seeds = tuple(
        int(child.generate_state(1, np.uint64)[0] >> np.uint64(1))
        for child in np.random.SeedSequence(seed).spawn(len(given))
    )
    store = None if results is None else Results(results, _name(function))
    shows, given_report = split(progress)
    with bar("sweep", "task", len(given), shows) as show:
        report = given_report if show is None else lambda done, total: show(done)
        if store is not None:
            return _stored(function, given, seeds, executor, report, store)
        return _run(function, given, seeds, executor, report)


def _run(
    function: Callable[[P, int], R],
    given: tuple[P, ...],
    seeds: tuple[int, ...],
    executor: Executor | None,
    report: Callable[[int, int], object] | None,
) -> Sweep[P, R]:
    """Runs a sweep without stored results; the first failure is raised."""
    found: list[R] = []
    if executor is None:
        try:
            for parameter, task_seed in zip(given, seeds, strict=True):
                found.append(function(parameter, task_seed))
                if report is not None:
                    report(len(found), len(given))
        except BaseException as error:
            _keep(error, Sweep(given[: len(found)], seeds[: len(found)], tuple(found)), len(given))
            raise
        return Sweep(given, seeds, tuple(found))
    futures: list[Future[R]] = [
        executor.submit(function, parameter, task_seed)
        for parameter, task_seed in zip(given, seeds, strict=True)
    ]
    try:
        for future in futures:
            found.append(future.result())
            if report is not None:
                report(len(found), len(given))
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
    return Sweep(given, seeds, tuple(found))


def _name(function: Callable[..., object]) -> str:
    """Returns a function's name without its module, which differs between a program and a notebook."""
    inner = getattr(function, "func", function)
    return str(getattr(inner, "__qualname__", type(inner).__qualname__))


def _stored(
    function: Callable[[P, int], R],
    given: tuple[P, ...],
    seeds: tuple[int, ...],
    executor: Executor | None,
    report: Callable[[int, int], object] | None,
    store: Results,
) -> Sweep[P, R]:
    """Runs a sweep like :func:`sweep` and stores the results in a folder."""
    parameters = dict(zip(seeds, given, strict=True))
    found: dict[int, R] = store.finished(parameters)
    errors: dict[int, str] = {}
    tasks = [seed for seed in seeds if seed not in found]

    def finish(seed: int, outcome: Callable[[], R]) -> None:
        try:
            result = outcome()
            store.add(seed, parameters[seed], result)
        except Exception as error:
            errors[seed] = f"{type(error).__name__}: {error}"
            store.fail(seed, parameters[seed], errors[seed])
        else:
            found[seed] = result
        if report is not None:
            report(len(found) + len(errors), len(given))

    def result() -> Sweep[P, R]:
        done = [seed for seed in seeds if seed in found]
        failures = (Failed(parameters[seed], seed, errors[seed]) for seed in seeds if seed in errors)
        return Sweep(
            tuple(parameters[seed] for seed in done),
            tuple(done),
            tuple(found[seed] for seed in done),
            tuple(failures),
        )

    futures: dict[Future[R], int] = {}
    try:
        if executor is None:
            for seed in tasks:
                finish(seed, lambda seed=seed: function(parameters[seed], seed))  # type: ignore[misc]
        else:
            futures = {executor.submit(function, parameters[seed], seed): seed for seed in tasks}
            for future in as_completed(futures):
                if isinstance(broken := future.exception(), BrokenExecutor):
                    raise broken
                finish(futures[future], future.result)
    except BaseException as error:
        for future in futures:
            future.cancel()
        _keep(error, result(), len(given))
        raise
    finally:
        store.write()
    return result()


def _keep(error: BaseException, finished: Sweep[P, R], total: int) -> None:
    """Attaches the finished tasks to the exception that ends a sweep."""
    error.sweep = finished  # type: ignore[attr-defined]
    error.add_note(f"{len(finished)} of {total} tasks of this sweep are finished: attribute `sweep` of this exception")
