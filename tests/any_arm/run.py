#!/usr/bin/env python3
"""Public URDFs, unedited: `supple demo` and `supple up --plant sim` on each, in virtual time.

A case passes if the demo ends with code 0, if the worst of its ten models that are 0.1 % and 3 % off errs no more than
`allowed_error_m` of its `summary.json` (15 mm, more in proportion for an arm that weighs more than 23 N at the tip), and if
`up` tracks for 60 s without a fault. Run it with the interpreter of a virtual environment that has requirements.txt, with
`--all` requirements-held-back.txt:

    python tests/any_arm/run.py --programs target/release [--all] [--only NAME] [--out FOLDER]
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import sysconfig
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parent.parent
TRACKED_S = 60
# Of each of the two commands, on a busy machine.
LIMIT_S = 1200


def cases(held_back: bool) -> list[str]:
    packages = sysconfig.get_paths()["purelib"]
    found = []
    for line in (HERE / "cases.txt").read_text().splitlines():
        if line == "# held back" and not held_back:
            break
        if line and not line.startswith("#"):
            found.append(line.replace("PACKAGES", packages).replace("REPOSITORY", str(REPOSITORY)))
    return found


def command(arguments: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(arguments, capture_output=True, text=True, timeout=LIMIT_S, check=False)


def named(case: str) -> list[str]:
    """The arguments that name the arm."""
    name, _, options = case.partition(",")
    return ["--arm", name, *(["--repair"] if options == "repair" else [])]


def demo(programs: Path, case: str, out: Path) -> str:
    """Runs the demo; returns what it found, or raises."""
    done = command(
        [str(programs / "supple-report"), "demo", *named(case), "--quiet", "--json"]
        + ["--realistic-seeds", "0", "--no-logs", "--out", str(out / "demo")]
    )
    if done.returncode != 0:
        raise RuntimeError(f"demo: code {done.returncode}: {done.stderr.strip()[-500:]}")
    summary = json.loads(done.stdout)
    worst_m, allowed_m = max(summary["seeds"], default=float("nan")), summary["allowed_error_m"]
    adapted = summary.get("adapted", [])
    smaller = sum("scale" in row for row in adapted)
    if not worst_m <= allowed_m:
        raise RuntimeError(f"demo: {1e3 * worst_m:.1f} mm RMS, {1e3 * allowed_m:.1f} mm allowed; {adapted}")
    return (
        f"{1e3 * worst_m:5.1f} of {1e3 * allowed_m:.1f} mm, {smaller} runs smaller, {len(adapted) - smaller} left out"
    )


def up(programs: Path, case: str, out: Path, number: int) -> str:
    """Tracks on processes; returns what it found, or raises."""
    done = command(
        [str(programs / "supple"), "up", "--plant", "sim", "--virtual-time", "--for", str(TRACKED_S), *named(case)]
        + ["--json", "--prefix", f"any_arm_{number}_", "--log", str(out / "up.mcap")]
    )
    if done.returncode != 0:
        raise RuntimeError(f"up: code {done.returncode}: {(done.stderr + done.stdout).strip()[-500:]}")
    return f"up {json.loads(done.stdout)['faults'] or 'without a fault'}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=Path, default=REPOSITORY / "target" / "release")
    parser.add_argument("--all", action="store_true", help="also the cases that are held back")
    parser.add_argument("--only", default="", help="cases whose path contains this")
    parser.add_argument("--out", type=Path, help="keep the results here")
    options = parser.parse_args()
    failed = 0
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(1) as beside:
        chosen = [case for case in cases(options.all) if options.only in case]
        for number, case in enumerate(chosen):
            out = (options.out or Path(folder)) / f"{number:02}"
            out.mkdir(parents=True, exist_ok=True)
            since = time.monotonic()
            # The processes wait for each other most of the time: beside the demo they cost little.
            tracked = beside.submit(up, options.programs, case, out, number)
            results, problems = [], []
            for result in (lambda: demo(options.programs, case, out), tracked.result):
                try:
                    results.append(result())
                except (RuntimeError, subprocess.TimeoutExpired, KeyError, ValueError) as error:
                    problems.append(str(error))
            failed += bool(problems)
            verdict = f"FAILED: {'; '.join(problems)}" if problems else "; ".join(results)
            name = case.rsplit("/", 1)[-1]
            print(f"{name:44} {verdict}; {time.monotonic() - since:.0f} s", flush=True)
    print(f"{len(chosen) - failed} of {len(chosen)} arms")
    return 1 if failed or not chosen else 0


if __name__ == "__main__":
    sys.exit(main())
