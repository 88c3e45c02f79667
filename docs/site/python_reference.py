"""Prints the reference of the installed package `supple` as Markdown, from its docstrings."""

from __future__ import annotations

import inspect
import re

import supple

SECTIONS = ("Parameters", "Returns", "Raises", "Examples", "Yields")


def main() -> None:
    print("# Python\n")
    print(markdown(inspect.getdoc(supple) or ""))
    for name in supple.__all__:
        thing = getattr(supple, name)
        if name != "__version__":
            print(f"## {name}\n")
            print(describe(thing, name))
            for member, value in members(thing):
                print(f"### {name}.{member}\n")
                print(describe(value, member))


def members(thing: object) -> list[tuple[str, object]]:
    if not inspect.isclass(thing) or issubclass(thing, (Warning, Exception)):
        return []
    own = [(name, value) for name, value in vars(thing).items() if not name.startswith("_")]
    return [(name, value) for name, value in own if inspect.getdoc(value) and not isinstance(value, str)]


def describe(thing: object, name: str) -> str:
    lines = []
    if callable(thing):
        try:
            lines += ["```python", f"{name}{inspect.signature(thing)}", "```", ""]
        except ValueError:
            pass
    return "\n".join([*lines, markdown(inspect.getdoc(thing) or "")])


def markdown(text: str) -> str:
    """Numpy's sections and Sphinx's roles in Markdown."""
    text = re.sub(r":(?:class|meth|func|attr):`~?([^`]+)`", r"`\1`", text)
    text = text.replace("``", "`")
    lines, section, code = [], "", False
    given = text.splitlines()
    for index, line in enumerate(given):
        below = given[index + 1] if index + 1 < len(given) else ""
        if line in SECTIONS and set(below) == {"-"}:
            section = line
            lines += [f"**{line}**", ""]
            continue
        if line and set(line) == {"-"}:
            continue
        example = section == "Examples" and line.startswith((">>>", "...")) or code and line.strip() != ""
        if example != code:
            lines += ["```pycon" if example else "```"] + ([] if example else [""])
            code = example
        if section in ("Parameters", "Returns", "Raises") and line and not line.startswith(" "):
            line = f"- `{line}`"
        lines.append(line)
    if code:
        lines.append("```")
    return "\n".join([*lines, ""])


main()
