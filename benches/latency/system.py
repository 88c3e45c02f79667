"""Alternates complete systems in wall-clock time with cyclictest and writes SYSTEM.md. `run.sh --system`
calls it.

The systems: a simulated and an emulated WAM, the simulated one also with a page that one viewer reads and another
blocks, and the emulated arms without brakes, each at its default rate. For all, an overrun is a cycle that starts so
late that its reply cannot arrive in time. A plant waits for the reply until three quarters of the period have passed;
a reply takes some 50 us.
"""

import argparse
import contextlib
import json
import os
import pathlib
import statistics
import subprocess
import tempfile
import time

import run
import viewers

HERE = pathlib.Path(__file__).parent
OVERRUN_US = 700
TARGET_PERCENT = 0.1
PREFIX = "latency"
VIEWED = "wam4 sim, viewers"
# Plant and arm of each system.
SYSTEMS = {
    "wam4 sim": ("sim", "wam4"),
    VIEWED: ("sim", "wam4"),
    "wam4 emu": ("emu", "wam4"),
    "openarm emu": ("emu", "openarm"),
    "yam emu": ("emu", "yam"),
}
# A change of p99.9 beyond this share would show that viewers delay the loop.
VIEWERS_PERCENT = 5
STARTED_S = 2
START_AND_END_S = 60


def up(arguments, name):
    """Runs `supple up` and returns its summary, also that of a run that a fault ends."""
    plant, arm = SYSTEMS[name]
    programs = arguments.programs.resolve()
    with tempfile.TemporaryDirectory() as folder:
        environment = dict(os.environ, XDG_RUNTIME_DIR=folder)
        command = [programs / "supple", "up", "--plant", plant, "--arm", arm, "--json"]
        command += ["--for", str(arguments.seconds), "--prefix", PREFIX]
        system = subprocess.Popen(
            command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        try:
            # Its messages are few: they fit into the pipe.
            time.sleep(STARTED_S)
            watching = viewers.watching(programs, PREFIX, environment) if name == VIEWED else contextlib.nullcontext(({}, []))
            with watching as (counts, problems):
                # A fault ends the system, and with it its viewers, before the time.
                with contextlib.suppress(subprocess.TimeoutExpired):
                    system.wait(max(0, arguments.seconds - 2 * STARTED_S))
            output, messages = system.communicate(timeout=arguments.seconds + START_AND_END_S)
        finally:
            system.terminate()
            system.wait()
    if not output:
        raise ChildProcessError(f"{name}: {messages}")
    summary = json.loads(output)
    if not summary["faults"] and (problems or not all(counts.values())):
        raise ConnectionError(f"{name}: {counts}, {problems}")
    return {**summary, "viewers": counts}


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


def comparison(rounds):
    """p99.9 of the wake-up and of the step with viewers, as a share of the run without them in the same round."""
    complete = [r for r in rounds if not r[VIEWED]["faults"] and not r["wam4 sim"]["faults"]]
    if not complete:
        yield "- Viewers: in each round a fault ended a run: nothing to compare."
        return
    for key, unit in (("wake_us", "wake-up"), ("step_ns", "step")):
        shares = [share(r[VIEWED][key]["p999"], r["wam4 sim"][key]["p999"]) - 100 for r in complete]
        within = abs(statistics.median(shares)) <= VIEWERS_PERCENT
        yield (
            f"- p99.9 of the {unit} with viewers: median {statistics.median(shares):+.1f} %, from {min(shares):+.1f} to "
            f"{max(shares):+.1f} % of the run without them in the same round, in {len(complete)} of {len(rounds)} rounds that no fault ended; target {VIEWERS_PERCENT} %: "
            f"{'met' if within else '**not met**'}"
        )


def lines(machine, rounds, seconds):
    text = ["# Complete systems in wall-clock time", ""]
    text += [
        f"Written by `benches/latency/run.sh --system`; do not edit. {len(rounds)} rounds of {seconds} s each for",
        "`supple up` with the WAM (`--plant sim`, `--plant emu`; 1 kHz), OpenArm (7 motors, CAN FD, 1 kHz) and YAM (6 motors, CAN,",
        "400 Hz), and for cyclictest at 1 kHz, alternating, none bound to a CPU. With viewers: `supple view` beside it, one viewer that",
        "reads all channels and one that reads nothing. An overrun of cyclictest is a wake-up later than",
        f"{OVERRUN_US} us, which leaves no time for a reply; the target is {TARGET_PERCENT} % of missed cycles, or at most twice",
        "cyclictest's overruns of the same round. A fault ends a run: its figures are those until then.",
        "",
    ]
    text += [f"- {key}: {value}" for key, value in machine.items()]
    text += [
        "",
        "| round | cyclictest overruns % | max us | system | cycles | missed % | tx_lost | clock stall ms | wake-up p99.9 us | round trip p50, p99.9 us "
        "| step p99, p99.9 us | faults |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for number, beside in enumerate(rounds, 1):
        bare = beside["cyclictest"]
        for name in SYSTEMS:
            s = beside[name]
            trip, step = s["round_trip_us"], s["step_ns"]
            text.append(
                f"| {number} | {share(bare['overruns'], bare['cycles']):.3f} | {bare['max_us']} | {name} "
                f"| {s['cycles']} | {share(s['missed'], s['cycles']):.3f} | {s['tx_lost']} | {s['clock_stall_ms']:.1f} "
                f"| {s['wake_us']['p999']:.0f} | {trip['p50']:.0f}, {trip['p999']:.0f} "
                f"| {step['p99'] / 1e3:.1f}, {step['p999'] / 1e3:.1f} | {'; '.join(s['faults']) or 'none'} |"
            )
    text += [""]
    bare = statistics.median(share(r["cyclictest"]["overruns"], r["cyclictest"]["cycles"]) for r in rounds)
    for name in SYSTEMS:
        shares = [share(r[name]["missed"], r[name]["cycles"]) for r in rounds]
        missed = statistics.median(shares)
        ended = sum(bool(r[name]["faults"]) for r in rounds)
        met = missed <= max(TARGET_PERCENT, 2 * bare) and not ended
        text.append(
            f"- `{name}`: {ended} of {len(rounds)} runs ended by a fault; median {missed:.3f} % missed (to {max(shares):.3f} %), "
            f"{bare:.3f} % overruns of cyclictest: "
            f"{'met' if met else '**not met**'}"
        )
    text += comparison(rounds)
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
        # Every second round in the opposite order.
        order = [*SYSTEMS, "cyclictest"][:: (-1) ** number]
        results = {name: cyclictest(arguments, realtime) if name == "cyclictest" else up(arguments, name) for name in order}
        rounds.append(results)
        print(f"{number + 1}/{arguments.rounds}: {results}", flush=True)
    machine = {
        "processor": f"{run.processor()}, {os.cpu_count()} cores",
        "scheduling": "SCHED_FIFO, memory locked" if realtime else "SCHED_OTHER",
        "load at the end": " ".join(f"{load:.2f}" for load in os.getloadavg()),
    }
    (HERE / "SYSTEM.md").write_text("\n".join(lines(machine, rounds, arguments.seconds)) + "\n")


if __name__ == "__main__":
    main()
