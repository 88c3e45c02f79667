"""HTML table of an arm for notebooks; `Arm._repr_html_` of the native module calls `arm_table`."""

from __future__ import annotations

from supple import _native
from supple._frames import table


def arm_table(arm: _native.Arm) -> str:
    """A table with a row for each joint: what turns with it, its friction, its rotor and its start angle."""
    masses_kg = arm.parameters.reshape(arm.dof, 10)[:, 0]
    head = (
        "joint",
        "link and tool [kg]",
        "rotor [kg m²]",
        "Coulomb [N m]",
        "viscous [N m s/rad]",
        "home [rad]",
    )
    rows = (
        (
            name,
            f"{mass_kg:.4g}",
            f"{rotor:.4g}",
            f"{friction.coulomb_nm:.4g}",
            f"{friction.viscous_nm_s_per_rad:.4g}",
            f"{home_rad:.4g}",
        )
        for name, mass_kg, rotor, friction, home_rad in zip(
            arm.joint_names, masses_kg, arm.armature, arm.friction, arm.home_rad, strict=True
        )
    )
    return table(f"{arm.name}, {arm.dof} joints", head, rows)
