"""The pages of the documentation, and the code in them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PATTERNS = ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/*.md", "benches/*/*.md", "tests/*/*.md")
# Its entries describe old versions.
NOT_CHECKED = ("CHANGELOG.md",)

FENCE = re.compile(r"^(?P<indent> *)```(?P<language>\w*)\n(?P<code>.*?)^ *```$", re.DOTALL | re.MULTILINE)
INLINE = re.compile(r"(?<!`)`([^`]+)`(?!`)")
FIGURE = re.compile(r"^<!-- figure: (?P<file>\S+), (?P<caption>[^>]+?) -->$", re.MULTILINE)


@dataclass(frozen=True)
class Code:
    """A piece of code in a page."""

    page: str
    line: int
    language: str
    text: str

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"


def pages() -> list[str]:
    """Paths of all pages, from the root of the repository."""
    found = [path for pattern in PATTERNS for path in sorted(ROOT.glob(pattern))]
    return [str(path.relative_to(ROOT)) for path in [*found, ROOT / "python/README.md"]]


def read(page: str) -> str:
    """Text of a page."""
    return (ROOT / page).read_text(encoding="utf-8")


def blocks(page: str) -> Iterator[Code]:
    """The fenced blocks of a page, in their order."""
    text = read(page)
    for match in FENCE.finditer(text):
        line = text.count("\n", 0, match.start("code")) + 1
        yield Code(page, line, match["language"], match["code"])


def indented(page: str) -> Iterator[Code]:
    """Lines of blocks that are marked by their indent alone."""
    text = FENCE.sub(lambda match: "\n" * match[0].count("\n"), read(page))
    in_list = False
    for number, line in enumerate(text.splitlines(), 1):
        if line and not line.startswith(" "):
            in_list = bool(re.match(r"([-*]|\d+\.) ", line))
        elif line.startswith("    ") and not in_list:
            yield Code(page, number, "", line.strip())


def inline(page: str) -> Iterator[Code]:
    """The code within sentences and tables of a page."""
    text = FENCE.sub(lambda match: "\n" * match[0].count("\n"), read(page))
    for match in INLINE.finditer(text):
        yield Code(page, text.count("\n", 0, match.start()) + 1, "", " ".join(match[1].split()))
