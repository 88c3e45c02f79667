#!/usr/bin/env python3
"""Docstrings of the native module in its stub, where editors look for them.

    python python/stub_docstrings.py          # writes them, after a change of the module's documentation
    python python/stub_docstrings.py --check  # fails where the stub differs

Run it with an interpreter that has the package.
"""

from __future__ import annotations

import ast
import inspect
import sys
from pathlib import Path

from supple import _native

STUB = Path(__file__).resolve().parent / "package" / "supple" / "_native.pyi"


def documentation(owner: object, name: str) -> str | None:
    """The docstring of a public member; none of the special methods, which Python itself documents."""
    if name.startswith("_"):
        return None
    text = getattr(getattr(owner, name), "__doc__", None)
    return inspect.cleandoc(text) if text else None


def quoted(text: str, indent: str) -> list[str]:
    escaped = text.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
    if escaped.endswith('"'):
        escaped = escaped[:-1] + '\\"'
    lines = [f"{indent}{line}".rstrip() for line in escaped.splitlines()]
    lines[0] = f'{indent}"""{lines[0].strip()}'
    if len(lines) == 1:
        lines[0] += '"""'
    else:
        lines.append(f'{indent}"""')
    return lines


def has_docstring(node: ast.ClassDef | ast.FunctionDef) -> bool:
    return ast.get_docstring(node) is not None


def without_docstrings(source: str) -> str:
    lines = source.splitlines()
    nodes = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ClassDef | ast.FunctionDef)]
    for node in sorted(filter(has_docstring, nodes), key=lambda node: -node.lineno):
        docstring = node.body[0]
        del lines[docstring.lineno - 1 : docstring.end_lineno]
        if len(node.body) == 1:
            lines[docstring.lineno - 2] += " ..."
            if lines[docstring.lineno - 1 : docstring.lineno] == [""]:
                del lines[docstring.lineno - 1]
    return "\n".join(lines) + "\n"


def with_docstrings(source: str) -> str:
    """The stub with the docstrings of the module instead of its own."""
    source = without_docstrings(source)
    lines = source.splitlines()
    changes: list[tuple[int, bool, str]] = []

    def collect(node: ast.ClassDef | ast.FunctionDef, owner: object) -> None:
        text = documentation(owner, node.name)
        if text:
            first = node.body[0]
            alone = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
            # Decorators stand before a member's own line.
            decorators = getattr(first, "decorator_list", [])
            line = min([first.lineno, *(decorator.lineno for decorator in decorators)])
            changes.append((line, alone, text))
        if isinstance(node, ast.ClassDef):
            for member in node.body:
                if isinstance(member, ast.FunctionDef):
                    collect(member, getattr(owner, node.name))

    for node in ast.parse(source).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            collect(node, _native)
    for line, alone, text in sorted(changes, reverse=True):
        at = lines[line - 1]
        if alone and at.endswith(": ..."):
            indent = at[: len(at) - len(at.lstrip())] + "    "
            lines[line - 1] = at.removesuffix(" ...")
            lines[line:line] = [*quoted(text, indent), ""]
        else:
            indent = at[: len(at) - len(at.lstrip())]
            lines[line - 1 : line - 1] = quoted(text, indent)
    return "\n".join(lines).rstrip() + "\n"


def main() -> int:
    found = STUB.read_text()
    wanted = with_docstrings(found)
    if "--check" in sys.argv[1:]:
        if found != wanted:
            print(f"{STUB} differs from the module: run {Path(__file__).name} without --check", file=sys.stderr)
            return 1
        return 0
    STUB.write_text(wanted)
    return 0


if __name__ == "__main__":
    sys.exit(main())
