"""Outcomes of the cases as lines of text and as a Markdown page."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

STEPS = ("new", "demo", "up", "identify")
HEADING = """# Public URDFs, unedited

Written by `tests/any_arm/run.py --all --table`; do not edit. Each URDF is given as it is, with nothing but the link that is
the tip: `supple new` (5 s of the sinusoid at 5 N/m with a model that is 0.1 % and 3 % off), `supple demo` (the worst of ten
such models; none of these runs was made smaller or left out), `supple up --plant sim` in virtual time, and `supple excite design`,
`excite run` and `identify`: what the model leaves of the torques of a motion that was not fitted. Allowed are 15 mm RMS, more in
proportion for an arm that weighs more than 23 N at the tip. Identification is reported, not judged: derived thresholds end
some excitations with a fault.

| URDF | tip | `supple new` | `supple demo` | `supple up` | `supple identify` | outcome |
|---|---|---|---|---|---|---|
"""


@dataclass
class Outcome:
    """What came of a case."""

    text: str
    """The case, as in cases.txt."""
    found: dict[str, str] = field(default_factory=dict)
    """Results by step."""
    problems: list[str] = field(default_factory=list)
    """What failed."""
    skipped: str | None = None
    """Why it was not tried."""
    took_s: float = 0.0
    """How long it took (s)."""

    @property
    def name(self) -> tuple[str, str]:
        """File and tip."""
        path, _, rest = self.text.partition("#")
        return path.rsplit("/", 1)[-1], rest

    def verdict(self) -> str:
        """In one word, with the reason where it is not OK."""
        if self.skipped is not None:
            return f"skipped: {self.skipped}"
        return f"FAILED: {'; '.join(self.problems)}" if self.problems else "OK"

    def line(self) -> str:
        """For a terminal."""
        results = "; ".join(f"{step} {result}" for step, result in self.found.items())
        return f"{'#'.join(self.name):44} {self.verdict()}; {results}; {self.took_s:.0f} s"


def write(file: Path, outcomes: list[Outcome]) -> None:
    """Writes the page."""
    rows = []
    for outcome in outcomes:
        urdf, tip = outcome.name
        results = [outcome.found.get(step, "-") for step in STEPS]
        rows.append("| " + " | ".join([urdf, tip.replace(",", ", --"), *results, outcome.verdict()]) + " |")
    passed = sum(outcome.verdict() == "OK" for outcome in outcomes)
    file.write_text(HEADING + "\n".join(rows) + f"\n\n{passed} of {len(outcomes)} pass.\n")
