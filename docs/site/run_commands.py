"""Runs the commands of the documentation: every block of `sh` and `python` of the pages in docs/, in their order, one
folder for each page.

A block after a comment `<!-- not run: why -->` is left out; the comment says why. A block of Python is left out where the
package is not installed (--package).

    python docs/site/run_commands.py --programs target/debug [--package PYTHON] [PAGE...]
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"(<!-- not run: (?P<why>[^>]+) -->\n)?```(?P<language>sh|python)\n(?P<code>.*?)```", re.DOTALL)
TIMEOUT_S = 600


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=Path, required=True, help="folder of the programs")
    parser.add_argument("--package", help="Python that has the package")
    parser.add_argument("pages", nargs="*", type=Path, help="default: every page in docs/")
    arguments = parser.parse_args()
    environment = os.environ | {
        "PATH": f"{arguments.programs.resolve()}{os.pathsep}{os.environ['PATH']}",
        "SUPPLE_PREFIX": f"docs-{os.getpid()}",
    }
    failed = ran = 0
    for page in arguments.pages or sorted((ROOT / "docs").glob("*.md")):
        with tempfile.TemporaryDirectory() as folder:
            for block in BLOCK.finditer(page.read_text(encoding="utf-8")):
                command = to_run(block, arguments.package)
                if command is None:
                    continue
                done = subprocess.run(
                    command,
                    cwd=folder,
                    env=environment,
                    capture_output=True,
                    text=True,
                    timeout=TIMEOUT_S,
                    check=False,
                )
                ran += 1
                if done.returncode != 0:
                    failed += 1
                    line = block.string.count("\n", 0, block.start("code")) + 1
                    print(f"{page.name}:{line}: exit code {done.returncode}\n{block['code']}{done.stdout}{done.stderr}")
    print(f"{ran} blocks run, {failed} failed")
    return 1 if failed or not ran else 0


def to_run(block: re.Match[str], package: str | None) -> list[str] | None:
    if block["why"]:
        return None
    if block["language"] == "sh":
        return ["bash", "-euo", "pipefail", "-c", block["code"]]
    return [package, "-W", "error", "-c", block["code"]] if package else None


if __name__ == "__main__":
    sys.exit(main())
