"""Checks of arguments: each returns its argument, or raises an error with its name, the expected value and the given value.

An argument of the wrong type raises a TypeError, one with a value out of range a ValueError. Neither text nor ``bool``
counts as a number.
"""

from __future__ import annotations

import operator
import os
import reprlib
from collections.abc import Callable, Iterable, Mapping
from math import inf, isfinite
from typing import ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple import _native

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")

_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = 60
_NOT_NUMBERS = (str, bytes, bytearray, bool, np.bool_)


def wrong(name: str, expected: str, value: object) -> TypeError:
    """Returns the error for an argument of the wrong type."""
    # Joins the lines: the text of an array has several.
    found = " ".join(_SHORT.repr(value).split())
    return TypeError(f"{name}: expected {expected}, got {found}")


def number(name: str, value: float, *, positive: bool = False, signed: bool = False) -> float:
    """Returns a finite number of zero or more; with ``positive`` above zero, with ``signed`` of either sign."""
    if isinstance(value, _NOT_NUMBERS) or getattr(value, "ndim", 0) != 0:
        raise wrong(name, "a number", value)
    try:
        found = float(value)
    except (TypeError, ValueError):
        raise wrong(name, "a number", value) from None
    except OverflowError:
        found = inf
    if not isfinite(found) or (found < 0.0 and not signed) or (positive and found == 0.0):
        wanted = "finite" if signed else "finite and positive" if positive else "finite and not negative"
        raise ValueError(f"{name}: expected a number that is {wanted}, got {value}")
    return found


def integer(name: str, value: int, *, least: int = 0, limit: int = 2**64) -> int:
    """Returns an integer of ``least`` or more and below ``limit``."""
    if isinstance(value, _NOT_NUMBERS):
        raise wrong(name, "an integer", value)
    try:
        found = operator.index(value)
    except TypeError:
        raise wrong(name, "an integer", value) from None
    if found < least:
        raise ValueError(f"{name}: expected {least or 'zero'} or more, got {found}")
    if found >= limit:
        raise ValueError(f"{name}: expected less than {limit}, got {found}")
    return found


def iterable(name: str, values: Iterable[T]) -> Iterable[T]:
    """Returns the values after checking that they can be iterated over."""
    try:
        iter(values)
    except TypeError:
        raise wrong(name, "an iterable", values) from None
    return values


def integers(name: str, values: Iterable[int]) -> list[int]:
    """Returns the integers, each zero or more, as a list."""
    if isinstance(values, (str, bytes)):
        raise wrong(name, "integers", values)
    return [integer(f"{name}[{i}]", value) for i, value in enumerate(iterable(name, values))]


def array(name: str, values: ArrayLike, shape: tuple[int, ...] | None = None) -> NDArray[np.float64]:
    """Returns the numbers, finite or not, as an array; ``shape``, if given, is the required shape."""
    try:
        found = np.asarray(values)
    except ValueError as error:
        raise ValueError(f"{name}: expected numbers, got lists of different lengths") from error
    if found.dtype.kind not in "iuf":
        raise wrong(name, "numbers", values)
    if shape is not None and found.shape != shape:
        raise ValueError(f"{name}: expected shape {shape}, got {found.shape}")
    return found.astype(np.float64)


def named_numbers(name: str, values: Mapping[str, float]) -> dict[str, float]:
    """Returns finite numbers of either sign by their names."""
    if not isinstance(values, Mapping):
        raise wrong(name, "a mapping of names to numbers", values)
    return {
        text(f"a name in {name}", key): number(f"{name}[{key!r}]", value, signed=True)
        for key, value in values.items()
    }


def flag(name: str, value: bool) -> bool:
    """Returns a value that is True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise wrong(name, "True or False", value)
    return bool(value)


def text(name: str, value: str) -> str:
    """Returns a value that is text."""
    if not isinstance(value, str):
        raise wrong(name, "text", value)
    return value


def path(name: str, value: str | os.PathLike[str], expected: str = "a path") -> str:
    """Returns a path as text."""
    try:
        found = os.fspath(value)
    except TypeError:
        found = None
    if not isinstance(found, str):
        raise wrong(name, expected, value)
    return found


def instance(name: str, value: T, kind: type[T]) -> T:
    """Returns a value that is an instance of ``kind``."""
    if not isinstance(value, kind):
        raise wrong(name, f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}", value)
    return value


def function(name: str, value: Callable[P, R], expected: str = "a callable") -> Callable[P, R]:
    """Returns a value that is callable."""
    if not callable(value):
        raise wrong(name, expected, value)
    return value


def arm(name: str, value: _native.Arm) -> _native.Arm:
    """Returns a value that is an arm."""
    return instance(name, value, _native.Arm)
