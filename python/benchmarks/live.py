"""The live Python interface on a running simulated system: accuracy of streamed set-points, and the time from a call to its torque.

    python benchmarks/live.py [--programs FOLDER] [--rounds 5] [--calls 300] [--json FILE]

Starts `supple up --plant sim`, which runs by the wall clock, and connects to it.

stream: the paper's sinusoid (0.2 m, period 8 s), once from the start pose. A round has three runs per stiffness, one after
the other: the controller's own trajectory; positions alone, streamed at 100 Hz; positions, velocities and accelerations,
streamed. Before each, the joints move to the same pose and the tip rests at the centre. Runs are aligned by the lag in whole
cycles at which their references differ least, and the tips are compared cycle by cycle. Every streamed run is compared with every
run of the controller's own trajectory, and these with each other, which is the repeatability. The tip is that of the
controller, from the encoders. When the host is busy the drive gets no torque in some cycles, which disturbs every kind of run: the
missed cycles are counted. So the same runs follow on a system inside the process, where time waits for the program.

latency: calls at random phases of the cycle, gains and set-points by turns. The time is from just before the call in Python to
the end of the controller's step in the first cycle

- in which the controller carries out the request,
- whose torque reflects it: gains act in the cycle that carries them out. A set-point changes the reference from the next
  cycle on, because the motion to it begins at the present reference.

Both ends are readings of the monotonic clock. The step's end is the measurement's time stamp, plus the time from it to the
start of the step, plus the duration of the step. The drive applies the torque in its next cycle, which is not counted.

The program only reports: it ends with 0 whatever it measured.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import os
import platform
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import supple
from numpy.typing import NDArray

Array = NDArray[np.float64]
ROOT = Path(__file__).resolve().parents[2]

# The paper's sinusoid, from the start of its ramp.
CENTRE_M = np.array([0.6, 0.0, 0.0])
AMPLITUDE_M = np.array([0.2, 0.0, 0.0])
ANGULAR_FREQUENCY_RAD_PER_S = np.pi / 4.0
RAMP_S = 1.0
RUN_S = 9.0
# Time at the start that is not compared, and the largest lag between two runs.
SKIPPED_S, MAX_LAG_S = 0.1, 0.1
MOVE_S, SETTLE_S = 1.5, 1.0
# The law's gains in `supple up`; the damping grows with the square root of the stiffness.
STIFFNESS_N_PER_M, DAMPING_N_S_PER_M = 5.0, 1.5

TARGET_M = 1e-3
TARGET_BESIDE_PERIOD_S = 1e-4
INTERNAL, POSITIONS, DERIVATIVES = "internal", "positions", "positions, velocities, accelerations"


class HostTooSlow(Exception):
    """The controller latched a fault because the host delayed a cycle for too long."""


@dataclass(frozen=True)
class Trace:
    """Cycles of a run from its start; those that did not reach this program are NaN."""

    reference_m: Array
    tip_m: Array
    missed_cycles: int
    """Cycles for which the drive had no torque in time."""
    in_contact: int
    """Cycles in which the controller took the motion for a contact, and faded the friction feed-forward."""
    unseen: int
    """Cycles that did not reach this program."""
    late_set_points: int
    load: float

    def disturbances(self) -> dict[str, float]:
        names = ("missed_cycles", "in_contact", "unseen", "late_set_points", "load")
        return {name: getattr(self, name) for name in names}


@contextlib.contextmanager
def running(options: argparse.Namespace) -> Iterator[supple.System]:
    """A simulated system, until it tracks."""
    command = [str(options.programs / "supple"), "up", "--plant", "sim", "--no-log", "--prefix", options.prefix]
    if not options.realtime:
        command.append("--no-realtime")
    with tempfile.TemporaryDirectory() as folder:
        up = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            with supple.connect(options.prefix, timeout_s=30.0) as system:
                while system.state.mode != "track":
                    check_fault(system.wait(0.1))
                yield system
        finally:
            up.send_signal(signal.SIGTERM)
            up.wait(30)


@contextlib.contextmanager
def repeated(faults: list[str]) -> Iterator[None]:
    """Adds the fault that ended a measurement to the list; the caller repeats it, ten times at most."""
    try:
        yield
    except (HostTooSlow, supple.Refused) as fault:
        faults.append(str(fault))
        print(f"  repeated: {fault}", file=sys.stderr, flush=True)
        if len(faults) > 10:
            raise


def check_fault(state: supple.State) -> None:
    if state.fault is not None:
        raise HostTooSlow(state.fault)


def sinusoid(t_s: float) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration of the controller's trajectory."""
    omega = ANGULAR_FREQUENCY_RAD_PER_S
    if t_s >= RAMP_S:
        path_s, rate, rate_per_s = t_s - 0.5 * RAMP_S, 1.0, 0.0
    else:
        x = t_s / RAMP_S
        path_s = RAMP_S * x**4 * (2.5 + x * (x - 3.0))
        rate = x**3 * (10.0 + x * (6.0 * x - 15.0))
        rate_per_s = 30.0 * x**2 * (1.0 - x) ** 2 / RAMP_S
    sine, cosine = np.sin(omega * path_s), np.cos(omega * path_s)
    return (
        CENTRE_M + AMPLITUDE_M * sine,
        AMPLITUDE_M * (omega * rate * cosine),
        AMPLITUDE_M * (omega * rate_per_s * cosine - (omega * rate) ** 2 * sine),
    )


