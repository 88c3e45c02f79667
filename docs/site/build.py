"""Builds the site of the documentation: gathers pages, generates the reference, and runs mkdocs.

The pages are those of the repository at the same paths, so that a link works here and there. The reference of the
command line is what `supple help` prints; that of Python is the docstrings of the installed package.

    python docs/site/build.py --programs target/debug [--package PYTHON]
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = ROOT / "target/site/pages"
COPIED = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/*.md", "benches/*/*.md"]
RUST = """# Rust

The crates are documented for rustdoc:

    cargo doc --workspace --exclude supple-python --no-deps --open

[Architecture](../ARCHITECTURE.md) says which crate is what. `supple_core` is the controller; `supple_core::controller::step` is
where to begin reading.
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=Path, required=True, help="folder of the program `supple`")
    parser.add_argument("--package", help="Python that has the package; without it, its page names the command only")
    arguments = parser.parse_args()
    shutil.rmtree(PAGES, ignore_errors=True)
    gather()
    write("docs/command_line.md", command_line(arguments.programs / "supple"))
    write("docs/python.md", python_reference(arguments.package))
    write("docs/rust.md", RUST)
    mkdocs = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet"]
    command = [*mkdocs, "--config-file", str(ROOT / "docs/site/mkdocs.yml")]
    # The theme announces its successor at every build.
    return subprocess.run(command, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}, check=False).returncode


def write(path: str, text: str) -> None:
    target = PAGES / path
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(text, encoding="utf-8")


def gather() -> None:
    """Copies every page, and what it links to or shows."""
    pages = [page for pattern in COPIED for page in sorted(ROOT.glob(pattern))]
    for page in pages:
        text = page.read_text(encoding="utf-8")
        write(str(page.relative_to(ROOT)), text)
        for target in re.findall(r"\]\(([^)#]+)", text):
            linked = (page.parent / target).resolve()
            if "://" in target or linked.suffix == ".md" or not linked.is_file():
                continue
            copy = PAGES / linked.relative_to(ROOT)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(linked, copy)


def command_line(program: Path) -> str:
    """Every command with its help, as clap prints it."""
    sections = ["# Command line\n\nWhat `supple help` prints, command by command.\n"]
    open_commands: list[list[str]] = [[]]
    while open_commands:
        command = open_commands.pop(0)
        help_text = subprocess.run(
            [program, *command, "--help"], check=True, capture_output=True, text=True
        ).stdout
        name = " ".join(["supple", *command])
        sections.append(f"## {name}\n\n```text\n{help_text.strip()}\n```\n")
        found = [[*command, sub] for sub in subcommands(help_text)]
        open_commands = found + open_commands
    return "\n".join(sections)


def subcommands(help_text: str) -> list[str]:
    inside, found = False, []
    for line in help_text.splitlines():
        if line.endswith("Commands:"):
            inside = True
        elif inside and (match := re.match(r"^  ([a-z][a-z-]*)(\s|$)", line)):
            found.append(match[1])
        elif inside and line and not line.startswith(" "):
            inside = False
    return [name for name in found if name != "help"]


def python_reference(package: str | None) -> str:
    if package is None:
        return (
            "# Python\n\nThis site was built without the package; `python -m pydoc supple` shows its reference once it "
            "is installed.\n"
        )
    script = Path(__file__).with_name("python_reference.py")
    return subprocess.run([package, script], check=True, capture_output=True, text=True).stdout


if __name__ == "__main__":
    sys.exit(main())
