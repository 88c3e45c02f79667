#!/usr/bin/env python3
"""Calibrates simulated arms without brakes from wrong models, seed by seed, and prints a row of results for each.

The steps are those of `supple calibrate` and `supple hold-check`; this script only runs them and reads their results:

    cargo build --release
    benches/calibrations.py --arms openarm,yam --seeds 0-9                    # in one process
    benches/calibrations.py --arms yam --seeds 0-9 --plant emu                # through the emulated bus, in virtual time
    benches/calibrations.py --plant-options assets/plants/geared-motors.toml    # another plant

The starting models are 15 % off in gravity, 50 % in friction and 100 % in rotor inertia. A seed without a result is a row with the
reason. Python 3.11 or later; no packages.
"""

import argparse
import concurrent.futures
import json
import pathlib
import subprocess
import sys

# A tenth of the stiffness that the makers' programs use [N m/rad].
WEAK_NM_PER_RAD = {"openarm": "24,24,24,24,2.4,3.1,2.5", "yam": "8,8,8,1,1,1"}
HEADER = (
    "| arm | seed | motion [min] | unexplained [%] | float [mrad] | verdict [mm] | model alone [mm] | learning [mm] | contacts "
    "| hold: drift [mm] | stiffness: error [mrad] |\n|---|---|---|---|---|---|---|---|---|---|---|"
)


def seeds(text):
    """Returns the seeds of `0-9` or `0,3,5`."""
    if "-" in text:
        first, last = text.split("-")
        return range(int(first), int(last) + 1)
    return [int(seed) for seed in text.split(",")]


def run(program, arguments, folder, limit_s):
    """Runs a command, with its output in a file; returns the last line of its errors if it fails."""
    log = folder.with_suffix(".log")
    with log.open("ab") as output:
        done = subprocess.run([program, *arguments], stdout=output, stderr=output, timeout=limit_s, check=False)
    if done.returncode == 0:
        return None
    lines = log.read_text(errors="replace").strip().splitlines()
    return f"exit code {done.returncode}: {lines[-1] if lines else 'no output'}"


def number(value, scale=1.0, digits=1):
    """Returns a value in other units as text."""
    return "fault" if value is None else f"{scale * value:.{digits}f}"


def row(options, arm, seed):
    """Calibrates one arm and checks how its model holds; returns a row of the table."""
    program = options.programs / "supple"
    folder = options.out / f"{arm}-{seed}"
    plant = ["--arm", arm, "--seed", str(seed), "--yes", "--plant", options.plant, "--plant-options", options.plant_options]
    if options.plant == "emu":
        plant += ["--virtual-time", "--no-realtime", "--prefix", f"calibrations_{arm}_{seed}_"]
    start = ["--start-error", "0.15,0.5,1"]
    failed = run(program, ["calibrate", *plant, *start, "--out", str(folder)], folder, options.limit_s)
    if failed:
        return f"| {arm} | {seed} | {failed} |"
    found = json.loads((folder / "calibration.json").read_text())
    fit, sinusoid = found["fit"], found["sinusoid"] or {}
    interval = fit["interval_at_5_n_per_m"]
    verdict = "-" if interval is None else f"{1e3 * interval['lower_m']:.0f} to {1e3 * interval['upper_m']:.0f}"
    cells = [
        arm,
        str(seed),
        number(found["moved_s"], 1 / 60, 2),
        number(fit["validation_relative"], 100),
        number(found["float_drift_rad"], 1e3, 0),
        verdict,
        number(sinusoid.get("calibrated_rms_m"), 1e3),
        number(sinusoid.get("learning_rms_m"), 1e3),
        str(sinusoid.get("false_contacts", 0)),
    ]
    if options.hold:
        held = folder / "hold"
        weak = ["--model", str(folder), "--stiffness", WEAK_NM_PER_RAD[arm]]
        failed = run(program, ["hold-check", *plant, *weak, "--out", str(held)], folder, options.limit_s)
        cells += [failed, ""] if failed else hold_cells(json.loads((held / "summary.json").read_text()))
    return "| " + " | ".join(cells) + " |"


def hold_cells(summary):
    """Returns drift and worst joint error of a hold check."""
    poses = summary["poses"]
    drift_m = max((pose["tip_drift_m"] for pose in poses if pose["tip_drift_m"] is not None), default=None)
    errors = [
        (error, joint)
        for pose in poses
        for error, joint in zip(pose["joint_error_rad"], summary["joints"], strict=False)
    ]
    worst_rad, joint = max(errors, default=(None, "-"))
    return [number(drift_m, 1e3), f"{number(worst_rad, 1e3)} ({joint})"]


def main():
    """Runs the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arms", default="openarm,yam", help="arms, separated by commas: openarm, yam")
    parser.add_argument("--seeds", type=seeds, default=range(10), help="0-9 or 0,3,5")
    parser.add_argument("--plant", choices=["in-process", "emu"], default="in-process")
    parser.add_argument("--plant-options", default="openarm-realistic", metavar="NAME|FILE")
    parser.add_argument("--no-hold", dest="hold", action="store_false", help="leave out the check of holding")
    parser.add_argument("--programs", type=pathlib.Path, default=pathlib.Path("target/release"), metavar="DIR")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/calibrations"), metavar="DIR")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="calibrations at a time")
    parser.add_argument("--limit-s", type=float, default=1800.0, help="time limit of each command [s]")
    options = parser.parse_args()
    if not (options.programs / "supple").exists():
        sys.exit(f"{options.programs / 'supple'} does not exist: run cargo build --release, or give --programs")
    options.out.mkdir(parents=True, exist_ok=True)
    print(HEADER, flush=True)

    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        rows = [pool.submit(row, options, arm, seed) for arm in options.arms.split(",") for seed in options.seeds]
        for done in rows:
            print(done.result(), flush=True)


if __name__ == "__main__":
    main()
