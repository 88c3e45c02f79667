"""The Python blocks of both README files run as they stand."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

PYTHON = Path(__file__).resolve().parents[1]
BLOCKS = [
    (file, number, block)
    for file in (PYTHON.parent / "README.md", PYTHON / "README.md")
    for number, block in enumerate(re.findall(r"^```python\n(.*?)^```", file.read_text(), re.DOTALL | re.MULTILINE))
]


def test_both_files_have_blocks():
    assert len({file for file, _, _ in BLOCKS}) == 2


@pytest.mark.parametrize(
    "block", [block for _, _, block in BLOCKS], ids=[f"{file.parent.name}-{number}" for file, number, _ in BLOCKS]
)
def test_block(tmp_path, block):
    ran = subprocess.run(
        [sys.executable, "-W", "error", "-c", block], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