class Recorder:
    """Collects every cycle: of a running system in a thread, over a connection of its own."""

    def __init__(self, system: supple.System) -> None:
        self._system = system
        self._blocks: list[supple.States] = []
        self._ended = threading.Event()
        self._watching = supple.connect(system.prefix, watch=True) if system.is_live else None
        self._thread = threading.Thread(target=self._collect)

    def __enter__(self) -> Recorder:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.read()
        self._ended.set()
        self._thread.join()
        if self._watching is not None:
            self._watching.close()

    def read(self) -> None:
        """Reads what a system inside the process keeps of the last cycles; reading takes none of its time."""
        if not self._system.is_live:
            self._blocks.append(self._system.recent(0.6 * RUN_S))

    def _collect(self) -> None:
        if self._watching is None:
            return
        for block in self._watching.stream(0.25):
            self._blocks.append(block)
            if self._ended.is_set():
                return

    def trace(self, begin: int, cycles: int, late_set_points: int) -> Trace:
        """The cycles from `begin` on."""
        reference_m, tip_m = np.full((cycles, 3), np.nan), np.full((cycles, 3), np.nan)
        missed = np.full(cycles, np.nan)
        contact = np.zeros(cycles)
        for block in self._blocks:
            inside = (block.cycle >= begin) & (block.cycle < begin + cycles)
            at = block.cycle[inside] - begin
            reference_m[at] = block.reference_position_m[inside]
            tip_m[at] = block.tip_position_m[inside]
            missed[at] = block.columns["missed_cycles"][inside]
            contact[at] = block.columns["in_contact"][inside]
        return Trace(
            reference_m,
            tip_m,
            missed_cycles=int(np.nanmax(missed) - np.nanmin(missed)),
            in_contact=int(contact.sum()),
            unseen=int(np.isnan(missed).sum()),
            late_set_points=late_set_points,
            load=os.getloadavg()[0],
        )


def run(system: supple.System, kind: str, stiffness_n_per_m: float, start_rad: Array, rate_hz: float) -> Trace:
    """One run."""
    damping = DAMPING_N_S_PER_M * np.sqrt(stiffness_n_per_m / STIFFNESS_N_PER_M)
    system.move(start_rad, MOVE_S)
    system.gains(stiffness_n_per_m=stiffness_n_per_m, damping_n_s_per_m=damping, ramp_s=0.2)
    system.request("track", CENTRE_M, trajectory="hold")
    check_fault(system.wait(SETTLE_S))
    late = 0
    with Recorder(system) as recorder:
        if kind == INTERNAL:
            frequency_hz = ANGULAR_FREQUENCY_RAD_PER_S / (2.0 * np.pi)
            begin = system.sinusoid(AMPLITUDE_M, frequency_hz, centre_m=CENTRE_M, ramp_s=RAMP_S).cycle
            system.wait(0.5 * RUN_S)
            recorder.read()
            state = system.wait(0.5 * RUN_S)
        else:
            with system.set_points(rate_hz) as points:
                begin = points._begin
                while points.time_s < RUN_S:
                    before = points._begin
                    position, velocity, acceleration = sinusoid(points.time_s)
                    if kind == POSITIONS:
                        points.send(position)
                    else:
                        points.send(position, velocity, acceleration)
                    late += points._begin != before
                    if points._sent == round(0.5 * RUN_S * rate_hz):
                        recorder.read()
                state = points.finish()
    check_fault(state)
    return recorder.trace(begin, round(RUN_S / system.period_s), late)


