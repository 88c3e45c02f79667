"""Results of a sweep in a folder of Parquet files, a row for each task, by its seed."""

from __future__ import annotations

import json
import os
import time
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import Any

# A part is written after this many rows or seconds: a killed client loses, and must repeat, at most as many.
_ROWS = 500
_SECONDS = 10.0
# Columns that every part has.
_OWN = ("seed", "error")
# Key of the metadata in a part's schema.
_METADATA = b"supple.sweep"


class Results:
    """The results of one sweep in a folder.

    A row has ``seed``, the parameter and the result (a mapping becomes columns of its own, anything else ``parameter`` and
    ``result``), and ``error`` if the task failed. A part is complete or absent: it is written under another name first.
    """

    def __init__(self, folder: str | os.PathLike[str], function: str) -> None:
        self._folder = Path(folder)
        self._function = function
        self._pending: list[dict[str, Any]] = []
        self._shape: dict[str, Any] | None = None
        self._written_s = time.monotonic()
        _pyarrow()
        self._folder.mkdir(parents=True, exist_ok=True)

    def finished(self, parameters: Mapping[int, object]) -> dict[int, Any]:
        """Returns the results of finished tasks by seed; failed tasks are not finished.

        Raises
        ------
        ValueError
            If the folder has results of another function, or of another parameter for the same seed.
        """
        parquet = _pyarrow()
        found: dict[int, Any] = {}
        for part in sorted(self._folder.glob("*.parquet")):
            table = parquet.read_table(part)
            described = (table.schema.metadata or {}).get(_METADATA)
            if described is None:
                raise ValueError(f"results: {part} was not written by supple.sweep; give an empty folder")
            shape = json.loads(described)
            if shape["function"] != self._function:
                raise ValueError(
                    f"results: {part} has results of {shape['function']}, expected {self._function}; give another folder"
                )
            for row in table.to_pylist():
                seed = row["seed"]
                if row["error"] is not None or seed not in parameters:
                    continue
                expected = _columns("parameter", parameters[seed])
                stored = {name: row[name] for name in shape["parameter"]}
                if not all(_same(stored.get(name), value) for name, value in expected.items()):
                    raise ValueError(
                        f"results: {part} has seed {seed} with {stored}, expected {expected}; give another folder"
                    )
                values = {name: row[name] for name in shape["result"]}
                found[seed] = values if shape["mapping"] else values["result"]
        return found

    def add(self, seed: int, parameter: object, result: object) -> None:
        """Adds a finished task."""
        given, got = _columns("parameter", parameter), _columns("result", result)
        both = [name for name in got if name in given or name in _OWN]
        if both or any(name in _OWN for name in given):
            raise ValueError(f"results: the names {both or _OWN} are in a result and in its parameter, or are reserved")
        shape = {"parameter": [*given], "result": [*got], "mapping": isinstance(result, Mapping)}
        self._row({"seed": seed, **given, **got, "error": None}, shape)

    def fail(self, seed: int, parameter: object, error: str) -> None:
        """Adds a failed task."""
        given = _columns("parameter", parameter)
        self._row({"seed": seed, **given, "error": error}, {"parameter": [*given], "result": [], "mapping": False})

    def _row(self, row: dict[str, Any], shape: dict[str, Any]) -> None:
        if self._pending and shape != self._shape:
            self.write()
        self._shape = shape
        self._pending.append(row)
        if len(self._pending) >= _ROWS or time.monotonic() - self._written_s >= _SECONDS:
            self.write()

    def write(self) -> None:
        """Writes the pending rows as a new part."""
        self._written_s = time.monotonic()
        if not self._pending:
            return
        parquet = _pyarrow()
        import pyarrow

        names = [*self._pending[0]]
        columns = {name: [row[name] for row in self._pending] for name in names}
        table = pyarrow.table({name: _array(pyarrow, name, values) for name, values in columns.items()})
        described = json.dumps({"function": self._function} | (self._shape or {}))
        table = table.replace_schema_metadata({_METADATA: described.encode()})
        name = uuid.uuid4().hex
        part = self._folder / f"{name}.parquet.part"
        parquet.write_table(table, part)
        part.rename(self._folder / f"{name}.parquet")
        self._pending = []


def _array(pyarrow: Any, name: str, values: list[Any]) -> Any:
    """Returns a column; its type is text if all values are absent or their types differ."""
    if name == "seed":
        return pyarrow.array(values, pyarrow.int64())
    try:
        array = pyarrow.array(values)
    except (pyarrow.ArrowInvalid, pyarrow.ArrowTypeError):
        return pyarrow.array([None if value is None else str(value) for value in values])
    return array.cast(pyarrow.string()) if pyarrow.types.is_null(array.type) else array


def _same(stored: object, value: object) -> bool:
    """Returns whether a stored parameter equals ``value``; a column of mixed types stores text."""
    return stored == value or str(stored) == str(value)


def _columns(name: str, value: object) -> dict[str, Any]:
    """Returns a parameter or a result as columns."""
    values = {str(key): item for key, item in value.items()} if isinstance(value, Mapping) else {name: value}
    return {key: _plain(item) for key, item in values.items()}


def _plain(value: Any) -> Any:
    """Returns numbers, text and lists unchanged, NumPy scalars and arrays converted to them, other values as text."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return value if value is None or isinstance(value, (bool, int, float, str)) else repr(value)


def _pyarrow() -> Any:
    try:
        import pyarrow.parquet
    except ImportError as error:
        raise ImportError("results: storing a sweep needs pyarrow: pip install 'supple[cluster]'") from error
    return pyarrow.parquet
