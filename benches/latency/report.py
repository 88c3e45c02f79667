"""Writes RESULTS.md and results.json from the measurements of `run.py`."""

import collections
import statistics

SHARES = {"p50": 0.50, "p99": 0.99, "p999": 0.999}
# Maximum ratios (targets).
WAKE_TARGETS = {"p99": 1.5}
ROUND_TRIP_TARGETS = {"p50": 1.5, "p99": 2.0}


def percentiles(histogram):
    """Percentiles and maximum of {value: count}."""
    found, total, seen = {}, sum(histogram.values()), 0
    for value in sorted(histogram):
        seen += histogram[value]
        for name, share in SHARES.items():
            if name not in found and seen >= share * total:
                found[name] = value
    found["max"] = max(histogram)
    return found


class Round:
    """One round: times of the system and of its peers."""

    def __init__(self, system_wake_us, cyclictest_us, trips):
        self.wake_us = {"system": system_wake_us, "cyclictest": cyclictest_us}
        self.round_trip_us = {
            name: dict(collections.Counter(round(ns / 1000, 1) for ns in measured["round_trip_ns"]))
            for name, measured in trips.items()
        }
        self.missed = trips["system"]["missed"]
        self.wake = {name: percentiles(times) for name, times in self.wake_us.items()}
        self.round_trip = {name: percentiles(times) for name, times in self.round_trip_us.items()}

    def __str__(self):
        return f"wake {self.wake}, round trip {self.round_trip}, missed {self.missed}"


def ratio(pairs, name):
    """Median over the rounds of our time divided by the peer's; times below 1 us count as 1 us."""
    return statistics.median(max(ours[name], 1) / max(other[name], 1) for ours, other in pairs)


def row(label, found):
    cells = [f"{statistics.median(times[name] for times in found):g}" for name in SHARES]
    return f"| {label} | " + " | ".join(cells) + f" | {max(times['max'] for times in found):g} |"


def comparison(pairs, label, targets):
    cells = []
    for name in SHARES:
        found = ratio(pairs, name)
        text = f"{found:.2f}"
        if name in targets:
            text = f"**{text}**" if found > targets[name] else text
            text += f" ({targets[name]})"
        cells.append(text)
    return f"| {label} | " + " | ".join(cells) + " | |"


def octaves(histogram):
    """Fraction of the times in [1, 2), [2, 4), ... us; times below 1 us are in the first."""
    found = collections.Counter()
    for value, count in histogram.items():
        found[max(int(value), 1).bit_length() - 1] += count
    total = sum(histogram.values())
    return {octave: count / total for octave, count in found.items()}


def merged(histograms):
    return sum((collections.Counter(histogram) for histogram in histograms), collections.Counter())


def histogram_table(columns):
    shares = {label: octaves(merged(histograms)) for label, histograms in columns.items()}
    yield "| us | " + " | ".join(f"{label} (%)" for label in shares) + " |"
    yield "|---|" + "---|" * len(shares)
    for octave in range(max(max(of) for of in shares.values()) + 1):
        cells = [f"{100 * of.get(octave, 0):.4f}" for of in shares.values()]
        yield f"| {2**octave} to {2 ** (octave + 1)} | " + " | ".join(cells) + " |"


def section(rounds, kind, targets):
    """Table of percentiles, ratios and histogram of one kind of time; the targets apply to the first
    peer."""
    found = [getattr(each, kind) for each in rounds]
    raw = [getattr(each, f"{kind}_us") for each in rounds]
    names = list(found[0])
    yield "| us | p50 | p99 | p99.9 | max |"
    yield "|---|---|---|---|---|"
    for name in names:
        yield row(name, [each[name] for each in found])
    for number, peer in enumerate(names[1:]):
        pairs = [(each["system"], each[peer]) for each in found]
        label = f"system / {peer}" + (" (target)" if number == 0 else "")
        yield comparison(pairs, label, targets if number == 0 else {})
    yield ""
    yield from histogram_table({name: [each[name] for each in raw] for name in names})


def lines(machine, rounds, seconds):
    return [
        "# Wake-up latency and round-trip time",
        "",
        f"Written by `benches/latency/run.sh`; do not edit. {len(rounds)} rounds of {seconds} s each for the system,",
        "cyclictest, the echo and the messages alone, alternating, all at 1 kHz on one core. Percentiles are medians",
        "over the rounds, max is the maximum of all rounds; a ratio is the median over the rounds of the system's time",
        "divided by the peer's in the same round, **bold** if it exceeds its target. On a virtual machine the host and",
        "its load determine the tail: compare only the ratios.",
        "",
        *(f"- {key}: {value}" for key, value in machine.items()),
        f"- cycles in which `supple-sim` received no command before its deadline: {sum(each.missed for each in rounds)} of "
        f"{len(rounds) * seconds * 1000}",
        "",
        "## Wake-up",
        "",
        "Delay from the due time to the start of a cycle: `supple-sim`, which sets its timer 50 us early and then",
        "polls the clock, compared with cyclictest, which does not.",
        "",
        *section(rounds, "wake", WAKE_TARGETS),
        "",
        "## Round trip: from state published to command received",
        "",
        "`supple-sim` and `supple-rt` in gravity hold, the controller's step included, compared with two processes that",
        "only exchange Unix datagrams of the same sizes (echo), and with two that exchange the system's own messages",
        "through shared memory without any computation (messages alone).",
        "",
        *section(rounds, "round_trip", ROUND_TRIP_TARGETS),
    ]


def results(machine, rounds, seconds):
    def sorted_pairs(histogram):
        return [[value, histogram[value]] for value in sorted(histogram)]

    return {
        "machine": machine,
        "seconds": seconds,
        "ratios": {
            "wake": {
                name: ratio([(r.wake["system"], r.wake["cyclictest"]) for r in rounds], name)
                for name in SHARES
            },
            "round_trip": {
                name: ratio([(r.round_trip["system"], r.round_trip["echo"]) for r in rounds], name)
                for name in SHARES
            },
        },
        "rounds": [
            {
                "missed": each.missed,
                "wake": each.wake,
                "round_trip": each.round_trip,
                "wake_us": {name: sorted_pairs(of) for name, of in each.wake_us.items()},
                "round_trip_us": {
                    name: sorted_pairs(of) for name, of in each.round_trip_us.items()
                },
            }
            for each in rounds
        ],
    }