def distances(a: Array, b: Array) -> Array:
    apart: Array = np.linalg.norm(a - b, axis=1)
    return apart[np.isfinite(apart)]


def compare(a: Trace, b: Trace, period_s: float) -> dict[str, float]:
    """RMS and maximum distance of tips and references, aligned by the references."""
    edge = round((SKIPPED_S + MAX_LAG_S) / period_s)
    most = round(MAX_LAG_S / period_s)

    def rms_of_lag(lag: int) -> float:
        apart = distances(a.reference_m[edge:-edge], b.reference_m[edge + lag : len(b.reference_m) - edge + lag])
        return float(np.sqrt(np.mean(apart**2)))

    lag = min(range(-most, most + 1), key=rms_of_lag)
    found: dict[str, float] = {"lag_cycles": lag}
    for name, one, other in (("tip", a.tip_m, b.tip_m), ("reference", a.reference_m, b.reference_m)):
        apart = distances(one[edge:-edge], other[edge + lag : len(other) - edge + lag])
        found[f"{name}_rms_m"] = float(np.sqrt(np.mean(apart**2)))
        found[f"{name}_max_m"] = float(apart.max())
    return found


def spread(comparisons: list[dict[str, float]]) -> dict[str, list[float]]:
    """Minimum, median and maximum of each number over the pairs of runs."""
    return {
        name: [float(x) for x in np.percentile([one[name] for one in comparisons], (0, 50, 100))]
        for name in comparisons[0]
    }


def in_process(options: argparse.Namespace) -> list[dict[str, Any]]:
    """The comparisons on a system inside the process; every kind of run once, because a second one gives the same numbers."""
    start_rad = supple.simulated(supple.Arm.load("wam4")).state.q
    traces: dict[tuple[float, str], list[Trace]] = {}
    period_s = 0.0
    for stiffness, kind in itertools.product(options.stiffness_n_per_m, (INTERNAL, POSITIONS, DERIVATIVES)):
        system = supple.simulated(supple.Arm.load("wam4"))
        period_s = system.period_s
        traces[stiffness, kind] = [run(system, kind, stiffness, start_rad, options.rate_hz)]
    return comparisons_of(traces, options, period_s)


def comparisons_of(
    traces: dict[tuple[float, str], list[Trace]], options: argparse.Namespace, period_s: float
) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    for stiffness in options.stiffness_n_per_m:
        internal = traces[stiffness, INTERNAL]
        for kind in (POSITIONS, DERIVATIVES, INTERNAL):
            pairs = (
                itertools.combinations(internal, 2)
                if kind == INTERNAL
                else itertools.product(traces[stiffness, kind], internal)
            )
            comparisons = [compare(a, b, period_s) for a, b in pairs]
            if comparisons:
                found.append(
                    {
                        "stiffness_n_per_m": stiffness,
                        "compared": "two internal runs" if kind == INTERNAL else f"streamed {kind}",
                        "pairs": len(comparisons),
                        "runs": [trace.disturbances() for trace in traces[stiffness, kind]],
                        "of_pairs": comparisons,
                        "minimum_median_maximum": spread(comparisons),
                    }
                )
    return found


