"""Progress bars, shown if tqdm is installed and the output is a terminal or a notebook."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def bar(description: str, unit: str = "task") -> Callable[[int, int], None]:
    """Returns a function ``progress(done, total)`` that shows a bar in a terminal or a notebook.

    Raises
    ------
    ImportError
        If tqdm is not installed.
    """
    from tqdm.auto import tqdm

    shown: list[Any] = []

    def progress(done: int, total: int) -> None:
        if not shown:
            # `disable=None` shows no bar if the output is no terminal.
            shown.append(tqdm(total=total, desc=description, unit=unit, disable=None))
        shown[0].update(done - shown[0].n)
        if done >= total:
            shown[0].close()

    return progress
