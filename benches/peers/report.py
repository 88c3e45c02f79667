"""Writes RESULTS.md, results.json and growth.svg from the measurements of `run.py`."""

import json
import statistics

import matplotlib
import numpy as np

matplotlib.use("svg")
import matplotlib.pyplot as plt

FUNCTIONS = ("rnea", "crba", "aba", "jacobian", "jdot_qd", "regressor", "law")
# Ours alone: the law with every term apart, and the controller's whole cycle.
OWN = ("law_apart", "step")
GROWING = ("rnea", "crba", "aba", "jacobian", "jdot_qd", "regressor")
# Maximum ratios (targets): to Pinocchio, to generated code.
TARGETS = {
    "rnea": (0.40, 1.5),
    "crba": (0.50, 1.6),
    "aba": (0.50, None),
    "jacobian": (0.50, 1.6),
    "jdot_qd": (0.50, 1.6),
    "regressor": (0.40, None),
    "law": (0.33, 1.2),
}
PEERS = ("pinocchio", "codegen")


def median(times, mode="independent"):
    return statistics.median(middle for middle, _ in times[mode])


def minimum(times, mode="independent"):
    return min(low for _, low in times[mode])


def ratio(ours, peer, mode="independent"):
    """Median over the rounds of our median divided by the peer's in the same round."""
    pairs = zip(ours[mode], peer[mode])
    return statistics.median(mine / theirs for (mine, _), (theirs, _) in pairs)


def spread(times, mode="independent"):
    """Range of the rounds' medians, as a share of their median."""
    medians = [middle for middle, _ in times[mode]]
    return (max(medians) - min(medians)) / statistics.median(medians)


def write(folder, machine, arms, differences, growth, rounds):
    results = {
        name: {
            arm: {
                f"{label}_ns": round(median(times[label][name]), 1)
                for label in ("ours", *PEERS)
                if name in times[label]
            }
            for arm, times in arms.items()
        }
        for name in (*FUNCTIONS, *OWN)
    }
    results["machine"] = machine
    (folder / "results.json").write_text(json.dumps(results, indent=2) + "\n")
    lines = [*head(machine, differences, rounds)]
    for mode in ("independent", "dependent"):
        lines += ["", f"## {mode.capitalize()} calls", "", *table(arms, mode)]
    lines += ["", "## The law as one sum, apart, and in the controller", "", *own(arms)]
    lines += ["", "## Growth with the number of joints", "", *slopes(growth), ""]
    (folder / "RESULTS.md").write_text("\n".join(lines))
    plot(folder / "growth.svg", growth)


def head(machine, differences, rounds):
    yield "# Comparison with other libraries"
    yield ""
    yield "Written by `benches/peers/run.sh`; do not edit. ns per call, one pinned core: median of"
    yield f"{rounds} rounds (minimum and spread in brackets: range of the rounds' medians); each round runs ours, Pinocchio and the generated code"
    yield "alternately on the same 256 random states of each arm. A ratio is the median over the rounds of our time divided by"
    yield "the peer's; **bold** if it exceeds its target (in brackets)."
    yield ""
    for key, value in machine.items():
        yield f"- {key}: {value}"
    yield "- the peers' flags: `clang++ -O3 -march=native -DNDEBUG`; ours: `-C target-cpu=native`, release"
    yield "  profile"
    worst = max(error for by_peer in differences.values() for error in by_peer.values())
    yield f"- maximum difference between outputs, mixed absolute and relative: {worst:.1e}"
    yield ""
    yield "`law` is Eq. (3.6) with the arm's own inertia, without friction, from joint angles to torques: the"
    yield "position of the tip for 3 and 4 joints, its pose for 7, null space damped for 4 and 7. Pinocchio's is"
    yield "tuned by hand (one crba, one nle, the rest from their by-products, Eigen matrices of fixed size); the"
    yield "generated law is one symbolic expression of one arm. If Pinocchio has two functions, the faster one is used."


def cell(times, mode="independent"):
    return f"{median(times, mode):.0f} ({minimum(times, mode):.0f}, {spread(times, mode):.0%})"


def own(arms):
    yield "Ours alone, independent calls on the same states: `law` as above; `law_apart`, the same law with every term"
    yield "apart, as the controller records it; `step`, `controller::step` whole (estimator, all checks, the law of the"
    yield "position with the configured held joints, limits that nothing reaches), measured at one state after the other."
    yield ""
    yield "| arm | law | law_apart | law_apart / law | step |"
    yield "|---|---|---|---|---|"
    for arm, times in arms.items():
        ours = times["ours"]
        cells = [cell(ours["law"]), cell(ours["law_apart"])]
        cells += [f"{ratio(ours['law_apart'], ours['law']):.2f}", cell(ours["step"])]
        yield f"| {arm} | " + " | ".join(cells) + " |"


def table(arms, mode):
    yield "| function | arm | ours | Pinocchio | generated | ours / Pinocchio (target) | ours / generated (target) |"
    yield "|---|---|---|---|---|---|---|"
    for name in FUNCTIONS:
        for arm, times in arms.items():
            cells = [cell(times[label][name], mode) for label in ("ours", *PEERS)]
            for peer, target in zip(PEERS, TARGETS[name]):
                found = ratio(times["ours"][name], times[peer][name], mode)
                text = f"{found:.2f}"
                if target is not None:
                    text = f"**{text}**" if found > target else text
                    text += f" ({target})"
                cells.append(text)
            yield f"| {name} | {arm} | " + " | ".join(cells) + " |"


def fit(growth, label, name):
    """Exponent of `ns ~ joints^exponent`, and ns per added joint."""
    joints = np.array(list(growth))
    ns = np.array([median(times[label][name]) for times in growth.values()])
    return np.polyfit(np.log(joints), np.log(ns), 1)[0], np.polyfit(joints, ns, 1)[0]


def slopes(growth):
    yield f"Random arms of {min(growth)} to {max(growth)} joints, `growth.svg`. Exponent of the fitted power law, and"
    yield "the slope of the fitted straight line in ns per joint."
    yield ""
    yield "| function | ours: exponent | Pinocchio: exponent | ours: ns per joint | Pinocchio: ns per joint |"
    yield "|---|---|---|---|---|"
    for name in GROWING:
        (a, b), (c, d) = fit(growth, "ours", name), fit(growth, "pinocchio", name)
        yield f"| {name} | {a:.2f} | {c:.2f} | {b:.0f} | {d:.0f} |"


def plot(path, growth):
    figure, axes = plt.subplots(2, 3, figsize=(10, 6), sharex=True)
    for name, axis in zip(GROWING, axes.flat):
        for label, title in (("ours", "supple"), ("pinocchio", "Pinocchio")):
            ns = [median(times[label][name]) for times in growth.values()]
            axis.plot(list(growth), ns, marker="o", markersize=3, label=title)
        axis.set_title(name)
        axis.set_ylim(bottom=0)
        axis.set_ylabel("ns per call")
        axis.set_xlabel("joints")
    axes.flat[0].legend()
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})