def stream(options: argparse.Namespace) -> tuple[list[dict[str, Any]], float, list[str]]:
    """The comparisons, the period, and the faults that ended a run."""
    start_rad = supple.simulated(supple.Arm.load("wam4")).state.q
    traces: dict[tuple[float, str], list[Trace]] = {}
    faults: list[str] = []
    kinds = (INTERNAL, POSITIONS, DERIVATIVES)
    pending = list(itertools.product(range(options.rounds), options.stiffness_n_per_m, kinds))
    while pending:
        # A fault leaves the drives idle: the run is repeated on a new system.
        with repeated(faults), running(options) as system:
            period_s = system.period_s
            while pending:
                round_number, stiffness, kind = pending[0]
                trace = run(system, kind, stiffness, start_rad, options.rate_hz)
                traces.setdefault((stiffness, kind), []).append(trace)
                del pending[0]
                print(f"  round {round_number + 1}, {stiffness:g} N/m, {kind}: {trace.disturbances()}", file=sys.stderr, flush=True)
    return comparisons_of(traces, options, period_s), period_s, faults


def end_of_step_s(rows: supple.States, index: int) -> float:
    return float(sum(rows.columns[name][index] for name in ("stamp_s", "latency_s", "step_s")))


def first(rows: supple.States, condition: NDArray[np.bool_], after: int) -> int | None:
    """Index of the first cycle after cycle `after` that fulfils a condition."""
    (found,) = np.nonzero(condition & (rows.cycle > after))
    return int(found[0]) if found.size else None


def latency(options: argparse.Namespace) -> tuple[list[dict[str, Any]], dict[str, float], float, list[str]]:
    """Times of both kinds of call, the check of the clock, the period, and the faults after which it began anew."""
    faults: list[str] = []
    while True:
        with repeated(faults), running(options) as system:
            return *measured_calls(system, options), system.period_s, faults


def measured_calls(system: supple.System, options: argparse.Namespace) -> tuple[list[dict[str, Any]], dict[str, float]]:
    rng = np.random.default_rng(0)
    system.move(supple.simulated(supple.Arm.load("wam4")).state.q, MOVE_S)
    damping = [DAMPING_N_S_PER_M] * 3
    system.gains(stiffness_n_per_m=STIFFNESS_N_PER_M, damping_n_s_per_m=DAMPING_N_S_PER_M, ramp_s=0.0)
    system.request("track", CENTRE_M, trajectory="hold")
    check_fault(system.wait(SETTLE_S))
    names = ("gains", "set-point")
    carried_out_s: dict[str, list[float]] = {name: [] for name in names}
    in_torque_s: dict[str, list[float]] = {name: [] for name in names}
    returned_s: dict[str, list[float]] = {name: [] for name in names}
    ages_s = []
    lead_s = 0.02
    with system.set_points(100.0, lead_s=lead_s) as points:
        for call in range(options.calls):
            for name in names:
                time.sleep(rng.uniform(2e-3, 6e-3))
                before = system.state
                ages_s.append(time.monotonic() - float(before.columns["stamp_s"]))
                assert before.reference_position_m is not None
                if name == "gains":
                    stiffness = STIFFNESS_N_PER_M * (1.0, 1.2)[call % 2 == 0]
                    act: Callable[[], object] = lambda: system.request("gains", [stiffness] * 3 + damping + [0.0])  # noqa: B023, E731
                else:
                    target = CENTRE_M + [0.0, 0.0, 5e-5 * (call % 2 == 0)]
                    act = lambda: points.send(target, np.zeros(3), pace=False)  # noqa: B023, E731
                called_s = time.monotonic()
                act()
                returned = time.monotonic() - called_s
                check_fault(system.wait(2.0 * lead_s))
                rows = system.recent(0.2)
                # Nobody else requests anything: zero is no request.
                request = first(rows, rows.columns["request"] != 0.0, before.cycle)
                changed = {
                    "gains": rows.columns["stiffness_n_per_m"] != before.stiffness_n_per_m,
                    "set-point": rows.reference_position_m != before.reference_position_m,
                }[name].any(axis=1)
                torque = first(rows, changed, before.cycle)
                if request is not None and torque is not None:
                    carried_out_s[name].append(end_of_step_s(rows, request) - called_s)
                    in_torque_s[name].append(end_of_step_s(rows, torque) - called_s)
                    returned_s[name].append(returned)
    found: list[dict[str, Any]] = []
    for name in names:
        for counted, times_s in (
            ("carried out", carried_out_s[name]),
            ("in the torque", in_torque_s[name]),
            ("call returns", returned_s[name]),
        ):
            median_s, p90_s, p99_s, max_s = (float(x) for x in np.percentile(times_s, (50, 90, 99, 100)))
            found.append(
                {
                    "call": name,
                    "to": counted,
                    "calls": len(times_s),
                    "median_s": median_s,
                    "p90_s": p90_s,
                    "p99_s": p99_s,
                    "max_s": max_s,
                }
            )
    return found, {"stamp_age_min_s": min(ages_s), "stamp_age_max_s": max(ages_s)}


