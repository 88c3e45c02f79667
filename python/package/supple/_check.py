"""Arguments of functions: every error names the argument, what it takes and what it got."""

from __future__ import annotations

import operator
from math import isfinite


def number(name: str, value: float, *, positive: bool = False) -> float:
    """A finite number, zero or more, or with ``positive`` more than zero."""
    try:
        found = float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: expected a number, got {value!r}") from None
    if not isfinite(found) or found < 0.0 or (positive and found == 0.0):
        wanted = "finite and positive" if positive else "finite and not negative"
        raise ValueError(f"{name}: expected a number that is {wanted}, got {value}")
    return found


def integer(name: str, value: int, *, limit: int = 2**64) -> int:
    """An integer, zero or more and below ``limit``."""
    try:
        found = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: expected an integer, got {value!r}") from None
    if found < 0:
        raise ValueError(f"{name}: expected zero or more, got {found}")
    if found >= limit:
        raise ValueError(f"{name}: expected less than {limit}, got {found}")
    return found


def flag(name: str, value: bool) -> bool:
    """True or False."""
    if not isinstance(value, bool) and type(value).__name__ not in ("bool", "bool_"):
        raise TypeError(f"{name}: expected True or False, got {value!r}")
    return bool(value)
