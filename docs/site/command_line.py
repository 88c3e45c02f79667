"""The help of the programs: the reference of the command line, and what commands and options there are."""

from __future__ import annotations

import re
import subprocess
from functools import cache
from pathlib import Path

PROGRAMS = ("supple", "supple-can", "supple-emu", "supple-rt", "supple-sim")


class CommandLine:
    """The programs in a folder."""

    def __init__(self, programs: Path) -> None:
        self.programs = programs
        self.help = cache(self._help)

    def _help(self, command: tuple[str, ...]) -> str:
        program = self.programs / command[0]
        return subprocess.run([program, *command[1:], "--help"], check=True, capture_output=True, text=True).stdout

    def subcommands(self, command: tuple[str, ...]) -> list[str]:
        """Names of the commands below a command."""
        section = re.search(r"^Commands:\n(.*?)(?=^\S|\Z)", self.help(command), re.DOTALL | re.MULTILINE)
        names = re.findall(r"^  ([a-z][a-z-]*)", section[1], re.MULTILINE) if section else []
        return [name for name in names if name != "help"]

    def options(self, command: tuple[str, ...]) -> set[str]:
        """Options of a command, such as `--arm`."""
        return set(re.findall(r"^ +(?:-\w, )?(--[a-z][a-z0-9-]*)", self.help(command), re.MULTILINE))

    def commands(self, program: str) -> list[tuple[str, ...]]:
        """A program and all commands below it, each after the one that it belongs to."""
        found: list[tuple[str, ...]] = []
        waiting = [(program,)]
        while waiting:
            command = waiting.pop(0)
            found.append(command)
            waiting = [(*command, name) for name in self.subcommands(command)] + waiting
        return found

    def every_option(self) -> set[str]:
        """Options of all commands of all programs."""
        return {
            option for program in PROGRAMS for command in self.commands(program) for option in self.options(command)
        }

    def reference(self) -> str:
        """A page with the help of every command of every program."""
        sections = [
            "# Command line\n\nWhat `--help` of every command prints. `supple completions bash` prints completions for a "
            "shell, `supple man FOLDER` writes manual pages.\n"
        ]
        for program in PROGRAMS:
            for command in self.commands(program):
                mark = "##" if len(command) == 1 else "###"
                name = " ".join(command)
                sections.append(f"{mark} {name}\n\n```text\n{self.help(command).strip()}\n```\n")
        return "\n".join(sections)
