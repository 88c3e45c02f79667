"""An arm of which only a Denavit-Hartenberg table is known."""

from __future__ import annotations

from typing import Literal

from numpy.typing import ArrayLike

from supple import _check, _native

__all__ = ["dh_to_urdf"]


def dh_to_urdf(
    table: ArrayLike,
    convention: Literal["standard", "modified"],
    *,
    masses_kg: ArrayLike | None = None,
    name: str = "arm",
) -> str:
    """Convert a Denavit-Hartenberg table to a URDF, as ``supple arms from-dh`` does.

    Parameters
    ----------
    table : array_like, (N, 4)
        One row for each revolute joint: ``a`` (m), ``alpha`` (rad), ``d`` (m), and ``theta`` where the joint's angle is zero
        (rad).
    convention : {"standard", "modified"}
        Standard: ``Rot_z(theta + q) Trans_z(d) Trans_x(a) Rot_x(alpha)``. Modified, as in the books of Craig and Khalil:
        ``Rot_x(alpha) Trans_x(a) Rot_z(theta + q) Trans_z(d)``, where a row has the ``alpha`` and ``a`` that lead to its axis.
    masses_kg : array_like, (N,), optional
        Mass of the link after each joint, at the origin of its frame. Default: 1 kg, for an identification to begin with.
    name : str
        Name of the robot.

    Returns
    -------
    str
        The URDF, with the links ``base``, ``link1`` .. and ``tool0``, and joints without limits.

    Raises
    ------
    TypeError
        For an argument of the wrong type.
    ValueError
        For another shape or convention, numbers that are not finite, lengths above 1000 m, masses that are not positive.

    Examples
    --------
    >>> import math, pathlib, supple, tempfile
    >>> half = math.pi / 2
    >>> urdf = supple.dh_to_urdf([[0, half, 0.18, 0], [-0.61, 0, 0, 0], [-0.57, 0, 0, 0]], "standard")
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "arm.urdf"
    >>> _ = file.write_text(urdf)
    >>> arm = supple.Arm.from_urdf(file, tip="tool0")
    >>> arm.tip_pose([0, 0, 0])[:3, 3].round(2)
    array([-1.18,  0.  ,  0.18])
    """
    rows = _check.array("table", table)
    if rows.ndim != 2 or rows.shape[1] != 4:
        raise ValueError(
            f"table: expected shape (N, 4), a row of a, alpha, d, theta for each joint, got {rows.shape}"
        )
    if _check.text("convention", convention) not in ("standard", "modified"):
        raise ValueError(f"convention: expected 'standard' or 'modified', got {convention!r}")
    masses = None
    if masses_kg is not None:
        masses = _check.array("masses_kg", masses_kg, (len(rows),)).tolist()
    return _native.dh_to_urdf(_check.text("name", name), convention == "standard", rows.tolist(), masses)
