"""Alternates complete systems in wall-clock time with cyclictest and writes SYSTEM.md. `run.sh --system`
calls it.

For both, an overrun is a cycle that starts so late that its reply cannot arrive in time. A plant waits
for the reply until three quarters of the period have passed; a reply takes some 50 us.
"""

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import tempfile

import run

HERE = pathlib.Path(__file__).parent
OVERRUN_US = 700
TARGET_PERCENT = 0.1


def up(arguments, plant):
    """Runs `supple up` and returns its summary."""
    with tempfile.TemporaryDirectory() as folder:
        environment = dict(os.environ, XDG_RUNTIME_DIR=folder)
        command = [arguments.programs.resolve() / "supple", "up", "--plant", plant, "--json"]
        command += ["--for", str(arguments.seconds), "--prefix", "latency"]
        ended = subprocess.run(
            command, cwd=folder, env=environment, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
    return json.loads(ended.stdout)


def cyclictest(arguments, realtime):
    """Cycles, overruns and maximum wake-up time of one thread without CPU affinity, like the system's
    threads."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "cyclictest.json"
        command = ["cyclictest", "--quiet", "--threads=1", f"--interval={run.PERIOD_US}"]
        command += [f"--duration={arguments.seconds}", f"--histogram={run.HISTOGRAM_US}", f"--json={file}"]
        command += ["--mlockall", f"--priority={run.PRIORITY}"] if realtime else ["--policy=other"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        thread = json.loads(file.read_text())["thread"]["0"]
    kept = {int(us): count for us, count in thread["histogram"].items()}
    cycles = thread["cycles"]
    in_time = sum(count for us, count in kept.items() if us <= OVERRUN_US)
    return {"cycles": cycles, "overruns": cycles - in_time, "max_us": thread["max"]}


def share(part, whole):
    return 100 * part / whole


def lines(machine, rounds, seconds):
    text = ["# Complete systems in wall-clock time", ""]
    text += [
        f"Written by `benches/latency/run.sh --system`; do not edit. {len(rounds)} rounds of {seconds} s each for",
        "`supple up --plant sim`, `--plant emu` and cyclictest, alternating, all at 1 kHz, none bound to a CPU.",
        f"An overrun of cyclictest is a wake-up later than {OVERRUN_US} us, which leaves no time for a reply;",
        f"the target is {TARGET_PERCENT} % of missed cycles, or at most twice cyclictest's overruns of the same round.",
        "",
    ]
    text += [f"- {key}: {value}" for key, value in machine.items()]
    text += ["", "| round | cyclictest overruns % | max us | plant | missed % | tx_lost | clock stall ms | step p99 us |"]
    text += ["|---|---|---|---|---|---|---|---|"]
    for number, beside in enumerate(rounds, 1):
        bare = beside["cyclictest"]
        for plant in ("sim", "emu"):
            s = beside[plant]
            text.append(
                f"| {number} | {share(bare['overruns'], bare['cycles']):.3f} | {bare['max_us']} | {plant} "
                f"| {share(s['missed'], s['cycles']):.3f} | {s['tx_lost']} | {s['clock_stall_ms']:.1f} "
                f"| {s['step_ns']['p99'] / 1e3:.1f} |"
            )
    text += [""]
    bare = statistics.median(share(r["cyclictest"]["overruns"], r["cyclictest"]["cycles"]) for r in rounds)
    for plant in ("sim", "emu"):
        missed = statistics.median(share(r[plant]["missed"], r[plant]["cycles"]) for r in rounds)
        met = missed <= max(TARGET_PERCENT, 2 * bare)
        text.append(
            f"- `{plant}`: median {missed:.3f} % missed, {bare:.3f} % overruns of cyclictest: {'met' if met else '**not met**'}"
        )
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", type=pathlib.Path, required=True)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    realtime = run.realtime_is_granted()
    rounds = []
    for number in range(arguments.rounds):
        rounds.append(
            {
                "sim": up(arguments, "sim"),
                "cyclictest": cyclictest(arguments, realtime),
                "emu": up(arguments, "emu"),
            }
        )
        print(f"{number + 1}/{arguments.rounds}: {rounds[-1]}", flush=True)
    machine = {
        "processor": f"{run.processor()}, {os.cpu_count()} cores",
        "scheduling": "SCHED_FIFO, memory locked" if realtime else "SCHED_OTHER",
        "load at the end": " ".join(f"{load:.2f}" for load in os.getloadavg()),
    }
    (HERE / "SYSTEM.md").write_text("\n".join(lines(machine, rounds, arguments.seconds)) + "\n")


if __name__ == "__main__":
    main()
