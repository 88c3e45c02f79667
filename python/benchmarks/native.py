"""Overhead of batched calls from Python relative to the same loop in Rust.

    python benchmarks/native.py [--arm wam7] [--samples 2000] [--rounds 60] [--json FILE]

Each round times Rust and Python in turn and takes the minimum of three passes over states that fit in the cache. The
result is the median of the ratios. Exits with 1 if any median is above 1.3.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import supple

ROOT = Path(__file__).resolve().parents[2]
MAX_RATIO = 1.3


def native_loop() -> Path:
    """Builds the loop in Rust and returns its path."""
    example = ["--release", "--package", "supple-model", "--example", "state_loop"]
    command = ["cargo", "build", "--locked", *example, "--message-format", "json"]
    # The folder in which the package's own compiler flags apply.
    folder = ROOT / "python"
    built = subprocess.run(command, cwd=folder, check=True, stdout=subprocess.PIPE, text=True)
    messages = [json.loads(line) for line in built.stdout.splitlines()]
    return Path(next(m["executable"] for m in reversed(messages) if m.get("executable")))


def batched(arm: supple.Arm, samples: int) -> dict[str, float]:
    """Nanoseconds per state of each function."""
    q, qd, qdd = np.random.default_rng(0).uniform(-1.5, 1.5, size=(3, samples, arm.dof))
    position = np.ascontiguousarray(qdd[:, :3])
    calls: dict[str, Callable[..., np.ndarray]] = {
        "rnea": partial(arm.rnea, q, qd, qdd),
        "mass_matrix": partial(arm.mass_matrix, q),
        "forward_dynamics": partial(arm.forward_dynamics, q, qd, qdd),
        "gravity": partial(arm.gravity, q),
        "impedance_torque": partial(arm.impedance_torque, q, qd, position, stiffness=5.0, damping=1.5),
    }
    costs = {}
    for name, call in calls.items():
        out = call()
        passes = []
        for _ in range(3):
            start = time.perf_counter()
            call(out=out)
            passes.append(time.perf_counter() - start)
        costs[name] = 1e9 * min(passes) / samples
    return costs


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--arm", default="wam7", help="a built-in arm, or the path of its TOML")
    parser.add_argument("--samples", type=int, default=2_000)
    parser.add_argument("--rounds", type=int, default=60)
    parser.add_argument("--json", type=Path, help="output file for the results")
    options = parser.parse_args()

    arm = supple.Arm.load(options.arm)
    command = [str(native_loop()), options.arm, str(options.samples)]
    rounds = []
    for _ in range(options.rounds):
        printed = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
        rounds.append((json.loads(printed), batched(arm, options.samples)))
    print(f"{arm.name}, {options.samples} states, {options.rounds} alternating rounds, ns per state")
    print(f"{'':18} {'Rust':>8} {'Python':>8} {'ratio':>8}")
    lines = []
    for name in rounds[0][0]:
        line = {
            "name": name,
            "rust_ns": statistics.median(native[name] for native, _ in rounds),
            "python_ns": statistics.median(python[name] for _, python in rounds),
            "ratio": statistics.median(python[name] / native[name] for native, python in rounds),
        }
        lines.append(line)
        print(f"{name:18} {line['rust_ns']:8.0f} {line['python_ns']:8.0f} {line['ratio']:8.2f}")
    if options.json:
        options.json.write_text(json.dumps(lines, indent=2) + "\n")
    slow = [line["name"] for line in lines if line["ratio"] > MAX_RATIO]
    if slow:
        print(f"above {MAX_RATIO} times the loop in Rust: {', '.join(slow)}", file=sys.stderr)
    return 1 if slow else 0


if __name__ == "__main__":
    sys.exit(main())
