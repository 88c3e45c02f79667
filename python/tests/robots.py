"""Random serial arms as URDF text: random axes and origins, full inertia tensors."""

from __future__ import annotations

from pathlib import Path

import numpy as np


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    """A uniformly distributed random rotation."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def random_body(rng: np.random.Generator) -> str:
    """Inertia of a random cloud of point masses, hence physically consistent."""
    points = rng.normal(scale=0.1, size=(12, 3)) + rng.normal(scale=0.1, size=3)
    masses = rng.uniform(0.05, 0.5, size=12)
    mass = masses.sum()
    com = masses @ points / mass
    # In axes rotated relative to the link's, so that the <origin rpy> of inertias matters.
    rotation = random_rotation(rng)
    about = (points - com) @ rotation
    second = (masses[:, None] * about).T @ about
    inertia = np.trace(second) * np.eye(3) - second
    roll = np.arctan2(rotation[2, 1], rotation[2, 2])
    pitch = -np.arcsin(rotation[2, 0])
    yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    values = zip(names, inertia[np.triu_indices(3)], strict=True)
    entries = " ".join(f'{name}="{float(value)!r}"' for name, value in values)
    return (
        f'<inertial><origin xyz="{words(com)}" rpy="{words((roll, pitch, yaw))}"/>'
        f'<mass value="{float(mass)!r}"/>'
        f"<inertia {entries}/></inertial>"
    )


def words(values) -> str:
    return " ".join(repr(float(value)) for value in values)


def random_urdf(dof: int, seed: int) -> str:
    """An arm of ``dof`` joints with links ``link1`` .. and a fixed ``tip``."""
    rng = np.random.default_rng(seed)
    parts = ['<robot name="random"><link name="base"/>']
    parent = "base"
    for i in range(1, dof + 1):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        parts.append(
            f'<link name="link{i}">{random_body(rng)}</link>'
            f'<joint name="joint{i}" type="revolute"><parent link="{parent}"/><child link="link{i}"/>'
            f'<origin xyz="{words(rng.normal(scale=0.3, size=3))}"'
            f' rpy="{words(rng.uniform(-1.5, 1.5, size=3))}"/><axis xyz="{words(axis)}"/>'
            '<limit lower="-3" upper="3" effort="100" velocity="5"/></joint>'
        )
        parent = f"link{i}"
    parts.append(
        f'<link name="tip"/><joint name="tip_joint" type="fixed"><parent link="{parent}"/>'
        f'<child link="tip"/><origin xyz="{words(rng.normal(scale=0.2, size=3))}"'
        f' rpy="{words(rng.uniform(-1.5, 1.5, size=3))}"/></joint></robot>'
    )
    return "".join(parts)


def write_random_urdf(folder: Path, dof: int, seed: int) -> Path:
    path = folder / f"random_{dof}_{seed}.urdf"
    path.write_text(random_urdf(dof, seed))
    return path
