#!/usr/bin/env python3
"""Public URDFs, unedited: `supple new`, `supple demo`, `supple up --plant sim` and an identification on each, in virtual time.

A case passes if

- `supple new` writes the arm, and its run of 5 s on the sinusoid errs no more than `allowed_error_m` (15 mm, more in
  proportion for an arm that weighs more than 23 N at the tip), without a fault;
- the demo ends with code 0, none of its sinusoids at 5 N/m with a model that is 0.1 % and 3 % off was made smaller or left
  out, and the worst of them errs no more than that either;
- `up` tracks for 60 s without a fault.

What `excite design`, `excite run` and `identify` give is reported, and judges no case: derived thresholds end the excitation of
some arms with a fault.

Run it with the interpreter of a virtual environment that has requirements.txt, with `--all` requirements-held-back.txt:

    python tests/any_arm/run.py --programs target/release [--all] [--steps NAME,NAME] [--only NAME] [--jobs N] [--out FOLDER]
                                [--table FILE]
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from cases import REPOSITORY, Case, Missing, chosen
from table import Outcome, write

TRACKED_S = 60
# Of each command, on a busy machine.
LIMIT_S = 1200

Step = Callable[[Path, Case, Path, int], str]


class Failed(Exception):
    """A command did not give what a case needs."""


def command(arguments: list[str]) -> subprocess.CompletedProcess[str]:
    """The command, ended; raises if its code is not 0."""
    try:
        done = subprocess.run(arguments, capture_output=True, text=True, timeout=LIMIT_S, check=False)
    except subprocess.TimeoutExpired as error:
        raise Failed(f"not ended after {LIMIT_S} s") from error
    if done.returncode != 0:
        errors = [line for line in done.stderr.splitlines() if line.startswith("error:")]
        raise Failed(f"code {done.returncode}: {' '.join(errors) or done.stderr.strip()[-300:]}")
    return done


def new(programs: Path, case: Case, out: Path, _number: int) -> str:
    """Makes an arm of the URDF; returns its first run."""
    tip = ["--tip", case.tip] if case.tip else []
    repair = ["--repair"] if case.repair else []
    done = command(
        [str(programs / "supple-report"), "new", case.file, *tip, *repair]
        + ["--json", "--force", "--out", str(out / "arm")]
    )
    found = json.loads(done.stdout)
    rms_m, allowed_m, fault = found["rms_error_m"], found["allowed_error_m"], found["fault"]
    if fault is not None:
        raise Failed(f"a fault in the first run: {fault}")
    if not rms_m <= allowed_m:
        raise Failed(f"{1e3 * rms_m:.1f} mm RMS, {1e3 * allowed_m:.1f} mm allowed")
    return f"{1e3 * rms_m:.1f} of {1e3 * allowed_m:.1f} mm"


def is_the_sinusoid(run: str) -> bool:
    """Whether a run of the demo is the sinusoid at its speed with one of the models that are off."""
    return run == "sinusoid_speed_1" or run.startswith("sinusoid_model_")


def demo(programs: Path, case: Case, out: Path, _number: int) -> str:
    """Runs the demo; returns the worst of its sinusoids."""
    done = command(
        [str(programs / "supple-report"), "demo", "--arm", case.name, "--quiet", "--json"]
        + ["--realistic-seeds", "0", "--no-logs", "--out", str(out / "demo")]
    )
    summary = json.loads(done.stdout)
    seeds, allowed_m, adapted = summary["perturbed_rms_m"], summary["allowed_error_m"], summary.get("adapted", [])
    gone = [row for row in adapted if is_the_sinusoid(row["run"])]
    if gone or not seeds or None in seeds:
        raise Failed(f"the sinusoid was made smaller or left out: {gone or seeds}")
    if not max(seeds) <= allowed_m:
        raise Failed(f"{1e3 * max(seeds):.1f} mm RMS, {1e3 * allowed_m:.1f} mm allowed")
    smaller = sum("scale" in row for row in adapted)
    return (
        f"{1e3 * max(seeds):.1f} of {1e3 * allowed_m:.1f} mm; "
        f"other runs: {smaller} smaller, {len(adapted) - smaller} left out"
    )


def up(programs: Path, case: Case, out: Path, number: int) -> str:
    """Tracks on processes; returns how well."""
    done = command(
        [str(programs / "supple"), "up", "--plant", "sim", "--virtual-time", "--for", str(TRACKED_S), "--json"]
        + ["--arm", case.name, "--prefix", f"any_arm_{os.getpid()}_{number}_", "--log", str(out / "up.mcap")]
    )
    found = json.loads(done.stdout)
    if found["faults"]:
        raise Failed(f"faults: {found['faults']}")
    return f"{1e3 * found['rms_error_m']:.1f} mm, no fault in {TRACKED_S} s"


def identify(programs: Path, case: Case, out: Path, _number: int) -> str:
    """Excites the simulated arm and identifies it; returns what the model leaves of a motion that was not fitted."""
    program, arm = str(programs / "supple-report"), ["--arm", case.name]
    design, excited = str(out / "design"), str(out / "excited")
    log = str(Path(excited) / "logs" / "excitation.mcap")
    try:
        command([program, "excite", "design", *arm, "--quiet", "--out", design])
        command([program, "excite", "run", *arm, "--design", design, "--out", excited])
        done = command([program, "identify", *arm, "--quiet", "--json", "--out", str(out / "identified"), log])
    except Failed as error:
        return f"no model: {error}"
    left = max(motion["total_relative"] for motion in json.loads(done.stdout)["held_out"])
    return f"{100 * left:.1f} % left"


STEPS: dict[str, Step] = {"new": new, "demo": demo, "up": up, "identify": identify}


def attempt(steps: dict[str, Step], programs: Path, case: Case | Missing, results: Path, number: int) -> Outcome:
    """Tries a case."""
    if isinstance(case, Missing):
        return Outcome(case.text, skipped=case.why)
    out = results / f"{number:02}"
    out.mkdir(parents=True, exist_ok=True)
    outcome, since = Outcome(case.text), time.monotonic()
    for name, step in steps.items():
        try:
            outcome.found[name] = step(programs, case, out, number)
        except (Failed, KeyError, ValueError) as error:
            outcome.problems.append(f"{name}: {error}")
    outcome.took_s = time.monotonic() - since
    return outcome


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=Path, default=REPOSITORY / "target" / "release")
    parser.add_argument("--all", action="store_true", help="also the cases that are held back")
    parser.add_argument("--steps", default=",".join(STEPS), help="which of new, demo, up, identify; default: all")
    parser.add_argument("--jobs", type=int, default=2, help="cases at a time")
    parser.add_argument("--only", default="", help="cases whose path contains one of these, separated by commas")
    parser.add_argument("--out", type=Path, help="keep the results here")
    parser.add_argument("--table", type=Path, help="write the results as Markdown")
    options = parser.parse_args()
    steps = {name: STEPS[name] for name in options.steps.split(",")}
    outcomes: list[Outcome] = []
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(options.jobs) as pool:
        results = options.out or Path(folder)
        for outcome in pool.map(
            lambda item: attempt(steps, options.programs, item[1], results, item[0]),
            enumerate(chosen(options.all, options.only)),
        ):
            outcomes.append(outcome)
            print(outcome.line(), flush=True)
    tried = [outcome for outcome in outcomes if outcome.skipped is None]
    passed = sum(not outcome.problems for outcome in tried)
    print(f"{passed} of {len(tried)} arms, {len(outcomes) - len(tried)} skipped")
    if options.table:
        write(options.table, outcomes)
    return 0 if tried and passed == len(tried) else 1


if __name__ == "__main__":
    sys.exit(main())
