"""``python -m supple sweep SPEC``, which ``supple sweep SPEC`` starts: many experiments, on this machine or on a cluster."""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from supple._spec import Spec, SpecError
from supple._sweep import Sweep, sweep

# Exit codes, the same as those of the program `supple`.
_USAGE, _EXPERIMENT, _FILE, _INTERRUPTED = 2, 4, 6, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; returns its exit code."""
    parser = argparse.ArgumentParser(prog="supple")
    command = parser.add_subparsers(required=True).add_parser("sweep", help="many experiments")
    command.add_argument("spec", type=Path, help="the experiments, TOML")
    command.add_argument("--results", type=Path, default=Path("out/sweep"), help="folder of the results")
    command.add_argument("--workers", type=int, help="worker processes of this machine; default: one per processor")
    command.add_argument("--scheduler", help="address of the Dask scheduler of a cluster")
    command.add_argument("--json", action="store_true", help="print the summary as JSON")
    command.add_argument("--quiet", action="store_true", help="print no progress")
    options = parser.parse_args(arguments)
    try:
        spec = Spec.read(options.spec)
        found = _run(spec, options)
    except (SpecError, ValueError) as error:
        return _fail(error, _USAGE)
    except OSError as error:
        return _fail(error, _FILE)
    except ImportError as error:
        return _fail(f"{error}; a sweep needs: pip install 'supple[cluster]'", _FILE)
    except KeyboardInterrupt:
        return _fail(f"interrupted; the finished tasks are in {options.results}: repeat the command to run the others", _INTERRUPTED)
    _print(found, options)
    return _EXPERIMENT if found.failures else 0


def _fail(error: object, code: int) -> int:
    print(f"error: {error}", file=sys.stderr)
    return code


def _run(spec: Spec, options: argparse.Namespace) -> Sweep[dict[str, object], dict[str, object]]:
    distributed: Any = importlib.import_module("distributed")
    tasks = spec.tasks()
    report = False if options.quiet else _progress()
    if options.scheduler:
        with distributed.Client(options.scheduler) as client:
            executor = client.get_executor()
            return sweep(spec.run, tasks, seed=spec.seed, executor=executor, progress=report, results=options.results)
    with (
        distributed.LocalCluster(
            n_workers=options.workers, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        executor = client.get_executor()
        return sweep(spec.run, tasks, seed=spec.seed, executor=executor, progress=report, results=options.results)


def _progress() -> Callable[[int, int], None] | bool:
    """Returns a progress bar (tqdm, on a terminal), or a function that prints a line after each tenth of the tasks."""
    if sys.stderr.isatty():
        try:
            import tqdm  # noqa: F401
        except ImportError:
            pass
        else:
            return True
    said = [-1]

    def report(done: int, total: int) -> None:
        tenth = 10 * done // max(total, 1)
        if tenth != said[0]:
            said[0] = tenth
            print(f"{done} of {total} tasks", file=sys.stderr, flush=True)

    return report


def _print(found: Sweep[dict[str, object], dict[str, object]], options: argparse.Namespace) -> None:
    if options.json:
        failures = [{"seed": failed.seed, **failed.parameter, "error": failed.error} for failed in found.failures]
        summary = {"finished": len(found), "failed": len(failures), "results": str(options.results), "failures": failures}
        print(json.dumps(summary, indent=2))
        return
    print(f"{len(found)} tasks finished, {len(found.failures)} failed; results in {options.results}")
    for failed in found.failures:
        print(f"  seed {failed.seed}, {failed.parameter}: {failed.error}")


if __name__ == "__main__":
    sys.exit(main())
