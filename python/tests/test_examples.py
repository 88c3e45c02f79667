"""The examples run unchanged."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import supple

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def test_identify_from_log(tmp_path):
    command = [sys.executable, "-W", "error", str(EXAMPLES / "identify_from_log.py")]
    ran = subprocess.run(
        [*command, "--arm", "wam3", "--candidates", "200", "--out", "found"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    assert "rank" in ran.stdout and "mm RMS" in ran.stdout
    assert supple.Arm.load(tmp_path / "found").dof == 3
