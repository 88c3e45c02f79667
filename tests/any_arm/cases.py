"""The cases of cases.txt, with the places of their files on this machine."""

from __future__ import annotations

import os
import sysconfig
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parent.parent
# The folder of a URDF that no package has.
UR10E_DIR = "SUPPLE_UR10E_DIR"


@dataclass(frozen=True)
class Case:
    """A URDF."""

    text: str
    """As in cases.txt."""
    file: str
    """Path of the URDF."""
    tip: str
    """Link that is the tip."""
    repair: bool
    """Whether inertias that no body has are replaced."""

    @property
    def name(self) -> str:
        """The arm as one word, as all programs read it."""
        return f"{self.file}#{self.tip}{',repair' if self.repair else ''}"


@dataclass(frozen=True)
class Missing:
    """A case whose file is not on this machine."""

    text: str
    """As in cases.txt."""
    why: str
    """What would bring it."""


def chosen(held_back: bool, only: str) -> Iterator[Case | Missing]:
    """The cases, those that are held back only if asked for, whose text contains one of `only`, separated by commas."""
    for line in (HERE / "cases.txt").read_text().splitlines():
        if line == "# held back" and not held_back:
            return
        if line and not line.startswith("#") and any(part in line for part in only.split(",")):
            yield read(line)


def read(line: str) -> Case | Missing:
    """A line of cases.txt."""
    path, _, rest = line.partition("#")
    tip, _, option = rest.partition(",")
    place, _, inside = path.partition("/")
    if place == "UR10E":
        folder = os.environ.get(UR10E_DIR)
        if not folder:
            return Missing(line, f"{UR10E_DIR} names no folder with {inside}")
    else:
        folder = {"PACKAGES": sysconfig.get_paths()["purelib"], "REPOSITORY": str(REPOSITORY)}[place]
    file = Path(folder) / inside
    if not file.is_file():
        return Missing(line, f"{file.name} is not in the installed packages" if place == "PACKAGES" else f"no {file}")
    return Case(line, str(file), tip, option == "repair")
