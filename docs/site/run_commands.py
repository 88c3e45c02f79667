"""Runs the commands of the documentation: every block of `sh` and `python` of every page, in their order, in one folder for
each page, in which `target/release` has the programs.

`commands.toml` lists each command that is not run, or runs in another form, with the reason; an entry that fits no command is
an error. Figures that a page shows (`<!-- figure: FILE, caption -->`) are files that its commands have written; they are
copied to the folder of --figures.

    python docs/site/run_commands.py --programs target/debug --figures target/site/figures [PAGE...]
"""

from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from pages import FIGURE, NOT_CHECKED, ROOT, Code, blocks, pages, read

TIMEOUT_S = 300
HELPERS = Path(__file__).with_name("helpers.sh")
# What may keep a command from being run by a test.
NEEDS = ("arm", "root", "build", "viewer", "minutes", "clock", "cluster")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=Path, required=True, help="folder of the programs")
    parser.add_argument("--figures", type=Path, help="folder for the figures that pages show")
    parser.add_argument("pages", nargs="*", help="default: all")
    arguments = parser.parse_args()
    chosen = arguments.pages or [page for page in pages() if page not in NOT_CHECKED]
    exceptions = Exceptions.read()
    runner = Runner(arguments.programs.resolve(), arguments.figures, exceptions)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        done = list(pool.map(runner.run, chosen))
    problems = [problem for page in done for problem in page.problems]
    if not arguments.pages:
        problems += exceptions.unused()
    for page in done:
        if page.ran:
            print(f"{page.name}: {page.ran} blocks, {page.seconds:.0f} s")
    print("\n".join([*problems, f"{sum(page.ran for page in done)} blocks run, {len(problems)} problems"]))
    print(f"{exceptions.count('not_run')} commands not run and {exceptions.count('changed')} in another form, see commands.toml")
    return 1 if problems or not any(page.ran for page in done) else 0


@dataclass
class Exceptions:
    """The commands of `commands.toml`, by page and command."""

    entries: dict[tuple[str, str], dict[str, str]]
    used: set[tuple[str, str]] = field(default_factory=set)

    @classmethod
    def read(cls) -> Exceptions:
        """Reads the file and checks the reasons."""
        tables = tomllib.loads(Path(__file__).with_name("commands.toml").read_text(encoding="utf-8"))
        entries = {}
        for kind in ("not_run", "changed"):
            for entry in tables[kind]:
                if kind == "not_run" and entry["needs"] not in NEEDS:
                    raise SystemExit(f"commands.toml: needs: expected one of {', '.join(NEEDS)}, got {entry['needs']}")
                if kind == "not_run" and entry["needs"] in ("minutes", "clock") and not (ROOT / entry["test"]).exists():
                    raise SystemExit(f"commands.toml: no {entry['test']}, which is to test `{entry['command']}`")
                if not entry["why"]:
                    raise SystemExit(f"commands.toml: `{entry['command']}` has no reason")
                entries[entry["page"], entry["command"]] = entry | {"kind": kind}
        return cls(entries)

    def count(self, kind: str) -> int:
        return sum(entry["kind"] == kind for entry in self.entries.values())

    def unused(self) -> list[str]:
        """Entries that fit no command."""
        return [
            f"commands.toml: {page} has no command `{command}`"
            for page, command in self.entries.keys() - self.used
        ]

    def apply(self, block: Code) -> str:
        """The block as a test runs it; empty if nothing is left."""
        lines = []
        for line in block.text.splitlines():
            key = block.page, line.split(" #")[0].strip()
            if key in self.entries:
                self.used.add(key)
                lines.append(self.entries[key].get("runs", ""))
            else:
                lines.append(line)
        code = "\n".join(lines)
        return code if code.strip() else ""


@dataclass
class Page:
    """What the commands of a page came to."""

    name: str
    ran: int = 0
    seconds: float = 0.0
    problems: list[str] = field(default_factory=list)


