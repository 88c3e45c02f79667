"""Effects of a real arm in the simulated one."""

from __future__ import annotations

import os
from collections.abc import Mapping

from supple import _check, _native

PlantOptions = Mapping[str, float] | str | os.PathLike[str]

__all__ = ["plant_options"]


def plant_options(name: str = "realistic") -> dict[str, float]:
    """Return a built-in set of effects of a real arm, to change and pass on.

    ``supple plant list`` describes all options. The sizes are assumptions, not measurements of an arm.

    Parameters
    ----------
    name : {"realistic", "openarm-realistic", "urdf-realistic"}
        All effects together, each of modest size: of motors with cables, of motors with gears on a bus, or of
        motors that are not described, as of a URDF alone.

    Returns
    -------
    dict
        Size of each effect by name; SI units, with the unit in the name.

    Raises
    ------
    ValueError
        For an unknown name.

    Examples
    --------
    >>> import supple
    >>> options = supple.plant_options()
    >>> options["cable_stiffness_nm_per_rad"]
    3000.0
    """
    return _native.plant_options(_check.text("name", name))


def _chosen(
    arm: _native.Arm, options: PlantOptions | None, realistic: bool
) -> dict[str, float] | str | None:
    realistic = _check.flag("realistic", realistic)
    if options is not None and realistic:
        raise ValueError("realistic: expected False if plant_options is given")
    if realistic:
        return plant_options(_native.realistic_set(arm))
    if options is None:
        return None
    if isinstance(options, Mapping):
        return _check.named_numbers("plant_options", options)
    return _check.path("plant_options", options, "a mapping or a path")
