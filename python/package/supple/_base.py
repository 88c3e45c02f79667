"""Base parameters: the combinations that motion can identify."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple import _check, _native
from supple._check import flag, integer

Array = NDArray[np.float64]

__all__ = ["BaseParameters", "base_parameters"]


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """Base parameters of an arm: identifiable combinations of the columns, see :func:`base_parameters`.

    ``values = x[independent] + combination @ x[dependent]`` for parameters ``x`` of the columns.
    """

    names: tuple[str, ...]
    """Each base parameter as text, such as ``"Izz1 + Iyy2 - 0.55 mcx2"``, (rank,)."""
    values: Array
    """Values of the base parameters for this arm, (rank,), SI units."""
    null_space: tuple[str, ...]
    """Null space as text: directions in which the parameters can change without changing any torque."""
    columns: tuple[str, ...]
    """Names of the columns: ten for each link, then the rotors; links and joints are counted from 0."""
    independent: NDArray[np.intp]
    """Indices of the independent columns, (rank,)."""
    dependent: NDArray[np.intp]
    """Indices of the dependent columns."""
    combination: Array
    """Coefficients of the dependent columns, (rank, dependent)."""
    condition: float
    """Condition number of the independent columns, each scaled to unit length."""

    @property
    def rank(self) -> int:
        """Number of base parameters."""
        return len(self.names)


def base_parameters(
    arm: _native.Arm,
    *,
    rotor: bool = False,
    moving: Sequence[int] | None = None,
    samples: int = 500,
    seed: int = 0,
) -> BaseParameters:
    """Find the combinations of an arm's inertial parameters that any motion can identify.

    The regressor of random states, all angles within half a turn, is decomposed by QR with column
    pivoting.

    Parameters
    ----------
    arm : Arm
        The arm.
    rotor : bool
        Whether to include a rotor inertia for each moving joint.
    moving : sequence of int, optional
        Joints that move, increasing from 0; the others are held. Default: all.
    samples : int
        Random states.
    seed : int
        Their seed.

    Returns
    -------
    BaseParameters
        Rank, names, values, null space.

    Raises
    ------
    TypeError
        For an argument of the wrong type.
    ValueError
        If a joint does not exist, or there are too few samples.

    Examples
    --------
    >>> import supple
    >>> base = supple.base_parameters(supple.Arm.load("wam4"))
    >>> base.rank, base.columns[:4]
    (22, ('m0', 'mcx0', 'mcy0', 'mcz0'))
    """
    _check.arm("arm", arm)
    samples = integer("samples", samples)
    rotor = flag("rotor", rotor)
    if samples < 20 * arm.dof:
        raise ValueError(f"samples: expected {20 * arm.dof} or more for this arm, got {samples}")
    rng = np.random.default_rng(integer("seed", seed))
    q = rng.uniform(-np.pi, np.pi, size=(samples, arm.dof))
    qd, qdd = rng.normal(scale=3.0, size=(2, samples, arm.dof))
    joints = list(range(arm.dof)) if moving is None else _check.integers("moving", moving)
    found = _native.base_parameters(arm, [q, qd, qdd], rotor, joints)
    return BaseParameters(
        names=tuple(found["names"]),
        values=found["values"],
        null_space=tuple(found["null_space"]),
        columns=tuple(found["columns"]),
        independent=np.array(found["independent"], dtype=np.intp),
        dependent=np.array(found["dependent"], dtype=np.intp),
        combination=found["combination"],
        condition=found["condition"],
    )
