"""The programs in a wheel: permissions that pip keeps, and digests in RECORD."""

import base64
import csv
import hashlib
import io
import runpy
import stat
import sys
import zipfile
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "add_programs.py"
INFO = "supple-0.1.0.dist-info"


def test_programs_are_executable_and_recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given, made = tmp_path / "supple-0.1.0-py3-none-any.whl", tmp_path / "out"
    with zipfile.ZipFile(given, "w") as wheel:
        wheel.writestr("supple/__init__.py", "")
        wheel.writestr(f"{INFO}/RECORD", f"supple/__init__.py,,\n{INFO}/RECORD,,\n")
    (tmp_path / "programs").mkdir()
    (tmp_path / "programs" / "supple").write_bytes(b"\x7fELF")
    (tmp_path / "share/man/man1").mkdir(parents=True)
    (tmp_path / "share/man/man1/supple.1").write_text("page")
    made.mkdir()
    monkeypatch.setattr(sys, "argv", ["add_programs.py", str(given), str(tmp_path), "--out", str(made)])
    runpy.run_path(str(SCRIPT), run_name="__main__")

    with zipfile.ZipFile(made / given.name) as wheel:
        modes = {entry.filename: entry.external_attr >> 16 for entry in wheel.infolist()}
        rows = {row[0]: row[1] for row in csv.reader(io.StringIO(wheel.read(f"{INFO}/RECORD").decode()))}
        program, page = "supple-0.1.0.data/scripts/supple", "supple-0.1.0.data/data/share/man/man1/supple.1"
        for name in (program, page):
            digest = base64.urlsafe_b64encode(hashlib.sha256(wheel.read(name)).digest()).rstrip(b"=").decode()
            assert rows[name] == f"sha256={digest}"
    # pip makes regular files executable whose mode says so, and no others.
    assert stat.S_ISREG(modes[program]) and modes[program] & 0o111
    assert stat.S_ISREG(modes[page]) and not modes[page] & 0o111
