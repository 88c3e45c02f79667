"""Checks commands that no test runs: those within sentences, and those that `commands.toml` excepts from being run.

Programs, commands and options must be in the help of the programs; steps of `ci.sh`, targets of cargo and files must exist.
Blocks marked by an indent alone must not have commands.

    python docs/site/check_inline.py --programs target/debug
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

from command_line import PROGRAMS, CommandLine
from pages import NOT_CHECKED, ROOT, Code, blocks, indented, inline, pages

COMMAND = re.compile(rf"^(?:\S*/)?(?P<program>{'|'.join(PROGRAMS)})(?= |$)")
RUN = re.compile(r"^(sudo|cargo|pip|python3?|rerun|ros2|import|from|\./ci\.sh|(\S*/)?supple(-\w+)?)( |$)")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=Path, required=True, help="folder of the programs")
    checker = Checker(CommandLine(parser.parse_args().programs))
    wrong: list[str] = []
    checked = 0
    for page in [page for page in pages() if page not in NOT_CHECKED]:
        lines = [
            Code(page, block.line + offset, "sh", text)
            for block in blocks(page)
            if block.language == "sh"
            for offset, text in enumerate(block.text.splitlines())
        ]
        for code in [*inline(page), *lines]:
            problem = checker.problem(code.text)
            checked += problem != "no command"
            if problem and problem != "no command":
                wrong.append(f"{code}: `{code.text}`: {problem}")
        wrong += [f"{code}: put this command into a block ```sh: {code.text}" for code in indented(page) if RUN.match(code.text)]
    print("\n".join([*wrong, f"{checked} commands and options checked, {len(wrong)} wrong"]))
    return 1 if wrong or not checked else 0


class Checker:
    """What a command may contain."""

    def __init__(self, command_line: CommandLine) -> None:
        self.command_line = command_line
        self.every_option = command_line.every_option()
        self.steps = set(re.findall(r"^step_([\w-]+)\(\)", (ROOT / "ci.sh").read_text(), re.MULTILINE))
        self.crates = {path.parent.name: path.parent for path in ROOT.glob("*/**/Cargo.toml") if "target" not in path.parts}

    def problem(self, text: str) -> str | None:
        """What is wrong with a command or an option; "no command" for other code."""
        text = text.split(" #")[0].strip().removeprefix("XDG_RUNTIME_DIR=/run/supple ")
        if match := COMMAND.match(text):
            return self.of_program(match["program"], text.removesuffix(" &").split()[1:])
        if text.startswith("./ci.sh "):
            unknown = set(text.split()[1:]) - self.steps - {"full", "help", "summary"}
            return f"ci.sh has no {', '.join(sorted(unknown))}" if unknown else None
        if text.startswith("cargo "):
            return self.of_cargo(text.split())
        if re.match(r"--[a-z]", text):
            unknown = options(text.split()) - self.every_option - CARGO_OPTIONS
            return f"no program has {', '.join(sorted(unknown))}" if unknown else None
        return "no command"

    def of_program(self, program: str, words: list[str]) -> str | None:
        """What is wrong with the words after the name of a program."""
        command = (program,)
        for word in words:
            below = self.command_line.subcommands(command)
            if not below or not re.fullmatch(r"[a-z][a-z-]*", word):
                break
            if word not in below:
                return f"`{' '.join(command)}` has no command {word}"
            command = (*command, word)
        known = set().union(*(self.command_line.options(command[: n + 1]) for n in range(len(command))))
        unknown = options(words) - known - {"--help", "--version"}
        return f"`{' '.join(command)}` has no {', '.join(sorted(unknown))}" if unknown else None

    def of_cargo(self, words: list[str]) -> str | None:
        """Whether the crate, test or example that cargo is to run exists."""
        folder = ROOT
        for option, value in zip(words, words[1:], strict=False):
            if option == "-p":
                if value not in self.crates:
                    return f"there is no crate {value}"
                folder = self.crates[value]
        for option, value in zip(words, words[1:], strict=False):
            place = {"--test": "tests", "--example": "examples"}.get(option)
            where = [folder] if "-p" in words else [ROOT, *self.crates.values()]
            names = (f"{value}.rs", f"{value}/main.rs")
            if place and not any((path / place / name).is_file() for path in where for name in names):
                return f"there is no {option.removeprefix('--')} {value}"
        return None


CARGO_OPTIONS = {"--release", "--test", "--example", "--workspace", "--exclude", "--cap-add", "--shm-size"}


def options(words: list[str]) -> set[str]:
    """The options among words, up to `--`."""
    end = words.index("--") if "--" in words else len(words)
    return {word.split("=")[0] for word in words[:end] if re.match(r"--[a-z]", word)}


if __name__ == "__main__":
    sys.exit(main())
