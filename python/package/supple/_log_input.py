"""Logs as the caller passes them: one log, or lists of the columns of several logs."""

from __future__ import annotations

from typing import Any

import numpy as np


def log_input(t: Any, q: Any, tau: Any, qd: Any, qdd: Any) -> dict[str, Any]:
    """Returns the columns of one log by name."""
    return {"t": t, "q": q, "tau": tau, "qd": qd, "qdd": qdd}


def log_inputs(t: Any, q: Any, tau: Any, qd: Any, qdd: Any) -> list[dict[str, Any]]:
    """Returns one log, or several if the columns are lists: the entries of ``t`` are then arrays."""
    several = isinstance(t, (list, tuple)) and len(t) > 0 and all(np.ndim(part) > 0 for part in t)
    if not several:
        return [log_input(t, q, tau, qd, qdd)]
    given = {"q": q, "tau": tau, "qd": qd, "qdd": qdd}
    for name, columns in given.items():
        if columns is not None and len(columns) != len(t):
            raise ValueError(f"{name}: expected {len(t)} logs, as many as t, got {len(columns)}")
    parts = {name: [None] * len(t) if value is None else value for name, value in given.items()}
    return [log_input(t[k], *(parts[name][k] for name in ("q", "tau", "qd", "qdd"))) for k in range(len(t))]
