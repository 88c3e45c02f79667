"""Compiles the peers (Pinocchio and code that CasADi generates), runs them and ours alternately, compares their outputs, and
writes RESULTS.md, results.json and growth.svg. `run.sh` calls it."""

import argparse
import importlib.metadata
import os
import pathlib
import platform
import statistics
import subprocess
import sys
import time

import cases
import numpy as np
import report

HERE = pathlib.Path(__file__).parent
# Number of task directions of each arm: 3 for the position law, 6 for the pose law.
ARMS = {"wam3": 3, "wam4": 3, "wam7": 6}
# Numbers of joints of the random arms, for the growth of the time with the joints.
GROWTH = range(2, 13)
TOLERANCE = 1e-9
# Maximum load average, of one minute, of everything but this benchmark; and how long to wait for it, since
# compiling has raised it.
QUIET_LOAD = 0.3
QUIET_WAIT_S = 300
CLANG = ["clang++", "-std=c++17", "-O3", "-march=native", "-DNDEBUG"]
# Options that Pinocchio's own build sets for Boost.
BOOST = [
    "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
    "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30",
    "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
    "-DBOOST_FUSION_INVOKE_MAX_ARITY=10",
]


def compile_cpp(source, program, flags, depends):
    newest = max(path.stat().st_mtime for path in [source, HERE / "harness.hpp", *depends])
    if not program.exists() or program.stat().st_mtime < newest:
        subprocess.run([*CLANG, *flags, str(source), "-o", str(program)], check=True)


def pinocchio(folder):
    """Compiles the program of Pinocchio."""
    prefix = next(folder.glob("python/lib/python*/site-packages/cmeel.prefix")) / "include"
    program = folder / "pinocchio"
    include = ["-isystem", str(prefix), "-isystem", str(prefix / "eigen3")]
    compile_cpp(HERE / "pinocchio.cpp", program, [*BOOST, *include], [])
    return program


def symbolic(folder, arm):
    """Generates the C code of an arm by CasADi, and compiles it."""
    code, program = folder / f"{arm}.c", folder / f"symbolic_{arm}"
    subprocess.run(
        [sys.executable, HERE / "symbolic.py", folder / f"{arm}.txt", code], check=True
    )
    compile_cpp(HERE / "symbolic.cpp", program, [f'-DARM_C="{code.resolve()}"'], [code])
    return program


class Runner:
    """Runs a program pinned to one core; returns (function, {mode: (median, minimum)}) in ns, and the outputs.

    Mode "dependent": each call needs the result of the last one; "independent": none does.
    """

    def __init__(self, folder, core):
        self.folder, self.core = folder, core

    def __call__(self, program, case):
        outputs = self.folder / "outputs.bin"
        command = ["taskset", "-c", str(self.core), str(program), self.folder / case, outputs]
        printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        found = []
        for line in printed.splitlines():
            name, mode, median, minimum = line.split()
            # The first mode of each function.
            if mode == "independent":
                found.append((name, {}))
            found[-1][1][mode] = (float(median), float(minimum))
        return found, np.fromfile(outputs)


def split(found, outputs, joints):
    """The outputs of each measured function, one row per state."""
    # Ours alone: "law_apart", the law with every torque term apart; "step", a whole cycle of the controller.
    sizes = {
        "rnea": joints,
        "crba": joints**2,
        "aba": joints,
        "jacobian": 6 * joints,
        "jdot_qd": 6,
        "regressor": 10 * joints**2,
        "law": joints,
        "law_apart": joints,
        "step": joints,
    }
    at, out = 0, []
    for name, _ in found:
        count = sizes[name] * cases.STATES
        out.append((name, outputs[at : at + count].reshape(cases.STATES, -1)))
        at += count
    if at != len(outputs):
        sys.exit(f"{len(outputs)} numbers were written, {at} were expected")
    return out


def worst_difference(name, found, expected, joints):
    """Maximum difference, mixed absolute and relative; accelerations relative to the largest one."""
    if name == "crba":
        # Pinocchio fills only the upper triangle.
        column, row = np.divmod(np.arange(joints**2), joints)
        found, expected = found[:, row <= column], expected[:, row <= column]
    size = np.abs(expected)
    if name == "aba":
        size = size.max(axis=1, keepdims=True)
    worst = np.max(np.abs(found - expected) / (1.0 + size))
    return worst if np.isfinite(worst) else np.inf


def compare(arm, joints, ours, peer, label):
    mine = dict(split(*ours, joints))
    worst = {}
    if "law" in mine:
        worst["law_apart"] = worst_difference("law", mine["law_apart"], mine["law"], joints)
    for name, values in split(*peer, joints):
        worst[name] = max(
            worst.get(name, 0.0), worst_difference(name, mine[name], values, joints)
        )
    wrong = {name: error for name, error in worst.items() if not error <= TOLERANCE}
    if wrong:
        sys.exit(f"{arm}: differs from {label} by more than {TOLERANCE}: {wrong}")
    return max(worst.values())