@dataclass
class Runner:
    """Runs pages, several at once."""

    programs: Path
    figures: Path | None
    exceptions: Exceptions

    def run(self, name: str) -> Page:
        page, begin = Page(name), time.monotonic()
        scripts = [(block, self.exceptions.apply(block)) for block in blocks(name) if block.language in ("sh", "python")]
        page.problems += [
            f"{block}: a block needs a language: sh, python, toml or text" for block in blocks(name) if not block.language
        ]
        with tempfile.TemporaryDirectory(prefix="docs-") as path:
            folder = Path(path)
            (folder / "target").mkdir()
            (folder / "target/release").symlink_to(self.programs)
            # One prefix for each page: its systems are its own.
            environment = os.environ | {
                "PATH": os.pathsep.join([str(self.programs), str(Path(sys.executable).parent), os.environ["PATH"]]),
                "SUPPLE_PREFIX": f"docs-{os.getpid()}-{name.lower().replace('/', '-').split('.')[0].replace('_', '-')}",
                "BASH_ENV": str(HELPERS),
                # Nothing of this user's settings, and nothing left in them.
                "HOME": path,
                "MPLBACKEND": "Agg",
            }
            with started_processes(environment) as groups:
                for block, script in scripts:
                    if script and not self.run_block(page, block, script, folder, environment, groups):
                        break
            if not page.problems:
                page.problems += self.keep_figures(name, folder)
        page.seconds = time.monotonic() - begin
        return page

    def run_block(
        self, page: Page, block: Code, script: str, folder: Path, environment: dict[str, str], groups: list[int]
    ) -> bool:
        """Runs a block; false if it failed."""
        command = ["bash", "-euo", "pipefail", "-c", script]
        if block.language == "python":
            command = [sys.executable, "-W", "error", "-c", script]
        with (folder / ".output").open("w+") as output:
            process = subprocess.Popen(
                command, cwd=folder, env=environment, stdout=output, stderr=output, stdin=subprocess.DEVNULL,
                start_new_session=True,
            )  # fmt: skip
            groups.append(process.pid)
            try:
                status = str(process.wait(TIMEOUT_S))
            except subprocess.TimeoutExpired:
                status = f"none after {TIMEOUT_S} s"
                process.kill()
                process.wait()
            output.seek(0)
            text = output.read()
        page.ran += 1
        if status != "0":
            background = folder / ".background"
            if background.exists():
                text += "the system in the background:\n" + background.read_text(errors="replace")
            page.problems.append(f"{block}: exit code {status}\n{script}\n{text}")
        return status == "0"

    def keep_figures(self, name: str, folder: Path) -> list[str]:
        """Copies the figures that the page shows; what is missing."""
        missing = []
        for match in FIGURE.finditer(read(name)):
            made = folder / match["file"]
            if not made.is_file():
                missing.append(f"{name}: no command has written {match['file']}")
            elif self.figures is not None:
                target = self.figures / Path(name).stem / made.name
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(made, target)
        return missing


@contextlib.contextmanager
def started_processes(environment: dict[str, str]) -> Iterator[list[int]]:
    """Process groups of blocks; at the end, what is left of them is ended."""
    groups: list[int] = []
    try:
        yield groups
    finally:
        if any(alive(group) for group in groups):
            with contextlib.suppress(subprocess.TimeoutExpired):
                subprocess.run(["supple", "stop"], env=environment, capture_output=True, check=False, timeout=30.0)
        for number, seconds in ((signal.SIGTERM, 20.0), (signal.SIGKILL, 5.0)):
            left = [group for group in groups if alive(group)]
            for group in left:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(group, number)
            end = time.monotonic() + seconds
            while any(alive(group) for group in left) and time.monotonic() < end:
                time.sleep(0.05)


def alive(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


if __name__ == "__main__":
    sys.exit(main())
