"""Progress of long calls: bars of tqdm, in a terminal or a notebook.

An argument ``progress`` of None shows progress of a call that takes more than a second, if tqdm is installed and the call is the
outermost one, in the main thread of the main process. True always asks for it, and needs tqdm. tqdm's own ``TQDM_DISABLE=1``
switches both off.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ParamSpec

P = ParamSpec("P")

# Time after which a call shows progress without being asked, and between two updates of the elapsed time (s).
_DELAY_S, _INTERVAL_S = 1.0, 0.5

# Whether a call that reports progress is running in this thread.
_call = threading.local()


def split(progress: Callable[P, object] | bool | None) -> tuple[bool | None, Callable[P, object] | None]:
    """Returns whether to show a bar, and the caller's own function, which replaces the bar."""
    if progress is None or isinstance(progress, bool):
        return progress, None
    return False, progress


@contextmanager
def bar(description: str, unit: str, total: int, progress: bool | None) -> Iterator[Callable[[int], None] | None]:
    """Yields a function that sets the number of finished parts; None if no bar is shown."""
    with _shown(progress, desc=description, unit=unit, total=total) as shown:
        yield None if shown is None else lambda done: _set(shown, done)


@contextmanager
def elapsed(description: str, progress: bool | None) -> Iterator[None]:
    """Shows the elapsed time of a call whose remaining time is not known."""
    with _shown(progress, desc=description, bar_format="{desc}: {elapsed}") as shown:
        if shown is None:
            yield
            return
        ended = threading.Event()

        def refresh() -> None:
            while not ended.wait(_INTERVAL_S):
                shown.update()

        thread = threading.Thread(target=refresh, name="supple-progress", daemon=True)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()


@contextmanager
def _shown(progress: bool | None, **options: Any) -> Iterator[Any]:
    """Yields tqdm's bar, or None if there is none; calls within it show no bar without being asked."""
    is_inner = getattr(_call, "is_running", False)
    shown = None
    if progress is None:
        # A call of a second or less flashes no bar.
        if not is_inner and _in_main_thread() and _output():
            try:
                tqdm = _tqdm()
            except ImportError:
                pass
            else:
                shown = tqdm(delay=_DELAY_S, disable=False, **options)
    elif progress:
        tqdm = _tqdm()
        if _output():
            shown = tqdm(disable=False, **options)
    _call.is_running = True
    try:
        yield shown
    finally:
        _call.is_running = is_inner
        if shown is not None:
            shown.close()


def _set(shown: Any, done: int) -> None:
    shown.update(done - shown.n)


def _tqdm() -> Any:
    with warnings.catch_warnings():
        # A notebook without ipywidgets gets bars of text.
        warnings.simplefilter("ignore")
        from tqdm.auto import tqdm
    return tqdm


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread() and multiprocessing.parent_process() is None


def _output() -> bool:
    """Whether there is a terminal or a notebook to show a bar in."""
    if os.environ.get("TQDM_DISABLE", "") not in ("", "0"):
        return False
    return _in_notebook() or _in_terminal()


def _in_terminal() -> bool:
    return sys.stderr is not None and sys.stderr.isatty()


def _in_notebook() -> bool:
    if "IPython" not in sys.modules:
        return False
    shell = sys.modules["IPython"].get_ipython()
    return shell is not None and "IPKernelApp" in shell.config