def collect(rounds):
    """Medians and minima of all rounds for each function and mode. If a program measures a function in two
    variants under one name, those of the faster one."""
    variants = [name for name, _ in rounds[0]]
    best = {}
    for variant, name in enumerate(variants):
        times = {
            mode: [found[variant][1][mode] for found in rounds] for mode in ("independent", "dependent")
        }
        middle = statistics.median(median for median, _ in times["independent"])
        if name not in best or middle < best[name][0]:
            best[name] = (middle, times)
    return {name: times for name, (_, times) in best.items()}


def measure(run, programs, case, arm, joints, rounds):
    """Times of every program, and differences between the peers' outputs and ours in the same run."""
    found = {label: [] for label in programs}
    differences = {}
    for _ in range(rounds):
        results = {label: run(program, case) for label, program in programs.items()}
        for label, result in results.items():
            found[label].append(result[0])
            if label != "ours":
                error = compare(arm, joints, results["ours"], result, label)
                differences[label] = max(differences.get(label, 0.0), error)
    return {label: collect(rounds) for label, rounds in found.items()}, differences


def load():
    """Load average of one minute."""
    return os.getloadavg()[0]


def require_quiet(load_of_others, anyway):
    """Ends the program if the machine is not quiet."""
    if load_of_others > QUIET_LOAD and not anyway:
        sys.exit(
            f"the load average of other programs is {load_of_others:.2f}, above {QUIET_LOAD}: nothing is written. "
            "Stop them, or accept their disturbance by --anyway."
        )


def wait_until_quiet(anyway):
    """Waits until the load that compiling has caused has fallen; ends the program if it does not fall (except with `anyway`)."""
    until = time.monotonic() + QUIET_WAIT_S
    while load() > QUIET_LOAD and not anyway and time.monotonic() < until:
        time.sleep(5.0)
    require_quiet(load(), anyway)


def first_line(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()[0]


def machine():
    cpu = next(
        (
            line.split(":")[1].strip()
            for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines()
            if line.startswith("model name")
        ),
        platform.processor(),
    )
    versions = {name: importlib.metadata.version(name) for name in ("pin", "casadi")}
    return {
        "processor": cpu,
        "system": f"{platform.system()} {platform.machine()}",
        "rustc": first_line("rustc", "--version"),
        "clang": first_line("clang++", "--version"),
        **versions,
    }


def vendor(processor):
    """Maker of a processor, from its name."""
    known = ("amd", "intel", "arm", "apple")
    return next((name for name in known if name in processor.lower()), "other")


def keep_other_processors_results(processor):
    """Renames results of another maker's processor, so that they stand beside the new ones."""
    for line in (HERE / "RESULTS.md").read_text().splitlines():
        if line.startswith("- processor: ") and vendor(line) != vendor(processor):
            for name in ("RESULTS.md", "results.json", "growth.svg"):
                path = HERE / name
                kept = path.rename(path.with_stem(f"{path.stem}-{vendor(line)}"))
                if kept.suffix == ".md":
                    kept.write_text(kept.read_text().replace("growth.svg", f"growth-{vendor(line)}.svg"))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=pathlib.Path, required=True)
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("--core", type=int, default=0)
    parser.add_argument("--anyway", action="store_true", help="write results on a busy machine too")
    options = parser.parse_args()
    folder = options.folder
    run = Runner(folder, options.core)
    random = np.random.default_rng(20261121)
    ours, peer = folder / "cargo/release/peers", pinocchio(folder)
    descriptions, generated = {}, {}
    for arm, task in ARMS.items():
        descriptions[arm] = cases.reference_arm(arm, task)
        cases.write(folder / f"{arm}.txt", descriptions[arm], random)
        generated[arm] = symbolic(folder, arm)
    wait_until_quiet(options.anyway)
    before = load()

    arms, differences = {}, {}
    for arm, description in descriptions.items():
        programs = {"ours": ours, "pinocchio": peer, "codegen": generated[arm]}
        joints = len(description.joints)
        arms[arm], differences[arm] = measure(
            run, programs, f"{arm}.txt", arm, joints, options.rounds
        )
        print(f"{arm}: measured, outputs agree", flush=True)

    growth = {}
    for joints in GROWTH:
        name = f"random{joints}"
        cases.write(folder / f"{name}.txt", cases.random_arm(joints, random), random)
        programs = {"ours": ours, "pinocchio": peer}
        growth[joints], _ = measure(run, programs, f"{name}.txt", name, joints, 3)
    print("random arms of 2 to 12 joints: measured, outputs agree")

    # The load average includes this benchmark, which uses one core.
    after = load()
    require_quiet(after - 1.0, options.anyway)
    loads = f"{before:.2f} before, {after:.2f} after, which counts this benchmark as 1"
    described = {**machine(), "load average": loads}
    keep_other_processors_results(described["processor"])
    report.write(HERE, described, arms, differences, growth, options.rounds)
    print(f"written: {HERE / 'RESULTS.md'}, results.json, growth.svg")


if __name__ == "__main__":
    main()
