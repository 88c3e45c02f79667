"""RESULTS.md, results.json and growth.svg from what `run.py` measured."""

import json
import statistics

import matplotlib
import numpy as np

matplotlib.use("svg")
import matplotlib.pyplot as plt

FUNCTIONS = ("rnea", "crba", "aba", "jacobian", "jdot_qd", "regressor", "law")
GROWING = ("rnea", "crba", "aba", "jacobian", "jdot_qd", "regressor")
# Greatest ratios asked for: to Pinocchio, to generated code.
ASKED = {
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


def least(times, mode="independent"):
    return min(low for _, low in times[mode])


def ratio(ours, peer, mode="independent"):
    """Median over the rounds of our median over the peer's in the same round."""
    pairs = zip(ours[mode], peer[mode])
    return statistics.median(mine / theirs for (mine, _), (theirs, _) in pairs)


def write(folder, machine, arms, differences, growth, rounds):
    results = {
        name: {
            arm: {
                f"{label}_ns": round(median(times[label][name]), 1)
                for label in ("ours", *PEERS)
            }
            for arm, times in arms.items()
        }
        for name in FUNCTIONS
    }
    (folder / "results.json").write_text(json.dumps(results, indent=2) + "\n")
    lines = [*head(machine, differences, rounds)]
    for mode in ("independent", "dependent"):
        lines += ["", f"## {mode.capitalize()} calls", "", *table(arms, mode)]
    lines += ["", "## Growth with the number of joints", "", *slopes(growth), ""]
    (folder / "RESULTS.md").write_text("\n".join(lines))
    plot(folder / "growth.svg", growth)


def head(machine, differences, rounds):
    yield "# Beside the peers"
    yield ""
    yield "Written by `benches/peers/run.sh`; do not edit. ns a call, one pinned core: median of "
    yield f"{rounds} rounds (least of all in brackets); each round runs ours, Pinocchio and the generated code"
    yield "in turn on the same 256 random states of each arm. A ratio is the median over the rounds of ours over"
    yield "the peer's; **bold** where it is above what is asked for (in the column's head)."
    yield ""
    for key, value in machine.items():
        yield f"- {key}: {value}"
    yield "- the peers' flags: `clang++ -O3 -march=native -DNDEBUG`; ours: `-C target-cpu=native`, release"
    yield "  profile"
    worst = max(error for by_peer in differences.values() for error in by_peer.values())
    yield f"- greatest difference between outputs, mixed absolute and relative: {worst:.1e}"
    yield ""
    yield "`law` is Eq. (3.6) with the arm's own inertia, without friction, from joint angles to torques: the"
    yield "position of the tip for 3 and 4 joints, its pose for 7, null space damped for 4 and 7. Pinocchio's is"
    yield "tuned by hand (one crba, one nle, the rest from their by-products, Eigen matrices of fixed size); the"
    yield "generated law is one symbolic expression of one arm. Where Pinocchio offers two ways, the quicker counts."


def table(arms, mode):
    yield "| function | arm | ours | Pinocchio | generated | ours / Pinocchio (asked) | ours / generated (asked) |"
    yield "|---|---|---|---|---|---|---|"
    for name in FUNCTIONS:
        for arm, times in arms.items():
            cells = [
                f"{median(times[label][name], mode):.0f} ({least(times[label][name], mode):.0f})"
                for label in ("ours", *PEERS)
            ]
            for peer, asked in zip(PEERS, ASKED[name]):
                found = ratio(times["ours"][name], times[peer][name], mode)
                text = f"{found:.2f}"
                if asked is not None:
                    text = f"**{text}**" if found > asked else text
                    text += f" ({asked})"
                cells.append(text)
            yield f"| {name} | {arm} | " + " | ".join(cells) + " |"


def fit(growth, label, name):
    """Exponent of `ns ~ joints^exponent`, and ns per added joint."""
    joints = np.array(list(growth))
    ns = np.array([median(times[label][name]) for times in growth.values()])
    return np.polyfit(np.log(joints), np.log(ns), 1)[0], np.polyfit(joints, ns, 1)[0]


def slopes(growth):
    yield f"Random arms of {min(growth)} to {max(growth)} joints, `growth.svg`. Exponent of the fitted power law, and"
    yield "the fitted straight line's ns for each further joint."
    yield ""
    yield "| function | ours: exponent | Pinocchio: exponent | ours: ns a joint | Pinocchio: ns a joint |"
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
        axis.set_ylabel("ns a call")
        axis.set_xlabel("joints")
    axes.flat[0].legend()
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})
