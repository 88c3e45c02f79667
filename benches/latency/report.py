"""RESULTS.md and results.json from what `run.py` measured."""

import collections
import statistics

SHARES = {"p50": 0.50, "p99": 0.99, "p999": 0.999}
# Greatest ratios asked for.
ASKED_WAKE = {"p99": 1.5}
ASKED_ROUND_TRIP = {"p50": 1.5, "p99": 2.0}


def percentiles(histogram):
    """Percentiles and the greatest value of {value: count}."""
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
    """Median over the rounds of ours over the other's; a wake-up within the same microsecond counts as one."""
    return statistics.median(max(ours[name], 1) / max(other[name], 1) for ours, other in pairs)


def row(label, found):
    cells = [f"{statistics.median(times[name] for times in found):g}" for name in SHARES]
    return f"| {label} | " + " | ".join(cells) + f" | {max(times['max'] for times in found):g} |"


def comparison(pairs, label, asked):
    cells = []
    for name in SHARES:
        found = ratio(pairs, name)
        text = f"{found:.2f}"
        if name in asked:
            text = f"**{text}**" if found > asked[name] else text
            text += f" ({asked[name]})"
        cells.append(text)
    return f"| {label} | " + " | ".join(cells) + " | |"


def octaves(histogram):
    """Share of the times in [1, 2), [2, 4), ... us; what is below 1 us is in the first."""
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


def section(rounds, kind, asked):
    """Table of percentiles, ratios and histogram of one kind of time; what is asked holds beside the first peer."""
    found = [getattr(each, kind) for each in rounds]
    raw = [getattr(each, f"{kind}_us") for each in rounds]
    names = list(found[0])
    yield "| us | p50 | p99 | p99.9 | max |"
    yield "|---|---|---|---|---|"
    for name in names:
        yield row(name, [each[name] for each in found])
    for number, peer in enumerate(names[1:]):
        pairs = [(each["system"], each[peer]) for each in found]
        label = f"system / {peer}" + (" (asked)" if number == 0 else "")
        yield comparison(pairs, label, asked if number == 0 else {})
    yield ""
    yield from histogram_table({name: [each[name] for each in raw] for name in names})


def lines(machine, rounds, seconds):
    return [
        "# Wake-up and answer",
        "",
        f"Written by `benches/latency/run.sh`; do not edit. {len(rounds)} rounds of {seconds} s each for the system,",
        "cyclictest, the echo and the messages alone, in turn, all at 1 kHz on one core. Percentiles are medians",
        "over the rounds, max the greatest of all; a ratio is the median over the rounds of ours over the other's in the same round, **bold**",
        "where it is above what is asked for. The host decides the tail of a virtual machine, and the load beside it:",
        "only the ratios are worth comparing.",
        "",
        *(f"- {key}: {value}" for key, value in machine.items()),
        f"- cycles of the system without an answer in time: {sum(each.missed for each in rounds)} of "
        f"{len(rounds) * seconds * 1000}",
        "",
        "## Wake-up",
        "",
        "From when a cycle was due to when it began: `supple-sim`, which sets its timer to 50 us before and then",
        "watches the clock, beside cyclictest, which does not.",
        "",
        *section(rounds, "wake", ASKED_WAKE),
        "",
        "## State published to command received",
        "",
        "`supple-sim` and `supple-rt` in gravity hold, the controller's step included, beside two processes that do",
        "nothing but exchange Unix datagrams of the same sizes (echo), and beside two that exchange the system's own",
        "messages through shared memory and compute nothing (messages alone).",
        "",
        *section(rounds, "round_trip", ASKED_ROUND_TRIP),
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
