"""Alternates the system, cyclictest and the echo and writes RESULTS.md and results.json. `run.sh` calls
it."""

import argparse
import collections
import contextlib
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile

import report

HERE = pathlib.Path(__file__).parent
PRIORITY = 79
# Range of cyclictest's histogram; longer times are counted separately (us).
HISTOGRAM_US = 20_000
PERIOD_US = 1_000


def realtime_is_granted():
    """Whether this user may use SCHED_FIFO."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except PermissionError:
        return False
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    return True


@contextlib.contextmanager
def processors_kept_awake():
    """Disables CPU idle states with long exit latency during all runs, as cyclictest does."""
    try:
        with open("/dev/cpu_dma_latency", "wb", buffering=0) as file:
            file.write((0).to_bytes(4, sys.byteorder))
            yield True
    except OSError:
        yield False


def run_latency_program(arguments, what, realtime):
    command = [arguments.programs / "latency", what, "--seconds", str(arguments.seconds)]
    command += ["--cpu", str(arguments.core)]
    if what == "system":
        command += ["--programs", arguments.programs]
    if not realtime:
        command.append("--no-realtime")
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)


def cyclictest(arguments, realtime):
    """Wake-up times as {us: count}; times beyond the histogram are counted together."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "cyclictest.json"
        command = ["cyclictest", "--quiet", "--threads=1", f"--affinity={arguments.core}"]
        command += [f"--interval={PERIOD_US}", f"--duration={arguments.seconds}"]
        command += [f"--histogram={HISTOGRAM_US}", f"--json={file}"]
        command += ["--mlockall", f"--priority={PRIORITY}"] if realtime else ["--policy=other"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        thread = json.loads(file.read_text())["thread"]["0"]
    histogram = {int(us): count for us, count in thread["histogram"].items()}
    beyond = thread["cycles"] - sum(histogram.values())
    if beyond > 0:
        histogram[max(HISTOGRAM_US, thread["max"])] = beyond
    return histogram


def in_us(times_ns):
    """Times in whole microseconds, truncated as by cyclictest."""
    return dict(collections.Counter(time_ns // 1000 for time_ns in times_ns))


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return platform.machine()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", type=pathlib.Path, required=True)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--core", type=int, default=os.cpu_count() - 1)
    parser.add_argument("--smoke", action="store_true")
    arguments = parser.parse_args()
    if arguments.smoke:
        arguments.seconds, arguments.rounds = 2, 1
    realtime = realtime_is_granted()
    rounds = []
    with processors_kept_awake() as awake:
        for number in range(arguments.rounds):
            system = run_latency_program(arguments, "system", realtime)
            wake = cyclictest(arguments, realtime)
            echo = run_latency_program(arguments, "echo", realtime)
            messages = run_latency_program(arguments, "messages", realtime)
            trips = {"system": system, "echo": echo, "messages alone": messages}
            rounds.append(report.Round(in_us(system["wake_ns"]), wake, trips))
            print(f"{number + 1}/{arguments.rounds}: {rounds[-1]}", flush=True)
    machine = {
        "processor": f"{processor()}, {os.cpu_count()} cores, core {arguments.core} used",
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "scheduling": "SCHED_FIFO, memory locked" if realtime else "SCHED_OTHER",
        "processors kept awake": "yes, through /dev/cpu_dma_latency" if awake else "no",
        "load at the end": " ".join(f"{load:.2f}" for load in os.getloadavg()),
    }
    lines = report.lines(machine, rounds, arguments.seconds)
    if arguments.smoke:
        print("\n".join(lines))
        return
    (HERE / "RESULTS.md").write_text("\n".join(lines) + "\n")
    results = report.results(machine, rounds, arguments.seconds)
    (HERE / "results.json").write_text(json.dumps(results) + "\n")


if __name__ == "__main__":
    main()