def print_comparisons(found: list[dict[str, Any]]) -> None:
    for row in found:
        numbers = row["minimum_median_maximum"]
        shown = ", ".join(
            f"{what} {1e3 * numbers[name][1]:.3f} ({1e3 * numbers[name][0]:.3f} to {1e3 * numbers[name][2]:.3f})"
            for name, what in (("tip_rms_m", "RMS"), ("tip_max_m", "max"), ("reference_max_m", "max of the reference"))
        )
        of_runs = ", ".join(
            f"{sum(run[name] for run in row['runs'])} {what}"
            for name, what in (
                ("missed_cycles", "missed cycles"),
                ("in_contact", "in contact"),
                ("late_set_points", "late set-points"),
            )
        )
        print(f"  {row['stiffness_n_per_m']:g} N/m, {row['compared']}: {shown}; {row['pairs']} pairs; in its runs {of_runs}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--programs", type=Path, default=ROOT / "target/release", help="folder of the programs")
    parser.add_argument("--prefix", default="live_benchmark", help="prefix of the system that it starts")
    parser.add_argument("--rounds", type=int, default=5, help="runs of each kind")
    parser.add_argument("--rate-hz", type=float, default=100.0, help="set-points per second (Hz)")
    parser.add_argument("--stiffness-n-per-m", type=float, nargs="+", default=[5.0, 200.0], help="of the tip (N/m)")
    parser.add_argument("--calls", type=int, default=300, help="calls of each kind")
    parser.add_argument("--realtime", action="store_true", help="let the system use real-time priority")
    parser.add_argument("--only", choices=("stream", "latency"), help="one of the two measurements")
    parser.add_argument("--json", type=Path, help="file for the results")
    options = parser.parse_args()
    loads = [os.getloadavg()[0]]
    results: dict[str, Any] = {
        "machine": {
            "processors": os.cpu_count(),
            "system": f"{platform.system()} {platform.release()} {platform.machine()}",
            "realtime": options.realtime,
        },
        "target_m": TARGET_M,
    }
    if options.only != "latency":
        found, _, faults = stream(options)
        results["stream"] = {"rate_hz": options.rate_hz, "rows": found, "faults": faults}
        results["in_process"] = in_process(options)
        print(f"Distance of the tip at {options.rate_hz:g} Hz (mm): median of the pairs (minimum to maximum); target {1e3 * TARGET_M:g} mm")
        print_comparisons(found)
        print("The same inside the process")
        print_comparisons(results["in_process"])
        print(f"  runs repeated because the host delayed a cycle for too long: {len(faults)}")
        loads.append(os.getloadavg()[0])
    if options.only != "stream":
        found, clock, period_s, faults = latency(options)
        target_s = period_s + TARGET_BESIDE_PERIOD_S
        results["latency"] = {"period_s": period_s, "target_median_s": target_s, "rows": found, "clock": clock, "faults": faults}
        print(f"Time from the call (us), period {1e6 * period_s:.0f} us; target of the median {1e6 * target_s:.0f} us")
        for row in found:
            numbers = ", ".join(
                f"{what} {1e6 * row[name]:.0f}"
                for name, what in (("median_s", "median"), ("p90_s", "90 %"), ("p99_s", "99 %"), ("max_s", "max"))
            )
            print(f"  {row['call']}, {row['to']}: {numbers}; {row['calls']} calls")
        print(
            f"  age of the newest time stamp by this process's clock: {1e6 * clock['stamp_age_min_s']:.0f} us to "
            f"{1e6 * clock['stamp_age_max_s']:.0f} us"
        )
        loads.append(os.getloadavg()[0])
    results["machine"]["load"] = loads
    print(f"load {', '.join(f'{load:.1f}' for load in loads)} on {os.cpu_count()} processors")
    if options.json:
        options.json.write_text(json.dumps(results, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
