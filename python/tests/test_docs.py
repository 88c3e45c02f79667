"""Every example in a docstring runs, and every public name has one."""

from __future__ import annotations

import doctest
import inspect

import pytest
import supple

FINDER = doctest.DocTestFinder(exclude_empty=True)
PUBLIC = [getattr(supple, name) for name in supple.__all__ if name != "__version__"]


def examples():
    found = {}
    for target in (supple, *PUBLIC):
        for test in FINDER.find(target, target.__name__, module=False, globs={}):
            if test.examples and not test.name.startswith("supple."):
                found[test.name] = test
            elif test.name == "supple":
                found[test.name] = test
    return list(found.values())


@pytest.mark.parametrize("example", examples(), ids=lambda example: example.name)
def test_example(example):
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    output = []
    runner.run(example, out=output.append)
    assert runner.summarize(verbose=False).failed == 0, "".join(output)


def test_every_public_name_is_documented():
    undocumented = []
    for thing in PUBLIC:
        members = inspect.getmembers(thing) if inspect.isclass(thing) else []
        for name, value in [(thing.__name__, thing), *members]:
            own = not name.startswith("_") and callable(value) or value is thing
            if own and not (inspect.getdoc(value) or "").strip():
                undocumented.append(f"{thing.__name__}.{name}")
    assert undocumented == []
