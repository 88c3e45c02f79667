"""Compares batched calls of supple with a loop over Pinocchio, on the same states in the same run.

Both fill a preallocated array on one thread, and their results are compared number by number. Rounds
alternate, so that other load of the machine affects both; the result is the median of the ratios.

    python benchmarks/regressor.py [--samples 100000] [--rounds 7] [--json FILE]

Exits with 1 if the numbers disagree, or if the regressor is less than 5 times faster.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np
import pinocchio as pin
import supple

AGREEMENT = 1e-9
TARGET = 5.0


def loop(function: Callable[..., np.ndarray], arguments: list[np.ndarray], out: np.ndarray) -> None:
    """One call of the peer for each state."""
    for k, state in enumerate(zip(*arguments, strict=True)):
        out[k] = function(*state)


def seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def compare(
    name: str,
    ours: Callable[..., np.ndarray],
    theirs: Callable[..., np.ndarray],
    arguments: list[np.ndarray],
    shape: tuple[int, ...],
    rounds: int,
) -> dict[str, Any]:
    """Measures both alternately; returns one line of the table."""
    samples = len(arguments[0])
    # Ones, so that every page is mapped before the first round.
    mine, peer = np.ones((samples, *shape)), np.ones((samples, *shape))
    times: list[tuple[float, float]] = []
    for _ in range(rounds):
        our_s = seconds(lambda: ours(*arguments, out=mine))
        their_s = seconds(lambda: loop(theirs, arguments, peer))
        times.append((our_s, their_s))
    worst = float((np.abs(mine - peer) / (1.0 + np.abs(peer))).max())
    line = {
        "name": name,
        "supple_ns": 1e9 * statistics.median(t[0] for t in times) / samples,
        "pinocchio_ns": 1e9 * statistics.median(t[1] for t in times) / samples,
        "ratio": statistics.median(t[1] / t[0] for t in times),
        "disagreement": worst,
    }
    print(
        f"{name:18} {line['supple_ns']:10.0f} {line['pinocchio_ns']:12.0f}"
        f" {line['ratio']:8.1f} {worst:14.1e}"
    )
    return line


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--arm", default="wam7", help="a built-in arm, or the path of its TOML")
    parser.add_argument("--samples", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--json", type=Path, help="output file for the results")
    options = parser.parse_args()

    arm = supple.Arm.load(options.arm)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.urdf"
        path.write_text(arm.urdf)
        model = pin.buildModelFromUrdf(str(path))
    # The tool of the TOML is not part of the URDF: the peer receives our parameters.
    for link, parameters in enumerate(arm.parameters.reshape(arm.dof, 10), start=1):
        model.inertias[link] = pin.Inertia.FromDynamicParameters(parameters)
    model.gravity.linear = arm.gravity_m_per_s2
    model.armature = arm.armature
    data = model.createData()
    rng = np.random.default_rng(0)
    q, qd, qdd = rng.uniform(-1.5, 1.5, size=(3, options.samples, arm.dof))
    n = arm.dof

    def crba(q: np.ndarray) -> np.ndarray:
        upper = pin.crba(model, data, q)
        return np.asarray(np.triu(upper) + np.triu(upper, 1).T)

    print(f"{arm.name}, {options.samples} states, {options.rounds} alternating rounds, one thread")
    print(f"{'':18} {'supple ns':>10} {'pinocchio ns':>12} {'ratio':>8} {'disagreement':>14}")
    lines = [
        compare(
            "regressor",
            arm.regressor,
            lambda *s: pin.computeJointTorqueRegressor(model, data, *s),
            [q, qd, qdd],
            (n, 10 * n),
            options.rounds,
        ),
        compare("rnea", arm.rnea, lambda *s: pin.rnea(model, data, *s), [q, qd, qdd], (n,), options.rounds),
        compare("mass_matrix", arm.mass_matrix, crba, [q], (n, n), options.rounds),
        compare(
            "forward_dynamics",
            arm.forward_dynamics,
            lambda *s: pin.aba(model, data, *s),
            [q, qd, qdd],
            (n,),
            options.rounds,
        ),
        compare(
            "gravity",
            arm.gravity,
            lambda q: pin.computeGeneralizedGravity(model, data, q),
            [q],
            (n,),
            options.rounds,
        ),
    ]
    if options.json:
        versions = {"supple": supple.__version__, "pinocchio": pin.__version__}
        options.json.write_text(json.dumps({"versions": versions, "lines": lines}, indent=2) + "\n")
    wrong = [line["name"] for line in lines if line["disagreement"] > AGREEMENT]
    if wrong:
        print(f"disagreement above {AGREEMENT}: {', '.join(wrong)}", file=sys.stderr)
        return 1
    if lines[0]["ratio"] < TARGET:
        print(f"regressor: {lines[0]['ratio']:.1f} times faster, target {TARGET}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
